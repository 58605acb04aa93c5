# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Metrics of other packages, which measure whole records or have a reducer, and the rows that they get."""

import math

import numpy as np
import pytest

from figure_reductions import greatest, least, length
from random_flights import blocks, expectation_of, flights, shape
from satform.control.sampled_stability import SampledLoop
from satform.evaluation.evaluate import figures_of
from satform.evaluation.flight_figures import FlightFigures
from satform.evaluation.loops import SpectralRadius
from satform.evaluation.reducers import ExtremeOf
from satform.evaluation.tracking import Distance, TrackingError, TrackingErrorAt
from satform.record.flight_record import FlightRecord
from satform.record.reducer import FlightShape, Reducer
from satform.record.stretch import rows_of
from satform.scenario.expectation import ComputedFrom, Loops
from satform.scenario.windowed_expectation import OverWindow

RADIUS = SpectralRadius(below=1.0, source="none")


class MeanSpeed(OverWindow):
    """A metric of one's own that measures whole records."""

    kind: str = "mean_speed"

    def measure(self, record: FlightRecord) -> float:
        return float(np.mean(np.linalg.norm(self.window(record.velocity, record), axis=-1)))


class TrackingSquared(TrackingError):  # noqa: N818 - the figure is called an error
    """A metric of one's own that changes what a kind of the project measures."""

    def measure(self, record: FlightRecord) -> float:
        return super().measure(record) ** 2


class FromReducer(TrackingSquared):
    """One that has a reducer again."""

    def reducer(self, flight: FlightShape) -> Reducer:
        return ExtremeOf(self.stretch(flight, flight.steps), "control")


def test_a_metric_that_measures_whole_records_has_no_reducer_and_the_figures_say_so() -> None:
    flown = flights(np.random.default_rng(1), runs=2)
    expectations = [MeanSpeed(below=9.0, source="none"), TrackingSquared(below=9.0, source="none")]
    assert [own.computed_from for own in expectations] == [ComputedFrom.RECORD, ComputedFrom.RECORD]
    assert expectations[0].reducer(shape(flown[0])) is None
    assert all(math.isfinite(own.measure(flown[0].record)) for own in expectations)
    figures = FlightFigures([*expectations, FromReducer(below=9.0, source="none"), RADIUS], shape(flown[0]))
    assert (figures.whole_records, figures.of_loops) == ((0, 1), (3,))
    for block in blocks(flown, [], figures.needs):
        figures.update(block)
    found = figures.figures()
    assert np.isnan(found[[0, 1, 3]]).all()
    assert found[2].tolist() == [float(length(flight.arrays["acceleration"]).max()) for flight in flown]


def test_a_kind_without_a_figure_is_named() -> None:
    flight = flights(np.random.default_rng(1), runs=1)[0]
    with pytest.raises(NotImplementedError, match="OverWindow defines neither reducer nor measure"):
        OverWindow(below=0.0, source="none").measure(flight.record)


def test_the_figure_of_loops_needs_no_flight() -> None:
    loops = [SampledLoop("tracking", ("a",), 0.5, "law"), SampledLoop("tracking", ("b",), 0.9, "law")]
    assert RADIUS.figure_of_loops(("a", "b"), lambda: loops) == 0.9
    assert math.isnan(TrackingError(below=1.0, source="none").figure_of_loops(("a", "b"), lambda: loops))


class Margin(SpectralRadius):
    """A metric of one's own of loops, by their figure and not by `figure_of_loops`."""

    def figure(self, record: FlightRecord, loops: Loops | None) -> float:
        return 1.0 - super().figure(record, loops)


class OwnLoops(OverWindow):
    """One that is of loops and has none of the kinds' own figures."""

    of_loops = True

    def measure(self, record: FlightRecord) -> float:
        return 2.0


def test_a_metric_of_loops_that_changes_the_figure_takes_whole_records() -> None:
    flight = flights(np.random.default_rng(1), runs=1)[0]
    expectations = [Margin(below=1.0, source="none"), RADIUS, OwnLoops(below=1.0, source="none")]
    figures = FlightFigures(expectations, shape(flight))
    assert (figures.whole_records, figures.of_loops) == ((0, 2), (1,))
    loops = [SampledLoop("tracking", flight.record.satellites, 0.75, "law")]
    assert figures_of(expectations, flight.record, lambda: loops) == [0.25, 0.75, 2.0]


class Doubled:
    """A part of metrics that is no metric itself."""

    def measure(self, record: FlightRecord) -> float:
        return 2.0


class DoubledTracking(Doubled, TrackingError):  # noqa: N818 - the figure is called an error
    """A metric of one's own with a figure from a class of another kind."""


def test_what_a_figure_is_computed_from_is_known_of_every_kind() -> None:
    kinds = (TrackingError, FromReducer, SpectralRadius, Margin, OwnLoops, DoubledTracking)
    blocks_, loops, record = ComputedFrom.BLOCKS, ComputedFrom.LOOPS, ComputedFrom.RECORD
    assert [kind.computed_from for kind in kinds] == [blocks_, blocks_, loops, record, record, record]


@pytest.mark.parametrize("seed", range(10))
def test_rows_for_a_metric_of_one_s_own_are_those_of_the_figures(seed: int) -> None:
    rng = np.random.default_rng(seed)
    flight = flights(rng, runs=1)[0]
    record = flight.record
    window = expectation_of("tracking_error", rng, flight)
    assert isinstance(window, OverWindow)
    assert same(greatest(window.window(record.tracking_error, record)), window.measure(record))
    pointing = expectation_of("pointing_error", rng, flight)
    assert isinstance(pointing, OverWindow)
    if len(record.pointing_error):
        rows = pointing.window(record.pointing_error, record, of_others=True)
        assert same(greatest(rows), pointing.measure(record))
    pair = expectation_of("distance", rng, flight)
    assert isinstance(pair, Distance)
    apart = pair.window(record.position, record, of_bodies=True)
    expected = {"minimum": least, "maximum": greatest}[pair.statistic](length(apart[:, 0] - apart[:, 1]))
    assert same(expected, pair.measure(record))
    moment = expectation_of("tracking_error_at", rng, flight)
    assert isinstance(moment, TrackingErrorAt)
    instant = moment.instant(shape(flight), record.steps, moment.satellites)
    row = rows_of(record.tracking_error, record, instant)
    assert same(greatest(row), moment.measure(record))


def same(one: float, other: float) -> bool:
    return one == other or (math.isnan(one) and math.isnan(other))
