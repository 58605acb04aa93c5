# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Checks of the launch file and the text of its result, without imports of `launch`."""

import difflib
from collections.abc import Collection, Sequence
from pathlib import Path

from satform.common.name_list import listed
from satform.evaluation.conclusion import conclusion_of
from satform.evaluation.evaluate import evaluate
from satform.scenario import Scenario


def refuse_unknown_arguments(arguments: Sequence[str], file_name: str, known: Collection[str]) -> None:
    """Refuse arguments on the command line that a launch file does not declare: launch itself ignores them.

    Only where the command line names the launch file: another one that includes it may have arguments of its
    own.

    Args:
        arguments: of the command line.
        file_name: of the launch file.
        known: names of the arguments that it declares.

    Raises:
        RuntimeError: there are others; the sentence names the nearest spelling.
    """
    named = [index for index, argument in enumerate(arguments) if Path(argument).name == file_name]
    if not named:
        return
    assigned = [argument.partition(":=")[0] for argument in arguments[named[0] + 1 :] if ":=" in argument]
    for name in assigned:
        if name not in known:
            close = difflib.get_close_matches(name, known, n=1)
            hint = f"did you mean {close[0]}:=?" if close else f"there are {listed(sorted(known))}"
            raise RuntimeError(f"there is no launch argument {name}:=; {hint}")


def result(scenario: Scenario, bag: Path | None) -> list[str]:
    """How a flight that has ended was, by what its scenario expects.

    Args:
        scenario: that was flown.
        bag: its folder; None when nothing was recorded.

    Returns:
        Sentences, the conclusion last.
    """
    from satform.bag.errors import BagError  # noqa: PLC0415 - the start does without
    from satform.bag.reader import read_bag  # noqa: PLC0415 - the start does without

    if bag is None:
        return ["result: not judged, since nothing was recorded"]
    try:
        flight = read_bag(bag)
    except BagError as error:
        return [f"result: not judged: {error}"]
    if not flight.complete:
        return [f"result: not judged: {flight.record.steps} of {scenario.timing.steps} steps are in the bag"]
    verdicts = list(evaluate(scenario, flight.record))
    lines = [
        f"{'met' if verdict.met else 'MISSED'}: {verdict.label}: {verdict.figure:g} {verdict.unit}, "
        f"expected {verdict.allowed}"
        for verdict in verdicts
    ]
    end = flight.record.early_end
    if end is not None:
        missed = f"; {sum(not verdict.met for verdict in verdicts)} of {len(verdicts)} expectations missed"
        flown = f"step {flight.record.steps} of {scenario.timing.steps}"
        return [*lines, f"result: ENDED EARLY after {flown}: {end.sentence}{missed if verdicts else ''}"]
    return [*lines, f"result: {conclusion_of(scenario, verdicts)}"]
