# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Connects a record with its scenario: chief's motion, history of the links, a central filter."""

from dataclasses import replace
from functools import partial

from satform.flight.central_navigation import central_estimate
from satform.flight.chief_motion import chief_motion
from satform.flight.compile import compile_scenario
from satform.flight.link_outcomes import link_history
from satform.membership.formation import Plan
from satform.numeric.elementwise import Array
from satform.record.flight_record import FlightRecord
from satform.record.link_history import LinkHistory
from satform.scenario.model import Scenario


def with_chief(record: FlightRecord, scenario: Scenario, events: Plan | None = None) -> FlightRecord:
    """A record that can compute its chief's motion, its inertial quantities, what its links did, and more.

    Args:
        record: of a flight.
        scenario: that was flown.
        events: what happened beside that which the scenario plans, by step; of these the changes of the
            graph count.
    """
    return replace(
        record,
        chief_source=partial(chief_motion, scenario),
        link_source=partial(_links_of, scenario, events or {}),
        central_source=partial(_central_estimate, scenario),
    )


def _links_of(scenario: Scenario, events: Plan, record: FlightRecord) -> LinkHistory:
    return link_history(compile_scenario(scenario), record, events)


def _central_estimate(scenario: Scenario, record: FlightRecord) -> Array | None:
    return central_estimate(compile_scenario(scenario), record)
