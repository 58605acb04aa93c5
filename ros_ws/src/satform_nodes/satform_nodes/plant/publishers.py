# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the plant says: the states of a step, what became of commands, and who takes part."""

from collections.abc import Collection, Iterable, Sequence
from typing import Any

import numpy as np
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from satform_msgs.msg import Attitude, Command, FormationStatus, Propulsion, RelativeState
from satform_msgs.msg import EarlyEnd as EarlyEndMessage

from satform.communication.topic_graph import Channel, relative, topic_name
from satform.flight.compile import FormationPlan
from satform.flight.plant import Plant
from satform.membership.manager import Change
from satform.membership.state import Formation
from satform.record.early_end import EarlyEnd
from satform_nodes.runtime.lifecycle import see_off
from satform_nodes.transport import qos, topics
from satform_nodes.transport.cdr_codec import layout
from satform_nodes.transport.discovery_barrier import Company
from satform_nodes.transport.node_names import local_name
from satform_nodes.transport.sim_time import Stamps

_STATE = layout(RelativeState, topics.FRAME)
_ATTITUDE = layout(Attitude, topics.FRAME)
_PROPULSION = layout(Propulsion, topics.FRAME)

_NOTHING = Change((), ())
"""No change of the formation."""

_FAREWELL = 5.0
"""How long the last status is kept up for those who have not yet taken it, s."""


