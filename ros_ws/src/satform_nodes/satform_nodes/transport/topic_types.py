# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Message type of every topic. QoS: `qos`; names, publishers and subscribers: `satform`'s `topic_table`."""

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, QuaternionStamped
from nav_msgs.msg import Path
from rosgraph_msgs.msg import Clock
from satform_msgs.msg import (
    ArcLength,
    Attitude,
    AttitudeEstimate,
    Command,
    Estimate,
    FormationStatus,
    GroupCommand,
    GroupPhase,
    GroupState,
    GroupTracking,
    LinkConditions,
    Measurements,
    NavigationEstimate,
    NodeReady,
    OrbitState,
    ParameterChange,
    Propulsion,
    RecorderProgress,
    RelativeState,
    Tracking,
)
from sensor_msgs.msg import Imu, NavSatFix, Range
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

TYPES = {
    "clock": Clock,
    "status": FormationStatus,
    "node_ready": NodeReady,
    "recorder_progress": RecorderProgress,
    "state": RelativeState,
    "attitude": Attitude,
    "link_conditions": LinkConditions,
    "measurements": Measurements,
    "navigation_estimate": NavigationEstimate,
    "truth": RelativeState,
    "orbit_state": OrbitState,
    "propulsion": Propulsion,
    "arc_length": ArcLength,
    "motion": RelativeState,
    "command": Command,
    "tracking": Tracking,
    "estimate": Estimate,
    "attitude_estimate": AttitudeEstimate,
    "parameter_changes": ParameterChange,
    "group_state": GroupState,
    "group_command": GroupCommand,
    "group_phase": GroupPhase,
    "group_tracking": GroupTracking,
    "range": Range,
    "imu": Imu,
    "fix": NavSatFix,
    "orientation": QuaternionStamped,
    "diagnostics": DiagnosticArray,
    "pose": PoseStamped,
    "path": Path,
    "markers": MarkerArray,
    "tf": TFMessage,
}
"""Message type of each topic by the last part of its name."""
