# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Steps of one satellite's flight software as a program on floats.

As in `float_act`, but for a step from the numbers of the received messages to those of the published ones,
without an array on the way. It is for satellites without attitude and filters; `float_act` flies the others.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from satform.communication.messages import WIDTH, encode
from satform.communication.neighbour_buffer import Received
from satform.control.protocol import MakesPlans, Motion
from satform.flight.compile import FormationPlan
from satform.flight.float_act import WORTHWHILE
from satform.flight.limits import LimitCheck
from satform.flight.satellite import Satellite
from satform.flight.satellite_step import Decision
from satform.numeric.array_trees import arrays_of, filled, numbers_of_arrays, others_of, same_bits
from satform.numeric.recorded_arrays import Recording, elements, paired
from satform.numeric.recording import NotRecordableError, is_own
from satform.numeric.straight_line import Program, program

_FIRST = 8
"""Steps over arrays before one is recorded."""

_MOST_RECORDINGS = 4
"""Times that a satellite is recorded; then it stays with arrays."""

_SHORTEST_RUN = 50
"""Steps that a program has to fly; with less it is not used any more."""

_OWN_INPUTS = 9
"""Numbers of a state message that a step needs: position, velocity, applied acceleration."""


class FloatSatellite:
    """Flies steps of one satellite by a program, as far as it goes.

    What a step gives are numbers in this order: commanded acceleration (3), position, velocity and
    acceleration of the reference (9), errors of position and velocity (6), sliding variable (3), then time
    and numbers of the neighbour message for the next step.
    """

    def __init__(self, plan: FormationPlan, index: int) -> None:
        """Nothing is recorded yet.

        Args:
            plan: of the flight's parts.
            index: of the satellite.
        """
        self._limits = LimitCheck(plan.limits)
        self._steps = plan.timing.steps
        self._width = 1 + WIDTH[plan.announces]
        self._index = index
        faulty = plan.faults.any_clock or any(fault.satellite == index for fault in plan.faults.byzantine)
        self._fits = plan.links.links is None and not faulty
        self._recordings = 0
        self._flown_over_arrays = 0
        self._recorded: _Recorded | None = None
        self._trial: _Recorded | None = None

    def takes(self, satellite: Satellite) -> bool:
        """Whether a satellite may be flown in this way."""
        return self._fits and suits(satellite)

    def fly(self, satellite: Satellite, step: int, inputs: Sequence[float]) -> list[float] | None:
        """Fly a step by the program, or record it.

        Args:
            satellite: whose step it is; its state stays behind until `settle`.
            step: number of the step.
            inputs: position, velocity and applied acceleration, then of each neighbour 1 if the graph has its
                edge, else 0, then of each time and numbers of its message, zeros without an edge.

        Returns:
            What the step gives; None where it has to go over arrays, by `judge` afterwards.
        """
        recorded = self._recorded
        if recorded is not None:
            if recorded.is_of(satellite) and (results := recorded.fly(step, inputs)) is not None:
                return results
            self._give_up(satellite, recorded)
        self._trial = None
        self._flown_over_arrays += 1
        worthwhile = self._fits and self._steps - step >= WORTHWHILE and self._recordings < _MOST_RECORDINGS
        if worthwhile and self._flown_over_arrays > _FIRST:
            self._record(satellite, step, inputs)
        return None

    def judge(self, satellite: Satellite, results: Sequence[float]) -> None:
        """Use the program that was recorded in this step if it gives the bits of the arrays.

        Args:
            satellite: after the step over arrays.
            results: of the step over arrays, in the order of those of `fly`.
        """
        if self._trial is not None and self._trial.agrees(satellite, results):
            self._recorded = self._trial
        self._trial = None

    @property
    def on_trial(self) -> bool:
        """Whether `judge` is to be called after this step over arrays."""
        return self._trial is not None

    def settle(self, satellite: Satellite) -> None:
        """Bring the state of the program into the satellite; it goes on unless the satellite is changed."""
        if self._recorded is not None:
            self._recorded.settle(satellite)

    def forget(self) -> None:
        """Use no program any more: the satellite is another one."""
        self._recorded = self._trial = None
        self._flown_over_arrays = 0

    def _give_up(self, satellite: Satellite, recorded: "_Recorded") -> None:
        """Go over arrays from this step on; record another program later if this one has been of use."""
        recorded.settle(satellite)
        if recorded.flown < _SHORTEST_RUN:
            self._recordings = _MOST_RECORDINGS
        self.forget()

    def _record(self, satellite: Satellite, step: int, inputs: Sequence[float]) -> None:
        self._recordings += 1
        if not suits(satellite):
            return
        try:
            self._trial = _recorded_step(satellite, step, inputs, self._limits, self._width)
        except NotRecordableError:
            self._flown_over_arrays = 0


