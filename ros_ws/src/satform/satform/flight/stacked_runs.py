# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Many runs flown as one formation: R runs of N satellites are R N rows of the same arrays.

Every number of a run has the bits that `simulate` gives it alone. Satellites of different runs do not
receive from each other, and no operation mixes rows. A run that would end early leaves the flight; the others
go on undisturbed.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from satform.attitude.guidance import Attitude
from satform.communication.messages import WIDTH, encode
from satform.communication.receiver import ReceiverModel
from satform.communication.stacked_receiver import StackedReceiver
from satform.control.protocol import Motion
from satform.dynamics.stacked_models import stack_dynamics
from satform.flight.compile import FormationPlan
from satform.flight.plans import PlantPlan
from satform.flight.plant import Plant
from satform.flight.satellite import Satellite
from satform.flight.satellite_step import Decision
from satform.flight.stacked_limits import StackedLimitCheck
from satform.flight.stacked_record import BlockRecorder
from satform.membership.formation import Formation
from satform.numeric import stacking
from satform.numeric.elementwise import Array, Indices
from satform.record.flight_block import FlightBlock

BLOCK_STEPS = 32
"""Steps that are handed over at once."""


def fly_stacked(
    plans: Sequence[FormationPlan],
    observe: Callable[[FlightBlock], None],
    quantities: frozenset[str],
    *,
    block_steps: int = BLOCK_STEPS,
) -> dict[int, int]:
    """Fly runs as one formation.

    Args:
        plans: of the runs, all of one group of `group_runs`.
        observe: is handed each block of steps, in order.
        quantities: of a flight record that it needs, by name.
        block_steps: steps of a block.

    Returns:
        The step in which a run would end early, by its index. Its numbers mean nothing from there on; flown
        by `simulate` it says why.
    """
    with np.errstate(all="ignore"):
        flight = _StackedFlight(plans, quantities)
        steps = plans[0].timing.steps
        first = 0
        while True:
            count = min(block_steps, steps - first)
            flight.fly(first, count, last=first + count == steps)
            if len(flight.ends) == len(plans):
                break
            observe(flight.block())
            first += count
            if first == steps:
                break
            flight.leave_ended()
    return flight.ends


@dataclass
class _Group:
    """Alike satellites of all runs.

    Attributes:
        satellite: their flight software.
        receiver: what they receive.
        rows: of these satellites among all, ascending; None for all.
        neighbours: largest number of possible in-neighbours.
        announced: numbers that they announce for the coming step, shape (M, width).
        stamp: simulated time to which these belong, s.
    """

    satellite: Satellite
    receiver: StackedReceiver
    rows: Indices | None
    neighbours: int
    announced: Array = field(init=False)
    stamp: float = field(init=False)

    def __post_init__(self) -> None:
        self.announce()

    def announce(self) -> None:
        """Take down what they announce for the coming step, after each one and when some have left."""
        message = self.satellite.announce()
        self.announced, self.stamp = encode(message), float(message.time.flat[0])

    def of(self, values: Array) -> Array:
        """Their rows of an array of all satellites."""
        return values if self.rows is None else stacking.take(values, self.rows)

    def turned(self, attitude: Attitude) -> Attitude:
        """Their rows of the attitude of all satellites."""
        parts = (attitude.mrp, attitude.angular_velocity, attitude.wheel_momentum)
        return Attitude(*(self.of(part) for part in parts))


