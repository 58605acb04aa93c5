"""Type and QoS profile of every topic; publishers and subscribers: `satform.communication.topic_graph`."""

from functools import partial

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from satform_msgs.msg import (
    ArcLength,
    Attitude,
    Command,
    Estimate,
    FormationStatus,
    ParameterChange,
    Propulsion,
    Ready,
    Recorded,
    RelativeState,
    Tracking,
)
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from satform.communication import topic_graph

FRAME = "lvlh"
"""The chief's rotating frame, in metres (REP 103): x radial outward, y along-track, z orbit normal."""

MARKER_FRAMES = {1.0: FRAME, 1e-3: f"{FRAME}_km"}
"""Frames of the markers by the length in them of one metre."""

SCALED_FRAME = f"{FRAME}_scaled"
"""Frame of markers of any other scale."""

CLOCK = topic_graph.CLOCK
STATUS = topic_graph.STATUS
READY = topic_graph.READY
RECORDED = topic_graph.RECORDED
MARKERS = "/formation/markers"
TF = topic_graph.TF

RECORDER_WINDOW = 256
"""Steps by which the plant may be ahead of the recorder."""


def state(satellite: str) -> str:
    """Topic on which the plant tells a satellite its own state, as its sensor gives it."""
    return topic_graph.topic_name("state", satellite)


def attitude(satellite: str) -> str:
    """Topic on which the plant tells a satellite with attitude how it is turned."""
    return topic_graph.topic_name("attitude", satellite)


def truth(satellite: str) -> str:
    """Topic on which the plant shows where a satellite with a sensor really is."""
    return topic_graph.topic_name("truth", satellite)


def propulsion(satellite: str) -> str:
    """Topic on which the plant shows what a satellite's thrusters made of its commands."""
    return topic_graph.topic_name("propulsion", satellite)


def arc_length(satellite: str) -> str:
    """Topic on which a satellite tells its neighbours its phase."""
    return topic_graph.topic_name("arc_length", satellite)


def motion(satellite: str) -> str:
    """Topic on which a satellite tells its listeners where it is, where they share their motion."""
    return topic_graph.topic_name("motion", satellite)


def command(satellite: str) -> str:
    """Topic on which a satellite commands its thrusters."""
    return topic_graph.topic_name("command", satellite)


def tracking(satellite: str) -> str:
    """Topic on which a satellite shows how well it follows its reference."""
    return topic_graph.topic_name("tracking", satellite)


def estimate(satellite: str) -> str:
    """Topic on which a satellite with a filter shows what it estimates, with the covariance."""
    return topic_graph.topic_name("estimate", satellite)


def parameter_changes(satellite: str) -> str:
    """Topic on which a satellite says which gains changed at which step."""
    return topic_graph.topic_name("parameter_changes", satellite)


def pose(satellite: str) -> str:
    """Topic on which the display shows where a satellite is and how it is turned."""
    return topic_graph.topic_name("pose", satellite)


def path(satellite: str) -> str:
    """Topic on which the display shows where a satellite has been."""
    return topic_graph.topic_name("path", satellite)


TYPES = {
    "clock": Clock,
    "status": FormationStatus,
    "ready": Ready,
    "recorded": Recorded,
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

_PASSING = partial(
    QoSProfile,
    history=HistoryPolicy.KEEP_LAST,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.VOLATILE,
)
"""For those who are there when something is said."""

_KEPT = partial(_PASSING, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""For those who come later as well."""

STEPPED = _PASSING(depth=2 * RECORDER_WINDOW)
"""A message a step, as it is written. In lockstep nothing is lost: no reader falls behind by more than the
depth, since the plant waits for every satellite at each step and for the recorder within `RECORDER_WINDOW`;
on the wall clock it waits for nobody. No more is kept than that: until a killed reader is given up, a writer
holds for it what it has not acknowledged, and a reader that comes anew is led past all of that first, which
takes longer the more there is."""

STEPPED_READER = _PASSING(depth=64 * RECORDER_WINDOW)
"""For those who need each of them: room for a stranger's flood on top, which would push out what is not
taken yet."""

NEWEST = _PASSING(depth=1)
"""For those who read on the wall clock: what is out of date by the time it can be read is left out."""

LATCHED = _KEPT(depth=64)
"""Said now and then, and still heard by those who come later."""

LATCHED_READER = _KEPT(depth=2048)
"""The other end of it, with room: what is written by strangers in a burst is not to displace the rest."""

BY_RHYTHM = {"states": STEPPED, "steps": STEPPED, "now and then": LATCHED}
"""How plant and satellites say something, by the rhythm in which they do."""

SEEN = QoSProfile(depth=10)
"""For whoever looks on: reliable, and what is missed is missed."""

GLANCED = _PASSING(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
"""For one who only looks on: the newest message, if it comes. No writer ever waits for such a reader."""

TRANSFORMS = _PASSING(depth=100)
"""As tf2's own broadcasters publish."""

PICTURE = _KEPT(depth=1)
"""The newest picture, also for those who come later."""
