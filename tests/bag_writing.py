# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags written as the recorder does, from the record of a flight in this process, without any node."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from satform_msgs.msg import FormationStatus

from satform.communication import topic_table
from satform.communication.sim_time import NANOSECONDS, Stamps
from satform.communication.topic_table import topic_name
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario
from satform_nodes.bag.metadata import offered
from satform_nodes.bag.writer import BagWriter
from satform_nodes.transport import qos, topic_types
from satform_nodes.transport.cdr_codec import layout
from satform_nodes.transport.message_definitions import described

VERSIONS = {"satform": "0.1.0", "numpy": "2.4"}
PROFILES = [offered(qos.LOCKSTEP)]

Messages = Iterator[tuple[str, str, int, dict[str, float]]]
"""Kind, satellite, step and numbers of each message in the order in which they pass."""


def messages_of(record: FlightRecord) -> Messages:
    """What the nodes of this flight said."""

    def vectors(**fields: Any) -> dict[str, float]:
        return {f"{name}.{axis}": value[i] for name, value in fields.items() for i, axis in enumerate("xyz")}

    position_error = record.position[:-1] - record.reference_position
    velocity_error = record.velocity[:-1] - record.reference_velocity
    for k in range(record.steps + 1):
        for i, name in enumerate(record.satellites):
            applied = np.zeros(3) if k == 0 else record.applied_acceleration[k - 1, i]
            told = vectors(
                position=record.position[k, i],
                velocity=record.velocity[k, i],
                applied_acceleration=applied,
            )
            yield "state", name, k, {"formation_version": 0, **told}
            yield "arc_length", name, k, {"arc_length": record.arc_length[k, i], "rate": record.rate[k, i]}
            if k == record.steps:
                continue
            nothing = np.zeros(3)
            command = vectors(
                acceleration=record.acceleration[k, i],
                wheel_torque=nothing,
                announced_position=nothing,
                announced_velocity=nothing,
            )
            stamp = {"announced_at.sec": 0, "announced_at.nanosec": 0}
            announced = {
                "announced_arc_length": record.arc_length[k + 1, i],
                "announced_rate": record.rate[k + 1, i],
            }
            within = {"violation": 0, "violating_value": 0.0}
            yield "command", name, k, {**command, **stamp, **announced, **within}
            tracking = {
                "reference_position": record.reference_position[k, i],
                "reference_velocity": record.reference_velocity[k, i],
                "reference_acceleration": record.reference_acceleration[k, i],
                "position_error": position_error[k, i],
                "velocity_error": velocity_error[k, i],
                "sliding_variable": record.sliding_variable[k, i],
            }
            yield "tracking", name, k, {**vectors(**tracking), "unsolved_plans": 0}


def write(
    folder: Path,
    scenario: Scenario,
    messages: Messages,
    *,
    close: bool = True,
    statuses: Sequence[FormationStatus] = (),
) -> BagWriter:
    """Write a bag as the recorder does, without any node."""
    writer = BagWriter(folder, scenario, VERSIONS)
    stamps = Stamps(scenario.timing.step, scenario.timing.step_nanoseconds)
    channels: dict[str, int] = {}
    for kind in ("state", "arc_length", "command", "tracking"):
        message_type = topic_types.TYPES[kind]
        for satellite in scenario.satellites:
            topic = topic_name(kind, satellite.name)
            channels[topic] = writer.add_topic(topic, described(message_type), PROFILES)
    for kind, name, step, numbers in messages:
        form = layout(topic_types.TYPES[kind], topic_table.FRAME)
        seconds, nanoseconds = stamps.at(step)
        data = form.pack(seconds, nanoseconds, step, *(numbers[field] for field in form.fields[3:]))
        topic = topic_name(kind, name)
        writer.write(channels[topic], seconds * NANOSECONDS + nanoseconds, data, step)
    for kind, topic in (("clock", topic_table.CLOCK), ("status", topic_table.STATUS)) if statuses else ():
        message_type = topic_types.TYPES[kind]
        channels[topic] = writer.add_topic(topic, described(message_type), PROFILES)
    for step in range(scenario.timing.steps + 1) if statuses else ():
        seconds, nanoseconds = stamps.at(step)
        clock = Clock()
        clock.clock.sec, clock.clock.nanosec = seconds, nanoseconds
        writer.write(
            channels[topic_table.CLOCK], seconds * NANOSECONDS + nanoseconds, serialize_message(clock), step
        )
    for status in statuses:
        writer.write(channels[topic_table.STATUS], 0, serialize_message(status), status.step)
    if close:
        writer.close()
    return writer


def first_steps(record: FlightRecord, steps: int) -> FlightRecord:
    """The beginning of a flight."""
    shorter = {
        name: value[: len(value) - record.steps + steps]
        for name, value in vars(record).items()
        if isinstance(value, np.ndarray)
    }
    return replace(record, **shorter)
