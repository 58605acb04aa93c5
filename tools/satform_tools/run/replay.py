# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flying a recorded flight once more in one process, with all that happened in it, and comparing the bits."""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from satform.common.exit_codes import EXIT_DONE, EXIT_ENDED_EARLY, EXIT_MISSED
from satform.evaluation.conclusion import left_out
from satform.flight.simulate import simulate
from satform.membership.state import Plan, SatelliteLost
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario, Timing
from satform_bringup import BAG_FOLDER
from satform_tools import console
from satform_tools.errors import CommandError
from satform_tools.run import ros_packages

_SAID = (
    "acceleration",
    "wheel_torque",
    "arc_length",
    "rate",
    "reference_position",
    "reference_velocity",
    "reference_acceleration",
    "sliding_variable",
    "estimated_position_error",
    "estimated_velocity_error",
    "estimate_covariance",
    "innovation",
    "rejected_measurements",
)
"""Quantities that are in the bag because the satellite itself said them: the last may be lost with it."""

_ANNOUNCED = ("arc_length", "rate")
"""Those of them that it says a step ahead."""


@dataclass(frozen=True)
class Replay:
    """What came of flying a recorded flight once more.

    Attributes:
        steps: compared.
        events: that happened beside what the scenario plans.
        differences: a sentence for each quantity that differs; empty when all bits are the same.
        state_hash: of the recorded flight; None where it is not the whole one.
        omitted_expectations: labels of what the longer flight is judged by of which this is a part.
        early_end: in words, why the flight ended before its last step, the recorded one and the one flown
            once more; empty when it did not.
    """

    steps: int
    events: int
    differences: tuple[str, ...]
    state_hash: str | None
    omitted_expectations: tuple[str, ...]
    early_end: str = ""


def replay(path: Path, *, as_json: bool) -> int:
    """Fly a bag's flight once more, say whether the bits are the same, and return the exit code.

    Raises:
        CommandError: there is no such bag, or it cannot be flown again.
    """
    ros_packages.require()
    from satform.bag.errors import BagError  # noqa: PLC0415 - needs ROS
    from satform.bag.reader import read_bag  # noqa: PLC0415 - most commands do without

    folder = path / BAG_FOLDER if (path / BAG_FOLDER).is_dir() else path
    try:
        bag = read_bag(folder)
    except BagError as error:
        raise CommandError(str(error)) from None
    if bag.clocked:
        raise CommandError(
            f"{path}: was flown on the wall clock, whose chances are not in the bag; "
            "flights in lockstep can be flown again"
        )
    if bag.record.steps < 1 and bag.record.early_end is None:
        raise CommandError(f"{path}: holds no whole step; there is nothing to be flown again")
    found = compare(bag.scenario, bag.record, bag.events)
    if as_json:
        console.as_json(asdict(found))
    else:
        _print(found, bag.scenario)
    if found.differences:
        return EXIT_MISSED
    return EXIT_ENDED_EARLY if found.early_end else EXIT_DONE


def compare(scenario: Scenario, record: FlightRecord, events: Plan) -> Replay:
    """Fly a flight once more and compare.

    Args:
        scenario: that was flown.
        record: of the flight, as far as it goes.
        events: that happened beside what the scenario plans, by step.

    Returns:
        The differences.

    Raises:
        CommandError: what happened cannot be done again.
    """
    steps, end = record.steps, record.early_end
    if end is not None:
        # It ends early once more if it is flown as far as the step at which it did.
        steps = min(scenario.timing.steps, end.step + 1)
    timing = Timing(step=scenario.timing.step, duration=steps * scenario.timing.step)
    shortened = scenario.model_copy(update={"timing": timing})
    within = {step: list(found) for step, found in events.items() if step <= steps}
    try:
        again = simulate(shortened, events=within)
    except ValueError as error:
        raise CommandError(f"what happened in the flight cannot be done again: {error}") from None
    _forget_unshown(again, record, scenario, within)
    count = sum(len(found) for found in within.values())
    whole = record.steps == scenario.timing.steps or (end is not None and record.steps > 0)
    return Replay(
        steps=record.steps,
        events=count,
        differences=tuple(again.differences(record)),
        state_hash=record.digest() if whole else None,
        omitted_expectations=scenario.omitted_expectations,
        early_end="" if end is None else end.sentence,
    )


def _forget_unshown(again: FlightRecord, record: FlightRecord, scenario: Scenario, events: Plan) -> None:
    """Leave out what lost satellites had said at last and nobody recorded: it was lost with them."""
    from satform_nodes.transport import qos  # noqa: PLC0415 - needs ROS

    # A satellite that its scenario kills waits until its words have arrived, but for the last it shows.
    for plan, longest in ((scenario.membership_plan().events, 1), (events, qos.LOCKSTEP.depth)):
        for step, found in plan.items():
            for event in found:
                if isinstance(event, SatelliteLost) and 0 < step <= record.steps:
                    for name in _SAID:
                        # What it announces is for the step after.
                        end = step + 1 if name in _ANNOUNCED and longest > 1 else step
                        last = slice(max(0, step - longest), end)
                        again_said, said = getattr(again, name), getattr(record, name)
                        _forget(again_said[last, event.satellite], said[last, event.satellite])


def _forget(again: NDArray[np.float64], recorded: NDArray[np.float64]) -> None:
    """Leave out the steps of which nothing is recorded."""
    if recorded.size:
        nothing = np.isnan(recorded.reshape(len(recorded), -1)).all(axis=1)
        again[nothing] = recorded[nothing]


def _print(found: Replay, scenario: Scenario) -> None:
    console.heading(f"{scenario.name}: {scenario.title}")
    happened = f"{found.events} unplanned events" if found.events else "nothing unplanned"
    console.line(f"{found.steps} of {scenario.timing.steps} steps, with {happened} in them")
    for difference in found.differences:
        console.line(difference, "bold red")
    if not found.differences:
        if found.early_end:
            console.line(f"Ended early: {found.early_end}.", "bold red")
        console.line("Flown once more in one process: the same to the last bit.", "green")
    if found.state_hash is not None:
        console.line(f"state hash {found.state_hash[:16]}")
    if left := left_out(scenario):
        console.line(f"{left} than was flown.")
