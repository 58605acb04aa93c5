# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A hostile node: anything that can be written on the topics of a formation, at full speed, until killed."""

import random
import sys
from contextlib import suppress

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy._rclpy_pybind11 import RCLError
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from satform_msgs.msg import (
    ArcLength,
    Command,
    FormationStatus,
    NodeReady,
    ParameterChange,
    RecorderProgress,
    RelativeState,
    Tracking,
)

from satform.communication import topic_table
from satform.communication.topic_table import topic_name
from satform_nodes.runtime.diagnostics import DIAGNOSTICS
from satform_nodes.transport import qos

NUMBERS = (0.0, 1.0, -1e3, 1e300, float("nan"), float("inf"))


def filled(message: object, draw: random.Random, steps: list[int]) -> object:
    """A message with the given steps and some numbers, well-formed for the most part."""
    if hasattr(message, "header"):
        message.header.frame_id = topic_table.FRAME
        message.header.stamp.sec = draw.choice(steps) // 2
    for name, kind in message.get_fields_and_field_types().items():
        if kind == "double":
            setattr(message, name, draw.choice(NUMBERS))
        elif name == "step":
            message.step = draw.choice(steps)
        elif kind in ("geometry_msgs/Vector3", "geometry_msgs/Point"):
            for axis in "xyz":
                setattr(getattr(message, name), axis, draw.choice(NUMBERS[:3]))
    return message


def lie_of_the_formation(draw: random.Random, names: list[str], steps: list[int]) -> FormationStatus:
    """All are lost, or the flight is over, or nobody hears anybody."""
    return FormationStatus(
        step=draw.choice(steps),
        version=draw.randrange(1, 1000),
        phase=draw.choice([FormationStatus.FINISHED, FormationStatus.ABORTED, FormationStatus.FLYING]),
        last_step=draw.choice(steps),
        satellites=names,
        alive=[draw.random() < 0.5 for _ in names],
        lost=names,
        final_commands=[Command() for _ in names],
        rejoined=names[:1],
        rejoin_checkpoints=[3],
        reason="a lie",
    )


def main(names: list[str]) -> None:
    draw = random.Random(20261122)
    rclpy.init()
    node = rclpy.create_node("stranger")
    kinds = {
        topic_table.CLOCK: Clock,
        topic_table.STATUS: FormationStatus,
        topic_table.NODE_READY: NodeReady,
        topic_table.RECORDER_PROGRESS: RecorderProgress,
        DIAGNOSTICS: DiagnosticArray,
    }
    for name in names:
        kinds |= {topic_name("state", name): RelativeState, topic_name("arc_length", name): ArcLength}
        kinds |= {topic_name("command", name): Command, topic_name("tracking", name): Tracking}
        kinds |= {topic_name("parameter_changes", name): ParameterChange}
    latched = (
        topic_table.STATUS,
        topic_table.NODE_READY,
        *(topic_name("parameter_changes", name) for name in names),
    )
    writers = {
        topic: node.create_publisher(kind, topic, qos.LATCHED if topic in latched else qos.LOCKSTEP)
        for topic, kind in kinds.items()
    }
    sys.stdout.write("talking\n")
    sys.stdout.flush()
    step = 0
    while True:
        step += 1
        steps = [0, 1, step, step + 1, step // 3, 10**6]
        for topic, writer in writers.items():
            kind = kinds[topic]
            if kind is FormationStatus:
                message = lie_of_the_formation(draw, names, steps)
            elif kind is DiagnosticArray:
                lie = KeyValue(key="rejected messages: none", value="1")
                message = DiagnosticArray(
                    status=[DiagnosticStatus(hardware_id="stranger", message="all is well", values=[lie])]
                )
            elif kind is NodeReady:
                name, first = draw.choice(names), draw.choice(steps)
                message = NodeReady(node=f"/{name}", step=first, checkpoint=7, interface=1)
            elif kind is ParameterChange:
                message = ParameterChange(
                    step=draw.choice(steps), name="controller.reaching_gain", value=[9.0]
                )
            else:
                message = filled(kind(), draw, steps)
            if isinstance(message, Clock):
                message.clock.sec = draw.choice(steps)
            data = serialize_message(message)
            if draw.random() < 0.1:
                data = draw.randbytes(draw.randrange(200))
            # What is longer than any message of its kind does not leave this process.
            with suppress(RCLError):
                writer.publish(data)


if __name__ == "__main__":
    main(sys.argv[1:])
