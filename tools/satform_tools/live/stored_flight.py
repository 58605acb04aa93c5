# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A stored flight as the live page shows it: a bag, a record, or a case of a campaign."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from satform.display.shapes import attitude_in_lvlh
from satform.evaluation.arc_lengths import arc_length_spread
from satform.flight.compile import scene_plan
from satform.numeric.elementwise import Array, Indices
from satform.plot.time_series import has_arc_length_spread
from satform_tools.live.formation import FormationView
from satform_tools.live.history import Column, History, Recent, rows_for
from satform_tools.live.link_losses import LOSS_WINDOW
from satform_tools.report.event_log import flight_events, graph_states
from satform_tools.report.page.content import status
from satform_tools.run.stored_run import StoredRun

ALIVE, LOST, STALE = 1.0, 0.0, 0.5
"""Health of a satellite as a number of the page."""


def columns(count: int, edges: int, *, attitudes: bool, losses: bool) -> dict[str, Column]:
    """What the live page shows over time.

    Args:
        count: of satellites.
        edges: that the page can draw.
        attitudes: whether there are satellites with attitude.
        losses: whether links lose messages.
    """
    return {
        "position": Column(3 * count),
        **({"attitude": Column(4 * count)} if attitudes else {}),
        **({"loss": Column(edges)} if losses else {}),
        "error": Column(count),
        "control": Column(count),
        "delta_v": Column(count),
        "health": Column(count),
        "age": Column(edges),
        "spread": Column(1),
        "connectivity": Column(1),
        "chief": Column(6, double=True),
    }


class StoredFlight:
    """A stored flight: all of its rows are there from the beginning, and nothing changes."""

    period = 1.0

    def __init__(self, stored: StoredRun) -> None:
        self._stored = stored
        self._view = FormationView(stored.scenario)
        self._verdicts = stored.verdicts()
        self._spreads = has_arc_length_spread(stored.scenario, stored.record)
        events = [{"time": entry.time, "text": entry.text} for entry in flight_events(stored)]
        self._states: list[dict[str, Any]] = [
            {
                "time": state.time,
                "alive": [bool(alive) for alive in state.alive],
                "pairs": [[int(row), int(column)] for row, column in np.argwhere(state.adjacency > 0.0)],
                "connectivity": state.connectivity,
            }
            for state in graph_states(stored)
        ]
        self.events, self.graphs = Recent(len(events), events), Recent(len(self._states), self._states)
        self.history = self._history()

    def formation(self) -> dict[str, Any]:
        """What does not change during the flight."""
        return {**self._view.description(), "agrees": self._spreads, "delta_v_note": ""}

    def status(self) -> dict[str, Any]:
        """The conclusion on the flight, which is over."""
        record = self._stored.record
        found = status(self._stored, self._verdicts)
        return {
            "phase": "stored",
            "step": record.steps,
            "time": record.steps * record.step,
            "over": True,
            "conclusion": {"kind": found.kind, "text": found.text},
        }

    def update(self) -> None:
        """Nothing is new."""

    def _history(self) -> History:
        record = self._stored.record
        count, edges = len(record.satellites), self._view.edges
        shown = min(rows_for(count) - 1, record.steps + 1)
        rows = np.unique(np.linspace(0, record.steps, shown).round().astype(np.int64))
        steps = np.minimum(rows, record.steps - 1)
        spread = arc_length_spread(record)[rows] if self._spreads else None
        age, loss = self._links(steps)
        values: dict[str, Array | None] = {
            "position": record.position[rows],
            "attitude": self._attitudes(rows),
            "error": record.tracking_error[steps],
            "control": np.linalg.norm(record.acceleration[steps], axis=-1),
            "delta_v": np.cumsum(record.effort, axis=0)[steps],
            "health": self._health(record.time[rows]),
            "age": age,
            "loss": loss,
            "spread": spread,
            "connectivity": self._connectivity(record.time[rows]),
            "chief": self._view.chief(record.time[rows]),
        }
        known = {name: array for name, array in values.items() if array is not None}
        kept = columns(count, len(edges), attitudes="attitude" in known, losses="loss" in known)
        found = History(kept, most=len(rows) + 1)
        for row, time in enumerate(record.time[rows].tolist()):
            found.append(time, {name: array[row] for name, array in known.items()})
        return found

    def _attitudes(self, rows: Indices) -> Array | None:
        record = self._stored.record
        if not record.mrp.size:
            return None
        found: Array = np.full((len(rows), len(record.satellites), 4), np.nan)
        for index, orbit in enumerate(scene_plan(self._stored.scenario).attitude_orbits):
            if orbit is not None:
                found[:, index] = attitude_in_lvlh(record.mrp[rows, index], orbit, record.time[rows])
        return found

    def _health(self, times: Array) -> Array:
        found: Array = np.full((len(times), len(self._view.names)), ALIVE)
        for state in self._states:
            found[times >= state["time"]] = np.where(state["alive"], ALIVE, LOST)
        return found

    def _connectivity(self, times: Array) -> Array:
        found = np.zeros(len(times))
        for state in self._states:
            found[times >= state["time"]] = state["connectivity"]
        return found

    def _links(self, steps: Indices) -> tuple[Array | None, Array | None]:
        """Age of the newest message in s, and part of the messages that was lost, by edge of the page."""
        stored, edges = self._stored, self._view.edges
        history = stored.record.links if stored.scenario.links is not None and edges else None
        if history is None or not len(history.edges):
            return None, None
        step = stored.record.step
        numbers = np.arange(len(history.delivered))[:, None]
        last = np.maximum.accumulate(np.where(history.delivered, numbers, -1), axis=0)
        ages = np.where(last >= 0, (numbers - last) * step, np.nan)
        window = max(1, round(LOSS_WINDOW / step))
        sent, arrived = (_within(flags, window) for flags in (history.sent, history.delivered & history.sent))
        losses = np.where(sent > 0, 1.0 - arrived / np.maximum(sent, 1), np.nan)
        age: Array = np.full((len(steps), len(edges)), np.nan)
        loss: Array = np.full((len(steps), len(edges)), np.nan)
        place = {edge: index for index, edge in enumerate(edges)}
        for column, (sender, receiver) in enumerate(history.edges.tolist()):
            index = place.get((receiver, sender))
            if index is not None:
                age[:, index], loss[:, index] = ages[steps, column], losses[steps, column]
        return age, loss


def _within(flags: NDArray[np.bool_], window: int) -> Array:
    """How many of the last steps up to each one have a flag, by column."""
    total = np.cumsum(flags, axis=0, dtype=np.float64)
    found: Array = total.copy()
    found[window:] -= total[:-window]
    return found
