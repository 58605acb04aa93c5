# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The jobs on the page about continuous integration do what they say, in a folder like that of a server."""

import os
import re
import subprocess
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from ruamel.yaml import YAML

from flights import SCENARIOS

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "ci.md"


def jobs() -> Iterator[tuple[str, list[str], Mapping[str, str]]]:
    """Name, commands in order, and variables of each job on the page."""
    for block in re.findall(r"```yaml\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL):
        ((_, job),) = _jobs(YAML(typ="safe", pure=True).load(block))
        if "steps" in job:
            yield "GitHub Actions", [step["run"] for step in job["steps"] if "run" in step], {}
        else:
            yield "GitLab", [*job["before_script"], *job["script"]], job["variables"]


def _jobs(file: dict[str, Any]) -> Any:
    return file.get("jobs", file).items()


JOBS = list(jobs())


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A repository with a short scenario, and beside it this project, as a cache restores it."""
    folder = tmp_path / "repository"
    (folder / "scenarios").mkdir(parents=True)
    text = (SCENARIOS / "triangle.yaml").read_text(encoding="utf-8").partition("expect:")[0]
    text = text.replace("duration: 12000.0", "duration: 20.0")
    expect = 'expect: [{kind: tracking_error, below: 1.0e4, source: "a test"}]\n'
    (folder / "scenarios" / "short.yaml").write_text(text + expect, encoding="utf-8")
    (folder / "satform").symlink_to(ROOT)
    return folder


@pytest.mark.parametrize(("server", "commands", "variables"), JOBS, ids=[name for name, *_ in JOBS])
def test_the_commands_of_a_job_check_fly_and_write_what_it_uploads(
    server: str, commands: list[str], variables: Mapping[str, str], repository: Path
) -> None:
    head = subprocess.run(
        ["git", "-C", ROOT, "rev-parse", "HEAD"], capture_output=True, text=True, check=True
    )
    more = {**variables, "SATFORM_COMMIT": head.stdout.strip(), "CI": "true"}
    if server == "GitHub Actions":
        more["GITHUB_WORKSPACE"] = str(repository)
    for command in commands:
        if " checkout " in command:
            continue  # The project under test stays as it is.
        done = subprocess.run(
            ["bash", "--noprofile", "--norc", "-e", "-o", "pipefail", "-c", command],
            cwd=repository,
            env={**os.environ, **more},
            capture_output=True,
            text=True,
            timeout=600,
            check=False,
        )
        assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    suite = ElementTree.parse(repository / "results" / "short.xml").getroot()  # noqa: S314 - our own
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("2", "0", "0")
    assert (repository / "runs" / "short" / "result.json").is_file()
    if server == "GitHub Actions":
        assert (repository / "satform.sarif").read_text(encoding="utf-8").startswith("{")


def test_the_clone_of_the_gitlab_job_is_made_where_the_cache_has_none(tmp_path: Path) -> None:
    (commands,) = (found for name, found, _ in JOBS if name == "GitLab")
    clone = [command for command in commands if "git " in command]
    environment = {**os.environ, "SATFORM_URL": str(ROOT), "SATFORM_COMMIT": "HEAD"}
    subprocess.run(["bash", "-ec", "\n".join(clone)], cwd=tmp_path, env=environment, check=True)
    assert (tmp_path / "satform" / "tools" / "satform").is_file()


def test_missed_expectations_fail_the_job_after_all_scenarios_are_flown(repository: Path) -> None:
    """The loop of both jobs, with a stand-in for the command that misses the first scenario."""
    (repository / "scenarios" / "second.yaml").touch()
    (repository / "satform").unlink()
    program = repository / "satform" / "tools" / "satform"
    program.parent.mkdir(parents=True)
    program.write_text('#!/bin/sh\necho "$2" >> flown\ncase "$2" in *second*) exit 0;; esac\nexit 1\n')
    program.chmod(0o755)
    for _, commands, _ in JOBS:
        (loop,) = (command for command in commands if "for file" in command)
        assert subprocess.run(["bash", "-ec", loop], cwd=repository, check=False).returncode == 1
        assert sorted((repository / "flown").read_text().split()) == [
            "scenarios/second.yaml",
            "scenarios/short.yaml",
        ]
        (repository / "flown").unlink()
