# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Steps of a satellite's flight software, repeated on floats; see `satform.flight.float_steps`.

It is for satellites in nodes, whose plant is another process. Beside the state, a step gets the motion, the
messages of the neighbours and what the plant reports.
"""

import dataclasses
from collections.abc import Sequence
from copy import copy
from typing import Any

import numpy as np

from satform.attitude.guidance import Attitude
from satform.communication.messages import NeighbourMessage
from satform.communication.neighbour_buffer import Received
from satform.control.protocol import Motion
from satform.flight.plans import FlightPlan
from satform.flight.satellite_step import Decision, SatelliteState
from satform.numeric.array_trees import (
    arrays_of,
    filled,
    numbers_of_arrays,
    others_of,
    same_bits,
    with_arrays,
)
from satform.numeric.elementwise import Array
from satform.numeric.recorded_arrays import Recording, elements, paired
from satform.numeric.recording import NotRecordableError, is_own
from satform.numeric.straight_line import Program, program
from satform.orbits.path_reference import Reference

_FIRST = 32
"""Steps over arrays before one is recorded."""

WORTHWHILE = 600
"""Steps that have to be left for a recording to be worth its time."""

_MOST_RECORDINGS = 4
"""Times that a satellite is recorded, as after changes of its plan; then it stays with arrays."""

_MOST_SATELLITES = 16
"""Satellites flown as one up to which they are recorded."""


@dataclasses.dataclass(frozen=True)
class StepInputs:
    """What a step gets beside the state, with a message from every neighbour.

    Attributes:
        motion: measured.
        values: of the neighbours' messages, shape (..., K, width).
        stamp: of these messages, s, shape (..., K).
        linked: 1 for each neighbour that is one, shape (..., K).
        attitude: measured; None for a satellite without attitude.
        applied: acceleration over the step before, m/s^2, shape (..., 3); None where it is not reported.
    """

    motion: Motion
    values: Array
    stamp: Array
    linked: Array
    attitude: Attitude | None
    applied: Array | None


class FloatAct:
    """Repeats steps of a satellite by a program."""

    def __init__(self, steps: int) -> None:
        """Nothing is recorded yet.

        Args:
            steps: of the whole flight.
        """
        self._steps = steps
        self._plan: FlightPlan | None = None
        self._program: _RecordedAct | None = None
        self._trial: tuple[_RecordedAct, Decision] | None = None
        self._seen = self._recordings = 0

    def act(self, satellite: Any, known: SatelliteState | None, inputs: StepInputs) -> Decision | None:
        """One step by a program.

        Args:
            satellite: a `Satellite`.
            known: its state; None where it is the one after the last step of the program.
            inputs: of the step.

        Returns:
            None where the step has to go over arrays.
        """
        if satellite.plan is not self._plan:
            # Its state comes from the program that is given up.
            known = satellite.state
            self._plan, self._program, self._trial, self._seen = satellite.plan, None, None, 0
        if self._program is not None and known is not None and not self._program.fits(known):
            # Another list of neighbours.
            self._program, self._seen = None, 0
        if self._program is not None:
            return self._program.act(known, inputs)
        self._seen += 1
        if self._seen == _FIRST and self._recordings < _MOST_RECORDINGS:
            self._record(satellite, inputs)
        return None

    def compare(self, decision: Decision, state: SatelliteState) -> None:
        """Use the program if its first step has the bits of the one over arrays.

        Args:
            decision: over arrays.
            state: after that step.
        """
        if self._trial is None:
            return
        (own, found), self._trial = self._trial, None
        mine, theirs = arrays_of((found, own.state)), arrays_of((decision, state))
        alike = list(map(np.shape, mine)) == list(map(np.shape, theirs))
        if alike and same_bits(numbers_of_arrays(mine), numbers_of_arrays(theirs)):
            self._program = own

    @property
    def program(self) -> "_RecordedAct":
        """The program, after a step by it."""
        assert self._program is not None  # noqa: S101 - it is asked for after such a step
        return self._program

    def _record(self, satellite: Any, inputs: StepInputs) -> None:
        state, plan = satellite.state, satellite.plan
        few = np.size(plan.arc_length) <= _MOST_SATELLITES
        if not few or self._steps - state.step < WORTHWHILE or not is_own(plan):
            return
        self._recordings += 1
        try:
            own = _recorded_act(satellite, inputs)
        except NotRecordableError:
            self._recordings = _MOST_RECORDINGS
            return
        found = own.act(state, inputs)
        self._trial = None if found is None else (own, found)


class _RecordedAct:
    """A program with the state that it is at.

    Attributes:
        step: number of the step that comes next.
        announcement: the message for the neighbours in it.
    """

    def __init__(
        self, program: Program, state: SatelliteState, decision: Decision, message: NeighbourMessage
    ) -> None:
        self.step = state.step
        self.announcement = message
        self._run = program.run
        self._template = dataclasses.replace(state, step=0)
        self._others = others_of(self._template)
        self._shapes = list(map(np.shape, arrays_of(state)))
        self._carried: Sequence[float] = ()
        results = [*_results(decision), *arrays_of(message)]
        self._parts: list[tuple[int | slice, tuple[int, ...] | None]] = []
        begin = 0
        for result in results:
            shape, end = np.shape(result), begin + np.size(result)
            part = slice(begin, end) if shape else begin
            self._parts.append((part, shape if len(shape) > 1 else None))
            begin = end
        self._turns, self._plans = decision.wheel_torque is not None, decision.unsolved_plans is not None
        self._size = sum(map(np.size, arrays_of(state)))

    @property
    def state(self) -> SatelliteState:
        """The state of the satellite as an object."""
        return dataclasses.replace(filled(self._template, self._carried), step=self.step)

    def fits(self, known: SatelliteState) -> bool:
        """Whether a state has arrays of the recorded shapes."""
        return list(map(np.shape, arrays_of(known))) == self._shapes

    def act(self, known: SatelliteState | None, inputs: StepInputs) -> Decision | None:
        """One step; see `FloatAct.act`."""
        if known is not None and not self._take(known):
            return None
        given = [*self._carried]
        for array in arrays_of_inputs(inputs):
            given += array.tolist() if array.ndim == 1 else array.ravel().tolist()
        rows: list[float] = []
        after, carried = self._run(self.step, self.step + 1, given, rows)
        if after == self.step:
            return None
        self.step, self._carried = after, carried[: self._size]
        numbers = np.array(rows)
        found = [
            numbers[part] if shape is None else numbers[part].reshape(shape) for part, shape in self._parts
        ]
        count = 5 + self._turns + self._plans
        self.announcement = type(self.announcement)(*found[count:])
        return Decision(
            acceleration=found[0],
            reference=Reference(found[1], found[2], found[3]),
            sliding_variable=found[4],
            motion=inputs.motion,
            wheel_torque=found[5] if self._turns else None,
            unsolved_plans=found[count - 1] if self._plans else None,
        )

    def _take(self, known: SatelliteState) -> bool:
        """Go on from a state, if it is of the recorded kind."""
        if others_of(dataclasses.replace(known, step=0)) != self._others:
            # It comes after a gap.
            return False
        self.step, self._carried = known.step, numbers_of_arrays(arrays_of(known))
        return True


def arrays_of_inputs(inputs: StepInputs) -> list[Array]:
    """The arrays of a step's inputs, as `arrays_of` has them."""
    attitude, applied = inputs.attitude, inputs.applied
    arrays = [inputs.motion.position, inputs.motion.velocity, inputs.values, inputs.stamp, inputs.linked]
    if attitude is not None:
        arrays += [attitude.mrp, attitude.angular_velocity, attitude.wheel_momentum]
    return arrays if applied is None else [*arrays, applied]


