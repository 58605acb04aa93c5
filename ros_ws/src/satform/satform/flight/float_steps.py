# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Steps of an in-process flight as a program on floats.

A step of a few satellites over arrays spends its time on calls of numpy, not on arithmetic. After some
steps over arrays the next one is recorded, number by number, and the program that is made of it repeats it.
Where a step is not as the recorded one, by another branch, an event or a division by zero, the flight goes
over arrays for this step. The formulas are those of the arrays, so both have the same bits.
"""

import dataclasses
from collections.abc import Collection, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from satform.flight.flight_log import FlightGroup, FlightLog
from satform.flight.held_dynamics import HeldDynamics
from satform.flight.plant import Plant
from satform.flight.satellite_step import SatelliteState
from satform.numeric.array_trees import arrays_of, filled, numbers_of_arrays, others_of, same_bits
from satform.numeric.elementwise import Array
from satform.numeric.recorded_arrays import Recorded, Recording, elements, paired, recorded
from satform.numeric.recording import NotRecordableError, is_own
from satform.numeric.straight_line import Program, program

MOST_SATELLITES = 16
"""Satellites up to which a flight is recorded; with more of them, arrays are faster."""

_FIRST = 8
"""Steps over arrays before one is recorded."""

_WORTHWHILE = 400
"""Steps that have to be left for a recording to be worth its time."""

_MOST_RECORDINGS = 8
"""Times that a flight is recorded; then it stays with arrays."""

_SHORTEST_RUN = 50
"""Steps that a program has to fly; with less it is made anew."""

_LATER = 64
"""Steps after one that could not be recorded before it is tried again, times the recordings so far."""

_BLOCK = 256
"""Steps after which results are written into the record."""


class Flying(Protocol):
    """What a flight has that is flown in this way."""

    plant: Plant
    groups: list[FlightGroup]
    log: FlightLog

    def fly_step(self, step: Any) -> None:
        """Fly a step in which nothing happens."""


class FloatSteps:
    """Flies steps of a flight by a program, as far as it goes."""

    def __init__(self, flight: Flying, steps: int, eventful: Collection[int]) -> None:
        """Nothing is recorded yet.

        Args:
            flight: whose objects hold the state while a step goes over arrays.
            steps: of the whole flight.
            eventful: steps that go over arrays, as something happens in them.
        """
        self._flight = flight
        self._ahead = sorted({*eventful, steps}, reverse=True)
        self._recorded: _RecordedStep | None = None
        self._trial: _RecordedStep | None = None
        self._recordings = 0
        self._next_recording = _FIRST
        self._over_arrays: int | None = None
        self._holds = False
        self._stays_with_arrays = not _suits(flight)

    def fly(self, step: int, end: int) -> int:
        """Fly steps by a program.

        Args:
            step: the first of them.
            end: the step after the last one.

        Returns:
            The step that comes next; the same step where there is no program, or none for this step.
        """
        if self._stays_with_arrays:
            return step
        while self._ahead[-1] < step:
            self._ahead.pop()
        quiet = self._ahead[-1]
        if step == quiet:
            self.settle()
            self._recorded = self._trial = None
            self._recordings, self._next_recording = 0, step + _FIRST
            return step
        end = min(end, quiet)
        if self._trial is not None:
            self._judge(self._trial)
        if self._recorded is None:
            if step >= self._next_recording and quiet - step >= _WORTHWHILE and not self._stays_with_arrays:
                self._record(step)
            return step
        if step == self._over_arrays:
            # It stopped here, and goes on with the next step.
            return step
        after = self._recorded.fly(step, end)
        if after < end:
            self._stopped(self._recorded, after)
        return after

    def settle(self) -> None:
        """Bring the state of the flight into its objects, and its results into the record."""
        if self._recorded is not None:
            self._recorded.settle()

    def _record(self, step: int) -> None:
        """Record a step, and fly it by the program; it is also flown over arrays, to be compared."""
        self._recordings += 1
        self._stays_with_arrays = self._recordings >= _MOST_RECORDINGS
        try:
            self._trial = self._recorded_in_some_way(step)
        except NotRecordableError:
            self._next_recording = step + _LATER * self._recordings

    def _recorded_in_some_way(self, step: int) -> "_RecordedStep":
        """Record a step with the truth model, or beside it."""
        if not self._holds:
            try:
                return _recorded_step(self._flight, step)
            except NotRecordableError:
                self._holds = True
        return _recorded_step(self._flight, step, HeldDynamics(self._flight.plant.dynamics))

    def _judge(self, trial: "_RecordedStep") -> None:
        """Use a program if its first step has the bits of the arrays."""
        self._trial = None
        if trial.agrees():
            self._recorded = trial
        else:
            self._stays_with_arrays = True

    def _stopped(self, recorded: "_RecordedStep", step: int) -> None:
        """Decide how to go on after a step that is not as the recorded one."""
        recorded.settle()
        self._over_arrays = step
        if step - recorded.begin < _SHORTEST_RUN:
            self._recorded = None
            self._next_recording = step + _FIRST
            self._stays_with_arrays = self._recordings >= _MOST_RECORDINGS
        recorded.begin = step


def _suits(flight: Flying) -> bool:
    """Whether a flight may be recorded.

    A part of another package may do more than its result shows, such as count its calls.
    """
    parts = [flight.plant.dynamics, *(group.satellite.plan for group in flight.groups)]
    count = len(flight.log.record.satellites)
    return count <= MOST_SATELLITES and flight.log.record.navigation is None and all(map(is_own, parts))


class _RecordedStep:
    """A program with the state of the flight that it is at.

    Attributes:
        begin: step at which it was begun, or went on.
    """

    def __init__(self, program: Program, state: "_State", columns: "list[_Column]", step: int) -> None:
        self.begin = step
        self._run = program.run
        self._state = state
        self._columns = columns
        self._width = sum(column.size for column in columns)
        self._carried: tuple[float, ...] | None = None
        self._rows: list[float] = []
        self._first = step
        self._next, self._trial = self._run(step, step + 1, state.numbers(), self._rows)

    def agrees(self) -> bool:
        """Whether the first step has the bits that it has over arrays, by which it has been flown since."""
        if self._next != self._first + 1:
            # It is one in which numpy goes on with infinity or NaN.
            return False
        results = [np.ravel(column.target[self._first + column.offset]) for column in self._columns]
        rows, self._rows = self._rows, []
        return same_bits(self._trial, self._state.numbers()) and same_bits(rows, np.concatenate(results))

    def fly(self, step: int, end: int) -> int:
        if self._carried is None:
            self._carried = self._state.numbers()
            self._first = self._next = step
        while self._next < end:
            until = min(end, self._first + _BLOCK)
            self._next, self._carried = self._run(self._next, until, self._carried, self._rows)
            if self._next == self._first + _BLOCK:
                self._write()
            elif self._next < until:
                break
        return self._next

    def settle(self) -> None:
        if self._carried is None:
            return
        self._write()
        self._state.settle(self._carried, self._next)
        self._carried = None

    def _write(self) -> None:
        """Write the results of the steps since the last time into the record."""
        count = self._next - self._first
        if count:
            rows = np.array(self._rows).reshape(count, self._width)
            position = 0
            for column in self._columns:
                column.write(self._first, rows[:, position : position + column.size])
                position += column.size
        self._rows.clear()
        self._first = self._next


@dataclass
class _Column:
    """A quantity of the record at the recorded step or the one before.

    Attributes:
        target: array of the record, over steps.
        offset: from the step to the row.
        values: at that row.
    """

    target: Array
    offset: int
    values: Recorded

    @property
    def size(self) -> int:
        return self.values.size

    def write(self, first: int, rows: Array) -> None:
        begin = first + self.offset
        self.target[begin : begin + len(rows)] = rows.reshape(len(rows), *self.values.shape)


class _Rows:
    """Stands for an array of the record while a step is recorded."""

    def __init__(self, target: Array, step: int) -> None:
        self._target = target
        self._step = step
        self.columns: dict[int, _Column] = {}

    def _values(self, row: Any) -> Recorded:
        if not isinstance(row, Recorded):
            raise NotRecordableError("a row of the record that does not depend on the step is asked for")
        offset = elements(row)[0].value - self._step
        if offset not in self.columns:
            known = self._target[self._step + offset]
            values = recorded(np.ravel(known).tolist(), known.shape)
            self.columns[offset] = _Column(self._target, offset, values)
        return self.columns[offset].values

    def __setitem__(self, key: Any, values: Any) -> None:
        row, *further = key if isinstance(key, tuple) else (key,)
        self._values(row)[(*further, ...)] = values

    def __getitem__(self, key: Any) -> Any:
        row, *further = key if isinstance(key, tuple) else (key,)
        return self._values(row)[(*further, ...)]


class _RecordOfStep:
    """Stands for the record while a step is recorded."""

    def __init__(self, record: Any, step: int) -> None:
        self._record = record
        self._step = step
        self.rows: dict[str, _Rows] = {}

    def __getattr__(self, name: str) -> Any:
        if name not in self.rows:
            values = getattr(self._record, name)
            if not isinstance(values, np.ndarray):
                return values
            self.rows[name] = _Rows(values, self._step)
        return self.rows[name]

    def columns(self) -> list[_Column]:
        return [column for rows in self.rows.values() for column in rows.columns.values()]


@dataclass
class _Part:
    """An attribute of an object of the flight that changes from step to step."""

    owner: Any
    name: str

    def get(self) -> Any:
        """The value, without the number of the step that a satellite counts."""
        value = getattr(self.owner, self.name)
        return dataclasses.replace(value, step=0) if isinstance(value, SatelliteState) else value

    def set(self, value: Any, step: Any) -> None:
        """Set the value, and the number of the step of a satellite."""
        own = isinstance(value, SatelliteState)
        setattr(self.owner, self.name, dataclasses.replace(value, step=step) if own else value)


@dataclass
class _HeldPart(_Part):
    """The state of a truth model that goes over arrays.

    Attributes:
        held: the model.
        records: whether this is the flight that is recorded.
    """

    held: HeldDynamics
    records: bool

    def get(self) -> Any:
        """What the program knows of it."""
        return self.owner._state if self.records else self.held.hold(self.owner._state, self.owner.step)

    def set(self, value: Any, step: Any) -> None:
        """Set it; the model's own state at a step is not made of numbers."""
        if self.records:
            self.owner._dynamics, self.owner._state = self.held, value
        else:
            self.owner._state = self.held.state(step)


