# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Links that lose, delay, repeat and reorder messages between satellites, in simulated time.

Every directed edge of the communication graph is a link of its own. What happens to a message is a
pure function of the run's seed, the edge and the step in which the message was sent, and it is applied
where the message is received: so the same run has the same losses in one process and over DDS.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from satform.common.spec import Complaint, FieldPath, NonNegative, Spec
from satform.common.time_window import Window
from satform.communication.neighbour_buffer import Received
from satform.communication.physical_links import (
    LONGEST_LIGHT_TIME,
    LinkConditions,
    LinkMedium,
    Physical,
)
from satform.equipment.random_streams import LINK_STREAM
from satform.numeric.elementwise import Array, Indices
from satform.numeric.seeded_numbers import SeededUniforms

LONGEST_WAY = 10_000
"""Steps that a message may take at most."""

_DRAWS = 4
"""Random numbers for each message: lost, late, repeated, overtaken."""

_SLACK = 1e-9
"""Of a step, by which a delay may exceed whole steps and still count as whole."""

Probability = Annotated[float, Field(ge=0.0, le=1.0)]


class LinkSpec(Spec):
    """What one directed link does to the messages on it."""

    loss: Probability = 0.0
    """Probability that a message never arrives."""
    delay: NonNegative = 0.0
    """Latency of every message, s; it is received at the first step after that time."""
    jitter: NonNegative = 0.0
    """Largest additional time, evenly spread between nothing and this, s."""
    duplication: Probability = 0.0
    """Probability that a message arrives a second time, a step after the first."""
    reordering: Probability = 0.0
    """Probability that a message takes two steps longer, so that later ones overtake it."""
    period: NonNegative = 0.0
    """Time between two messages that are sent at all, s; every step when zero."""
    outages: tuple[Window, ...] = ()
    """Stretches of time in which whatever is sent is lost."""
    channel: Physical | None = None
    """Radio or optical link by whose budget messages are lost and delayed, in addition to all the above."""


class EdgeSpec(LinkSpec):
    """One directed link; what it leaves out is taken from the default."""

    sender: str
    """Name of the satellite that sends over this link."""
    receiver: str
    """Name of the satellite that receives."""


class LinksSpec(Spec):
    """What links do to messages: all alike, or some of them in their own way."""

    default: LinkSpec = LinkSpec()
    """Of every link that is not named."""
    edges: tuple[EdgeSpec, ...] = ()
    """Links with something of their own."""

    def of(self, sender: str, receiver: str) -> LinkSpec:
        """The link between two satellites, with what it left out filled in."""
        for edge in self.edges:
            if (edge.sender, edge.receiver) == (sender, receiver):
                own = {
                    name: getattr(edge, name) for name in edge.model_fields_set & set(LinkSpec.model_fields)
                }
                return self.default.model_copy(update=own)
        return self.default

    @property
    def physical(self) -> bool:
        """Whether a link is a radio or an optical one."""
        return any(link.channel is not None for link in (self.default, *self.edges))

    def medium(self, edges: Sequence[tuple[int, int]], names: Sequence[str]) -> LinkMedium | None:
        """Those links that are radio or optical ones; None where there are none.

        Args:
            edges: indices of sender and receiver of each link that is used.
            names: of all satellites.
        """
        found = [(edge, self.of(names[edge[0]], names[edge[1]]).channel) for edge in edges]
        physical = [(edge, channel) for edge, channel in found if channel is not None]
        if not physical:
            return None
        return LinkMedium([edge for edge, _ in physical], [own for _, own in physical], len(names))

    def complaints(self, satellites: Sequence[str], step: float) -> list[Complaint]:
        """What of this cannot be, in a formation with these satellites and this control period in s."""
        found: list[Complaint] = []
        seen: set[tuple[str, str]] = set()
        every: list[tuple[FieldPath, LinkSpec]] = [(("default",), self.default)]
        every += [(("edges", i), self.of(edge.sender, edge.receiver)) for i, edge in enumerate(self.edges)]
        for path, link in every:
            if (link.delay + link.jitter) / step > LONGEST_WAY:
                sentence = (
                    f"delay and jitter make {link.delay + link.jitter:g} s, which is more than {LONGEST_WAY} "
                    f"steps of {step:g} s"
                )
                found.append((path, sentence))
        for index, edge in enumerate(self.edges):
            for name in (edge.sender, edge.receiver):
                if name not in satellites:
                    sentence = f"there is no satellite {name}; there are {', '.join(sorted(satellites))}"
                    found.append((("edges", index), sentence))
            if edge.sender == edge.receiver:
                found.append((("edges", index), f"{edge.sender} has no link to itself"))
            if (edge.sender, edge.receiver) in seen:
                sentence = f"the link from {edge.sender} to {edge.receiver} is described twice"
                found.append((("edges", index), sentence))
            seen.add((edge.sender, edge.receiver))
        return found


