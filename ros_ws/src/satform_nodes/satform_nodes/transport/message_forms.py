# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Layout of the messages of each topic of a flight, which of their numbers may have any value, validators."""

from satform.communication import topic_table
from satform.communication.array_layout import ArrayLayout
from satform.communication.array_validator import ArrayValidator
from satform.communication.covariance_check import covariance_complaint
from satform.communication.message_validator import (
    EARLIER_STAMPS,
    LARGEST,
    MessageRules,
    MessageValidator,
    RejectionCounter,
)
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import NUMBERS_OF_A_SATELLITE, Channel, TopicPlan, lengths_of
from satform_nodes.transport.cdr_codec import Layout, array_layout, layout
from satform_nodes.transport.compiled import new_validator
from satform_nodes.transport.topic_types import TYPES

_LAST_UNBOUNDED = {"command": 1, "orbit_state": 6}
"""Numbers at the end of a message that may have any value: what a satellite reports as beyond every limit,
and relative elements, which may be undefined."""

_WITH_COVARIANCE = frozenset({"estimate", "navigation_estimate", "attitude_estimate"})
"""Kinds with covariances, which are squares of what is bounded elsewhere."""

_READINGS = 4
"""Fields of a message of readings before them: stamp, step, and their number."""

_MOTION = (4, 10)
"""Fields of position and velocity in the state of a satellite that does not get its motion."""


def form_of(kind: str, plan: TopicPlan, satellite: int) -> Layout:
    """Layout of the messages of a kind about a satellite.

    Args:
        kind: of the topic.
        plan: of the flight's topics.
        satellite: its index; of no importance for a topic of the formation.
    """
    return layout(TYPES[kind], topic_table.frame_of(kind), lengths_of(kind, plan, satellite))


def largest_number(kind: str) -> float:
    """Magnitude above which no number of a message of a kind lies, but for those that may have any value."""
    return LARGEST * LARGEST if kind in _WITH_COVARIANCE else LARGEST


def unbounded_fields(kind: str, plan: TopicPlan, satellite: int) -> tuple[int, int]:
    """First of the numbers of a message that may have any value, and the first one after them.

    Args:
        kind: of the topic.
        plan: of the flight's topics.
        satellite: index of the satellite that the topic is about.
    """
    count = len(form_of(kind, plan, satellite).fields)
    if kind == "measurements":
        return (_READINGS, count)
    if kind == "state" and plan.satellites[satellite].navigates:
        return _MOTION
    last = _LAST_UNBOUNDED.get(kind, 0)
    return (count - last, count)


def validator_of(
    kind: str, topic: str, plan: TopicPlan, satellite: int, rejections: RejectionCounter, stamps: Stamps
) -> MessageValidator:
    """Validator of the messages of a topic.

    Args:
        kind: of the topic.
        topic: its name.
        plan: of the flight's topics.
        satellite: index of the satellite that the topic is about.
        rejections: counts the rejected messages.
        stamps: of the scenario's steps.
    """
    rules = MessageRules(
        exact=kind not in EARLIER_STAMPS,
        unbounded=unbounded_fields(kind, plan, satellite),
        largest=largest_number(kind),
        further=covariance_complaint if kind == "navigation_estimate" else None,
    )
    return new_validator(topic, form_of(kind, plan, satellite), rejections, stamps, rules)


def array_form_of(channel: Channel) -> ArrayLayout:
    """Layout of the messages of a topic with arrays."""
    numbers = NUMBERS_OF_A_SATELLITE[channel.kind]
    lengths = tuple((name, count * channel.satellites) for name, count in numbers.items())
    return array_layout(TYPES[channel.kind], topic_table.FRAME, lengths)


def array_validator_of(channel: Channel, rejections: RejectionCounter, stamps: Stamps) -> ArrayValidator:
    """Validator of the messages of a topic with arrays.

    Args:
        channel: the topic.
        rejections: counts the rejected messages.
        stamps: of the scenario's steps.
    """
    form = array_form_of(channel)
    return ArrayValidator(channel.topic, form, rejections, stamps, exact=channel.kind not in EARLIER_STAMPS)
