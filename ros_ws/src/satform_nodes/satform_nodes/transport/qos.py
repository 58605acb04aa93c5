# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""QoS profiles of all publishers and subscriptions, with the reason for each."""

from functools import partial

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from satform.communication.topic_table import LOCKSTEP_DEPTH, RECORDER_WINDOW

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
"""Publisher of one message a step. In lockstep no message is lost: no subscription lags by more than the
depth, because the plant waits for every satellite at each step and for the recorder within `RECORDER_WINDOW`;
on the wall clock it waits for none. The depth is no larger than that: until a killed subscription is timed
out, a publisher keeps for it all messages that it has not acknowledged, and a new subscription is led past
all of them first, which takes longer the more there are."""

LOCKSTEP_READER = _VOLATILE(depth=64 * RECORDER_WINDOW)
"""Subscription that needs every message: deep enough that a burst from an unauthorised publisher does not
displace messages that have not been taken yet."""

REALTIME = _VOLATILE(depth=1)
"""Subscription on the wall clock: only the newest message counts, older ones are dropped."""

LATCHED = _TRANSIENT_LOCAL(depth=64)
"""Publisher of occasional messages, which late subscriptions receive, too."""

LATCHED_READER = _TRANSIENT_LOCAL(depth=2048)
"""Subscription to a latched topic: deep enough that a burst from an unauthorised publisher displaces no
message that has not been taken yet."""

PUBLISHER_BY_RHYTHM = {"states": LOCKSTEP, "steps": LOCKSTEP, "occasional": LATCHED}
"""Profile of the publishers of plant and satellites, by the rhythm of the topic."""

OBSERVER = QoSProfile(depth=10)
"""Publisher of diagnostics: reliable; the flight does not wait for any subscription to them."""

BEST_EFFORT = _VOLATILE(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Subscription of an observer to the newest message: no publisher ever waits for it or retransmits."""

TRANSFORMS = _VOLATILE(depth=100)
"""Publisher of `/tf`, as tf2's own broadcasters have it."""

MARKERS = _TRANSIENT_LOCAL(depth=1)
"""Publisher of markers, poses and paths: the newest message, also for late subscriptions."""
