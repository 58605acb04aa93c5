# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Navigation of one satellite on the readings of its sensors: prediction, fusion, update, gaps.

A step of the flight software is: predict from the step before with the accelerations that are known; fuse the
estimates of neighbours that have arrived; update with the readings that have arrived. Readings that arrive
late are worked in at the step at which they were taken: the memory holds the filter at the last step of which
every reading has arrived, and goes from there to now.

The filter of satellites with `sensor` and `filter` instead of `sensors` and `navigation` is in
`relative_state_filter`.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from satform.consensus.graph import Graph
from satform.equipment.random_streams import FILTER_STREAM
from satform.equipment.sensors.protocol import SensorChannel
from satform.navigation.estimate import GaussianEstimate
from satform.navigation.information_fusion import (
    FusionRule,
    NeighbourEstimate,
    fused,
    metropolis_weights,
    propagated,
)
from satform.navigation.joint_state import (
    SIZE,
    JointMeasurement,
    JointModel,
    JointStep,
    from_upper_triangle,
    upper_triangle,
)
from satform.navigation.protocol import Filter
from satform.numeric.elementwise import Array
from satform.numeric.seeded_numbers import SeededNormals


@dataclass(frozen=True)
class NavigationInput:
    """What the navigation of a satellite gets in a step.

    Attributes:
        readings: that have arrived, of all channels, not a number where none has, shape (W,).
        estimates: that have arrived from neighbours, as `SatelliteNavigation.message` makes them, each with
            the index of its sender in front, shape (K, 1 + width).
        graph: of communication in this step.
    """

    readings: Array
    estimates: Array
    graph: Graph


@dataclass(frozen=True)
class NavigationMemory:
    """What the navigation of a satellite remembers from one step to the next.

    Attributes:
        filter: memory of the filter at the last step of which all readings have arrived.
        step: number of that step; -1 before the first.
        now: number of the step of the estimate.
        readings: taken at the last L + 1 steps up to now, as far as they have arrived, shape (L + 1, W).
        acceleration: own, over the period before each of these steps, not a number where it is not known,
            m/s^2, shape (L + 1, 3).
        mean: estimated now, shape (D,).
        covariance_of_all: of the error of the mean, shape (D, D).
        own: index of the satellite itself among those in the state.
        innovation: normalised innovation squared of the newest readings divided by their number, times the 6
            numbers of a measured motion, so that its mean is 6 for a consistent filter, shape (); 0 at first.
        rejected: readings that were rejected, none, shape ().
    """

    filter: Any
    step: int
    now: int
    readings: Array
    acceleration: Array
    mean: Array
    covariance_of_all: Array
    own: int
    innovation: Array
    rejected: Array

    @property
    def state(self) -> Array:
        """Own position and velocity, shape (6,)."""
        return self.mean[SIZE * self.own : SIZE * (self.own + 1)]

    @property
    def covariance(self) -> Array:
        """Of the error of the own position and velocity, shape (6, 6)."""
        block = slice(SIZE * self.own, SIZE * (self.own + 1))
        return self.covariance_of_all[block, block]


