# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a satellite says: commands, announcements, how it tracks, which gains changed."""

from collections import deque
from collections.abc import Sequence

import numpy as np
from satform_msgs.msg import Command, Estimate, NodeReady, ParameterChange, Tracking

from satform.communication.messages import NeighbourMessage, encode
from satform.communication.topic_graph import (
    PLANT,
    RECORDER,
    formation_channels,
    published_by,
    relative,
    satellite_channels,
)
from satform.consensus.arc_length import Announces
from satform.equipment.navigation import EstimatorMemory
from satform.flight.compile import FormationPlan
from satform.flight.limits import Violation
from satform.flight.satellite import Decision
from satform.numeric.elementwise import Array
from satform_nodes.runtime.lifecycle import see_off
from satform_nodes.runtime.parameters import FormationNode
from satform_nodes.transport import qos, topics
from satform_nodes.transport.cdr_codec import layout
from satform_nodes.transport.discovery_barrier import Company
from satform_nodes.transport.node_names import local_name
from satform_nodes.transport.sim_time import Stamps

_COMMAND = layout(Command, topics.FRAME)
_TRACKING = layout(Tracking, topics.FRAME)
_ESTIMATE = layout(Estimate, topics.FRAME)
_NO_TORQUE = (0.0, 0.0, 0.0)
_NOTHING = (0, 0, *[0.0] * 8)
"""What a command says of the next announcement when there is none."""

_WITHIN = (0, 0.0)
"""What a command says of violations of limits when there is none."""

_FAREWELL = 2.0
"""How long a satellite stays for the sake of what it said last, s."""

AROUND_NUMBERS: dict[Announces, tuple[tuple[int, ...], tuple[float, ...]]] = {
    "arc_length": ((), ()),
    "motion": ((0,), (0.0, 0.0, 0.0)),
}
"""What an announcement's message holds before its numbers (the formation's) and after them (what was
applied), by what is announced; only the plant fills these in."""

Spoken = tuple[tuple[int, int], list[float]]
"""Stamp and numbers of an announcement."""


