# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of links: connectivity of what was delivered, part of the messages that arrived, link margins."""

import math
from collections.abc import Callable
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from satform.common.spec import Positive
from satform.numeric.elementwise import Array
from satform.record.flight_record import FlightRecord
from satform.record.link_history import LinkHistory
from satform.record.stretch import TIME_SLACK, rows_within
from satform.scenario.expectation import Edges
from satform.scenario.parts import Timing
from satform.scenario.windowed_expectation import OverWindow

Statistic = Literal["minimum", "mean", "maximum"]
_STATISTICS: dict[Statistic, Callable[[Array], Any]] = {"minimum": np.min, "mean": np.mean, "maximum": np.max}


class _OfLinks(OverWindow):
    """An expectation of links over a stretch of the flight."""

    satellites: Annotated[tuple[str, ...], Field(min_length=2)] | None = None
    """Names of the satellites; links between any two of them are meant. All when left out."""

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        own = super().complaints(satellites, timing)
        if len(satellites) < 2:
            own.append("there are no links: there is one satellite")
        return own

    def between(self, edges: Edges) -> list[bool]:
        """Of each edge between satellites that are meant, whether it is a radio or optical link."""
        return [
            physical
            for sender, receiver, physical in edges()
            if self.satellites is None or {sender, receiver} <= set(self.satellites)
        ]

    def rows(self, record: FlightRecord) -> slice:
        """The steps of the stretch; none where the flight ends before."""
        first, end = rows_within(self.after, self.before, record.step, record.steps, held=True)
        if self.before is not None and self.before > record.steps * record.step * (1.0 + 1e-9):
            return slice(0, 0)
        return slice(first, end)


class DeliveredConnectivity(_OfLinks):
    """Algebraic connectivity of the graph of the links that delivered a message.

    The stretch is divided into windows; an edge counts in a window if it delivered at least one message of
    it, and if both its satellites are meant. Of a directed graph it is the second smallest real part of the
    Laplacian's eigenvalues. The topology is that of the flight; a satellite that does not fly is isolated.
    """

    figure_name = "{0.statistic} connectivity of what was delivered"
    kind: Literal["delivered_connectivity"] = "delivered_connectivity"
    statistic: Statistic = "minimum"
    """Of all windows."""
    window_length: Positive | None = None
    """Length of a window, s; one step when left out."""

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        own = super().complaints(satellites, timing)
        length = (timing.duration if self.before is None else self.before) - self.after
        if not own and self.window_length is not None and self.window_length > length * (1.0 + TIME_SLACK):
            own.append(f"window_length {self.window_length:g} s is longer than the stretch of {length:g} s")
        return own

    def measure(self, record: FlightRecord) -> float:
        links, rows = record.links, self.rows(record)
        steps = 1 if self.window_length is None else max(1, round(self.window_length / record.step))
        if links is None or rows.stop - rows.start < steps:
            return math.nan
        _, found = links.connectivity(steps, rows.start, rows.stop, self.satellites)
        return float(_STATISTICS[self.statistic](found))


class DeliveredFraction(_OfLinks):
    """Messages that were delivered, of those that were sent."""

    figure_name = "delivered part of the messages"
    kind: Literal["delivered_fraction"] = "delivered_fraction"

    def link_complaints(self, edges: Edges) -> list[str]:
        return [] if self.between(edges) else ["the graph has no edge between the satellites that are meant"]

    def measure(self, record: FlightRecord) -> float:
        links, rows = record.links, self.rows(record)
        if links is None:
            return math.nan
        meant = links.between(self.satellites)
        sent = int(links.sent[rows][:, meant].sum())
        return int(links.delivered[rows][:, meant].sum()) / sent if sent else math.nan


class LinkMargin(_OfLinks):
    """Margin of radio and optical links above the required bit error rate, in dB.

    A link that is blocked by the Earth, or without gain in the direction of the other satellite, has a margin
    of minus infinity. It is the minimum then, which counts as missed. Mean and maximum are those of the other
    links and steps; there is no figure where there are none.
    """

    unit = "dB"
    figure_name = "{0.statistic} link margin"
    kind: Literal["link_margin"] = "link_margin"
    statistic: Statistic = "minimum"
    """Of all links and steps that are meant."""

    def link_complaints(self, edges: Edges) -> list[str]:
        if any(self.between(edges)):
            return []
        return ["no edge of the graph between the satellites that are meant has a radio or optical channel"]

    def measure(self, record: FlightRecord) -> float:
        links, rows = record.links, self.rows(record)
        if links is None or links.states is None:
            return math.nan
        margins = links.states.margin[rows][:, _physical(links, self.satellites)]
        if self.statistic != "minimum":
            margins = margins[margins > -np.inf]
        return float(_STATISTICS[self.statistic](margins)) if margins.size else math.nan


def _physical(links: LinkHistory, satellites: tuple[str, ...] | None) -> NDArray[np.bool_]:
    """Which of the physical links are between satellites that are meant, shape (P,)."""
    return np.isin(links.physical, links.between(satellites))