class ChannelModel:
    """The incoming links of one satellite, or of many satellites that fly as one."""

    def __init__(
        self, links: Sequence[LinkSpec], draws: SeededUniforms | None, step: float, shape: tuple[int, ...]
    ) -> None:
        """Links with nothing on its way.

        Args:
            links: what each of them does.
            draws: random numbers of the same links; None where there are no links.
            step: control period, s.
            shape: of the satellites and their possible neighbours, (..., K), with one link for each.
        """
        self._links = tuple(links)
        self._shape = shape
        self._step = step
        self._loss = np.array([link.loss for link in links])
        self._delay = np.array([link.delay for link in links]) / step
        self._jitter = np.array([link.jitter for link in links]) / step
        self._duplication = np.array([link.duplication for link in links])
        self._reordering = np.array([link.reordering for link in links])
        self._every = np.array([max(1, round(link.period / step)) for link in links], dtype=np.int64)
        outages = [(index, *window.bounds) for index, link in enumerate(links) for window in link.outages]
        self._cut_links = np.array([index for index, _, _ in outages], dtype=np.int64)
        self._cut_from = np.array([begin for _, begin, _ in outages])
        self._cut_until = np.array([end for _, _, end in outages])
        self._draws = draws
        longest = float(np.max(self._delay + self._jitter, initial=0.0))
        physical = any(link.channel is not None and link.channel.light_time for link in links)
        self._depth = math.ceil(longest) + (math.ceil(LONGEST_LIGHT_TIME / step) + 1 if physical else 0) + 4
        self.forget()

    @classmethod
    def of(
        cls,
        spec: LinksSpec,
        edges: Sequence[tuple[int, int]],
        names: Sequence[str],
        setting: tuple[float, int],
        shape: tuple[int, ...],
    ) -> "ChannelModel":
        """The links of satellites of one run.

        Args:
            spec: from the scenario.
            edges: indices of sender and receiver of each link, row by row.
            names: of all satellites.
            setting: control period in s, and seed of the run.
            shape: of the satellites and their possible neighbours, (..., K), with one edge for each.
        """
        step, seed = setting
        draws = _draws_of(seed, edges, len(names)) if edges else None
        return cls(
            [spec.of(names[sender], names[receiver]) for sender, receiver in edges], draws, step, shape
        )

    @classmethod
    def stacked(cls, runs: "Sequence[ChannelModel]") -> "ChannelModel":
        """The links of many runs, one after another, with nothing on its way.

        Args:
            runs: of alike satellites, shape (n, K) each.
        """
        first = runs[0]
        links = [link for run in runs for link in run._links]
        draws = [run._draws for run in runs if run._draws is not None]
        shape = (len(runs) * first._shape[0], *first._shape[1:])
        if not draws:
            return cls(links, None, first._step, shape)
        seeds = [seed for own in draws for seed in own.seeds]
        numbers = [number for own in draws for number in own.satellites]
        return cls(links, SeededUniforms(seeds, LINK_STREAM, numbers, _DRAWS), first._step, shape)

    def keep(self, rows: Indices) -> "ChannelModel":
        """A model of the links to some of the receiving satellites alone, with their messages under way.

        It takes the place of this one, whose random numbers it goes on with.

        Args:
            rows: indices of these satellites, shape (M,).
        """
        width = self._shape[-1]
        edges = (rows[:, None] * width + np.arange(width)).ravel()
        draws = None if self._draws is None else self._draws.keep(edges)
        kept = ChannelModel(
            [self._links[edge] for edge in edges.tolist()],
            draws,
            self._step,
            (len(rows), width),
        )
        # A message is in the slot of its step modulo the depth; fewer links might need fewer slots.
        kept._depth = self._depth
        kept._messages = self._messages[:, edges]
        kept._newest = self._newest[edges]
        kept._stamps = self._stamps[:, edges]
        kept._values = self._values[:, edges]
        return kept

    def forget(self) -> None:
        """Lose all that is on its way, as a satellite does that is lost itself."""
        edges = len(self._loss)
        self._messages = np.full((self._depth, edges), -1, dtype=np.int64)
        self._newest = np.full(edges, -1, dtype=np.int64)
        self._stamps = np.zeros((self._depth, edges))
        self._values = np.zeros((self._depth, edges, 0))

    def transmit(self, step: int, received: Received, conditions: LinkConditions | None = None) -> Received:
        """What arrives in a step.

        Args:
            step: its number.
            received: what neighbours send for this step.
            conditions: loss and light time of each link in this step; None where no link is physical.

        Returns:
            What comes out of the links: in this step and of this or earlier steps, the newest where
            several arrive at once, and nothing that is older than what has arrived before.
        """
        if self._draws is None:
            return received
        values = received.values.reshape(len(self._loss), -1)
        if self._values.shape[-1] != values.shape[-1]:
            self._values = np.zeros((*self._messages.shape, values.shape[-1]))
        self._send(step, received, values, conditions)
        slot = step % self._depth
        arrived = self._messages[slot] > self._newest
        self._newest = np.where(arrived, self._messages[slot], self._newest)
        self._messages[slot] = -1
        return Received(
            values=self._values[slot].reshape(received.values.shape).copy(),
            stamp=self._stamps[slot].reshape(self._shape).copy(),
            fresh=arrived.astype(np.float64).reshape(self._shape) * received.linked,
            linked=received.linked,
            complete=False,
        )

    def _send(self, step: int, received: Received, values: Array, conditions: LinkConditions | None) -> None:
        assert self._draws is not None  # noqa: S101 - only called where there are links
        lost, late, repeated, overtaken = self._draws.at(step).T
        loss, delay = self._loss, self._delay
        if conditions is not None:
            loss = combined_loss(loss, conditions.loss.reshape(-1))
            delay = delay + conditions.light_time.reshape(-1) / self._step
        sent = (received.fresh.reshape(-1) > 0.0) & (lost >= loss) & (step % self._every == 0)
        time = step * self._step
        if self._cut_links.size:
            sent[self._cut_links[(self._cut_from <= time) & (time < self._cut_until)]] = False
        way = np.ceil(delay + late * self._jitter - _SLACK).astype(np.int64)
        way += np.where(overtaken < self._reordering, 2, 0)
        stamps = received.stamp.reshape(-1)
        self._put(step, sent, way, values, stamps)
        again = sent & (repeated < self._duplication)
        if again.any():
            self._put(step, again, way + 1, values, stamps)

    def _put(self, step: int, sent: NDArray[np.bool_], way: Indices, values: Array, stamps: Array) -> None:
        """Lay messages where they will be found when they arrive, in place of earlier ones."""
        edges = np.flatnonzero(sent)
        slots = (step + way[edges]) % self._depth
        self._messages[slots, edges] = step
        self._values[slots, edges] = values[edges]
        self._stamps[slots, edges] = stamps[edges]


def _draws_of(seed: int, edges: Iterable[Sequence[int]], count: int) -> SeededUniforms:
    """Random numbers of the links between satellites, each from sender to receiver."""
    numbers = [receiver * count + sender for sender, receiver in edges]
    return SeededUniforms(seed, LINK_STREAM, numbers, _DRAWS)


def loss_draws(seed: int, edges: Indices, count: int, steps: int, first: int = 0) -> Array:
    """The random numbers in [0, 1) below whose loss probability a message is lost, shape (steps, E).

    Args:
        seed: of the run.
        edges: indices of sender and receiver of each link, shape (E, 2).
        count: number of satellites.
        steps: how many.
        first: of them.
    """
    draws = _draws_of(seed, edges.tolist(), count)
    found = np.empty((steps, len(edges)))
    for step in range(steps if len(edges) else 0):
        found[step] = draws.at(first + step)[:, 0]
    return found


def combined_loss(constant: Array, physical: Array) -> Array:
    """Probability that one of two independent causes loses a message.

    Args:
        constant: by the constant probability of the link, shape (...).
        physical: by its radio or optical channel, shape (...).
    """
    return np.asarray(constant + (1.0 - constant) * physical)
