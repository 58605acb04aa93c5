# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What killed processes have left in shared memory is taken away, and nothing else."""

import fcntl
import os
from contextlib import ExitStack
from pathlib import Path

import pytest

from satform_bringup import leftovers

SEGMENT, OTHER = "fastrtps_00b7d9ee0dfb63b4", "fastrtps_0266b2462a80447c"


@pytest.fixture
def memory(tmp_path: Path) -> Path:
    folder = tmp_path / "shm"
    folder.mkdir()
    return folder


@pytest.fixture
def processes(tmp_path: Path) -> Path:
    folder = tmp_path / "proc"
    (folder / "17").mkdir(parents=True)
    (folder / "17" / "maps").write_text("")
    return folder


def put(folder: Path, *names: str) -> None:
    for name in names:
        (folder / name).touch()


def there(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir())


def test_ports_of_the_domain_are_taken_away_with_all_that_belongs_to_them(
    memory: Path, processes: Path
) -> None:
    # Domain 1 has the ports from 7650 to 7899.
    put(memory, "fastrtps_port7667", "fastrtps_port7667_el", "sem.fastrtps_port7667_mutex")
    put(memory, "sem.fastrtps_port7899_mutex", "fastrtps_port7649", "fastrtps_port7900", "somebody_elses")
    gone = leftovers.clear(1, memory, processes)
    assert sorted(gone) == [
        "fastrtps_port7667",
        "fastrtps_port7667_el",
        "sem.fastrtps_port7667_mutex",
        "sem.fastrtps_port7899_mutex",
    ]
    assert there(memory) == ["fastrtps_port7649", "fastrtps_port7900", "somebody_elses"]