class PlantVoice:
    """The plant's publishers, and its words as bytes."""

    def __init__(self, node: Node, plan: FormationPlan, plant: Plant, said: Iterable[Channel]) -> None:
        """Nothing has been said yet.

        Args:
            node: of the plant.
            plan: of the flight's parts.
            plant: whose states are told.
            said: the topics on which the plant speaks.
        """
        self._node = node
        self._plant = plant
        self._names = list(plan.names)
        self._last_step = plan.timing.steps
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        # What each satellite was told at this step, to be said again.
        self._said: dict[int, list[bytes]] = {}
        self._status = FormationStatus()
        # Diagnostics are told by the node's health.
        self._channels = [channel for channel in said if channel.kind != "diagnostics"]
        publishers = self._publishers = {
            channel.topic: node.create_publisher(
                topics.TYPES[channel.kind], relative(channel.topic), qos.BY_RHYTHM[channel.rhythm]
            )
            for channel in self._channels
        }

        def of_satellites(kind: str) -> dict[int, Any]:
            """The publishers of a kind by the satellites' places."""
            named = {index: topic_name(kind, name) for index, name in enumerate(self._names)}
            return {index: publishers[own] for index, own in named.items() if own in publishers}

        self._say_clock, self._say_status = publishers[topics.CLOCK], publishers[topics.STATUS]
        self._say_state = list(of_satellites("state").values())
        self._say_attitude = of_satellites("attitude")
        self._say_truth = of_satellites("truth")
        self._say_propulsion = list(of_satellites("propulsion").values())

    def expect_listeners(self, company: Company, *, recorded: bool) -> None:
        """Have those waited for that are to hear the plant.

        Args:
            company: waits.
            recorded: whether a recorder hears it too.
        """
        for channel in self._channels:
            company.listens(self._publishers[channel.topic], channel.subscribers_in(recorded=recorded))

    # At each step

    def tell_states(self, number: int) -> None:
        """Tell every satellite where it is, and those who look on how it really is.

        Args:
            number: of the formation that holds at this step.
        """
        step, stamps = self._plant.step, self._stamps
        seconds, nanoseconds = stamps.at(step)
        told, moments = self._plant.measured(), self._plant.measured_steps()
        applied = self._plant.applied.tolist()
        for index, (publisher, moment, position, velocity) in enumerate(
            zip(
                self._say_state,
                moments.tolist(),
                told.position.tolist(),
                told.velocity.tolist(),
                strict=True,
            )
        ):
            data = _STATE.pack(*stamps.at(moment), step, number, *position, *velocity, *applied[index])
            self._said[index] = [data]
            publisher.publish(data)
        self._tell_attitudes(seconds, nanoseconds, step)
        truth = self._plant.motion()
        for index, publisher in self._say_truth.items():
            position, velocity = truth.position[index].tolist(), truth.velocity[index].tolist()
            moved = (*position, *velocity, *applied[index])
            publisher.publish(_STATE.pack(seconds, nanoseconds, step, number, *moved))
        clock = Clock()
        clock.clock.sec, clock.clock.nanosec = seconds, nanoseconds
        self._say_clock.publish(clock)

    def _tell_attitudes(self, seconds: int, nanoseconds: int, step: int) -> None:
        attitude = self._plant.attitude()
        if attitude is None:
            return
        limits = self._plant.wheel_limits().astype(np.uint64).tolist()
        for index, publisher in self._say_attitude.items():
            turned = (
                *attitude.mrp[index].tolist(),
                *attitude.angular_velocity[index].tolist(),
                *attitude.wheel_momentum[index].tolist(),
            )
            data = _ATTITUDE.pack(seconds, nanoseconds, step, *turned, *limits[index])
            self._said[index].append(data)
            publisher.publish(data)

    def tell_again(self, satellites: Iterable[int]) -> None:
        """Repeat to some satellites what they were told at this step."""
        for index in satellites:
            publishers = [self._say_state[index]]
            if index in self._say_attitude:
                publishers.append(self._say_attitude[index])
            for publisher, data in zip(publishers, self._said.get(index, []), strict=False):
                publisher.publish(data)

    def show_propulsion(self) -> None:
        """Show what became of the commands of the step that was just taken."""
        thrusters = self._plant.thrusters
        if thrusters is None:
            return
        step = self._plant.step - 1
        seconds, nanoseconds = self._stamps.at(step)
        state = thrusters.propulsion
        given = self._plant.applied[thrusters.members].tolist()
        counters = np.stack(
            (state.saturated_steps, state.below_minimum_impulse_steps, state.propellant_depleted_steps),
            axis=-1,
        ).astype(np.uint64)
        for publisher, acceleration, delta_v, propellant, counts in zip(
            self._say_propulsion,
            given,
            state.delta_v.tolist(),
            state.propellant.tolist(),
            counters.tolist(),
            strict=True,
        ):
            publisher.publish(
                _PROPULSION.pack(seconds, nanoseconds, step, *acceleration, delta_v, propellant, *counts)
            )

    # Now and then

    def say_status(
        self,
        formation: Formation,
        phase: int,
        reason: str,
        change: Change = _NOTHING,
        final_commands: Sequence[Command] = (),
        early_end: EarlyEnd | None = None,
    ) -> None:
        """Tell everyone in what phase the formation is, from which step, and why.

        Args:
            formation: who flies and who hears whom.
            phase: of the flight.
            reason: why, in words.
            change: of the formation at this step.
            final_commands: the last command of each satellite that is lost now.
            early_end: why the flight ends now before its last step; None when it does not.
        """
        listeners, speakers = np.nonzero(formation.graph.adjacency)
        self._status = FormationStatus(
            step=self._plant.step,
            version=formation.number,
            phase=phase,
            last_step=self._last_step,
            satellites=self._names,
            alive=formation.alive.tolist(),
            edge_receivers=listeners.tolist(),
            edge_senders=speakers.tolist(),
            algebraic_connectivity=float(formation.connectivity),
            lost=[self._names[index] for index in change.lost],
            final_commands=list(final_commands),
            rejoined=[self._names[event.satellite] for event in change.rejoined],
            rejoin_checkpoints=[
                -1 if event.checkpoint is None else event.checkpoint for event in change.rejoined
            ],
            early_end=[] if early_end is None else [_early_end_message(early_end)],
            reason=reason,
        )
        seconds, nanoseconds = self._stamps.at(self._plant.step)
        self._status.header.stamp.sec, self._status.header.stamp.nanosec = seconds, nanoseconds
        self._status.header.frame_id = topics.FRAME
        self.repeat_status()

    def repeat_status(self) -> None:
        """Say once more how the formation is."""
        self._say_status.publish(self._status)

    def see_off(self, others: Collection[str], *, recorded: bool) -> bool:
        """Stay until what was said last has arrived, for a bounded time.

        Args:
            others: nodes that matter; when none of them listens any more, nobody is waited for.
            recorded: whether all steps are in a bag, so that none of them is on its way any more.

        Returns:
            False when the time was up.
        """

        def present() -> bool:
            listening = self._node.get_subscriptions_info_by_topic(self._say_status.topic_name)
            return any(local_name(other, self._node.get_namespace()) in others for other in listening)

        said_in_steps: list[Any] = [] if recorded else [*self._say_state, self._say_clock]
        return see_off((self._say_status, *said_in_steps), present, _FAREWELL)


def _early_end_message(end: EarlyEnd) -> EarlyEndMessage:
    return EarlyEndMessage(
        satellite=end.satellite,
        quantity=end.quantity,
        step=end.step,
        value=end.value,
        limit=end.limit,
        unit=end.unit,
        cause=end.cause,
    )