@dataclass(frozen=True, eq=False)
class SatelliteNavigation:
    """Navigation filter of one satellite with its sensors.

    Attributes:
        satellite: its index.
        members: indices of the satellites whose motion is estimated, ascending.
        channels: of its sensors, in order.
        filter: that estimates.
        model: of the motion.
        prior: what is known at step 0.
        exchange: how estimates of neighbours are used; None where there are none.
        seed: of the run.
    """

    satellite: int
    members: tuple[int, ...]
    channels: tuple[SensorChannel, ...]
    filter: Filter[Any]
    model: JointModel
    prior: GaussianEstimate
    exchange: FusionRule | None
    seed: int

    @property
    def own(self) -> int:
        """Index of the satellite itself among those in the state."""
        return self.members.index(self.satellite)

    @property
    def latency(self) -> int:
        """Of the slowest channel, steps."""
        return max((channel.timing.latency for channel in self.channels), default=0)

    @property
    def message_width(self) -> int:
        """Numbers of the estimate in a message to neighbours; 0 where none is exchanged."""
        return 0 if self.exchange is None else message_width(len(self.prior.mean))

    def start(self, step: int = 0) -> NavigationMemory:
        """The memory before the first step, of the flight or of a satellite that begins again from its plan.

        What is known is the motion at step 0, carried on to the step before without known accelerations.

        Args:
            step: number of that first step.
        """
        rows, none = self.latency + 1, np.zeros(())
        width = sum(channel.width for channel in self.channels)
        present = self.filter.start(self.prior, self._draws(0))
        for over in self._unknown(0, step - 1):
            present = self._predicted(present, step - 1, over)
        estimate = self.filter.estimate(present)
        return NavigationMemory(
            filter=present,
            step=step - 1,
            now=step - 1,
            readings=np.full((rows, width), np.nan),
            acceleration=np.full((rows, 3), np.nan),
            mean=estimate.mean,
            covariance_of_all=estimate.covariance,
            own=self.own,
            innovation=none,
            rejected=none,
        )

    def observe(
        self, memory: NavigationMemory, inputs: NavigationInput, applied: Array | None
    ) -> NavigationMemory:
        """The memory one step later.

        Args:
            memory: of the step before.
            inputs: what arrives in this step.
            applied: own acceleration since the step before, m/s^2, shape (3,); None where it is not known, as
                at the first step.
        """
        now = memory.now + 1
        readings = np.concatenate((memory.readings[1:], np.full((1, memory.readings.shape[1]), np.nan)))
        self._sort_in(readings, inputs.readings)
        last = np.full(3, np.nan) if applied is None else applied
        acceleration = np.concatenate((memory.acceleration[1:], last[None]))
        present, anchor, anchor_step = memory.filter, memory.filter, memory.step
        squared, numbers, steps = np.zeros(()), 0, range(now - self.latency, now + 1)
        for row, step in enumerate(steps):
            if step <= memory.step or step < 0:
                continue
            if step > 0:
                over = self._joint_step(step, acceleration[row], inputs.estimates)
                present = self._predicted(present, step, over)
                present = self._with_neighbours(present, (step, over), inputs)
            present, squared_here, numbers_here = self._updated(present, step, readings[row])
            if numbers_here:
                squared, numbers = squared_here, numbers_here
            if row == 0:
                anchor, anchor_step = present, step
        estimate = self.filter.estimate(present)
        return replace(
            memory,
            filter=anchor,
            step=anchor_step,
            now=now,
            readings=readings,
            acceleration=acceleration,
            mean=estimate.mean,
            covariance_of_all=estimate.covariance,
            innovation=SIZE * squared / numbers if numbers else memory.innovation,
        )

    def resume(
        self, memory: NavigationMemory, missed: int, commanded: Array, applied: Array
    ) -> NavigationMemory:
        """The memory after steps without the flight software, up to the step before the next one.

        Readings of these steps, and those that were on their way, are lost; the covariance grows.

        Args:
            memory: of the last step before the gap.
            missed: steps in the gap, at least 1.
            commanded: held from that last step on, m/s^2, shape (3,).
            applied: in each step of the gap, m/s^2, shape (3,).
        """
        present, nothing = memory.filter, np.zeros((0, 0))
        for row, step in enumerate(range(memory.now - self.latency, memory.now + 1)):
            if step > memory.step:
                if step > 0:
                    over = self._joint_step(step, memory.acceleration[row], nothing)
                    present = self._predicted(present, step, over)
                present, _, _ = self._updated(present, step, memory.readings[row])
        last = memory.now + missed
        step = memory.now + 1
        present = self._predicted(present, step, self._joint_step(step, commanded, nothing))
        if missed > 1:
            over = self.model.across(step, missed - 1, *self._of_own(applied))
            present = self._predicted(present, last, over)
        estimate = self.filter.estimate(present)
        return replace(
            memory,
            filter=present,
            step=last,
            now=last,
            readings=np.full_like(memory.readings, np.nan),
            acceleration=np.zeros_like(memory.acceleration),
            mean=estimate.mean,
            covariance_of_all=estimate.covariance,
        )

    def message(self, memory: NavigationMemory | None, commanded: Array | None) -> Array:
        """Numbers of the estimate that neighbours get with the phase of the next step.

        Args:
            memory: of the present step; None before the first one.
            commanded: from this step on, m/s^2, shape (3,); likewise.

        Returns:
            Number of the step of the estimate, its mean, upper triangle of its covariance, acceleration,
            shape (width,); zeros where there is none yet.
        """
        if memory is None or commanded is None:
            return np.zeros(message_width(len(self.prior.mean)))
        covariance = upper_triangle(memory.covariance_of_all)
        return np.concatenate(([float(memory.now)], memory.mean, covariance, commanded))

    @cached_property
    def _numbers(self) -> SeededNormals:
        return SeededNormals(self.seed, FILTER_STREAM, [self.satellite], max(1, self.filter.draws))

    @cached_property
    def _parts(self) -> list[tuple[SensorChannel, slice]]:
        """The channels with the columns of their readings."""
        found, begin = [], 0
        for channel in self.channels:
            found.append((channel, slice(begin, begin + channel.width)))
            begin += channel.width
        return found

    def _draws(self, step: int) -> Array:
        drawn: Array = self._numbers.at(step)[0]
        return drawn

    def _sort_in(self, readings: Array, arrived: Array) -> None:
        """Put what has arrived into the rows of the steps at which it was taken."""
        for channel, columns in self._parts:
            readings[self.latency - channel.timing.latency, columns] = arrived[columns]

    def _joint_step(self, step: int, acceleration: Array, received: Array) -> JointStep:
        """The model from the step before to a step, with the accelerations that are known."""
        applied, known = self._of_own(acceleration)
        for message in received:
            sender = int(message[0])
            if sender in self.members and int(message[1]) == step - 1:
                row = self.members.index(sender)
                applied[row], known[row] = message[-3:], True
        applied[self.own], known[self.own] = acceleration, bool(np.isfinite(acceleration).all())
        return self.model.over(step - 1, applied, known)

    def _of_own(self, acceleration: Array) -> tuple[Array, list[bool]]:
        """Accelerations of all satellites and whether they are known, when only the own one is."""
        applied, known = np.zeros((len(self.members), 3)), [False] * len(self.members)
        applied[self.own], known[self.own] = acceleration, bool(np.isfinite(acceleration).all())
        return applied, known

    def _predicted(self, present: Any, step: int, over: JointStep) -> Any:
        return self.filter.predict(present, over.transition, over.increment, over.process, self._draws(step))

    def _updated(self, present: Any, step: int, readings: Array) -> tuple[Any, Array, int]:
        """The filter's memory with the readings of a step, their innovation squared, and their number."""
        models, targets, numbers = [], [], []
        for channel, columns in self._parts:
            model = channel.model
            if model is None or not np.isfinite(readings[columns]).all():
                continue
            models.append(model)
            targets.append(self.own if model.target is None else self.members.index(model.target))
            numbers.append(readings[columns])
        if not models:
            return present, np.zeros(()), 0
        function = JointMeasurement.of(models, self.own, targets, numbers)
        measured = np.concatenate(numbers)
        present, squared = self.filter.update(present, measured, function, self._draws(step))
        return present, squared, len(measured)

    def _with_neighbours(self, present: Any, now: tuple[int, JointStep], inputs: NavigationInput) -> Any:
        """The filter's memory with the estimates of neighbours, each propagated to the present step.

        Args:
            present: the filter's memory, predicted.
            now: number of the step, and the model from the step before.
            inputs: with the estimates and the graph.
        """
        step, over = now
        size, found = len(self.prior.mean), []
        for message in inputs.estimates:
            sender, made = int(message[0]), int(message[1])
            mean, covariance = message[2 : 2 + size], message[2 + size : -3]
            if covariance[0] > 0.0 and made < step:
                estimate = GaussianEstimate(mean, from_upper_triangle(covariance, size))
                # The accelerations of a period that lies back were in messages that are not kept.
                steps = [*self._unknown(made, step - 1), over]
                found.append(NeighbourEstimate(sender, propagated(estimate, steps)))
        if not found or self.exchange is None:
            return present
        weights = metropolis_weights(inputs.graph)[self.satellite]
        estimate = fused(self.exchange, self.filter.estimate(present), found, weights)
        return self.filter.replaced(present, estimate, self._draws(step))

    def _unknown(self, first: int, last: int) -> list[JointStep]:
        """The model from one step to a later one without known accelerations; none if it is not later."""
        if last <= first:
            return []
        nothing, unknown = np.zeros((len(self.members), 3)), [False] * len(self.members)
        return [self.model.across(first, last - first, nothing, unknown)]


def message_width(size: int) -> int:
    """Numbers of an estimate in a message.

    Args:
        size: of the state, D.
    """
    return 1 + size + size * (size + 1) // 2 + 3
