# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Steps of a satellite: when it takes part, when a step has all its messages, what it publishes then.

The node of the satellite hands in what arrives, and publishes what it is asked to; it has the wall clock and
DDS.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from satform.communication.message_validator import MessageValidator
from satform.communication.messages import encode
from satform.communication.sim_time import Stamps
from satform.control.protocol import ReportsFailures
from satform.flight.compile import FormationPlan
from satform.flight.float_satellite import FloatSatellite, results_of
from satform.flight.limits import NO_COMMAND, LimitCheck, Violation, violation_of
from satform.flight.satellite import Satellite
from satform.flight.satellite_step import Decision
from satform.membership.formation import is_lost_at, rejoins_after
from satform.membership.reconfiguration import Target
from satform.protocol.formation_view import FormationView
from satform.protocol.neighbour_messages import Message, NeighbourMessages
from satform.protocol.satellite_output import Checkpoints, SatelliteOutput, StampedMessage
from satform.protocol.status import FormationStatus
from satform.protocol.step_batch import StepBatch
from satform.protocol.step_messages import StepMessages, needed_of_plant

ANY_STEP = 2**63
"""A step beyond every flight."""


class SatelliteSteps:
    """The steps of a flight, as a satellite takes them.

    Attributes:
        view: membership and communication graph, by the status of the plant.
        neighbour_messages: received from the in-neighbours.
        messages: of the next step.
        step: the one that comes next.
        flying: whether it takes part.
        pulse: number of messages of the plant.
        skipped: steps that were left out on the wall clock.
        busy_seconds: processor time of the flight software, s.
    """

    def __init__(
        self,
        plan: FormationPlan,
        index: int,
        output: SatelliteOutput,
        checkpoints: Checkpoints,
        *,
        clocked: bool = False,
        processor_clock: Callable[[], float] = lambda: 0.0,
    ) -> None:
        """Nothing has been received yet.

        Args:
            plan: of the flight's parts.
            index: of the satellite.
            output: publishes what follows.
            checkpoints: of the satellite.
            clocked: whether the flight goes by the wall clock.
            processor_clock: processor time of this thread, s.
        """
        self.step = 0
        self.pulse = 0
        self.flying = False
        self.skipped = 0
        self.busy_seconds = 0.0
        self.view = FormationView(plan)
        self._plan = plan
        self._index = index
        self._output = output
        self._checkpoints = checkpoints
        self._clocked = clocked
        self._processor_clock = processor_clock
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        self._planned = plan.membership.events
        self._limits = LimitCheck(plan.limits)
        self.neighbour_messages = NeighbourMessages(plan, index, self.view, self._stamps)
        self.messages = StepMessages(
            self.neighbour_messages, self._stamps, needed=needed_of_plant(plan, index), clocked=clocked
        )
        self._offered = False
        self._batch: StepBatch | None = None
        self._row = 0
        self._target: Target | None = None
        self._floats = FloatSatellite(plan, index)
        self._satellite = self._new_software()

    @property
    def satellite(self) -> Satellite:
        """The flight software, in its present state."""
        self._floats.settle(self._satellite)
        return self._satellite

    @satellite.setter
    def satellite(self, satellite: Satellite) -> None:
        self._floats.forget()
        self._satellite = satellite

    @property
    def reports_failures(self) -> bool:
        """Whether the control law counts its failures."""
        return isinstance(self._satellite.plan.controller, ReportsFailures)

    # Membership

    def offer(self) -> None:
        """Publish that this satellite is ready, since all its endpoints are matched."""
        self._offered = True
        self._output.publish_ready()

    def take_status(self, status: FormationStatus) -> bool:
        """Take in a status of the plant; False if it is not about this formation."""
        self.pulse += 1
        before, flew = self.view.formation.number, self.view.formation.alive.copy()
        if not self.view.take(status):
            return False
        formation = self.view.formation
        if formation.number == before:
            return True
        self.dissolve_batch()
        self._output.allow_replacement(np.flatnonzero(flew & ~formation.alive).tolist())
        if not formation.alive[self._index]:
            self._on_own_loss(was_alive=bool(flew[self._index]))
        self._add_new_neighbours()
        self.act_if_complete()
        return True

    def join(self, step: int) -> bool:
        """Take part from a step on: from the first state, or after a rejoin that the plant has published."""
        if not self.view.formation.alive[self._index]:
            # It was taken back and lost again before this state came.
            return False
        returned = self.view.returns.get(self._index)
        if returned is None:
            # On the wall clock the first states may have been skipped.
            may_be_late = self._clocked and bool(self.view.formation.alive[self._index])
            if step != 0 and not (may_be_late and self._output.may_have_begun_here(step)):
                return False
            self.satellite.join(step, skipped=True)
        else:
            if returned[0] != step and not (self._clocked and returned[0] < step):
                return False
            if returned[1] >= 0:
                self._checkpoints.restore(self.satellite, self.neighbour_messages.neighbours)
            self._use_target()
            self.satellite.join(step)
        self.flying = True
        self.step = step
        if returned is None or self.view.formation.lost_at.get(self._index) != step:
            # If it was lost in this step, the message that it had published before stays.
            self._output.publish_next(step, self._message(step))
            self._publish_joint_estimate(step)
        return True

    def _on_own_loss(self, *, was_alive: bool) -> None:
        """React to the loss of this satellite: end the process, or reset it if it shares one."""
        step, was_flying = self.view.formation.step, self.flying
        planned = is_lost_at(self._planned, self._index, step)
        returns = rejoins_after(self._planned, self._index, step)
        if was_flying:
            self._output.lost(step, planned=planned)
        self.flying = False
        self.neighbour_messages.by_step.clear()
        self._output.forget_messages()
        self.messages.forget_plant()
        if self._offered and was_alive and not was_flying and (returns or not planned):
            # The plant accepts a new process only when the loss of the one before takes effect. What it has
            # read earlier it has rejected; after a return that was lost at once, it has used it.
            self._output.publish_ready()
        if was_flying:
            # Satellites of a group share its process, which flies on.
            self.satellite = self._new_software()
            self._target = None
            self.neighbour_messages.reset()
            self._output.reset_parameters()
            self._checkpoints.load()
            if returns:
                self._output.publish_ready()

    def _use_target(self) -> None:
        """Fly by the target in force from the next step on."""
        target = self.view.formation.targets.get(self._index)
        if target is not None and target != self._target:
            self._output.retarget(self.satellite, target)
            self._target = target

    def _add_new_neighbours(self) -> None:
        """Subscribe to neighbours of which the graph had no edge before."""
        present = self.view.formation.graph.neighbours(self._index)
        new = [index for index in present if index not in self.neighbour_messages.neighbours]
        if not new:
            return
        previous_rows = self.neighbour_messages.add_neighbours(new)
        for neighbour in new:
            self._output.add_neighbour(neighbour)
        self.satellite.rearrange(previous_rows)
        self.satellite.find_target(self.neighbour_messages.neighbours)

    def _new_software(self) -> Satellite:
        """Flight software that is as at the start of the flight."""
        neighbours = self.neighbour_messages.neighbours
        satellite = Satellite(self._plan.satellite(self._index, neighbours), len(neighbours))
        if not self._floats.takes(satellite):
            satellite.repeat_on_floats(self._plan.timing.steps)
        return satellite

    # A step

    def lacking(self) -> tuple[str | int, ...] | None:
        """Messages that the next step lacks: kinds of the plant's, indices of neighbours for phase or motion.

        Returns:
            The same tuple as long as it stays the same; None if that is not known.
        """
        if not self.flying or self._clocked:
            return None
        if self._batch is not None:
            # The batch knows which messages of neighbours there are.
            return () if self.messages.state is not None else ("state",)
        return self.messages.lacking(self.step, self.view.formation)

    def take_announcement(self, neighbour: int, validator: MessageValidator, data: bytes) -> None:
        """Take in the phase or motion of a neighbour."""
        if self._clocked:
            fields = validator.validate(data, 0, ANY_STEP)
            if fields is not None:
                self.neighbour_messages.add_newest(neighbour, fields)
            return
        last = self.step + 1 if self.flying else ANY_STEP
        fields = validator.validate(data, self.step if self.flying else 0, last)
        if fields is None:
            return
        message = self.neighbour_messages.message(fields)
        if self._batch is None:
            self.neighbour_messages.add(neighbour, fields[2], message)
            self.act_if_complete()
        else:
            self._batch.add_neighbour_message(self._row, neighbour, fields[2], message)

    def take_state(self, validator: MessageValidator, data: bytes) -> None:
        """Take in a state of the plant."""
        before = validator.repeated
        last = self.step if self.flying and not self._clocked else ANY_STEP
        numbers = validator.validate(data, self.step, last)
        # Any message of the plant restarts its timeout.
        self.pulse += numbers is not None or validator.repeated > before
        if numbers is None:
            return
        self.messages.state = numbers
        if self._batch is None:
            self.act_if_complete()
        else:
            self._batch.add_state(self._row, numbers)

    def take_of_plant(self, kind: str, validator: MessageValidator, data: bytes) -> None:
        """Take in a message of the plant beside the state, by the kind of its topic."""
        last = self.step if self.flying and not self._clocked else ANY_STEP
        numbers = validator.validate(data, self.step, last)
        if numbers is None:
            return
        self.messages.of_plant[kind] = numbers
        if self._batch is None:
            self.act_if_complete()
        elif kind == "attitude":
            self._batch.add_attitude(self._row, numbers)

    def take_estimate(self, neighbour: int, validator: MessageValidator, data: bytes) -> None:
        """Take in the joint estimate of a neighbour."""
        if self._clocked:
            fields = validator.validate(data, 0, ANY_STEP)
            if fields is not None:
                self.neighbour_messages.add_newest_estimate(neighbour, fields)
            return
        last = self.step + 1 if self.flying else ANY_STEP
        fields = validator.validate(data, self.step if self.flying else 0, last)
        if fields is None:
            return
        self.neighbour_messages.add_estimate(neighbour, fields)
        self.act_if_complete()

    def act_if_complete(self) -> None:
        """Compute the step if all its messages have been received."""
        state = self.messages.state
        if state is None or not self._knows(int(state[3])):
            return
        step = int(state[2])
        if step >= self._plan.timing.steps:
            self.messages.state = None
            return
        if not self.flying and not self.join(step):
            formation = self.view.formation
            self._output.require_lost(
                step,
                int(state[3]),
                alive=bool(formation.alive[self._index]),
                known_version=formation.number,
            )
            return
        complete = self.messages.complete(step)
        if complete is None:
            return
        if self._clocked and step > self.step:
            # States that came too fast were left out.
            self.skipped += step - self.step
            self.satellite.join(step, skipped=True)
            self.step = step
        self._act(step, state, *complete)

    def _knows(self, number: int) -> bool:
        """Whether the formation that a state is meant for is known; its status is on its way if not."""
        if number > self.view.formation.number:
            self._output.await_status()
            return False
        return True

    def _act(
        self, step: int, state: tuple[Any, ...], messages: dict[int, Message], senders: list[int]
    ) -> None:
        # Processor time: wall-clock time would include other threads that run meanwhile.
        begin = self._processor_clock()
        self._use_target()
        inputs = self.messages.numbers(state, messages, senders)
        results = None
        if inputs is not None:
            results = self._floats.fly(self._satellite, step, inputs)
        if results is None:
            self._act_over_arrays(begin, step, state, messages, senders)
        else:
            self._publish_results(begin, step, results)

    def _publish_results(self, begin: float, step: int, results: list[float]) -> None:
        """Publish what a step by the program gives."""
        message = self._stamps.at_time(results[21]), results[22:]
        self._close_step(begin, step)
        output = self._output
        output.publish_command_numbers(step, results[:3], message)
        if self._checkpoints.due(step + 1):
            self._checkpoints.keep(self.satellite, self.neighbour_messages.neighbours)
        output.publish_next(step + 1, message)
        output.publish_tracking_numbers(step, results[3:21])
        output.publish_changes(step)

    def _close_step(self, begin: float, step: int) -> None:
        """Count the processor time of a step, and discard its messages."""
        self.busy_seconds += self._processor_clock() - begin
        self.messages.forget_plant()
        self.neighbour_messages.forget(step)
        self.step = step + 1

    def _act_over_arrays(
        self,
        begin: float,
        step: int,
        state: tuple[Any, ...],
        messages: dict[int, Message],
        senders: list[int],
    ) -> None:
        satellite = self.satellite
        given = self.messages.inputs(step, state, messages, senders)
        decision: Decision | None = None
        violation: Violation | None = None
        try:
            decision = satellite.act(
                given.motion,
                given.received,
                given.measured_step,
                given.attitude,
                given.applied,
                given.sensed,
            )
            announced = encode(satellite.announce())
            violation = self._limits.of_decision(decision, announced).get(0)
            if self._floats.on_trial:
                time = float(satellite.announce().time)
                self._floats.judge(satellite, results_of(decision, time, announced.tolist()))
        except ArithmeticError as error:
            violation = violation_of(error)
        self._close_step(begin, step)
        output = self._output
        if violation is not None or decision is None:
            # The plant ends the flight at this step.
            output.publish_violation(step, violation or NO_COMMAND)
            output.publish_changes(step)
            return
        message = self._message(self.step)
        output.publish_command(step, decision, message)
        if self._checkpoints.due(step + 1):
            self._checkpoints.keep(self.satellite, self.neighbour_messages.neighbours)
        output.publish_next(step + 1, message)
        self._publish_joint_estimate(step + 1)
        output.publish_tracking(step, decision)
        output.publish_changes(step)

    def _message(self, step: int) -> StampedMessage:
        """Stamp and numbers of the neighbour message for a step; a Byzantine fault may change them."""
        announcement = self.satellite.announce()
        values = self._plan.faults.corrupt(self._index, encode(announcement), step)
        return self._stamps.at_time(float(announcement.time)), values.tolist()

    def _publish_joint_estimate(self, step: int) -> None:
        """Publish the estimate of the whole formation that goes with the neighbour message for a step."""
        if self._plan.topics.satellites[self._index].estimated:
            self._output.publish_joint_estimate(step, self.satellite.estimate_numbers())

    # In a batch with other satellites of the process

    def join_batch(self, batch: StepBatch, row: int) -> None:
        """Put messages into a batch from now on, which computes this satellite's steps."""
        self._batch, self._row = batch, row

    def leave_batch(self, satellite: Satellite | None) -> None:
        """Compute steps alone from now on.

        Args:
            satellite: flight software in the state that it has in the batch; None before the first step.
        """
        self._batch = None
        if satellite is not None:
            if not self._floats.takes(satellite):
                satellite.repeat_on_floats(self._plan.timing.steps)
            self.satellite = satellite

    def count_batched_step(self, busy: float) -> None:
        """Count a step that the batch has computed.

        Args:
            busy: this satellite's part of the processor time, s.
        """
        self.busy_seconds += busy
        self.messages.forget_plant()
        self.step += 1

    def dissolve_batch(self) -> None:
        """Compute steps alone from now on, and so do all others of the batch."""
        if self._batch is not None:
            self._batch.dissolve()

    def software(self) -> Satellite:
        """The flight software by itself, also while a batch computes its steps."""
        return self.satellite if self._batch is None else self._batch.single(self._row)
