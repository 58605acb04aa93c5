# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads damaged inputs of one kind: `./tools/satform exec python tests/fuzz/soak.py bag --inputs 100000`.

Input 7 of a seed is the same in every run, so that a fault is found again by its number:
`soak.py bag --seed 1 --first 7 --inputs 1`. The inputs are read in a process of its own. If one ends it, or
hangs where Python cannot interrupt it, that is a fault of this input, and the next process goes on behind it.
"""

import argparse
import contextlib
import io
import json
import logging
import mmap
import multiprocessing
import os
import shutil
import struct
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from random import Random

if __name__ == "__main__":
    sys.path.append(str(Path(__file__).parents[1]))

from bag_inputs import bag_inputs
from input_guard import FaultError, answer_of
from input_kind import Input
from keystore_inputs import keystore_inputs
from result_inputs import result_inputs
from scenario_inputs import campaign_inputs, scenario_inputs

from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_DONE, EXIT_MISSED
from satform_tools.cli import main as cli

KINDS: dict[str, Callable[[Path], Callable[[Random, Path], Input]]] = {
    "bag": bag_inputs,
    "scenario": scenario_inputs,
    "campaign": campaign_inputs,
    "results": result_inputs,
    "keystore": keystore_inputs,
}
"""By the name of a kind: what makes its inputs, given a folder for whole ones."""

_STUCK = 600.0
"""Wall-clock time after which an input that Python cannot interrupt counts as a hang, s."""

_COUNTS = struct.Struct("<5Q")
"""Inputs begun, accepted, rejected, read by a command; largest memory of one, bytes."""


@dataclass
class Outcome:
    """What came of inputs.

    Attributes:
        kind: of the inputs.
        seed: of the inputs.
        first: number of the first.
        read: how many were read.
        accepted: of these.
        rejected: of these, in sentences.
        commands: how many were read by a command as well, which has to end with a fitting exit code.
        memory: largest resident memory that one took in addition, bytes.
        processor_seconds: of all.
        faults: number and what happened, for each that was neither accepted nor rejected.
    """

    kind: str
    seed: int
    first: int
    read: int = 0
    accepted: int = 0
    rejected: int = 0
    commands: int = 0
    memory: int = 0
    processor_seconds: float = 0.0
    faults: list[tuple[int, str]] = field(default_factory=list)

    def text(self) -> str:
        """The outcome in a sentence."""
        each = 1e3 * self.processor_seconds / max(1, self.read)
        return (
            f"{self.kind}: {self.read} inputs of seed {self.seed}, {self.accepted} accepted, {self.rejected} "
            f"rejected, {len(self.faults)} faults, {self.commands} by a command, at most "
            f"{self.memory / 2**20:.0f} MB in addition, {self.processor_seconds:.0f} s of processor time "
            f"({each:.1f} ms each)"
        )


def soak(
    kind: str,
    inputs: int,
    seed: int = 1,
    first: int = 0,
    *,
    every: int = 200,
    show: Callable[[Outcome], None] = lambda _outcome: None,
) -> Outcome:
    """Read damaged inputs.

    Args:
        kind: of the inputs.
        inputs: how many.
        seed: of the inputs.
        first: number of the first.
        every: of how many inputs one is read by a command as well.
        show: called now and then with the outcome so far.
    """
    outcome = Outcome(kind, seed, first)
    with tempfile.TemporaryDirectory(prefix="satform-fuzz-") as name:
        whole = Path(name) / "whole"
        whole.mkdir()
        make = KINDS[kind](whole)
        begun = _processor_time()
        number = first
        while number < first + inputs:
            number = _one_process(make, outcome, range(number, first + inputs), Path(name), every, show)
        outcome.processor_seconds = _processor_time() - begun
    return outcome


def _processor_time() -> float:
    own = os.times()
    return own.user + own.system + own.children_user + own.children_system


def _one_process(
    make: Callable[[Random, Path], Input],
    outcome: Outcome,
    numbers: range,
    folder: Path,
    every: int,
    show: Callable[[Outcome], None],
) -> int:
    """Read inputs in a process until all are read or it ends; the number with which the next goes on."""
    context = multiprocessing.get_context("fork")
    counts = mmap.mmap(-1, _COUNTS.size)
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(
        target=_read_all, args=(make, outcome.kind, outcome.seed, numbers, folder, every, counts, sender)
    )
    process.start()
    sender.close()
    stuck = _followed(process, receiver, counts, outcome, show)
    begun, accepted, rejected, commands, memory = _COUNTS.unpack(counts)
    process.join()
    ended = process.exitcode or 0
    outcome.read += begun
    outcome.accepted += accepted
    outcome.rejected += rejected
    outcome.commands += commands
    outcome.memory = max(outcome.memory, memory)
    if ended:
        how = f"no answer within {_STUCK:g} s" if stuck else f"its process ended with {ended}"
        outcome.faults.append((numbers.start + begun - 1, how))
    process.close()
    return numbers.start + begun


def _followed(
    process: "multiprocessing.context.ForkProcess",
    receiver: "multiprocessing.connection.Connection[object, object]",
    counts: mmap.mmap,
    outcome: Outcome,
    show: Callable[[Outcome], None],
) -> bool:
    """Take in the faults that a process finds, until it ends; whether it was stuck and was ended."""
    before, deadline, shown = -1, time.monotonic() + _STUCK, time.monotonic()
    while True:
        if receiver.poll(1.0):
            try:
                outcome.faults.append(receiver.recv())  # type: ignore[arg-type]
                continue
            except EOFError:
                return False
        begun, accepted, rejected, commands, memory = _COUNTS.unpack(counts)
        if begun != before:
            before, deadline = begun, time.monotonic() + _STUCK
        elif time.monotonic() > deadline:
            process.kill()
            return True
        if time.monotonic() > shown + 60.0:
            shown = time.monotonic()
            show(
                Outcome(
                    outcome.kind,
                    outcome.seed,
                    outcome.first,
                    outcome.read + begun,
                    outcome.accepted + accepted,
                    outcome.rejected + rejected,
                    outcome.commands + commands,
                    max(outcome.memory, memory),
                    faults=outcome.faults,
                )
            )


def _read_all(
    make: Callable[[Random, Path], Input],
    kind: str,
    seed: int,
    numbers: range,
    folder: Path,
    every: int,
    counts: mmap.mmap,
    faults: "multiprocessing.connection.Connection[object, object]",
) -> None:
    """Read inputs, and note what comes of each."""
    logging.disable()
    begun = accepted = rejected = commands = memory = 0
    for number in numbers:
        begun += 1
        _COUNTS.pack_into(counts, 0, begun, accepted, rejected, commands, memory)
        place = folder / "input"
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir()
        try:
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
                given = make(Random(f"{kind} {seed} {number}"), place)
                answer = answer_of(given.read, given.rejections, given.source)
                if given.command and number % every == 0:
                    commands += 1
                    _command(given, rejected=bool(answer.sentences) and not given.repairs)
        except BaseException as error:  # whatever it is, it is a fault
            faults.send((number, "".join(traceback.format_exception(error))[-3000:]))
            if isinstance(error, KeyboardInterrupt):
                raise
            continue
        accepted += not answer.sentences
        rejected += bool(answer.sentences)
        memory = max(memory, answer.memory)
        _COUNTS.pack_into(counts, 0, begun, accepted, rejected, commands, memory)


def _command(given: Input, *, rejected: bool) -> None:
    """Read an input by its command, which has to end in order, or with a sentence and exit code 2.

    Args:
        given: the input.
        rejected: whether the command has to reject it, with exit code 2.

    Raises:
        FaultError: it does not.
    """
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = cli.main(list(given.command))
    said = err.getvalue()
    if code == EXIT_BAD_INPUT and (out.getvalue() + said).strip() and "Traceback" not in said:
        return
    if rejected or code not in {EXIT_DONE, EXIT_MISSED} or "Traceback" in said:
        raise FaultError(f"{' '.join(given.command)} ended with exit code {code}: {said[-2000:]}")


def main() -> int:
    """Read inputs as the command line asks; 1 if there are faults."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("--inputs", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--every", type=int, default=200, help="one of so many is read by a command as well")
    given = parser.parse_args()
    outcome = soak(
        given.kind,
        given.inputs,
        given.seed,
        given.first,
        every=given.every,
        show=lambda so_far: sys.stderr.write(f"{so_far.text()}\n"),
    )
    for number, fault in outcome.faults:
        sys.stdout.write(f"-- input {number}\n{fault}\n")
    sys.stdout.write(f"{outcome.text()}\n")
    sys.stdout.write(f"{json.dumps({**asdict(outcome), 'faults': len(outcome.faults)})}\n")
    return int(bool(outcome.faults))


if __name__ == "__main__":
    sys.exit(main())