class _State:
    """The state of the flight, as objects and as a list of numbers."""

    def __init__(self, flight: Flying, held: HeldDynamics | None = None, *, records: bool = False) -> None:
        plant, log = flight.plant, flight.log
        own = _Part(plant, "_state") if held is None else _HeldPart(plant, "_state", held, records)
        self.parts = [
            own,
            *(_Part(plant, name) for name in ("applied", "_motion", "_measured")),
            *(_Part(log, name) for name in ("_messages", "_time")),
            *(_Part(group.satellite, "state") for group in flight.groups if group.flies),
            *(_Part(group, "state") for group in plant.turning),
        ]
        if plant.thrusters is not None:
            self.parts.append(_Part(plant.thrusters, "propulsion"))
        self._counters = [_Part(plant, "step"), _Part(log, "step")]
        self._indices: list[int] = []
        self._last: tuple[Any, ...] = ()

    def carry(self, indices: list[int]) -> None:
        """Set for each number of all leaves, one after another, its index among those of the program."""
        self._indices = indices

    def whole(self) -> tuple[Any, ...]:
        return tuple(part.get() for part in self.parts)

    def set(self, whole: tuple[Any, ...], step: Any) -> None:
        """Set the objects to a state before a step."""
        for part, value in zip(self.parts, whole, strict=True):
            part.set(value, step)
        for counter in self._counters:
            counter.set(step, step)

    def numbers(self) -> tuple[float, ...]:
        """Numbers that the program carries."""
        self._last = self.whole()
        values = numbers_of_arrays(arrays_of(self._last))
        # Of equal indices the numbers are equal.
        return tuple(dict(zip(self._indices, values, strict=True)).values())

    def settle(self, carried: Sequence[float], step: int) -> None:
        """Set the objects to the state before a step, from numbers that the program carries."""
        numbers = [carried[index] for index in self._indices]
        self.set(filled(self._last, numbers), step)