class _StackedFlight:
    """Runs under way.

    Attributes:
        ends: step in which a run ended, by its index among all.
        flying: indices of the runs that still fly.
    """

    def __init__(self, plans: Sequence[FormationPlan], quantities: frozenset[str]) -> None:
        first = plans[0]
        self.ends: dict[int, int] = {}
        self.flying = np.arange(len(plans))
        self._runs = len(plans)
        self._plans = list(plans)
        self._count = len(first.names)
        self._limits = StackedLimitCheck([plan.limits for plan in plans], self._count)
        self._events = first.membership.events
        self._formations = [Formation.of(plan.membership) for plan in plans]
        self._groups = _grouped(self._plans, self._count)
        self._plant = Plant(_plant_plan(self._plans, self._count))
        self._recorder = BlockRecorder(first, [plan.orientations() for plan in plans], quantities)
        self._width = WIDTH[first.announces]
        self._whole = _Whole(len(plans) * self._count, self._width)
        self._link()

    def fly(self, first_step: int, count: int, *, last: bool) -> None:
        """Fly some steps."""
        recorder = self._recorder
        recorder.begin(first_step, count, len(self.flying), last=last)
        for step in range(first_step, first_step + count):
            self._step(step)
        if last:
            self._end(self._limits.of_plant(self._plant), first_step + count)
            self._announce()
            recorder.known(self._plant, self._whole)

    def _step(self, step: int) -> None:
        plant, whole = self._plant, self._whole
        self._end(self._limits.of_plant(plant), step)
        self._announce()
        if step in self._events:
            for formation, plan in zip(self._formations, self._plans, strict=True):
                formation.apply(plan.membership.events[step], step, plan.names)
            self._link()
        self._recorder.known(plant, whole)
        motion, attitude = plant.measured(), plant.attitude()
        measured_steps = plant.measured_steps() if plant.measures else None
        for group in self._groups:
            own = Motion(group.of(motion.position), group.of(motion.velocity))
            received = group.receiver.receive(step, whole.sent, whole.stamp)
            measured_step = None
            if measured_steps is not None:
                measured_step = int(measured_steps[0 if group.rows is None else group.rows[0]])
            turned = None
            if attitude is not None and group.satellite.plan.orientation is not None:
                turned = group.turned(attitude)
            decision = group.satellite.act(own, received, measured_step, turned, group.of(plant.applied))
            group.announce()
            beyond = self._limits.of_decision(decision, group.announced)
            if beyond.size:
                self._end(beyond if group.rows is None else group.rows[beyond], step)
            whole.take_in(group.rows, decision)
        self._recorder.decided(whole)
        plant.advance(whole.acceleration, whole.wheel_torque)
        self._recorder.applied(plant)

    def _announce(self) -> None:
        """What all satellites send for the coming step."""
        whole = self._whole
        for group in self._groups:
            whole.stamp = group.stamp
            whole.sent[:, slice(None) if group.rows is None else group.rows] = group.announced.T

    def _end(self, rows: Indices, step: int) -> None:
        for index in np.unique(rows // self._count).tolist() if rows.size else ():
            self.ends.setdefault(int(self.flying[index]), step)

    def _link(self) -> None:
        for group in self._groups:
            group.receiver.link(self._formations)

    def block(self) -> FlightBlock:
        """The steps flown last, with a column for every run."""
        return self._recorder.block(self._runs, self.flying)

    def leave_ended(self) -> None:
        """Go on without the runs that have ended."""
        kept = np.array([index for index, run in enumerate(self.flying.tolist()) if run not in self.ends])
        if len(kept) == len(self.flying):
            return
        count = self._count
        rows = (kept[:, None] * count + np.arange(count)).ravel()
        for group in self._groups:
            group_count = count if group.rows is None else len(group.rows) // len(self.flying)
            own = (kept[:, None] * group_count + np.arange(group_count)).ravel()
            state = stacking.take(group.satellite.state, own)
            group.satellite = Satellite(stacking.take(group.satellite.plan, own), group.neighbours)
            group.satellite.state = state
            group.announce()
            group.receiver.keep(kept, own)
            if group.rows is not None:
                group.rows = group.rows[: len(own)]
        self._plant.keep(rows)
        self._limits.keep(rows)
        self._plans = [self._plans[index] for index in kept.tolist()]
        self._formations = [self._formations[index] for index in kept.tolist()]
        self._recorder.keep(kept)
        self._whole = _Whole(len(rows), self._width)
        self.flying = self.flying[kept]


class _Whole:
    """What all satellites of all runs decide and announce in a step.

    Attributes:
        sent: numbers that they send for the step, shape (width, R N).
        stamp: simulated time to which these belong, s.
        acceleration: commanded, m/s^2, shape (R N, 3).
        wheel_torque: commanded, N m, shape (R N, 3); None where nobody has wheels.
    """

    def __init__(self, rows: int, width: int) -> None:
        self._rows = rows
        self.sent: Array = np.zeros((width, rows))
        self.stamp = 0.0
        self._values: dict[str, Array] = {}

    @property
    def acceleration(self) -> Array:
        return self._values["acceleration"]

    @property
    def wheel_torque(self) -> Array | None:
        return self._values.get("wheel_torque")

    def values(self, name: str) -> Array | None:
        """What was decided, by the name of a quantity; None where nobody decides that."""
        return self._values.get(name)

    def take_in(self, rows: Indices | None, decision: Decision) -> None:
        """Take in what a group of satellites has decided."""
        found = _decided(decision)
        if rows is None:
            self._values = found
            return
        for name, values in found.items():
            whole = self._values.get(name)
            if whole is None or whole.shape[0] != self._rows:
                memory = np.full((*values.shape[1:], self._rows), np.nan)
                whole = self._values[name] = np.moveaxis(memory, -1, 0)
            whole[rows] = values


def _decided(decision: Decision) -> dict[str, Array]:
    """Quantities of a decision by the names of a flight record."""
    reference, motion = decision.reference, decision.motion
    found = {
        "acceleration": decision.acceleration,
        "reference_position": reference.position,
        "reference_velocity": reference.velocity,
        "reference_acceleration": reference.acceleration,
        "sliding_variable": decision.sliding_variable,
        "estimated_position": motion.position,
        "estimated_velocity": motion.velocity,
    }
    if decision.wheel_torque is not None:
        found["wheel_torque"] = decision.wheel_torque
    if decision.estimate is not None:
        found["estimate_covariance"] = decision.estimate.covariance
        found["innovation"] = decision.estimate.innovation
        found["rejected_measurements"] = decision.estimate.rejected
    if decision.unsolved_plans is not None:
        found["unsolved_plans"] = decision.unsolved_plans
    return found


def _grouped(plans: Sequence[FormationPlan], count: int) -> list[_Group]:
    """The satellites of all runs in groups of alike ones."""
    graphs = [plan.membership.possible_graph for plan in plans]
    alike: dict[Any, list[int]] = {}
    first = [plans[0].satellite(index, graphs[0].neighbours(index)) for index in range(count)]
    for index, plan in enumerate(first):
        alike.setdefault(stacking.kind(plan), []).append(index)
    groups = []
    for members in alike.values():
        neighbours = [[graph.neighbours(index) for index in members] for graph in graphs]
        own = [
            plan.satellite(index, known)
            for plan, run in zip(plans, neighbours, strict=True)
            for index, known in zip(members, run, strict=True)
        ]
        width = max(len(known) for known in neighbours[0])
        satellite = Satellite(stacking.component_major(stacking.stack(own)), width)
        satellite.state = stacking.component_major(satellite.state)
        receivers = [
            ReceiverModel(plan.links, np.array(members), run)
            for plan, run in zip(plans, neighbours, strict=True)
        ]
        rows = None
        if len(members) < count:
            rows = (np.arange(len(plans))[:, None] * count + np.array(members)).ravel()
        groups.append(_Group(satellite, StackedReceiver(receivers, count), rows, width))
    return groups


def _plant_plan(plans: Sequence[FormationPlan], count: int) -> PlantPlan:
    """What moves the satellites of all runs."""
    plants = [plan.plant for plan in plans]
    first = plants[0]
    starts = (
        np.concatenate([plant.start.position for plant in plants]),
        np.concatenate([plant.start.velocity for plant in plants]),
    )
    return replace(
        first,
        dynamics=stack_dynamics([plant.dynamics for plant in plants], count),
        start=stacking.component_major(Motion(*starts)),
        chief_radius=np.repeat(np.array([plant.chief_radius for plant in plants]), count),
        thrusters=tuple(own for plant in plants for own in plant.thrusters),
        sensors=tuple(own for plant in plants for own in plant.sensors),
        attitudes=tuple(own for plant in plants for own in plant.attitudes),
        identities=tuple((plant.seed, index) for plant in plants for index in range(count)),
    )