def suits(satellite: Satellite) -> bool:
    """Whether a satellite may be recorded: without filters, attitude, plans and parts of other packages."""
    plan = satellite.plan
    further = (plan.navigation, plan.estimator, plan.orientation)
    return (
        all(part is None for part in further) and not isinstance(plan.controller, MakesPlans) and is_own(plan)
    )


def results_of(decision: Decision, time: float, announced: Sequence[float]) -> list[float]:
    """What a step over arrays gives, in the order of `FloatSatellite`.

    Args:
        decision: of the step.
        time: of the neighbour message for the next step, s.
        announced: its numbers.
    """
    return [*np.concatenate([decision.acceleration, *decision.tracked()]).tolist(), time, *announced]


class _Recorded:
    """A program with the state of the satellite that it is at.

    Attributes:
        flown: number of steps that it has flown.
    """

    def __init__(
        self, made: Program, satellite: Satellite, indices: list[int], inputs: Sequence[float], step: int
    ) -> None:
        self.flown = 0
        self._run = made.run
        self._indices = indices
        self._plan = satellite.plan
        self._state = satellite.state
        self._step = step
        # What is carried from step to step, then the inputs of a step.
        before = self._numbers(satellite)
        self._own = len(before)
        self._carried = before
        self._settled = True
        self._trial = self.fly(step, inputs)

    def is_of(self, satellite: Satellite) -> bool:
        """Whether the satellite is as the program has left it."""
        return satellite.plan is self._plan and satellite.state is self._state

    def agrees(self, satellite: Satellite, results: Sequence[float]) -> bool:
        """Whether the first step gave the bits that it has over arrays; the program goes on from there."""
        if self._trial is None:
            return False
        own = self._numbers(satellite)
        self._state, self._settled = satellite.state, True
        return same_bits(self._trial, results) and same_bits(self._carried, own)

    def fly(self, step: int, inputs: Sequence[float]) -> list[float] | None:
        """Fly one step; None if it is not as the recorded one."""
        if step != self._step:
            return None
        results: list[float] = []
        following, carried = self._run(step, step + 1, (*self._carried, *inputs), results)
        if following != step + 1:
            return None
        self._carried = carried[: self._own]
        self._step, self._settled = following, False
        self.flown += 1
        return results

    def settle(self, satellite: Satellite) -> None:
        """Set the state of the satellite to that before the next step."""
        if self._settled:
            return
        numbers = [self._carried[index] for index in self._indices]
        satellite.state = self._state = replace(filled(self._state, numbers), step=self._step)
        self._settled = True

    def _numbers(self, satellite: Satellite) -> tuple[float, ...]:
        values = numbers_of_arrays(arrays_of(satellite.state))
        # Of equal indices the numbers are equal.
        return tuple(dict(zip(self._indices, values, strict=True)).values())


def _recorded_step(
    satellite: Satellite, number: int, inputs: Sequence[float], limits: LimitCheck, width: int
) -> _Recorded:
    """Record a step of a satellite, which stays as it is.

    Raises:
        NotRecordableError: it is no list of element-wise operations.
    """
    recording, state = Recording(), satellite.state
    step: Any = recording.inputs(np.asarray(number))
    own = copy(satellite)
    before = recording.inputs_of(replace(state, step=0))
    own.state = replace(before, step=step)
    inputs_before = [elements(array) for array in arrays_of(before)]
    given = recording.inputs(np.array(inputs))
    count = (len(inputs) - _OWN_INPUTS) // (1 + width)
    linked = given[_OWN_INPUTS : _OWN_INPUTS + count]
    messages = given[_OWN_INPUTS + count :].reshape(count, width)
    received = Received(messages[:, 1:], messages[:, 0], linked, linked, complete=True)
    with recording:
        decision = own.act(Motion(given[:3], given[3:6]), received, None, None, given[6:9], None)
        message = own.announce()
        announced = encode(message)
        if limits.of_decision(decision, announced):
            raise NotRecordableError("the step is beyond a limit")
        parts = [decision.acceleration, *decision.tracked(), message.time, announced]
        results = [item for values in parts for item in elements(values)]
    after = replace(own.state, step=0)
    if others_of(before) != others_of(after):
        raise NotRecordableError("the state of the satellite changes in more than numbers")
    carried, indices = paired(inputs_before, arrays_of(after))
    # The inputs of a step are new in the next one.
    given_again = [(item, item) for item in elements(given)]
    finished = program(recording, elements(step)[0], [*carried, *given_again], results)
    return _Recorded(finished, satellite, indices, inputs, number)
