# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Files of runs are the user's own: nobody else can redirect, read or empty them; domains are all users'."""

import json
import os
import socket
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from satform_bringup.deployment import domain_lock, runtime_folder
from satform_bringup.deployment.runtime_folder import RuntimeFolderError
from satform_bringup.supervisor.run_registry import described, file_name, registered_runs

NOBODY = 65534


@pytest.fixture(autouse=True)
def shared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder for temporary files that everybody may write to, and no runtime folder of the session."""
    folder = tmp_path / "tmp"
    folder.mkdir()
    folder.chmod(0o1777)
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    monkeypatch.setattr(domain_lock, "ABSTRACT", f"\0test {os.getpid()}/", raising=False)
    return folder


def test_links_that_another_user_has_planted_are_not_followed(shared: Path, tmp_path: Path) -> None:
    valuable = tmp_path / "thesis.tex"
    valuable.write_text("years of work")
    (shared / "satform-domains").mkdir()
    for place in (shared / "satform-domains" / "41", shared / f"satform-{os.geteuid()}"):
        place.symlink_to(valuable)
    with suppress(RuntimeError), described(41, "triangle", tmp_path):
        pass
    assert valuable.read_text() == "years of work"


@pytest.mark.parametrize(
    ("make", "found"),
    [
        (lambda place, other: place.symlink_to(other), "found a symbolic link"),
        (lambda place, other: place.write_text(other.name), "found Not a directory"),
        (lambda place, other: (place.mkdir(), place.chmod(0o777)), "its mode is 0777, which lets others in"),
        (lambda place, other: (place.mkdir(0o700), os.chown(place, NOBODY, NOBODY)), "id 65534"),
    ],
)
def test_what_is_not_the_users_own_folder_is_refused_in_a_sentence(
    make: object, found: str, tmp_path: Path
) -> None:
    if "65534" in found and os.geteuid() != 0:
        pytest.skip("NOT TESTED: only root can give a folder to another user")
    (tmp_path / "other").mkdir(mode=0o700)
    make(runtime_folder.folder_path(), tmp_path / "other")
    for use in (lambda: runtime_folder.write("a", "b"), registered_runs):
        with pytest.raises(RuntimeFolderError, match=f"is not a folder of this user alone .*{found}"):
            use()
    assert list((tmp_path / "other").iterdir()) == []


def test_the_folder_and_its_files_are_closed_to_others() -> None:
    runtime_folder.write("note", "text")
    assert stat.S_IMODE(runtime_folder.folder_path().stat().st_mode) == 0o700
    assert stat.S_IMODE((runtime_folder.folder_path() / "note").stat().st_mode) == 0o600
    assert runtime_folder.read("note") == "text"
    assert runtime_folder.names() == ["note"]
    runtime_folder.remove("note")
    assert runtime_folder.names() == []


def test_neither_a_link_nor_a_pipe_in_the_folder_is_read_and_a_link_is_replaced(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("mine")
    runtime_folder.write("note", "text")
    os.mkfifo(runtime_folder.folder_path() / "pipe")
    (runtime_folder.folder_path() / "link").symlink_to(secret)
    assert runtime_folder.read("pipe") is None
    assert runtime_folder.read("link") is None
    runtime_folder.write("link", "new")
    assert secret.read_text() == "mine"
    assert runtime_folder.read("link") == "new"


def test_the_runtime_folder_of_the_session_is_used_where_it_is_the_users_own(
    tmp_path: Path, shared: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = tmp_path / "session"
    session.mkdir(mode=0o700)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(session))
    assert runtime_folder.folder_path() == session / "satform"
    session.chmod(0o755)
    assert runtime_folder.folder_path() == shared / f"satform-{os.geteuid()}"
    for other in ("relative", str(tmp_path / "missing")):
        monkeypatch.setenv("XDG_RUNTIME_DIR", other)
        assert runtime_folder.folder_path() == shared / f"satform-{os.geteuid()}"


HOLD_AS_NOBODY = f"""
import os
from satform_bringup.deployment import domain_lock
os.setgid({NOBODY}); os.setuid({NOBODY})
domain_lock.ABSTRACT = {{abstract!r}}
print(domain_lock.hold(17), domain_lock.hold(18) is not None, domain_lock.holder(17) == (os.getppid(), 0))
"""


def test_a_domain_that_one_user_holds_is_held_for_all_users() -> None:
    if os.geteuid() != 0:
        pytest.skip("NOT TESTED: only root can become another user")
    lock = domain_lock.hold(17)
    assert lock is not None
    script = HOLD_AS_NOBODY.format(abstract=domain_lock.ABSTRACT)
    other = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert other.stdout.split() == ["None", "True", "True"]
    os.close(lock)
    assert domain_lock.holder(17) is None


@pytest.fixture
def bound() -> Iterator[int]:
    """A domain in which something listens on a port: RTPS 2.2, 9.6.1.1: 7400 + 250 d + 10 + 2 p."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as participant:
        for number in range(domain_lock.LAST, 0, -1):
            try:
                participant.bind(("127.0.0.1", 7400 + 250 * number + 10 + 2 * 7))
            except OSError:
                continue
            yield number
            return
    pytest.fail("no port is free")


def test_a_domain_in_which_others_already_are_is_taken_last(
    bound: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    assert bound in domain_lock.domains_with_participants()
    monkeypatch.setattr(domain_lock, "domains_with_participants", lambda: set(range(1, 100)) - {bound})
    with domain_lock.own_domain() as number:
        assert number == bound
    monkeypatch.setattr(domain_lock, "domains_with_participants", lambda: {bound})
    monkeypatch.setattr(os, "getpid", lambda: bound - 1)
    with domain_lock.own_domain() as number:
        assert number != bound


def test_the_sentence_about_a_domain_in_use_names_the_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "23")
    sentence = rf"ROS_DOMAIN_ID=23 is in use by another run on this machine \(process {os.getpid()}\)"
    with (
        domain_lock.own_domain(),
        pytest.raises(domain_lock.DomainError, match=sentence),
        domain_lock.own_domain(),
    ):
        pass


@pytest.mark.parametrize(
    "changed",
    [{"domain": "41"}, {"process": str(os.getpid())}, {"scenario": 3}, {"folder": None}, {"x": 1}, None],
)
def test_a_description_that_is_none_is_passed_over(changed: dict[str, object] | None, tmp_path: Path) -> None:
    with described(41, "triangle", tmp_path):
        assert [run.domain for run in registered_runs()] == [41]
        name = file_name(41)
        whole = json.loads(runtime_folder.read(name) or "")
        other = {
            key: str(os.getpid()) if value == "{pid}" else value for key, value in (changed or {}).items()
        }
        text = "[" * 100_000 if changed is None else json.dumps({**whole, **other})
        runtime_folder.remove(name)
        runtime_folder.write(name, text)
        assert registered_runs() == []
