# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Has each call of a writer fail once, and checks its promises; run with the failing calls of `LD_PRELOAD`.

The writer runs in a fork for each call, so that a fork can be killed. Its output is one line of JSON.
"""

import ctypes
import errno
import json
import os
import shutil
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1])]

from promises import WRITERS, Writer  # noqa: E402

from satform.campaign import parquet_file  # noqa: E402

KINDS = ("open", "write", "fsync", "rename", "mkdir", "unlink")
"""In the order of `failing_calls.c`."""

SHORT, KILL, DAY_AHEAD, DAY_BACK = -1, -2, -3, -4
"""Effects beside errors, as in `failing_calls.c`."""

EFFECTS = {
    "open": (errno.ENOSPC, KILL, DAY_AHEAD, DAY_BACK),
    "write": (errno.ENOSPC, SHORT, KILL),
    "fsync": (errno.EIO, KILL),
    "rename": (errno.EIO, KILL),
    "mkdir": (errno.ENOSPC, KILL),
    "unlink": (errno.EIO, KILL),
}
"""What becomes of a call of each kind."""

CALLS = ctypes.CDLL(None)


def acted(writer: Writer, folder: Path, failure: tuple[int, int, int]) -> tuple[list[str], str, list[int]]:
    """Have a writer act in a fork in which a call fails.

    Returns:
        What it said; how it ended: `done`, `failed`, `killed`, or a traceback; and the calls of each kind.
    """
    reading, writing = os.pipe()
    process = os.fork()
    if process == 0:
        _act(writer, folder, writing, failure)
    os.close(writing)
    with os.fdopen(reading) as lines:
        *said, last = lines.read().split("\n") or [""]
    _, status = os.waitpid(process, 0)
    if os.WIFSIGNALED(status):
        return said, "killed", []
    end = json.loads(last)
    return said, end["end"], end["counts"]


def _act(writer: Writer, folder: Path, pipe: int, failure: tuple[int, int, int]) -> None:
    """What the fork does; it does not return."""
    for reader in parquet_file._READERS:
        # The one of the process before, which waits meanwhile.
        reader.owner = os.getpid()
    CALLS.failing_watch(str(folder).encode())
    CALLS.failing_arm(*failure)
    try:
        writer.act(folder, lambda text: os.write(pipe, f"{text}\n".encode()))
        end = "done"
    except OSError:
        end = "failed"
    except BaseException:
        end = traceback.format_exc()
    counts = [CALLS.failing_count(own) for own in range(len(KINDS))]
    os.write(pipe, json.dumps({"end": end, "counts": counts}).encode())
    os._exit(0)


def outcomes(writer: Writer, place: Path) -> Iterator[tuple[str, str]]:
    """Each failure and which promise it broke, empty for none; the first one is that nothing failed."""
    promise, counts = outcome(writer, place, (-1, 0, 0))
    yield "none", promise
    for kind, count in enumerate(counts):
        for number in range(1, count + 1):
            for effect in EFFECTS[KINDS[kind]]:
                yield f"{KINDS[kind]} {number} ({effect})", outcome(writer, place, (kind, number, effect))[0]


def outcome(writer: Writer, place: Path, failure: tuple[int, int, int]) -> tuple[str, list[int]]:
    """Which promise a failure breaks, and how many calls of each kind there were."""
    folder = place / "kept"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    writer.prepare(folder)
    said, end, counts = acted(writer, folder, failure)
    if end not in {"done", "failed", "killed"}:
        return end, counts
    kind, _, effect = failure
    vital = effect > 0 and KINDS[kind] in {"open", "write", "fsync", "rename"}
    if vital and len(said) == writer.all_said:
        return f"{end}, said {said}: all of it, though a call has failed", counts
    try:
        promise = writer.broken(folder, said, end == "killed")
    except Exception:  # what is left cannot be read
        promise = traceback.format_exc()
    return promise and f"{end}, said {said}: {promise}", counts


def main(names: Sequence[str]) -> None:
    """Print a line for each writer: how many failures there were of each kind, and what they broke."""
    for name in names:
        writer = WRITERS[name]()
        with tempfile.TemporaryDirectory(prefix="satform-failing-") as place:
            found = list(outcomes(writer, Path(place)))
        broken = [f"{failure}: {promise}" for failure, promise in found if promise]
        failures = Counter(failure.split()[0] for failure, _ in found[1:])
        sys.stdout.write(json.dumps({"writer": name, "broken": broken, "failures": failures}) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:] or list(WRITERS))
