# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Checks whether the figure of an expectation can be made of flights of a scenario."""

from satform.common.spec import Complaint
from satform.communication.channel_model import LinksSpec
from satform.scenario.definition import ScenarioDefinition
from satform.scenario.environment import environment_of
from satform.scenario.expectation import Expectation


def figure_complaints(scenario: ScenarioDefinition, expectation: Expectation) -> list[Complaint]:
    """Why a figure cannot be made of flights of a scenario.

    Args:
        scenario: to be flown, by itself or case by case in a campaign.
        expectation: with the figure.

    Returns:
        Field of the expectation, empty where the whole of it is meant, and sentence of each fault.
    """
    whole = {own.name: scenario.satellite(index) for index, own in enumerate(scenario.satellites)}
    found = (
        expectation.complaints(set(whole), scenario.timing)
        or expectation.complaints_about_satellites(whole, scenario.consensus.announces)
        or expectation.orbit_complaints(scenario.setting, scenario.timing)
        or _link_complaints(scenario, expectation)
    )
    complaints: list[Complaint] = [((), sentence) for sentence in found]
    environment = environment_of(scenario.dynamics)
    if environment is not None:
        of_fields = expectation.environment_complaints(environment)
        complaints += [((field,), sentence) for field, sentence in of_fields]
    return complaints


def _link_complaints(scenario: ScenarioDefinition, expectation: Expectation) -> list[str]:
    names = [satellite.name for satellite in scenario.satellites]

    def edges() -> list[tuple[str, str, bool]]:
        pairs = [(names[sender], names[receiver]) for sender, receiver in scenario.possible_graph().edges]
        links = scenario.links or LinksSpec()
        return [(*pair, links.of(*pair).channel is not None) for pair in pairs]

    try:
        return expectation.link_complaints(edges)
    except ValueError:
        # A graph, or a change of it, that cannot be is named elsewhere.
        return []
