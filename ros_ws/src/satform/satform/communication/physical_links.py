# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Radio and optical links: from the true geometry to the loss of messages and the light time.

The truth (plant) evaluates this model. A satellite's link layer gets only the result for its own incoming
links, and the flight software none of it. The equations are in `link_budget`, antennas in `antennas`.
"""

import math
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from satform.common.physical_constants import SPEED_OF_LIGHT
from satform.common.spec import Positive, Spec, Vector
from satform.communication.antennas import (
    MOST_DECIBELS,
    Antenna,
    IsotropicSpec,
    factor,
)
from satform.communication.link_budget import (
    LEAST_ERROR_RATE,
    Detection,
    Modulation,
    beam_gain,
    bit_energy_ratio,
    bit_error_rate,
    decibels,
    free_space_loss,
    message_loss,
    photons_per_bit,
    pointing_factor,
    required_ratio,
)
from satform.numeric.directions import require_direction, unit, within
from satform.numeric.elementwise import Array, Indices
from satform.orbits.line_of_sight import blocked_by_earth, from_earth_centre, in_body_axes, line_of_sight

LONGEST_LIGHT_TIME = 3.0
"""Light time from which on a message counts as lost, s; the distance is then 900 000 km."""

_PointingError: TypeAlias = Annotated[float, Field(ge=0.0, le=math.pi)]


class PhysicalSpec(Spec):
    """What radio and optical links have in common."""

    power: Positive
    """Of the transmitter, W."""
    rate: Positive
    """Rate of the bits on the link, bit/s."""
    message_bits: Annotated[int, Field(ge=1, le=10_000_000)] = 512
    """Bits of a message without those of a code; it is lost when one of them is wrong."""
    losses: Annotated[float, Field(ge=0.0, le=MOST_DECIBELS)] = 0.0
    """All further losses of the link, such as those of lines and of the receiver's implementation, dB."""
    required_bit_error_rate: Annotated[float, Field(ge=LEAST_ERROR_RATE, le=0.1)] = 1e-5
    """Bit error rate at which the margin is zero; no part of the simulation."""
    light_time: bool = True
    """Whether the light time is added to the delay of the link."""
    line_of_sight_margin: Annotated[float, Field(ge=0.0, le=1e6)] = 0.0
    """Height above the Earth's equatorial radius that the line of sight has to keep, m."""

    @abstractmethod
    def ratio(self, distance: Array, forth: Array, back: Array) -> Array:
        """Eb/N0, or mean photons per bit, as a factor.

        Args:
            distance: between the satellites, m, shape (...).
            forth: unit vectors to the receiver in body axes of the sender, shape (..., 3).
            back: unit vectors to the sender in body axes of the receiver, shape (..., 3).
        """

    @property
    @abstractmethod
    def scheme(self) -> str:
        """Modulation or detection, a key of `BIT_ERROR_RATES`."""

    @property
    def code(self) -> float:
        """Coding gain, dB; 0 without a code."""
        return 0.0

    @property
    def required(self) -> float:
        """Eb/N0, or photons per bit, at the required bit error rate without a code, as a factor."""
        return required_ratio(self.scheme, self.required_bit_error_rate)


