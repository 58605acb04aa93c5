# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A result is computed again when a file that it depends on has changed, and only then."""

from pathlib import Path

import pytest

from satform_tools.run import result_cache


class Library:
    """Stands for where Python finds the library."""

    def __init__(self, origin: Path) -> None:
        self.origin = str(origin)


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    install = tmp_path / "ros_ws" / "install"
    install.mkdir(parents=True)
    (install / "complete.json").write_text("{}")
    (tmp_path / "source.yaml").write_text("a: 1\n")
    monkeypatch.setattr(result_cache, "find_spec", lambda _name: Library(install / "satform" / "__init__.py"))
    return tmp_path


def asked(project: Path, result: str) -> object:
    return result_cache.stored("name", project, [project / "source.yaml"], lambda: result)


def test_a_result_is_kept_while_no_file_changes(project: Path) -> None:
    assert asked(project, "first") == "first"
    assert asked(project, "second") == "first"
    (project / "source.yaml").write_text("a: 2\n")
    assert asked(project, "third") == "third"
    (project / "ros_ws/install/complete.json").write_text('{"built": 1}')
    assert asked(project, "fourth") == "fourth"


def test_what_was_cut_short_or_may_not_be_written_is_computed_again(project: Path) -> None:
    assert asked(project, "first") == "first"
    (project / "ros_ws/install/cache/name.json").write_text('{"key": ')
    assert asked(project, "second") == "second"
    (project / "ros_ws/install/cache/name.json").unlink()
    (project / "ros_ws/install/cache").rmdir()
    (project / "ros_ws/install/cache").write_text("a file in the folder's place")
    assert [asked(project, "third"), asked(project, "fourth")] == ["third", "fourth"]


def test_nothing_is_kept_of_another_library(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(result_cache, "find_spec", lambda _name: Library(Path("/opt/satform/__init__.py")))
    assert [asked(project, "first"), asked(project, "second")] == ["first", "second"]


def test_nothing_is_kept_when_a_file_is_missing(project: Path) -> None:
    (project / "source.yaml").unlink()
    assert [asked(project, "first"), asked(project, "second")] == ["first", "second"]
