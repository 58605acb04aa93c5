"""What killed processes have left in shared memory is taken away, and nothing else."""

import fcntl
import os
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
    gone = leftovers.clear(1, folder=memory, processes=processes)
    assert sorted(gone) == [
        "fastrtps_port7667",
        "fastrtps_port7667_el",
        "sem.fastrtps_port7667_mutex",
        "sem.fastrtps_port7899_mutex",
    ]
    assert there(memory) == ["fastrtps_port7649", "fastrtps_port7900", "somebody_elses"]


def test_ports_of_no_domain_go_too_and_those_of_domain_0_never(memory: Path, processes: Path) -> None:
    put(memory, "fastrtps_port6999", "fastrtps_port7000", "fastrtps_port7011", "fastrtps_port7011_sl")
    put(memory, "fastrtps_port7410")
    assert leftovers.clear(0, folder=memory, processes=processes) == []
    gone = ["fastrtps_port7000", "fastrtps_port7011", "fastrtps_port7011_sl"]
    assert leftovers.clear(1, folder=memory, processes=processes) == gone
    assert there(memory) == ["fastrtps_port6999", "fastrtps_port7410"]


def test_a_port_that_somebody_reads_stays_though_its_memory_is_not_seen(
    memory: Path, processes: Path
) -> None:
    put(memory, "fastrtps_port7660", "fastrtps_port7660_sl")
    reader = os.open(memory / "fastrtps_port7660_sl", os.O_RDONLY)
    fcntl.flock(reader, fcntl.LOCK_SH)
    assert leftovers.clear(1, folder=memory, processes=processes) == []
    os.close(reader)
    assert leftovers.clear(1, folder=memory, processes=processes) == [
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
    assert leftovers.clear(1, folder=memory, processes=processes) == [SEGMENT, f"{SEGMENT}_el"]
    assert there(memory) == ["fastrtps_port7660"]


def test_a_port_in_the_hands_of_the_dead_goes_in_a_flight_too_whoever_has_it_in_memory(
    memory: Path, processes: Path
) -> None:
    """Who is started next in a flight under way would wait for it as well."""
    put(memory, "fastrtps_port7660", "fastrtps_port7662", "fastrtps_port7662_el")
    # glibc keeps the count in a semaphore's first bytes: 0 is taken, 1 is free.
    (memory / "sem.fastrtps_port7660_mutex").write_bytes(bytes(32))
    (memory / "sem.fastrtps_port7662_mutex").write_bytes(bytes([1, *[0] * 31]))
    assert leftovers.clear(1, in_flight=True, folder=memory, processes=processes) == [
        "fastrtps_port7660",
        "sem.fastrtps_port7660_mutex",
    ]
    (memory / "sem.fastrtps_port7662_mutex").write_bytes(bytes(32))
    (processes / "17" / "maps").write_text(f"7f00-7f10 rw-s 00000000 00:1a 5 {memory}/fastrtps_port7662\n")
    assert leftovers.clear(1, folder=memory, processes=processes)[-1] == "sem.fastrtps_port7662_mutex"
    assert there(memory) == []


def test_a_port_that_is_held_for_a_moment_stays(memory: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put(memory, "fastrtps_port7660")
    semaphore = memory / "sem.fastrtps_port7660_mutex"
    semaphore.write_bytes(bytes(32))
    monkeypatch.setattr(leftovers.time, "sleep", lambda _: semaphore.write_bytes(bytes([1, *[0] * 31])))
    assert leftovers.clear(1, in_flight=True, folder=memory) == []


def test_what_a_process_has_in_its_memory_stays(memory: Path, processes: Path) -> None:
    put(memory, "fastrtps_port7660", "fastrtps_port7661", "sem.fastrtps_port7661_mutex")
    (processes / "17" / "maps").write_text(
        f"7f00-7f10 rw-s 00000000 00:1a 5 {memory}/fastrtps_port7660\n"
        f"7f10-7f20 rw-s 00000000 00:1a 6 {memory}/sem.fastrtps_port7661_mutex\n"
    )
    assert leftovers.clear(1, folder=memory, processes=processes) == []


def test_segments_go_when_their_owner_has_let_go_of_its_lock(memory: Path, processes: Path) -> None:
    put(memory, SEGMENT, f"{SEGMENT}_el", OTHER, f"{OTHER}_el", "fastrtps_being_made")
    owner = os.open(memory / f"{OTHER}_el", os.O_RDONLY)
    try:
        fcntl.flock(owner, fcntl.LOCK_SH)
        assert leftovers.clear(1, folder=memory, processes=processes) == [SEGMENT, f"{SEGMENT}_el"]
    finally:
        os.close(owner)
    assert leftovers.clear(1, folder=memory, processes=processes) == [OTHER, f"{OTHER}_el"]
    assert there(memory) == ["fastrtps_being_made"]


def test_files_of_other_users_are_left_alone(
    memory: Path, processes: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put(memory, "fastrtps_port7667", SEGMENT, f"{SEGMENT}_el")
    monkeypatch.setattr(os, "getuid", lambda: 4711)
    assert leftovers.clear(1, folder=memory, processes=processes) == []