def _recorded_step(flight: Flying, number: int, held: HeldDynamics | None = None) -> _RecordedStep:
    """Record a step of a flight, which stays as it is.

    Args:
        flight: whose step it is.
        number: of the step.
        held: its truth model, if it is to go over arrays.

    Raises:
        NotRecordableError: it is no list of element-wise operations.
    """
    recording = Recording()
    step = recording.inputs(np.asarray(number))
    state = _State(flight, held)
    before = state.whole()
    own = _copied(flight, number)
    own_state = _State(own, held, records=True)
    own_state.set(recording.inputs_of(before), step)
    # A list of numbers each: arrays of messages are written into.
    inputs = [elements(array) for array in arrays_of(own_state.whole())]
    with recording:
        own.fly_step(step)
    after = own_state.whole()
    if others_of(before) != others_of(after):
        raise NotRecordableError("the state of the flight changes in more than numbers")
    carried, indices = paired(inputs, arrays_of(after))
    state.carry(indices)
    columns = own.log.record.columns()
    results = [item for column in columns for item in elements(column.values)]
    return _RecordedStep(program(recording, elements(step)[0], carried, results), state, columns, number)


def _copied(flight: Flying, number: int) -> Any:
    """A flight of copies of the objects that a step changes."""
    own: Any = copy(flight)
    own.plant, own.log = copy(flight.plant), copy(flight.log)
    own.plant.thrusters = copy(flight.plant.thrusters)
    own.plant.turning = [copy(group) for group in flight.plant.turning]
    own.groups = [dataclasses.replace(group, satellite=copy(group.satellite)) for group in flight.groups]
    own.log.record = _RecordOfStep(flight.log.record, number)
    return own
