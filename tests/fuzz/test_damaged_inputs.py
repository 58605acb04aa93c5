# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Anything at all as a bag, scenario, campaign, result or keystore: accepted, or rejected in sentences.

About a thousand inputs, always the same, are read with the other tests, so that what is mended stays so;
`soak.py` reads any number of others.
"""

import os
import time
from collections.abc import Callable
from pathlib import Path
from random import Random

import input_guard
import pytest
import soak
from input_kind import Input

from satform_tools.errors import CommandError

INPUTS = {"bag": 250, "scenario": 200, "campaign": 100, "results": 300, "keystore": 150}


@pytest.mark.parametrize("kind", INPUTS)
def test_a_damaged_input_is_accepted_or_rejected_in_sentences(kind: str) -> None:
    outcome = soak.soak(kind, INPUTS[kind], seed=0, every=INPUTS[kind])
    assert outcome.faults == []
    assert outcome.read == INPUTS[kind]
    # Inputs that are all rejected at their first byte would show nothing.
    assert min(outcome.accepted, outcome.rejected) > 0.02 * outcome.read


def reject(text: str) -> None:
    raise CommandError(text)


def fail() -> None:
    raise KeyError("a mistake of the reader")


def loop() -> None:
    while time.monotonic() > 0.0:
        pass


READERS: tuple[tuple[Callable[[], object], str], ...] = (
    (lambda: None, ""),
    (lambda: reject("file: is empty"), ""),
    (fail, "KeyError"),
    (lambda: reject("file: two\nlines"), "of which this is none"),
    (lambda: reject("is empty"), "no sentence names file"),
    (lambda: b"x" * (200 * 2**20), "took 2"),
    (loop, "no answer within"),
    (os.abort, "its process ended with -6"),
    (lambda: None, ""),
)
"""What reads an input, and the fault that is found, empty where there is none."""


def test_the_driver_finds_errors_hangs_large_memory_and_processes_that_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def kind(_folder: Path) -> Callable[[Random, Path], Input]:
        waiting = iter(READERS)

        def make(_draw: Random, place: Path) -> Input:
            # The process that goes on behind an input that ended one begins anew.
            begun = place.parent / "begun"
            number = int(begun.read_text()) if begun.exists() else 0
            begun.write_text(str(number + 1))
            return Input(READERS[number][0], "file", (CommandError,))

        assert next(waiting)
        return make

    monkeypatch.setitem(soak.KINDS, "made", kind)
    monkeypatch.setattr(input_guard, "SECONDS", 0.2)
    monkeypatch.setattr(input_guard, "MEMORY", 100 * 2**20)
    outcome = soak.soak("made", len(READERS))
    expected = [(number, fault) for number, (_, fault) in enumerate(READERS) if fault]
    assert [number for number, _ in outcome.faults] == [number for number, _ in expected]
    for (_, found), (_, fault) in zip(outcome.faults, expected, strict=True):
        assert fault in found
    assert (outcome.read, outcome.accepted, outcome.rejected) == (len(READERS), 2, 1)


@pytest.mark.parametrize("repairs", [False, True])
def test_a_command_that_accepts_what_its_reader_rejects_is_a_fault_unless_it_repairs(
    repairs: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = Input(lambda: reject("file: is empty"), "file", (CommandError,), ["list"], repairs=repairs)
    monkeypatch.setitem(soak.KINDS, "made", lambda _folder: lambda _draw, _place: given)
    outcome = soak.soak("made", 1, every=1)
    assert [fault for _, fault in outcome.faults if "exit code 0" not in fault] == []
    assert len(outcome.faults) == int(not repairs)


def test_an_input_is_the_same_in_every_run(tmp_path: Path) -> None:
    def content(folder: Path) -> list[bytes]:
        folder.mkdir()
        make = soak.KINDS["keystore"](folder)
        found = []
        for number in range(5):
            place = folder / str(number)
            place.mkdir()
            make(Random(f"keystore 1 {number}"), place)
            found += sorted(path.name.encode() for path in place.rglob("*"))
        return found

    assert content(tmp_path / "a") == content(tmp_path / "b")
