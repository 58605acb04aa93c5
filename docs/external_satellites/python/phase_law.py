# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flight software of satellite 2 of the scenario `triangle`, written without satform.

The equations are in docs/controllers/consensus.md and docs/controllers/sliding_mode.md. Operations are
in the order of satform's own flight software, so that both give the same bits.
"""

import math

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Vector3
from scipy.special import ellipeinc
from std_msgs.msg import Header

STEP, STEP_NANOSECONDS = 0.5, 500_000_000  # control period
PERIOD = 6000.0  # s: of the orbit, and of the nominal motion along the ellipse
CENTRE, FIRST, SECOND = np.array([[0.0, 100.0e3, 0.0], [0.0, 75.0e3, 0.0], [37.5e3, 0.0, 0.0]])  # m, LVLH
A, B, SCALE = 75.0e3, 37.5e3, 0.75  # semi-axes in m; metres of arc length in one of generalised arc length
TRACKING, COUPLING, RATE = 1.0e-3, 1.0e-6, 1.0e-3  # consensus: 1/s, 1/s^2, 1/s
SLOPE, SWITCHING, REACHING, LAYER = 0.01, 0.1, 0.1, 0.1  # sliding mode: 1/s, m/s^2, 1/s, m/s
MEAN_MOTION = 2.0 * math.pi / PERIOD
GRADIENT = np.array([3.0 * MEAN_MOTION * MEAN_MOTION, 0.0, -(MEAN_MOTION * MEAN_MOTION)])
CORIOLIS = np.array([2.0 * MEAN_MOTION, -2.0 * MEAN_MOTION, 0.0])
PARAMETER = 1.0 - (A / B) ** 2
QUARTER = B * float(ellipeinc(0.5 * math.pi, PARAMETER))
EXCESS = math.sqrt((A - B) * (A + B)) * math.sqrt((A - B) * (A + B))
NOMINAL_RATE = 4.0 * QUARTER / SCALE / PERIOD  # m/s


class PhaseLaw:
    """Phase on the ellipse, consensus with the neighbours, and sliding mode towards the reference."""

    def __init__(self) -> None:
        self.arc_length, self.rate = 30.0e3, NOMINAL_RATE  # generalised: m, m/s

    @property
    def phase(self):
        """What the neighbours receive."""
        return {"arc_length": self.arc_length, "rate": self.rate}

    def join(self, step):
        """The phase at the first step in which it takes part, with the nominal motion up to it."""
        self.arc_length = self.arc_length + step * STEP * self.rate
        return self.phase

    def act(self, state, neighbours):
        """Acceleration (m/s^2, LVLH) of a step; moves the phase on to the next one.

        Args:
            state: message with measured position (m, LVLH) and velocity (m/s, LVLH).
            neighbours: arc length (m) and rate (m/s) of each in-neighbour, in the order of the formation.
        """
        position, velocity = (np.array([v.x, v.y, v.z]) for v in (state.position, state.velocity))
        pull = 0.0
        for arc_length, rate in neighbours:
            pull = pull + (COUPLING * (self.arc_length - arc_length) + RATE * (self.rate - rate))
        change = -TRACKING * (self.rate - NOMINAL_RATE) - pull
        half = 0.5 * STEP
        to_middle = (self.rate + change * (0.5 * half)) * half
        angle = _angle_at(SCALE * self.arc_length)
        here, speed, slope = _point(angle)[:3]
        onward = SCALE * to_middle / speed
        onward = onward - 0.5 * onward * onward * (slope / speed)
        part, turned = _from_apex(SCALE * (self.arc_length + to_middle))
        middle = _point(turned + _closer(angle + onward - turned, part))
        along, pace = SCALE * change, SCALE * (self.rate + change * half)
        feedforward = along * middle[3] + (middle[5] * pace * pace) * middle[4]
        along_track = SCALE * self.rate * _point(angle)[3]
        error = velocity - along_track
        s = error + SLOPE * (position - here)
        free = GRADIENT * position + CORIOLIS * velocity[[1, 0, 2]]
        switch = s / np.maximum(np.abs(s), LAYER)
        acceleration = feedforward - free - SLOPE * error - SWITCHING * switch - REACHING * s
        gained = change * STEP
        self.arc_length, self.rate = self.arc_length + (self.rate + 0.5 * gained) * STEP, self.rate + gained
        self.tracking = {
            "reference_position": Point(**_axes(here)),
            "reference_velocity": Vector3(**_axes(along_track)),
            "reference_acceleration": Vector3(**_axes(feedforward)),
            "position_error": Vector3(**_axes(position - here)),
            "velocity_error": Vector3(**_axes(error)),
            "sliding_variable": Vector3(**_axes(s)),
        }
        return Vector3(**_axes(acceleration))


def _axes(vector):
    return dict(zip("xyz", vector.tolist(), strict=True))


def header(step):
    """Header of a message of a step."""
    seconds, nanoseconds = divmod(step * STEP_NANOSECONDS, 10**9)
    return Header(stamp=Time(sec=seconds, nanosec=nanoseconds), frame_id="lvlh")


def _point(angle):
    """Position, speed and its slope, tangent, normal and curvature of the ellipse at an angle in rad."""
    sine, cosine = math.sin(angle), math.cos(angle)
    radial, along = A * sine, B * cosine
    speed = math.sqrt(radial * radial + along * along)
    first, second = FIRST / A, SECOND / B
    tangent = along / speed * second - radial / speed * first
    normal = -(radial / speed) * second - along / speed * first
    slope, curvature = (A * A - B * B) * sine * cosine / speed, A * B / (speed * speed * speed)
    return CENTRE + FIRST * cosine + SECOND * sine, speed, slope, tangent, normal, curvature


def _angle_at(arc_length):
    """Angle in rad at an arc length in m: three steps of Halley's iteration on the elliptic integral."""
    part, turned = _from_apex(arc_length)
    ratio = min(abs(part) / (2.0 * math.sqrt((A - B) * (A + B))), 0.5)
    angle = math.copysign(1.0, part) * min(abs(part) / B, 2.0 * float(np.arcsin(math.sqrt(ratio))))
    for _ in range(3):
        angle = _closer(angle, part)
    return turned + angle


def _from_apex(arc_length):
    """Arc length in m from the nearest end of the long axis, and the angle in rad of that end."""
    halves = round(arc_length / (2.0 * QUARTER))
    return arc_length - halves * (2.0 * QUARTER), halves * math.pi


def _closer(angle, part):
    """One step of Halley's iteration from an angle in rad towards an arc length in m from the apex."""
    sine = math.sin(angle)
    square = B * B + EXCESS * sine * sine
    newton = (B * float(ellipeinc(angle, PARAMETER)) - part) / math.sqrt(square)
    bend = EXCESS * sine * math.cos(angle) / square
    return angle - newton / (1.0 - 0.5 * newton * bend)
