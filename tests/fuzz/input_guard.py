# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""One input at a time, in bounded time and memory, and what came of it."""

import resource
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from satform_tools.errors import error_sentences

SECONDS = 60.0
"""Processor time after which an input counts as one that hangs."""

MEMORY = 768 * 2**20
"""Bytes of resident memory that an input may take in addition."""

_ADDRESSES = 4 * 2**30
"""Bytes of address space after which an input is ended, so that the machine is not in danger."""

_LONGEST_SENTENCE = 10_000
_MOST_SENTENCES = 201


class FaultError(AssertionError):
    """An input that was neither accepted nor rejected in sentences; the message says what happened."""


class _HangError(BaseException):
    """An input that hangs: no code is meant to catch this."""


@dataclass(frozen=True)
class Answer:
    """What came of an input.

    Attributes:
        sentences: with which it was rejected; none when it was accepted.
        memory: bytes of resident memory that it took in addition.
    """

    sentences: tuple[str, ...]
    memory: int


def answer_of(read: Callable[[], object], rejections: tuple[type[Exception], ...], source: str) -> Answer:
    """Have an input read.

    Args:
        read: reads it.
        rejections: errors by which it may be rejected.
        source: that a sentence of a rejection has to name.

    Raises:
        FaultError: another error, sentences that are none, too much memory, or no answer.
    """
    sentences: list[str] = []
    with _measured() as memory:
        try:
            read()
        except rejections as error:
            sentences = error_sentences(error) or [str(error)]
        except _HangError:
            raise FaultError(f"no answer within {SECONDS:g} s of processor time") from None
    if sentences and not any(source in sentence for sentence in sentences):
        raise FaultError(f"no sentence names {source}: {sentences[0]!r}")
    wrong = [sentence for sentence in sentences if not _is_sentence(sentence)]
    if wrong or len(sentences) > _MOST_SENTENCES:
        raise FaultError(
            f"{len(sentences)} sentences, of which this is none: {(wrong or sentences)[0]!r:.2000}"
        )
    if memory[0] > MEMORY:
        raise FaultError(f"took {memory[0] / 2**20:.0f} MB of memory")
    return Answer(tuple(sentences), memory[0])


def _is_sentence(text: str) -> bool:
    return len(text.strip()) > 0 and len(text) <= _LONGEST_SENTENCE and "\n" not in text.strip()


@contextmanager
def _measured() -> Iterator[list[int]]:
    """End what hangs; yields a list that has the resident memory taken in addition, afterwards."""
    taken = [0]
    before = _resident("VmRSS")
    # The highest value since now; Linux, proc(5).
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    limits = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (_resident("VmSize") + _ADDRESSES, limits[1]))
    handler = signal.signal(signal.SIGPROF, _hangs)
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        yield taken
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, handler)
        resource.setrlimit(resource.RLIMIT_AS, limits)
        taken[0] = max(0, _resident("VmHWM") - before)


def _hangs(_number: int, _frame: Any) -> None:
    raise _HangError


def _resident(name: str) -> int:
    """An entry of this process's status, bytes."""
    text = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
    line = next(line for line in text.splitlines() if line.startswith(f"{name}:"))
    return int(line.split()[1]) * 1024