class RadioSpec(PhysicalSpec):
    """A radio link, with equal equipment at both ends."""

    kind: Literal["radio"] = "radio"
    frequency: Positive
    """Of the carrier, Hz."""
    antenna: Antenna = IsotropicSpec()
    """Of the sender, and of the receiver unless `receive_antenna` is given."""
    receive_antenna: Antenna | None = None
    """Of the receiver."""
    noise_temperature: Positive = 290.0
    """Of the receiving system, K."""
    modulation: Modulation = "bpsk"
    """By which the bit error rate follows from Eb/N0; coherent but for dpsk and fsk_noncoherent."""
    coding_gain: Annotated[float, Field(ge=0.0, le=20.0)] = 0.0
    """By how much less Eb/N0 the link needs with its error-correcting code for the same bit error rate, dB;
    Eb is the energy of a bit of the message, and `rate` that of these bits."""

    @property
    def scheme(self) -> str:
        """Modulation or detection."""
        return self.modulation

    @property
    def code(self) -> float:
        """Coding gain, dB."""
        return self.coding_gain

    @property
    def receiving(self) -> Antenna:
        """The receiver's antenna."""
        return self.receive_antenna or self.antenna

    @property
    def mismatch(self) -> float:
        """Mismatch losses of both antennas together, dB."""
        return self.antenna.mismatch_loss + self.receiving.mismatch_loss

    def ratio(self, distance: Array, forth: Array, back: Array) -> Array:
        """As of every link."""
        gains = self.antenna.gain(forth, self.frequency) * self.receiving.gain(back, self.frequency)
        fixed = self.power * factor(-self.losses - self.mismatch)
        received = fixed * gains / np.maximum(free_space_loss(distance, self.frequency), 1.0)
        return bit_energy_ratio(received, self.noise_temperature, self.rate)


class OpticalSpec(PhysicalSpec):
    """A laser link between two equal terminals, received at the limit of shot noise."""

    kind: Literal["optical"] = "optical"
    wavelength: Positive
    """In vacuum, m."""
    divergence: Annotated[float, Field(ge=1e-9, le=1.0)]
    """Full angle of the Gaussian beam between the directions of 1/e^2 of its intensity, rad."""
    aperture: Positive
    """Diameter of the receiving telescope, m."""
    detection: Detection = "ook"
    """ook: on-off keying, photons are counted; heterodyne_psk, homodyne_psk: coherent detection."""
    pointing_offset: _PointingError = 0.0
    """Constant error of the beam's direction, rad."""
    pointing_jitter: _PointingError = 0.0
    """Standard deviation of the beam's direction about each of two axes, rad; its mean effect counts."""
    boresight: Vector = (1.0, 0.0, 0.0)
    """Middle of the terminal's field of regard, in body axes; its length does not matter."""
    field_of_regard: Annotated[float, Field(gt=0.0, le=math.pi)] = math.pi
    """Largest angle from the boresight at which a terminal can point, rad."""

    @model_validator(mode="after")
    def _points(self) -> "OpticalSpec":
        require_direction(self.boresight, "boresight")
        return self

    @property
    def scheme(self) -> str:
        """Modulation or detection."""
        return self.detection

    def ratio(self, distance: Array, forth: Array, back: Array) -> Array:
        """As of every link."""
        pointing = pointing_factor(self.divergence, self.pointing_offset, self.pointing_jitter)
        # The part of the beam that the telescope takes is at most all of it.
        spread = beam_gain(self.divergence) * (0.25 * self.aperture / np.maximum(distance, 1e-3)) ** 2
        received = self.power * factor(-self.losses) * pointing * np.minimum(spread, 1.0)
        axis = unit(self.boresight)
        in_regard = within(forth, axis, self.field_of_regard) & within(back, axis, self.field_of_regard)
        photons = photons_per_bit(received, self.wavelength, self.rate)
        return np.where(in_regard, photons, 0.0)


Physical: TypeAlias = Annotated[RadioSpec | OpticalSpec, Field(discriminator="kind")]


@dataclass(frozen=True)
class LinkStates:
    """State of E links; leading axes, if any, are times.

    Attributes:
        distance: between the satellites, m, shape (..., E).
        blocked: whether the Earth is between them, shape (..., E).
        ratio: Eb/N0, or photons per bit, dB; minus infinity where an antenna or terminal has no gain in the
            direction of the other satellite, shape (..., E).
        margin: of the ratio with the coding gain above the required one, dB; minus infinity when blocked or
            without gain, shape (..., E).
        loss: probability that a message is lost, shape (..., E).
        light_time: that is added to the delay, s, shape (..., E).
    """

    distance: Array
    blocked: NDArray[np.bool_]
    ratio: Array
    margin: Array
    loss: Array
    light_time: Array