def test_ports_of_all_domains_are_not_touched_unless_stuck_and_unused_ones_of_domain_0_never(
    memory: Path, processes: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put(memory, "fastrtps_port7000", "fastrtps_port7011", "fastrtps_port7011_sl", "fastrtps_port7410")
    put(memory, "fastrtps_port7013", "fastrtps_port7013_el")
    (memory / "sem.fastrtps_port7013_mutex").write_bytes(bytes(32))
    monkeypatch.setattr(leftovers, "_LONGEST_HOLD", 0.1)
    locked: list[str] = []
    lock = leftovers._take_locks

    def noting(folder: Path, stem: str, held: ExitStack) -> bool:
        locked.append(stem)
        return lock(folder, stem, held)

    monkeypatch.setattr(leftovers, "_take_locks", noting)
    gone = ["fastrtps_port7013", "fastrtps_port7013_el", "sem.fastrtps_port7013_mutex"]
    assert sorted(leftovers.clear(1, memory, processes)) == gone
    # Another flight that begins just now fails to open a port that is locked here.
    assert locked == ["fastrtps_port7013"]
    assert leftovers.clear(0, memory, processes) == []
    assert locked == ["fastrtps_port7013", "fastrtps_port7410"]


def test_a_port_that_somebody_reads_stays_though_its_memory_is_not_seen(
    memory: Path, processes: Path
) -> None:
    put(memory, "fastrtps_port7660", "fastrtps_port7660_sl")
    reader = os.open(memory / "fastrtps_port7660_sl", os.O_RDONLY)
    fcntl.flock(reader, fcntl.LOCK_SH)
    assert leftovers.clear(1, memory, processes) == []
    os.close(reader)
    assert leftovers.clear(1, memory, processes) == [
        "fastrtps_port7660",
        "fastrtps_port7660_sl",
    ]


def test_where_not_every_process_can_be_asked_ports_stay_and_segments_go(
    memory: Path, processes: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put(memory, "fastrtps_port7660", SEGMENT, f"{SEGMENT}_el")

    def refuse(_file: Path, errors: str) -> str:
        raise PermissionError

    monkeypatch.setattr(Path, "read_text", refuse)
    assert leftovers.clear(1, memory, processes) == [SEGMENT, f"{SEGMENT}_el"]
    assert there(memory) == ["fastrtps_port7660"]


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tenth of a second is longer than a port is held by the living."""
    monkeypatch.setattr(leftovers, "_LONGEST_HOLD", 0.1)


@pytest.mark.parametrize("domain", [0, 1])
@pytest.mark.usefixtures("hasty")
def test_a_port_in_the_hands_of_the_dead_goes_also_in_a_flight_and_nothing_else_does(
    domain: int, memory: Path
) -> None:
    """Who is started next in a flight under way would wait for it as well."""
    stuck, free, read = (f"fastrtps_port{7400 + 250 * domain + place}" for place in (10, 12, 14))
    put(memory, stuck, f"{stuck}_el", free, read, f"{read}_el", SEGMENT, f"{SEGMENT}_el")
    # glibc keeps the count in a semaphore's first bytes: 0 is taken, 1 is free.
    for port, count in ((stuck, 0), (free, 1), (read, 0)):
        (memory / f"sem.{port}_mutex").write_bytes(bytes([count, *[0] * 31]))
    reader = os.open(memory / f"{read}_el", os.O_RDONLY)
    try:
        fcntl.flock(reader, fcntl.LOCK_EX)
        assert leftovers.release(domain, memory) == [stuck, f"{stuck}_el", f"sem.{stuck}_mutex"]
    finally:
        os.close(reader)
    assert set(there(memory)) >= {free, read, f"sem.{read}_mutex", SEGMENT}


@pytest.mark.usefixtures("hasty")
def test_what_is_stuck_goes_though_a_process_waits_for_it(memory: Path, processes: Path) -> None:
    put(memory, "fastrtps_port7660")
    (memory / "sem.fastrtps_port7660_mutex").write_bytes(bytes(32))
    (processes / "17" / "maps").write_text(f"7f00-7f10 rw-s 00000000 00:1a 5 {memory}/fastrtps_port7660\n")
    assert leftovers.clear(1, memory, processes) == ["fastrtps_port7660", "sem.fastrtps_port7660_mutex"]


def test_a_port_that_somebody_lets_go_of_stays(memory: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put(memory, "fastrtps_port7660")
    semaphore = memory / "sem.fastrtps_port7660_mutex"
    semaphore.write_bytes(bytes(32))
    monkeypatch.setattr(leftovers.time, "sleep", lambda _: semaphore.write_bytes(bytes([1, *[0] * 31])))
    assert leftovers.release(1, memory) == []
    assert semaphore.exists()


def test_what_a_process_has_in_its_memory_stays(memory: Path, processes: Path) -> None:
    put(memory, "fastrtps_port7660", "fastrtps_port7661", "sem.fastrtps_port7661_mutex")
    (processes / "17" / "maps").write_text(
        f"7f00-7f10 rw-s 00000000 00:1a 5 {memory}/fastrtps_port7660\n"
        f"7f10-7f20 rw-s 00000000 00:1a 6 {memory}/sem.fastrtps_port7661_mutex\n"
    )
    assert leftovers.clear(1, memory, processes) == []


def test_segments_go_when_their_owner_has_let_go_of_its_lock(memory: Path, processes: Path) -> None:
    put(memory, SEGMENT, f"{SEGMENT}_el", OTHER, f"{OTHER}_el", "fastrtps_being_made")
    owner = os.open(memory / f"{OTHER}_el", os.O_RDONLY)
    try:
        fcntl.flock(owner, fcntl.LOCK_SH)
        assert leftovers.clear(1, memory, processes) == [SEGMENT, f"{SEGMENT}_el"]
    finally:
        os.close(owner)
    assert leftovers.clear(1, memory, processes) == [OTHER, f"{OTHER}_el"]
    assert there(memory) == ["fastrtps_being_made"]


def test_files_of_other_users_are_left_alone(
    memory: Path, processes: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put(memory, "fastrtps_port7667", SEGMENT, f"{SEGMENT}_el")
    monkeypatch.setattr(os, "getuid", lambda: 4711)
    assert leftovers.clear(1, memory, processes) == []
