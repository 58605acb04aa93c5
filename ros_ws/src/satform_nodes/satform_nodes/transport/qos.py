# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""QoS profiles of all publishers and subscriptions, with the topics that use each and the reason.

The rhythm of a topic is in `satform.communication.topic_table`, its message type in `topic_types`.
"""

from functools import partial

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from satform.communication.topic_table import LOCKSTEP_DEPTH, RECORDER_WINDOW, Channel

_VOLATILE = partial(
    QoSProfile,
    history=HistoryPolicy.KEEP_LAST,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.VOLATILE,
)
"""Reliable, for subscriptions that are matched when a message is published."""

_TRANSIENT_LOCAL = partial(_VOLATILE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Reliable, also for subscriptions that are matched later."""

LOCKSTEP = _VOLATILE(depth=LOCKSTEP_DEPTH)
"""Publisher of one message in each step: `command`, `tracking`, `estimate`, `state`, `attitude`, `truth`,
`propulsion`, `arc_length` or `motion`, `/clock`; also `/formation/recorder_progress`.

Reliable, so that no message is lost in lockstep: no subscription lags by more than the depth, because the
plant waits for every satellite at each step and for the recorder within `RECORDER_WINDOW`. In real time it
waits for none. The depth is not larger: until a killed subscription is timed out, a publisher keeps all
messages that this subscription has not acknowledged, and a new subscription has to skip them first, which
takes longer the more there are."""

ARRAYS = _VOLATILE(depth=LOCKSTEP_DEPTH)
"""Publisher of, and subscription to, one array in each step: `group_state`, `group_command`, `group_phase`,
`group_tracking`. In large formations `arrays` gives it less depth, since an array may have a megabyte."""

LOCKSTEP_READER = _VOLATILE(depth=64 * RECORDER_WINDOW)
"""Subscription that needs every message: the recorder's to all topics with one message in each step and to
`/diagnostics`; in lockstep also the plant's to `command` and a satellite's to `state`, `attitude` and its
neighbours' `arc_length` or `motion`; the plant's to `/formation/recorder_progress`.

Deep enough that a burst from an unauthorised publisher does not displace messages that have not been taken
yet."""

REALTIME = _VOLATILE(depth=1)
"""Subscription in real time, of the plant to `command` and of a satellite to `state`, `attitude` and its
neighbours' `arc_length` or `motion`: only the newest message counts, older ones are dropped."""

LATCHED = _TRANSIENT_LOCAL(depth=64)
"""Publisher of occasional messages, which late subscriptions receive, too: `/formation/status`,
`/formation/node_ready`, `parameter_changes`. Also the display's subscription to the status."""

LATCHED_READER = _TRANSIENT_LOCAL(depth=2048)
"""Subscription to a latched topic: of the plant to `/formation/node_ready`, of satellites and recorder to
`/formation/status`, of the recorder to `parameter_changes`. Deep enough that a burst from an unauthorised
publisher does not displace messages that have not been taken."""

PUBLISHER_BY_RHYTHM = {"states": LOCKSTEP, "steps": LOCKSTEP, "occasional": LATCHED}
"""Profile of the publishers of plant and satellites by the topic's rhythm in `topic_table`: `states` (a
message for every state), `steps` (for every step), `occasional`."""

OBSERVER = QoSProfile(depth=10)
"""Publisher of `/diagnostics`: reliable; the flight does not wait for any subscription to it."""

BEST_EFFORT = _VOLATILE(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Subscription of the display to the newest message: no publisher ever waits for it or retransmits."""

TRANSFORMS = _VOLATILE(depth=100)
"""Publisher of `/tf`, as tf2's own broadcasters have it."""

MARKERS = _TRANSIENT_LOCAL(depth=1)
"""Publisher of the display's `/formation/markers`, `pose` and `path`: the newest message, also for late
subscriptions."""


def publisher_profile(channel: Channel) -> QoSProfile:
    """Profile of the publishers of plant, satellites and groups on a topic."""
    return arrays(channel) if channel.satellites else PUBLISHER_BY_RHYTHM[channel.rhythm]


def arrays(channel: Channel) -> QoSProfile:
    """`ARRAYS` with the depth of a topic: twice the steps by which the plant may be ahead of the recorder."""
    return _VOLATILE(depth=channel.depth)