@dataclass(frozen=True)
class LinkConditions:
    """What the link layer of a receiver is told of its incoming links in a step.

    Attributes:
        loss: probability that the channel loses a message, shape (..., K).
        light_time: that is added to the delay, s, shape (..., K).
    """

    loss: Array
    light_time: Array


@dataclass(frozen=True)
class Geometry:
    """Where satellites are and how they are turned; leading axes, if any, are times.

    Attributes:
        position: LVLH, m, shape (..., N, 3).
        chief_radius: distance of the chief from the Earth's centre, m, shape (...).
        body: rows are the body axes of each satellite in LVLH, shape (..., N, 3, 3); None where the body axes
            of all are those of LVLH.
    """

    position: Array
    chief_radius: Array
    body: Array | None


class LinkMedium:
    """The physical links of a formation.

    Attributes:
        edges: indices of sender and receiver of each link, shape (E, 2).
    """

    def __init__(self, edges: Sequence[tuple[int, int]], specs: Sequence[PhysicalSpec], count: int) -> None:
        """Links of a formation.

        Args:
            edges: indices of sender and receiver of each link that is physical.
            specs: of each of them.
            count: number of satellites.
        """
        self.edges: Indices = np.array(edges, dtype=np.int64).reshape(-1, 2)
        self._count = count
        self._margin = np.array([spec.line_of_sight_margin for spec in specs])
        kinds: dict[PhysicalSpec, list[int]] = {}
        for index, spec in enumerate(specs):
            kinds.setdefault(spec, []).append(index)
        self._kinds = [(spec, np.array(rows, dtype=np.int64)) for spec, rows in kinds.items()]

    def states(self, geometry: Geometry) -> LinkStates:
        """State of every link.

        Args:
            geometry: of all satellites.
        """
        position, body = geometry.position, geometry.body
        senders, receivers = self.edges.T
        distance, direction = line_of_sight(position[..., senders, :], position[..., receivers, :])
        forth = in_body_axes(None if body is None else body[..., senders, :, :], direction)
        back = in_body_axes(None if body is None else body[..., receivers, :, :], -direction)
        ratio, required = np.empty_like(distance), np.empty(len(self.edges))
        code = np.zeros(len(self.edges))
        rate, light = np.empty_like(distance), np.zeros_like(distance)
        for spec, rows in self._kinds:
            own = spec.ratio(distance[..., rows], forth[..., rows, :], back[..., rows, :])
            ratio[..., rows], required[rows], code[rows] = own, spec.required, spec.code
            coded = own * factor(spec.code)
            rate[..., rows] = message_loss(bit_error_rate(spec.scheme, coded), spec.message_bits)
            if spec.light_time:
                light[..., rows] = distance[..., rows] / SPEED_OF_LIGHT
        blocked = self._blocked(geometry, senders, receivers)
        margin = np.where(blocked, -np.inf, decibels(ratio) - decibels(required) + code)
        lost = blocked | (light > LONGEST_LIGHT_TIME)
        return LinkStates(
            distance, blocked, decibels(ratio), margin, np.where(lost, 1.0, rate), np.where(lost, 0.0, light)
        )

    def conditions(self, states: LinkStates) -> LinkConditions:
        """The same as matrices, rows receivers and columns senders, shape (N, N); zero for other links.

        Args:
            states: of one time.
        """
        senders, receivers = self.edges.T
        loss, light = np.zeros((self._count, self._count)), np.zeros((self._count, self._count))
        loss[receivers, senders] = states.loss
        light[receivers, senders] = states.light_time
        return LinkConditions(loss, light)

    def _blocked(self, geometry: Geometry, senders: Indices, receivers: Indices) -> NDArray[np.bool_]:
        from_earth = from_earth_centre(geometry.position, geometry.chief_radius)
        return blocked_by_earth(from_earth[..., senders, :], from_earth[..., receivers, :], self._margin)
