# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The command `replay`: repeats a recorded flight in one process, with its events, and compares the bits."""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from satform.common.exit_codes import EXIT_DONE, EXIT_ENDED_EARLY, EXIT_MISSED
from satform.common.name_list import listed
from satform.evaluation.conclusion import excluded
from satform.flight.compile import external_satellites
from satform.flight.simulate import simulate
from satform.membership.formation import Plan, SatelliteLost
from satform.record.flight_record import FlightRecord
from satform.record.quantities import ATTITUDE_ESTIMATES
from satform.scenario import Scenario, Timing
from satform_bringup import BAG_FOLDER
from satform_tools import console
from satform_tools.errors import CommandError
from satform_tools.run import ros_packages

_FROM_SATELLITE = (
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
    "unsolved_plans",
    *ATTITUDE_ESTIMATES,
)
"""Quantities that the satellite publishes: the last messages may be lost with it."""

_ANNOUNCED = ("arc_length", "rate")
"""Those of them that it publishes a step ahead."""


@dataclass(frozen=True)
class Replay:
    """Result of a replay.

    Attributes:
        steps: compared.
        events: number of unplanned events.
        differences: a sentence for each quantity that differs; empty when all bits are the same.
        state_hash: of the recorded flight; None where it is not the whole one.
        omitted_expectations: labels of expectations that need a longer flight.
        early_end: reason for which both flights ended before the last step; empty when they did not.
    """

    steps: int
    events: int
    differences: tuple[str, ...]
    state_hash: str | None
    omitted_expectations: tuple[str, ...]
    early_end: str = ""


def replay(path: Path, *, as_json: bool) -> int:
    """Repeat the flight of a bag, print whether it is bitwise equal, and return the exit code.

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
            f"{path}: was flown against the wall clock, which a replay cannot repeat; "
            "flights in lockstep can be replayed"
        )
    if bag.record.steps < 1 and bag.record.early_end is None:
        raise CommandError(f"{path}: has no complete step; there is nothing to replay")
    external = external_satellites(bag.scenario)
    if external:
        console.note(
            f"{listed(external)} was flown by an external program; the replay flies the controller of the "
            "scenario, and is equal only where both compute the same"
        )
    found = compare(bag.scenario, bag.record, bag.events)
    if as_json:
        console.as_json(asdict(found))
    else:
        _print(found, bag.scenario)
    if found.differences:
        return EXIT_MISSED
    return EXIT_ENDED_EARLY if found.early_end else EXIT_DONE


def compare(scenario: Scenario, record: FlightRecord, events: Plan) -> Replay:
    """Repeat a flight and compare.

    Args:
        scenario: that was flown.
        record: of the flight, as far as it goes.
        events: unplanned ones, by step.

    Returns:
        The differences.

    Raises:
        CommandError: an event cannot be repeated.
    """
    steps, end = record.steps, record.early_end
    if end is not None:
        # It has to reach the step at which it ended early.
        steps = min(scenario.timing.steps, end.step + 1)
    timing = Timing(step=scenario.timing.step, duration=steps * scenario.timing.step)
    shortened = scenario.model_copy(update={"timing": timing})
    within = {step: list(found) for step, found in events.items() if step <= steps}
    try:
        again = simulate(shortened, events=within)
    except ValueError as error:
        raise CommandError(f"the events of the flight cannot be repeated: {error}") from None
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
    """Exclude the last messages of lost satellites that were not recorded from the comparison."""
    from satform_nodes.transport import qos  # noqa: PLC0415 - needs ROS

    # A satellite lost as planned waits until its messages are acknowledged, but for its last diagnostics.
    for plan, longest in ((scenario.membership_plan().events, 1), (events, qos.LOCKSTEP.depth)):
        for step, found in plan.items():
            for event in found:
                if isinstance(event, SatelliteLost) and 0 < step <= record.steps:
                    for name in _FROM_SATELLITE:
                        # Announcements are for the next step.
                        end = step + 1 if name in _ANNOUNCED and longest > 1 else step
                        last = slice(max(0, step - longest), end)
                        replayed, recorded = getattr(again, name), getattr(record, name)
                        _forget(replayed[last, event.satellite], recorded[last, event.satellite])


def _forget(again: NDArray[np.float64], recorded: NDArray[np.float64]) -> None:
    """Exclude the steps without recorded values."""
    if recorded.size:
        nothing = np.isnan(recorded.reshape(len(recorded), -1)).all(axis=1)
        again[nothing] = recorded[nothing]


def _print(found: Replay, scenario: Scenario) -> None:
    console.heading(f"{scenario.name}: {scenario.title}")
    happened = f"{found.events} unplanned events" if found.events else "no unplanned events"
    console.line(f"{found.steps} of {scenario.timing.steps} steps, {happened}")
    for difference in found.differences:
        console.line(difference, "bold red")
    if not found.differences:
        if found.early_end:
            console.line(f"Ended early: {found.early_end}.", "bold red")
        console.line("Replayed in one process: bitwise equal.", "green")
    if found.state_hash is not None:
        console.line(f"state hash {found.state_hash[:16]}")
    if left := excluded(scenario):
        console.line(f"{left} than was flown.")
