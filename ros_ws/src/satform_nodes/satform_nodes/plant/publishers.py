# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Publishers of the plant about each satellite: states, attitudes, links, readings, applied thrust."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from rclpy.node import Node
from satform_msgs.msg import Attitude, OrbitState, Propulsion, RelativeState

from satform.communication import topic_table
from satform.communication.topic_table import Channel, topic_name
from satform.flight.compile import FormationPlan
from satform.flight.geodetic_fixes import GeodeticFixes
from satform.flight.plant import Plant
from satform_nodes.plant.formation_publishers import FormationPublishers
from satform_nodes.plant.sensor_messages import SensorMessages
from satform_nodes.transport.cdr_codec import layout
from satform_nodes.transport.message_forms import form_of

_STATE = layout(RelativeState, topic_table.FRAME)
_ATTITUDE = layout(Attitude, topic_table.FRAME)
_PROPULSION = layout(Propulsion, topic_table.FRAME)
_ORBIT = layout(OrbitState, topic_table.INERTIAL_FRAME)


class PlantPublishers(FormationPublishers):
    """The plant's publishers, with its last messages for retransmission."""

    def __init__(self, node: Node, plan: FormationPlan, plant: Plant, channels: Iterable[Channel]) -> None:
        """Nothing has been published yet.

        Args:
            node: of the plant.
            plan: of the flight's parts.
            plant: whose states are published.
            channels: the topics on which the plant publishes.
        """
        super().__init__(node, plan, plant, channels)
        self._topics = plan.topics
        # Messages to each satellite at this step, for retransmission.
        self._last_messages: dict[int, list[bytes]] = {}
        publishers = self._publishers

        def of_satellites(kind: str) -> dict[int, Any]:
            """The publishers of a kind by the satellites' indices."""
            named = {index: topic_name(kind, name) for index, name in enumerate(self._names)}
            return {index: publishers[own] for index, own in named.items() if own in publishers}

        self._state_publishers = list(of_satellites("state").values())
        self._attitude_publishers = of_satellites("attitude")
        self._link_publishers = of_satellites("link_conditions")
        self._reading_publishers = of_satellites("measurements")
        self._truth_publishers = of_satellites("truth")
        self._orbit_publishers = of_satellites("orbit_state")
        self._orbits = plan.orbit_states
        self._geodetic = None if plan.geodetic is None else GeodeticFixes(plan.geodetic)
        self._sensor_messages = SensorMessages(plan.topics, publishers, self._stamps, self._geodetic)
        self._propulsion_publishers = list(of_satellites("propulsion").values())

    @property
    def _state_topics(self) -> list[Any]:
        return self._state_publishers

    # At each step

    def publish_states(self, number: int) -> None:
        """Publish the states of a step, measured to the satellites and true to observers, and the clock.

        Args:
            number: formation version of this step.
        """
        step, stamps = self._plant.step, self._stamps
        seconds, nanoseconds = stamps.at(step)
        measured, moments = self._plant.measured(), self._plant.measured_steps()
        applied = self._plant.applied.tolist()
        for index, (publisher, moment, position, velocity) in enumerate(
            zip(
                self._state_publishers,
                moments.tolist(),
                measured.position.tolist(),
                measured.velocity.tolist(),
                strict=True,
            )
        ):
            data = _STATE.pack(*stamps.at(moment), step, number, *position, *velocity, *applied[index])
            self._last_messages[index] = [data]
            publisher.publish(data)
        self._publish_attitudes(seconds, nanoseconds, step)
        self._publish_links(seconds, nanoseconds, step)
        self._publish_readings(seconds, nanoseconds, step)
        truth = self._plant.motion()
        for index, publisher in self._truth_publishers.items():
            position, velocity = truth.position[index].tolist(), truth.velocity[index].tolist()
            moved = (*position, *velocity, *applied[index])
            publisher.publish(_STATE.pack(seconds, nanoseconds, step, number, *moved))
        self._publish_orbits(seconds, nanoseconds, step)
        self._publish_clock(seconds, nanoseconds)

    def _publish_orbits(self, seconds: int, nanoseconds: int, step: int) -> None:
        if self._orbits is None:
            return
        found = np.concatenate(self._orbits.at(self._plant), axis=-1).tolist()
        for index, publisher in self._orbit_publishers.items():
            publisher.publish(_ORBIT.pack(seconds, nanoseconds, step, *found[index]))

    def _publish_attitudes(self, seconds: int, nanoseconds: int, step: int) -> None:
        attitude = self._plant.attitude()
        if attitude is None:
            return
        limits = self._plant.wheel_limits().astype(np.uint64).tolist()
        for index, publisher in self._attitude_publishers.items():
            turned = (
                *attitude.mrp[index].tolist(),
                *attitude.angular_velocity[index].tolist(),
                *attitude.wheel_momentum[index].tolist(),
            )
            data = _ATTITUDE.pack(seconds, nanoseconds, step, *turned, *limits[index])
            self._last_messages[index].append(data)
            publisher.publish(data)

    def _publish_links(self, seconds: int, nanoseconds: int, step: int) -> None:
        conditions = self._plant.link_conditions()
        if conditions is None:
            return
        for index, publisher in self._link_publishers.items():
            loss, light_time = conditions.loss[index].tolist(), conditions.light_time[index].tolist()
            data = form_of("link_conditions", self._topics, index).pack(
                seconds, nanoseconds, step, len(loss), *loss, len(light_time), *light_time
            )
            self._last_messages[index].append(data)
            publisher.publish(data)

    def _publish_readings(self, seconds: int, nanoseconds: int, step: int) -> None:
        for index, readings in self._plant.readings().items():
            form = form_of("measurements", self._topics, index)
            data = form.pack(seconds, nanoseconds, step, len(readings), *readings.tolist())
            self._last_messages[index].append(data)
            self._reading_publishers[index].publish(data)
        if self._geodetic is not None:
            self._geodetic.note(self._plant)
        self._sensor_messages.publish(self._plant.readings(), step)

    def retransmit_states(self, satellites: Iterable[int]) -> None:
        """Retransmit the messages of this step to some satellites."""
        for index in satellites:
            of_kinds = (self._attitude_publishers, self._link_publishers, self._reading_publishers)
            own = [publishers[index] for publishers in of_kinds if index in publishers]
            publishers = [self._state_publishers[index], *own]
            for publisher, data in zip(publishers, self._last_messages.get(index, []), strict=False):
                publisher.publish(data)

    def publish_propulsion(self) -> None:
        """Publish the applied thrust of the step that was just taken."""
        thrusters = self._plant.thrusters
        if thrusters is None:
            return
        step = self._plant.step - 1
        seconds, nanoseconds = self._stamps.at(step)
        state = thrusters.propulsion
        applied = self._plant.applied[thrusters.members].tolist()
        counters = np.stack(
            (state.saturated_steps, state.below_minimum_impulse_steps, state.propellant_depleted_steps),
            axis=-1,
        ).astype(np.uint64)
        for publisher, acceleration, delta_v, propellant, counts in zip(
            self._propulsion_publishers,
            applied,
            state.delta_v.tolist(),
            state.propellant.tolist(),
            counters.tolist(),
            strict=True,
        ):
            publisher.publish(
                _PROPULSION.pack(seconds, nanoseconds, step, *acceleration, delta_v, propellant, *counts)
            )
