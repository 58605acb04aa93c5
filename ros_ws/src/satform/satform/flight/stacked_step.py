# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A step of several satellites over stacked arrays, from what they receive to what they announce."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from satform.attitude.guidance import Attitude
from satform.communication.messages import encode
from satform.communication.receiver import ReceiverModel
from satform.control.protocol import Motion
from satform.flight.compile import FormationPlan
from satform.flight.limits import NO_COMMAND, LimitCheck, Violation
from satform.flight.satellite import Satellite
from satform.flight.satellite_step import Decision
from satform.membership.formation import Formation
from satform.numeric.elementwise import Array


@dataclass(frozen=True)
class StackedResult:
    """What a step of n satellites comes to.

    Attributes:
        decision: of all of them.
        announced: numbers of their messages for the next step, shape (n, width).
        time: simulated moment to which these belong, s; the same for all.
    """

    decision: Decision
    announced: Array
    time: float


class StackedStep:
    """Computes the steps of several satellites, whose models are alike, with the bits of single ones.

    Attributes:
        satellite: their flight software.
    """

    def __init__(
        self, plan: FormationPlan, members: Sequence[int], neighbours: Sequence[Sequence[int]]
    ) -> None:
        """Before their first step.

        Args:
            plan: of the flight's parts.
            members: indices of the satellites.
            neighbours: for each of them the indices of its possible in-neighbours, ascending.

        Raises:
            ValueError: they differ in kind, so that they cannot be stacked.
        """
        plans = [plan.satellite(index, own) for index, own in zip(members, neighbours, strict=True)]
        self.satellite = Satellite.stacked(plans, max(map(len, neighbours)))
        self.satellite.repeat_on_floats(plan.timing.steps)
        self._receiver = ReceiverModel(plan.links, np.array(members), neighbours)
        self._limits = LimitCheck(plan.limits)

    def compute(
        self,
        step: int,
        motion: Motion,
        values: Array,
        stamps: Array,
        formation: Formation,
        *,
        measured_step: int | None = None,
        attitude: Attitude | None = None,
        applied: Array | None = None,
    ) -> StackedResult | dict[int, Violation]:
        """Compute a step.

        Args:
            step: its number.
            motion: position and velocity of the n satellites, measured or true, shapes (n, 3).
            values: numbers that each possible neighbour sends for this step, shape (n, K, width); any finite
                numbers for one that is none.
            stamps: simulated time to which they belong, s, shape (n, K).
            formation: with the communication graph in this step.
            measured_step: number of the step at which the motion was so; this one when left out.
            attitude: of the satellites, shapes (n, 3); None without.
            applied: acceleration over the step before, m/s^2, shape (n, 3).

        Returns:
            The result; or, by their rows, what satellites computed that is not finite or beyond its limit.
        """
        received = self._receiver.receive(step, values, stamps, None, formation)
        try:
            decision = self.satellite.act(motion, received, measured_step, attitude, applied)
        except ArithmeticError:
            return {0: NO_COMMAND}
        announcement = self.satellite.announce()
        announced = encode(announcement)
        violations = self._limits.of_decision(decision, announced)
        return violations or StackedResult(decision, announced, float(announcement.time[0]))