def _results(decision: Decision) -> list[Array]:
    """What a step gives beside the state and the motion."""
    reference = decision.reference
    found = [decision.acceleration, reference.position, reference.velocity, reference.acceleration]
    further = [decision.sliding_variable, decision.wheel_torque, decision.unsolved_plans]
    return found + [values for values in further if values is not None]


def _recorded_act(satellite: Any, inputs: StepInputs) -> _RecordedAct:
    """Record a step of a satellite, which stays as it is.

    Raises:
        NotRecordableError: it is no list of element-wise operations.
    """
    recording, state = Recording(), satellite.state
    step = recording.inputs(np.asarray(state.step))
    own = copy(satellite)
    own.fly_over_arrays()
    before = with_arrays(dataclasses.replace(state, step=0), recording.inputs)
    given = with_arrays(inputs, recording.inputs)
    own.state = dataclasses.replace(before, step=step)
    received = Received(given.values, given.stamp, given.linked, given.linked, complete=True)
    with recording:
        decision = own.act(given.motion, received, None, given.attitude, given.applied)
    after, message = dataclasses.replace(own.state, step=0), own.announce()
    if others_of(before) != others_of(after):
        raise NotRecordableError("the state of a satellite changes in more than numbers")
    arrays = [*arrays_of(before), *arrays_of(given)]
    carried, _ = paired([elements(array) for array in arrays], [*arrays_of(after), *arrays_of(given)])
    results = [item for result in (*_results(decision), *arrays_of(message)) for item in elements(result)]
    return _RecordedAct(
        program(recording, elements(step)[0], carried, results), state, decision, satellite.announce()
    )
