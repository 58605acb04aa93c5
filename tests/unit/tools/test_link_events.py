# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Links that open and close in a flight: their events, and the connectivity of what they delivered."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flights import shipped
from satform.consensus.graph import Graph
from satform.evaluation.links import DeliveredConnectivity, DeliveredFraction, LinkMargin
from satform.flight.simulate import simulate
from satform.membership.formation import TopologyChanged
from satform.plot.style import Unit
from satform.record.link_history import LinkHistory
from satform_tools.report.event_log import flight_events
from satform_tools.report.page.charts import graph_charts
from satform_tools.run.stored_run import StoredRun


@pytest.fixture(scope="module")
def flight() -> StoredRun:
    scenario = shipped("radio_links_spread", "timing.duration=1400.0")
    return StoredRun(Path("bag"), scenario, simulate(scenario), True, {}, None)


def test_each_change_of_the_links_is_an_event_with_the_connectivity_that_it_leaves(flight: StoredRun) -> None:
    events = flight_events(flight)
    assert {event.kind for event in events} == {"link"}
    first, last = events[0], events[-1]
    assert first.text == "sat1 and sat5 below the required margin; connectivity 3"
    assert last.text.endswith("connectivity 0")
    # A complete graph of five without one edge has 3, and a chain of five 2 - 2 cos(36 deg).
    assert any(event.text.endswith("connectivity 0.382") for event in events)

    states = flight.record.links.states  # type: ignore[union-attr]
    assert states is not None
    edge = flight.record.links.between(("sat1", "sat5"))  # type: ignore[union-attr]
    margins = states.margin[:, edge[0]]
    assert np.flatnonzero(margins < 0.0)[0] == first.step


def test_the_earth_and_a_lost_satellite_close_links_too() -> None:
    scenario = shipped(
        "radio_links_spread",
        "timing.duration=200.0",
        "graph={kind: matrix, rows: [[0,1,0,0,0],[0,0,0,0,0],[0,0,0,0,0],[0,0,0,0,0],[0,0,0,0,0]]}",
        "links.default.channel.power=1.0e9",
        "links.default.channel.line_of_sight_margin=800000.0",
    )
    links = simulate(scenario).links
    assert links is not None
    assert links.states is not None
    # The chief is 758 km high, so that all lines of sight are lower than the margin.
    assert links.states.blocked.all()
    assert not links.delivered.any()
    assert links.changes() == []
    record = simulate(scenario)
    assert LinkMargin(value=0.0, absolute=1.0, source="t").measure(record) == -math.inf
    mean = LinkMargin(statistic="mean", value=0.0, absolute=1.0, source="t")
    assert math.isnan(mean.measure(record))
    lost = shipped(
        "radio_links_spread",
        "timing.duration=200.0",
        "faults=[{kind: satellite_lost, satellite: sat3, at: 100.0}]",
    )
    record = simulate(lost)
    assert record.links is not None
    from_lost = np.flatnonzero(record.links.edges[:, 0] == 2)
    # Its message for the step of its loss was sent in the step before.
    assert record.links.sent[:11, from_lost].all()
    assert not record.links.sent[11:, from_lost].any()


def test_the_chart_of_what_was_delivered_is_that_of_the_expectation(flight: StoredRun) -> None:
    (chart,) = [
        chart for chart in graph_charts(flight, Unit("s", 1.0)) if chart.key == "delivered_connectivity"
    ]
    values = chart.lines[0].values
    assert len(values) == 23
    for which, expected in (("minimum", values.min()), ("mean", values.mean()), ("maximum", values.max())):
        figure = DeliveredConnectivity(statistic=which, window_length=60.0, below=9.0, source="t")
        assert figure.measure(flight.record) == pytest.approx(expected, abs=1e-12)
    part = DeliveredConnectivity(
        satellites=("sat1", "sat2"), window_length=60.0, before=60.0, below=9.0, source="t"
    )
    assert part.measure(flight.record) == pytest.approx(2.0)


def test_constant_links_have_a_history_too_and_a_bare_record_has_none() -> None:
    outage = "links.edges=[{sender: sat3, receiver: sat1, outages: [{begin: 300.0, end: 400.0}]}]"
    record = simulate(shipped("lossy_links", "timing.duration=400.0", outage))
    figure = DeliveredFraction(satellites=("sat1", "sat2"), value=0.7, absolute=0.05, source="t")
    # Of 800 messages with a loss of 0.3, four standard deviations are 0.065.
    assert figure.measure(record) == pytest.approx(0.7, abs=0.065)
    cut = DeliveredFraction(satellites=("sat1", "sat3"), after=300.0, before=400.0, below=0.9, source="t")
    # One direction is in the outage, and 100 messages go in the other: four standard deviations are 0.09.
    assert cut.measure(record) == pytest.approx(0.35, abs=0.09)
    bare = replace(record, link_source=None)
    assert math.isnan(figure.measure(bare))


def test_an_unplanned_change_of_the_graph_counts_in_the_figures() -> None:
    scenario = shipped("triangle", "timing.duration=50.0")
    pair = np.zeros((3, 3))
    pair[0, 1] = 1.0
    record = simulate(
        scenario,
        events={
            10: [TopologyChanged(Graph(np.zeros((3, 3))), "told to")],
            20: [TopologyChanged(Graph(pair), "told to")],
        },
    )
    assert record.steps > 20
    links = record.links
    assert links is not None
    each_step = links.delivered.sum(axis=1)
    assert each_step[:10].tolist() == [len(links.edges)] * 10
    assert each_step[10:20].tolist() == [0] * 10
    assert set(each_step[20:].tolist()) == {1}
    assert links.names_of(int(np.flatnonzero(links.delivered[20])[0])) == ("sat2", "sat1")
    least = DeliveredConnectivity(above=1.0, below=4.0, source="t")
    assert least.measure(record) == pytest.approx(0.0, abs=1e-12)


def test_an_edge_that_only_an_unplanned_change_brings_has_no_channel() -> None:
    pair = "graph={kind: matrix, rows: [[0,1,0,0,0],[0,0,0,0,0],[0,0,0,0,0],[0,0,0,0,0],[0,0,0,0,0]]}"
    scenario = shipped("radio_links_spread", "timing.duration=200.0", pair)
    added = np.zeros((5, 5))
    added[0, 2] = added[0, 1] = 1.0
    links = simulate(scenario, events={5: [TopologyChanged(Graph(added), "told to")]}).links
    assert links is not None
    assert links.states is not None
    assert [links.names_of(int(edge)) for edge in links.physical] == [("sat2", "sat1")]
    assert links.states.margin.shape[1] == 1
    new = [place for place in range(len(links.edges)) if links.names_of(place) == ("sat3", "sat1")]
    assert links.delivered[:, new].sum(axis=1).tolist() == [0] * 5 + [1] * (len(links.sent) - 5)


def test_no_history_of_links_is_computed_for_events_of_a_scenario_without_channels() -> None:
    scenario = shipped("lossy_links", "timing.duration=20.0")

    def never(_: object) -> LinkHistory:
        raise AssertionError("computed")

    record = replace(simulate(scenario), link_source=never)
    assert flight_events(StoredRun(Path("bag"), scenario, record, True, {}, None)) == []
