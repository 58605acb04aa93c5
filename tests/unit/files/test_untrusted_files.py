# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Files from anywhere: whatever is in them, every reader answers with what it read or a sentence, soon."""

import io
import json
import os
import random
import signal
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import zstandard
from mcap.writer import CompressionType, Writer

from flights import shortened
from satform.bag import records as bag_records
from satform.bag.records import LEAST_EXPANDED
from satform.files.bounded_file import read_bounded, read_json
from satform.files.numpy_archive import ArchiveError, read_archive
from satform.flight.checkpoint import restore
from satform.flight.compile_satellite import flight_plan
from satform.flight.satellite import Satellite
from satform.record.archive import RecordError, load_record
from satform_tools.cli import main as cli
from satform_tools.run import output_folders

SECONDS = 120
"""After which an example counts as a hang, on however loaded a machine."""


@contextmanager
def bounded() -> Iterator[None]:
    """Ends what hangs with an exception that no code is meant to catch."""

    def hangs(_number: int, _frame: object) -> None:
        raise KeyboardInterrupt(f"no answer within {SECONDS} s")

    before = signal.signal(signal.SIGALRM, hangs)
    signal.alarm(SECONDS)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


@contextmanager
def ordinary_user() -> Iterator[None]:
    """Without root's right to read everything, where root runs the test."""
    before = os.geteuid()
    if before == 0:
        os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(before)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short flight as it is kept."""
    folder = tmp_path_factory.mktemp("kept") / "run"
    words = ["run", "triangle", "--mode", "inprocess", "--set", "timing.duration=20.0", "--set", "expect=[]"]
    assert cli.main([*words, "--out", str(folder)]) == 0
    return folder


@pytest.mark.parametrize("path", ["/dev/zero", "pipe", ".", "missing", "unreadable", "large"])
def test_what_is_no_regular_file_of_the_size_expected_is_refused_unread(
    path: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "unreadable").touch(0o000)
    (tmp_path / "large").write_bytes(bytes(1001))
    # Another user may enter this folder, but not those above it.
    tmp_path.chmod(0o755)
    monkeypatch.chdir(tmp_path)
    reader = ordinary_user() if path == "unreadable" else nullcontext()
    refused = pytest.raises(OSError, match=r"device|pipe|folder|No such|Permission|has 1001 bytes")
    with bounded(), reader, refused:
        read_bounded(Path(path), 1000)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"[" * 100_000, "is nested too deeply"),
        (b'{"a":' * 100_000, "is nested too deeply"),
        (b"{", "is not JSON"),
        (b"\xff\xfe\x00", "is not"),
        (b"9" * 5000, "is not JSON"),
        (b'{"a": 1e999}', "1e999 is not a finite number"),
        (b"[-Infinity]", "-Infinity is not a finite number"),
        (b"[NaN]", "NaN is not a finite number"),
        (b"", "is not JSON"),
    ],
)
def test_json_of_any_kind_is_read_or_refused_in_a_sentence(
    content: bytes, sentence: str, tmp_path: Path
) -> None:
    file = tmp_path / "any.json"
    file.write_bytes(content)
    with bounded(), pytest.raises(ValueError, match=sentence):
        read_json(file, 1_000_000)


def test_a_result_that_cannot_be_read_is_done_without(
    tmp_path: Path, run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # A report only takes from it which versions flew.
    kept = (run / output_folders.RESULT).read_bytes()
    (run / output_folders.RESULT).write_bytes(b"[" * 100_000)
    assert cli.main(["report", str(run), "--out", str(tmp_path / "report"), "--json"]) == 0
    (run / output_folders.RESULT).write_bytes(kept)
    assert json.loads(capsys.readouterr().out)["steps"] == 40


def archive(compression: int = zipfile.ZIP_STORED, **members: bytes) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compression) as file:
        for name, content in members.items():
            file.writestr(f"{name}.npy", content)
    return buffer.getvalue()


def array(header: str, content: bytes = b"") -> bytes:
    """An array as numpy keeps it, with any header."""
    words = header.encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(words).to_bytes(2, "little") + words + content


def test_arrays_come_back_as_numpy_wrote_them() -> None:
    buffer = io.BytesIO()
    whole = {"a": np.arange(6.0).reshape(2, 3), "b": np.array("text"), "c": np.asfortranarray(np.eye(3)[:2])}
    np.savez(buffer, **whole)
    read = read_archive(buffer.getvalue())
    assert {name: (entry.dtype, entry.tolist()) for name, entry in read.items()} == {
        name: (entry.dtype, entry.tolist()) for name, entry in whole.items()
    }


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (archive(zipfile.ZIP_DEFLATED, a=bytes(50_000_000)), "more bytes than the"),
        (archive(a=array("{'descr': '<f8', 'fortran_order': False, 'shape': (999999999999,)}")), "announces"),
        (archive(a=array("{'descr': '|O', 'fortran_order': False, 'shape': (1,)}")), "holds objects"),
        (archive(a=array("(" * 110)), "cannot be read"),
        (archive(a=b"\x93NUMPY\x09\x00"), "version"),
        (archive(a=b"hello"), "magic|early|EOF"),
        (b"PK\x03\x04", "zip"),
        (b"", "zip"),
    ],
    ids=["bomb", "huge shape", "objects", "nested header", "version", "no array", "cut", "empty"],
)
def test_an_archive_of_any_kind_is_refused_in_a_sentence(data: bytes, sentence: str, tmp_path: Path) -> None:
    scenario = shortened("triangle", 10.0)
    with bounded():
        with pytest.raises(ArchiveError, match=f"(?i){sentence}"):
            read_archive(data)
        with pytest.raises(ValueError, match="this is no checkpoint"):
            restore(Satellite(flight_plan(scenario, 0), 2), data)
        (tmp_path / "record.npz").write_bytes(data)
        with pytest.raises(RecordError, match="is not the record of a run"):
            load_record(tmp_path / "record.npz")


def bag(path: Path, content: bytes, compression: str, announced: int | None = None) -> Path:
    """An MCAP file with one chunk of any content."""
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.NONE)
        writer.start()
        writer.finish()
    whole = path.read_bytes()
    data = {"zstd": zstandard.compress, "lz4": lz4.frame.compress, "none": bytes}[compression](content)
    size = len(content) if announced is None else announced
    name = b"" if compression == "none" else compression.encode()
    head = bytes(16) + size.to_bytes(8, "little") + bytes(4) + len(name).to_bytes(4, "little") + name
    chunk = head + len(data).to_bytes(8, "little") + data
    record = b"\x06" + len(chunk).to_bytes(8, "little") + chunk
    # After the magic and the header.
    place = 8 + 9 + int.from_bytes(whole[9:17], "little")
    path.write_bytes(whole[:place] + record + whole[place:])
    return path


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
@pytest.mark.parametrize("announced", [None, 1000, 2**63])
def test_a_few_bytes_that_expand_to_gigabytes_are_refused(
    announced: int | None, compression: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = bag(tmp_path / "bomb.mcap", bytes(4 * LEAST_EXPANDED), compression, announced)
    assert file.stat().st_size < 2_000_000
    with bounded():
        assert cli.main(["report", str(file)]) == 2
    said = capsys.readouterr().err
    assert any(words in said for words in ("expand to more than", "than the", "a chunk of it holds"))
    assert said.count("\n") == 1


def test_a_chunk_too_large_for_memory_is_refused_however_large_its_file_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bag_records, "LEAST_EXPANDED", 2**40)
    file = bag(tmp_path / "large.mcap", bytes(1000), "zstd", 2**29)
    assert cli.main(["report", str(file)]) == 2
    assert (
        "a chunk of it holds 536870912 bytes; 268435456 is the most that is read" in capsys.readouterr().err
    )


@pytest.mark.parametrize("compression", ["zstd", "lz4", "none"])
def test_a_cut_chunk_is_a_sentence(
    compression: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = bag(tmp_path / "cut.mcap", random.Random(1).randbytes(5000), compression)
    whole = file.read_bytes()
    for length in (60, 200, 3000):
        file.write_bytes(whole[:length] + bytes(200))
        with bounded():
            assert cli.main(["report", str(file)]) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1, said
