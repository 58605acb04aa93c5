# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Feedback linearisation: cancelled relative dynamics and proportional-derivative feedback.

Equations: docs/controllers/lqr.md.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from satform.common.angle_text import OR_DEGREES_PER_SECOND
from satform.common.spec import PositivePerAxis
from satform.control.protocol import Action, ControllerSpec, ControlStep, FlightSetting, Memoryless, Motion
from satform.control.sampled_stability import require_stable_hold
from satform.dynamics import cw
from satform.numeric.elementwise import Array
from satform.orbits.path_reference import Reference


@dataclass(frozen=True)
class FeedbackLinearisation(Memoryless):
    """Cancels the natural relative acceleration and adds a spring and a damper to the reference.

    Attributes:
        stiffness: 1/s^2, shape (..., 3).
        damping: 1/s, shape (..., 3).
        natural: acceleration of free relative motion.
    """

    stiffness: Array
    damping: Array
    natural: cw.NaturalAcceleration

    def act(self, motion: Motion, reference: Reference, memory: None, step: ControlStep) -> Action:
        """Command under which the error obeys a damped oscillator on each axis.

        Args:
            motion: measured position and velocity, LVLH.
            reference: desired position, velocity and acceleration, LVLH.
            memory: unused.
            step: unused.

        Returns:
            Commanded acceleration; the sliding variable is zero.

        Source: Schaub & Junkins, Analytical Mechanics of Space Systems, formation control with the full
        relative state fed back; Clohessy & Wiltshire 1960 for the cancelled part.
        """
        acceleration = (
            reference.acceleration
            - self.natural.at(motion.position, motion.velocity)
            - self.stiffness * (motion.position - reference.position)
            - self.damping * (motion.velocity - reference.velocity)
        )
        return Action(acceleration, np.zeros_like(acceleration))


class FeedbackLinearisationSpec(ControllerSpec):
    """Proportional-derivative control about cancelled Hill dynamics."""

    kind: Literal["feedback_linearisation"] = "feedback_linearisation"
    natural_frequency: Annotated[PositivePerAxis, OR_DEGREES_PER_SECOND] = (0.01, 0.01, 0.01)
    """Undamped angular frequency of the error, per axis, rad/s."""
    damping_ratio: PositivePerAxis = (1.0, 1.0, 1.0)
    """Damping of the error as a fraction of critical, per axis."""

    def assumes_circular_chief(self) -> bool:
        """Its model is that of Clohessy and Wiltshire."""
        return True

    def build(self, setting: FlightSetting) -> FeedbackLinearisation:
        """The law with its spring and damper.

        Raises:
            ValueError: the step is too long for these gains.
        """
        frequency = np.asarray(self.natural_frequency, dtype=np.float64)
        stiffness = frequency**2
        damping = 2.0 * np.asarray(self.damping_ratio, dtype=np.float64) * frequency
        state, _ = cw.system_matrices(setting.mean_motion)
        gain = state[3:] + np.hstack((np.diag(stiffness), np.diag(damping)))
        transition = cw.transition_matrix(setting.mean_motion, setting.step)
        held = cw.input_matrix(setting.mean_motion, setting.step)
        require_stable_hold(transition - held @ gain, "feedback_linearisation", setting.step)
        return FeedbackLinearisation(stiffness, damping, cw.natural_acceleration(setting.mean_motion))
