# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Kinds of parts that have a template; apart from what uses them, since the command line imports it."""

from enum import StrEnum


class PartKind(StrEnum):
    """A kind of part that a package can add."""

    CONTROLLER = "controller"
    CURVE = "curve"
    CONSENSUS = "consensus"
    PERTURBATION = "perturbation"
    DYNAMICS = "dynamics"
    METRIC = "metric"
    SENSOR = "sensor"
    TOPOLOGY = "topology"