class SatelliteVoice:
    """A satellite's publishers, its words as bytes, and the last of them, to be said again."""

    def __init__(self, node: FormationNode, plan: FormationPlan, index: int, stamps: Stamps) -> None:
        """Nothing has been said yet.

        Args:
            node: of the satellite.
            plan: of the flight's parts.
            index: place of the satellite.
            stamps: of its steps.
        """
        self._node = node
        names = list(plan.names)
        name = self._name = names[index]
        self._index = index
        self._faults = plan.faults
        self._stamps = stamps
        self._said: deque[bytes] = deque(maxlen=2)
        self._last_command = b""
        announces = plan.announces
        self._in_phase = announces == "arc_length"
        # What an announcement carries between its step and its numbers, and after them.
        self._before_numbers, self._after_numbers = AROUND_NUMBERS[announces]
        self._announcement = layout(topics.TYPES[announces], topics.FRAME)
        table = [*satellite_channels(plan.topics, index), *formation_channels(plan.topics)]
        self._channels = {channel.kind: channel for channel in published_by(name, table)}
        self._publishers = {
            kind: node.create_publisher(
                topics.TYPES[kind],
                relative(self._channels[kind].topic),
                qos.BY_RHYTHM[self._channels[kind].rhythm],
            )
            for kind in (announces, "command", "tracking", "estimate", "parameter_changes", "node_ready")
            if kind in self._channels
        }
        self._say_announcement = self._publishers[announces]
        self._say_command = self._publishers["command"]
        self._say_tracking = self._publishers["tracking"]
        self._say_estimate = self._publishers.get("estimate")
        self._say_change = self._publishers["parameter_changes"]
        self._say_ready = self._publishers["node_ready"]
        self._spoken = (self._say_command, self._say_announcement, self._say_tracking, self._say_change)

    def expect_listeners(self, company: Company, *, recorded: bool) -> None:
        """Have those waited for that are to hear this satellite.

        Args:
            company: waits.
            recorded: whether a recorder hears it too.
        """
        for kind, publisher in self._publishers.items():
            # What has changed is kept for those who come later.
            if kind != "parameter_changes":
                company.listens(publisher, self._channels[kind].subscribers_in(recorded=recorded))

    # At each step

    def words(self, announcement: NeighbourMessage, step: int) -> Spoken:
        """Stamp and numbers of what a satellite announces for a step, true or not."""
        values = self._faults.corrupt(self._index, encode(announcement), step)
        return self._stamps.at_time(float(announcement.time)), values.tolist()

    def command(self, seconds: int, nanoseconds: int, step: int, decision: Decision, words: Spoken) -> None:
        """Command the thrusters, and say with it what is announced for the next step."""
        stamp, said = words
        torque = _NO_TORQUE if decision.wheel_torque is None else decision.wheel_torque.tolist()
        announced = (*said, *[0.0] * 6) if self._in_phase else (0.0, 0.0, *said)
        self.say_command(
            _COMMAND.pack(
                seconds,
                nanoseconds,
                step,
                *decision.acceleration.tolist(),
                *torque,
                *stamp,
                *announced,
                *_WITHIN,
            )
        )

    def report_violation(self, step: int, violation: Violation) -> None:
        """Command nothing for a step, and tell the plant what was not finite or beyond its limit in it."""
        self.say_command(violation_command(self._stamps.at(step), step, violation))

    def announce(self, step: int, words: Spoken) -> None:
        """Tell the listeners what they hear for a step."""
        stamp, said = words
        self.say_announcement(
            self._announcement.pack(*stamp, step, *self._before_numbers, *said, *self._after_numbers)
        )

    def show(self, seconds: int, nanoseconds: int, step: int, decision: Decision) -> None:
        """Show how well the reference is followed, and what the filter estimates."""
        reference, motion = decision.reference, decision.motion
        if decision.estimate is not None:
            self.show_estimate(seconds, nanoseconds, step, numbers_of(decision.estimate).tolist())
        self._say_tracking.publish(
            _TRACKING.pack(
                seconds,
                nanoseconds,
                step,
                *reference.position.tolist(),
                *reference.velocity.tolist(),
                *reference.acceleration.tolist(),
                *(motion.position - reference.position).tolist(),
                *(motion.velocity - reference.velocity).tolist(),
                *decision.sliding_variable.tolist(),
            )
        )

    def show_estimate(self, seconds: int, nanoseconds: int, step: int, estimate: Sequence[float]) -> None:
        """Show what the filter estimates, as `numbers_of` has it."""
        if self._say_estimate is not None:
            *encode, rejected = estimate
            self._say_estimate.publish(_ESTIMATE.pack(seconds, nanoseconds, step, *encode, int(rejected)))

    def say_command(self, data: bytes) -> None:
        """Command the thrusters; the message is kept to be said again."""
        self._last_command = data
        self._say_command.publish(data)

    def say_announcement(self, data: bytes) -> None:
        """Tell the listeners; the message is kept to be said again."""
        self._said.append(data)
        self._say_announcement.publish(data)

    def say_tracking(self, data: bytes) -> None:
        """Show how well the reference is followed."""
        self._say_tracking.publish(data)

    # Now and then

    def say_ready(self, step: int, checkpoint: int) -> None:
        """Tell the plant that this satellite can fly.

        Args:
            step: to which it has come.
            checkpoint: step of the checkpoint from which it would go on; -1 for none.
        """
        name = self._node.get_fully_qualified_name()
        ready = NodeReady(node=name, step=step, checkpoint=checkpoint)
        ready.header.stamp.sec, ready.header.stamp.nanosec = self._stamps.at(step)
        ready.header.frame_id = topics.FRAME
        self._say_ready.publish(ready)

    def tell_changes(self, step: int, changes: Sequence[tuple[str, list[float]]]) -> None:
        """Say which parameters have changed at a step."""
        seconds, nanoseconds = self._stamps.at(step)
        for name, value in changes:
            change = ParameterChange(step=step, name=name, value=value)
            change.header.stamp.sec, change.header.stamp.nanosec = seconds, nanoseconds
            change.header.frame_id = topics.FRAME
            self._say_change.publish(change)

    def say_again(self) -> None:
        """Repeat what was said last."""
        if self._last_command:
            self._say_command.publish(self._last_command)
        for said in self._said:
            self._say_announcement.publish(said)

    def forget(self) -> None:
        """Have nothing to repeat."""
        self._said.clear()
        self._last_command = b""

    def command_nothing(self, step: int) -> None:
        """Turn the thrusters off, as far as anyone hears it."""
        nothing = (*[0.0] * 6, *_NOTHING, *_WITHIN)
        self._say_command.publish(_COMMAND.pack(*self._stamps.at(step), step, *nothing))

    def see_off(self, *, only_changes: bool) -> None:
        """Stay until what was said last has arrived, for a bounded time: it would be lost with this node.

        Args:
            only_changes: whether nothing but changes can still be on its way.
        """
        see_off((self._say_change,) if only_changes else self._spoken, self._heard_out, _FAREWELL)

    def _heard_out(self) -> bool:
        """Whether the plant or the recorder still listens to this satellite."""
        others = self._node.get_subscriptions_info_by_topic(self._say_command.topic_name)
        return bool({PLANT, RECORDER} & {local_name(other, self._node.get_namespace()) for other in others})


def violation_command(stamp: tuple[int, int], step: int, violation: Violation) -> bytes:
    """A command message that commands nothing and tells of a violation.

    Args:
        stamp: of the step, seconds and nanoseconds.
        step: its number.
        violation: what was not finite or beyond its limit.
    """
    return _COMMAND.pack(*stamp, step, *[0.0] * 6, *_NOTHING, violation.number, violation.value)


def numbers_of(estimate: EstimatorMemory) -> Array:
    """What an estimate's message holds after its step, in order, shape (..., 44)."""
    shape = estimate.state.shape[:-1]
    last = np.stack(np.broadcast_arrays(estimate.innovation, estimate.rejected), axis=-1)
    return np.concatenate((estimate.state, estimate.covariance.reshape(*shape, 36), last), axis=-1)
