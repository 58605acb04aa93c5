# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Name and message type of every topic. QoS: `qos`; publishers and subscribers: `satform`'s `topic_table`."""

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from rosgraph_msgs.msg import Clock
from satform_msgs.msg import (
    ArcLength,
    Attitude,
    Command,
    Estimate,
    FormationStatus,
    NodeReady,
    ParameterChange,
    Propulsion,
    RecorderProgress,
    RelativeState,
    Tracking,
)
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from satform.communication import topic_table

FRAME = topic_table.FRAME

MARKER_FRAMES = {1.0: FRAME, 1e-3: f"{FRAME}_km"}
"""Frames of the markers by the length in them of one metre."""

SCALED_FRAME = f"{FRAME}_scaled"
"""Frame of markers of any other scale."""

CLOCK = topic_table.CLOCK
STATUS = topic_table.STATUS
NODE_READY = topic_table.NODE_READY
RECORDER_PROGRESS = topic_table.RECORDER_PROGRESS
MARKERS = "/formation/markers"
TF = topic_table.TF


def state(satellite: str) -> str:
    """Topic on which the plant publishes a satellite's state to it, measured if it has a sensor."""
    return topic_table.topic_name("state", satellite)


def attitude(satellite: str) -> str:
    """Topic on which the plant publishes a satellite's attitude to that satellite."""
    return topic_table.topic_name("attitude", satellite)


def truth(satellite: str) -> str:
    """Topic on which the plant publishes the true state of a satellite that has a sensor."""
    return topic_table.topic_name("truth", satellite)


def arc_length(satellite: str) -> str:
    """Topic on which a satellite publishes its phase to its out-neighbours."""
    return topic_table.topic_name("arc_length", satellite)


def motion(satellite: str) -> str:
    """Topic on which a satellite publishes its motion to its out-neighbours, if motion is shared."""
    return topic_table.topic_name("motion", satellite)


def command(satellite: str) -> str:
    """Topic on which a satellite publishes the commands to its thrusters and wheels."""
    return topic_table.topic_name("command", satellite)


def tracking(satellite: str) -> str:
    """Topic on which a satellite publishes its reference and tracking error."""
    return topic_table.topic_name("tracking", satellite)


def parameter_changes(satellite: str) -> str:
    """Topic on which a satellite publishes the changes of its parameters, each with its first step."""
    return topic_table.topic_name("parameter_changes", satellite)


def pose(satellite: str) -> str:
    """Topic on which the display publishes a satellite's position and attitude."""
    return topic_table.topic_name("pose", satellite)


def path(satellite: str) -> str:
    """Topic on which the display publishes the positions of a satellite so far."""
    return topic_table.topic_name("path", satellite)


TYPES = {
    "clock": Clock,
    "status": FormationStatus,
    "node_ready": NodeReady,
    "recorder_progress": RecorderProgress,
    "state": RelativeState,
    "attitude": Attitude,
    "truth": RelativeState,
    "propulsion": Propulsion,
    "arc_length": ArcLength,
    "motion": RelativeState,
    "command": Command,
    "tracking": Tracking,
    "estimate": Estimate,
    "parameter_changes": ParameterChange,
    "diagnostics": DiagnosticArray,
    "pose": PoseStamped,
    "path": Path,
    "markers": MarkerArray,
    "tf": TFMessage,
}
"""Message type of each topic by the last part of its name."""
