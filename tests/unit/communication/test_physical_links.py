# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Radio and optical links from the geometry of a formation to the messages that arrive in a flight."""

import math
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from scipy.stats import binom

from flights import shipped
from satform.common.physical_constants import BOLTZMANN, PLANCK, SPEED_OF_LIGHT
from satform.communication.antennas import BeamSpec
from satform.communication.channel_model import ChannelModel, LinksSpec
from satform.communication.link_budget import bit_error_rate, free_space_loss, message_loss
from satform.communication.neighbour_buffer import Received
from satform.communication.physical_links import (
    Geometry,
    LinkConditions,
    LinkMedium,
    OpticalSpec,
    RadioSpec,
)
from satform.communication.receiver import ReceiverModel
from satform.flight.simulate import simulate
from satform.orbits.earth import EQUATORIAL_RADIUS
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario, ScenarioError

RADIUS = np.asarray(7.0e6)
RADIO = RadioSpec(frequency=2.2e9, power=0.1, rate=256e3, noise_temperature=300.0, message_bits=1024)
LASER = OpticalSpec(
    wavelength=1550e-9, power=0.5, rate=1e9, divergence=20e-6, aperture=0.08, losses=6.0, message_bits=1024
)


def geometry(*positions: tuple[float, float, float], body: Any = None) -> Geometry:
    return Geometry(np.array(positions), RADIUS, body)


def test_a_radio_link_is_the_budget_of_its_distance() -> None:
    medium = LinkMedium([(0, 1), (1, 0)], [RADIO, RADIO], 2)
    states = medium.states(geometry((0.0, 0.0, 0.0), (0.0, 24.0e3, 7.0e3)))
    expected = 0.1 / (float(free_space_loss(np.asarray(25e3), 2.2e9)) * BOLTZMANN * 300.0 * 256e3)
    assert 10.0 ** (0.1 * states.ratio) == pytest.approx([expected] * 2, rel=1e-12)
    assert states.distance == pytest.approx([25e3] * 2)
    assert states.light_time == pytest.approx([25e3 / SPEED_OF_LIGHT] * 2)
    loss = float(message_loss(bit_error_rate("bpsk", np.asarray(expected)), 1024))
    assert states.loss == pytest.approx([loss] * 2, rel=1e-9)
    # The required rate of 1e-5 is that of Q(4.26489).
    required = 0.5 * 4.26489**2
    assert states.margin == pytest.approx([10.0 * math.log10(expected / required)] * 2, abs=1e-4)
    whole = medium.conditions(states)
    assert whole.loss.tolist() == [[0.0, states.loss[1]], [states.loss[0], 0.0]]


def test_a_code_needs_less_energy_by_its_gain() -> None:
    """Heller & Jacobs 1971: with rate 1/2 and constraint length 7, 4.5 dB instead of 9.6 dB for 1e-5."""
    wavelength = 299792458.0 / 2.2e9
    noise = 1.380649e-23 * 300.0 * 256e3
    # Where Eb/N0 is 4.488 dB, 5.1 dB below the 9.588 dB at which Q(sqrt(2 Eb/N0)) is 1e-5.
    distance = wavelength / (4.0 * math.pi) * math.sqrt(0.1 / noise / 10.0**0.4488)
    bit = RADIO.model_copy(update={"message_bits": 1})
    specs = [bit.model_copy(update={"coding_gain": 5.1}), bit]
    states = LinkMedium([(0, 1), (1, 0)], specs, 2).states(geometry((0.0, 0.0, 0.0), (0.0, distance, 0.0)))
    assert states.ratio == pytest.approx([4.488] * 2, abs=1e-6)
    assert states.margin == pytest.approx([0.0, -5.1], abs=1e-3)
    # Q(4.2649), and without the code Q(sqrt(2 x 2.8106)) = Q(2.3709) by tables.
    assert states.loss == pytest.approx([1.0e-5, 0.008873], rel=2e-3)


def test_an_optical_link_has_the_photons_of_its_beam() -> None:
    states = LinkMedium([(0, 1)], [LASER], 2).states(geometry((0.0, 0.0, 0.0), (0.0, 1.0e6, 0.0)))
    # On the axis of a Gaussian beam of the radius w the intensity is 2 P / (pi w^2).
    width = 1.0e6 * 10e-6
    received = 0.5 * 10.0**-0.6 * 2.0 / (math.pi * width**2) * math.pi * 0.04**2
    photons = received * 1550e-9 / (PLANCK * SPEED_OF_LIGHT * 1e9)
    assert 10.0 ** (0.1 * states.ratio[0]) == pytest.approx(photons, rel=1e-9)
    loss = message_loss(np.asarray(0.5 * math.exp(-2.0 * photons)), 1024)
    assert states.loss[0] == pytest.approx(float(loss), rel=1e-9)


def test_a_terminal_points_within_its_field_of_regard_as_the_attitude_has_it() -> None:
    narrow = LASER.model_copy(update={"field_of_regard": math.radians(60.0)})
    place = ((0.0, 0.0, 0.0), (1.0e3, 0.0, 0.0))
    # The second satellite is turned by half a turn, or only by 110 degrees, so that it looks 70 degrees off.
    for degrees, closed in ((180.0, False), (110.0, True)):
        turn = math.radians(degrees)
        body = np.stack(
            (
                np.eye(3),
                [[math.cos(turn), math.sin(turn), 0], [-math.sin(turn), math.cos(turn), 0], [0, 0, 1]],
            )
        )
        states = LinkMedium([(0, 1)], [narrow], 2).states(geometry(*place, body=body))
        assert states.loss[0] == pytest.approx(1.0 if closed else 0.0, abs=1e-6)
        assert not states.blocked[0]
        assert np.isneginf([states.ratio[0], states.margin[0]]).tolist() == [closed, closed]


def test_a_terminal_without_limits_points_everywhere() -> None:
    generator = np.random.default_rng(5)
    medium = LinkMedium([(0, 1)], [LASER], 2)
    for _ in range(50):
        x, y, z = generator.standard_normal(3)
        aimed = LASER.model_copy(update={"boresight": (x, y, z)})
        places = geometry((0.0, 0.0, 0.0), (1e3 * x, 1e3 * y, 1e3 * z))
        assert LinkMedium([(0, 1)], [aimed], 2).states(places).ratio == medium.states(places).ratio


def test_gains_are_those_in_the_body_axes_of_both() -> None:
    beam = RADIO.model_copy(
        update={"antenna": BeamSpec(peak_gain=12.0, beamwidth=math.radians(40.0), floor=-30.0)}
    )
    medium = LinkMedium([(0, 1)], [beam], 2)
    isotropic = LinkMedium([(0, 1)], [RADIO], 2)
    place = ((0.0, 0.0, 0.0), (5.0e3, 0.0, 0.0))
    facing = np.stack((np.eye(3), np.diag([-1.0, -1.0, 1.0])))
    gained = medium.states(geometry(*place, body=facing)).ratio - isotropic.states(geometry(*place)).ratio
    assert gained == pytest.approx([24.0], abs=1e-9)
    away = medium.states(geometry(*place)).ratio - isotropic.states(geometry(*place)).ratio
    assert away == pytest.approx([12.0 - 30.0], abs=1e-9)


@pytest.mark.parametrize(("margin", "blocked"), [(0.0, False), (130e3, True)])
def test_the_earth_blocks_what_passes_below_the_margin(margin: float, *, blocked: bool) -> None:
    # Half the angle between both satellites for a line of sight 100 km above the equator.
    half = math.acos((EQUATORIAL_RADIUS + 100e3) / float(RADIUS))
    places = [
        (float(RADIUS) * (math.cos(angle) - 1.0), float(RADIUS) * math.sin(angle), 0.0)
        for angle in (-half, half)
    ]
    spec = RADIO.model_copy(update={"power": 1e9, "line_of_sight_margin": margin})
    states = LinkMedium([(0, 1)], [spec], 2).states(geometry(*places))
    assert states.blocked.tolist() == [blocked]
    assert states.loss[0] == pytest.approx(1.0 if blocked else 0.0, abs=1e-12)
    assert (states.margin[0] == -math.inf) == blocked


def test_states_of_many_times_are_those_of_each() -> None:
    generator = np.random.default_rng(2)
    positions = generator.standard_normal((7, 4, 3)) * 3.0e4
    edges = [(0, 1), (1, 0), (2, 3), (3, 1)]
    medium = LinkMedium(edges, [RADIO, LASER, RADIO, RADIO], 4)
    together = medium.states(Geometry(positions, np.full(7, 7.0e6), None))
    for row in range(7):
        alone = medium.states(Geometry(positions[row], RADIUS, None))
        for name in ("distance", "ratio", "margin", "loss", "light_time"):
            assert getattr(together, name)[row] == pytest.approx(getattr(alone, name), rel=1e-12)


# The channel model with the conditions of physical links

STEP = 0.5


def channel(**default: Any) -> ChannelModel:
    spec = LinksSpec.model_validate({"default": {"channel": RADIO.model_dump(), **default}})
    return ChannelModel.of(spec, [(0, 1)], ("a", "b"), (STEP, 3), (1,))


def arrivals(line: ChannelModel, conditions: LinkConditions, steps: int) -> list[int]:
    """The step of the message that arrives in each step, or -1."""
    found = []
    for step in range(steps):
        sent = Received.whole(np.full((1, 2), float(step)), np.full(1, step * STEP))
        arrived = line.transmit(step, sent, conditions)
        found.append(int(arrived.values[0, 0]) if arrived.fresh[0] > 0.0 else -1)
    return found


def conditions(loss: float, light_time: float = 0.0) -> LinkConditions:
    return LinkConditions(np.array([loss]), np.array([light_time]))


def test_physical_loss_adds_to_the_constant_one() -> None:
    count = arrivals(channel(loss=0.3), conditions(0.4), 4000).count(-1)
    loss = 1.0 - 0.7 * 0.6
    assert binom.ppf(5e-5, 4000, loss) <= count <= binom.ppf(1 - 5e-5, 4000, loss)
    assert arrivals(channel(), conditions(1.0), 50) == [-1] * 50
    assert arrivals(channel(), conditions(0.0), 50) == list(range(50))


@pytest.mark.parametrize(("light_time", "steps"), [(0.0, 0), (1e-3, 1), (0.5, 1), (0.51, 2), (2.9, 6)])
def test_light_time_delays_by_whole_steps(light_time: float, steps: int) -> None:
    found = arrivals(channel(), conditions(0.0, light_time), 30)
    assert found == [-1] * steps + list(range(30 - steps))


# Flights

RADIO_LINKS: dict[str, Any] = {
    "kind": "radio",
    "frequency": 2.2e9,
    "power": 0.1,
    "rate": 256e3,
    "noise_temperature": 300.0,
    "light_time": False,
}


def flown(power: float, **changes: Any) -> tuple[Scenario, FlightRecord]:
    scenario = shipped("triangle").with_(
        {
            "timing.duration": 75.0,
            "links": {"default": {"channel": {**RADIO_LINKS, "power": power}}},
            **changes,
        },
        expect=[],
    )
    return scenario, simulate(scenario)


def test_a_link_with_much_power_changes_no_bit_and_one_without_power_delivers_nothing() -> None:
    strong_scenario, strong = flown(1e6)
    plain = simulate(strong_scenario.with_(links=None))
    assert strong.differences(plain) == []
    silent = simulate(strong_scenario.with_(graph={"kind": "none"}, links=None))
    _, weak = flown(1e-9)
    assert weak.differences(silent) == []
    assert weak.differences(plain) != []


def test_the_history_of_links_has_the_messages_that_arrived_also_of_single_satellites() -> None:
    receive, arrived = ReceiverModel.receive, []

    def noted(self: ReceiverModel, *given: Any) -> Received:
        found = receive(self, *given)
        arrived.append((self.members, self.neighbours, found.fresh))
        return found

    scenario, _ = flown(1.0)
    with patch.object(ReceiverModel, "receive", noted):
        record = simulate(scenario)
    links = record.links
    assert links is not None
    found = np.zeros((record.steps, 3, 3))
    for step, (members, neighbours, fresh) in enumerate(arrived):
        found[step, members[:, None], neighbours] = fresh
    senders, receivers = links.edges.T
    assert np.array_equal(found[:, receivers, senders] > 0.0, links.delivered)
    # The satellites are 80 to 200 km apart: some messages are lost and some are not.
    assert 0.1 < links.delivered.mean() < 0.9
    assert simulate(scenario, stacked=False).differences(record) == []


def test_light_time_is_the_delay_of_a_step() -> None:
    with_light, record = flown(1e6, **{"links.default.channel.light_time": True})
    delayed = simulate(with_light.with_({"links": {"default": {"delay": 1e-3}}}))
    assert record.differences(delayed) == []


def test_antennas_turn_with_the_satellites() -> None:
    scenario = shipped("formation_pointing").with_(
        {
            "timing.duration": 20.0,
            "links": {
                "default": {
                    "channel": {
                        **RADIO_LINKS,
                        "power": 10.0,
                        "antenna": {"kind": "beam", "peak_gain": 15.0, "beamwidth": 0.5, "floor": -20.0},
                    }
                }
            },
        },
        expect=[],
    )
    links = simulate(scenario).links
    fixed = simulate(
        scenario.with_({"links.default.channel.antenna": {"kind": "isotropic", "peak_gain": 15.0}})
    ).links
    assert links is not None
    assert fixed is not None
    assert links.states is not None
    assert fixed.states is not None
    below = fixed.states.ratio - links.states.ratio
    # Both antennas lose between nothing and 35 dB, and not the same in all directions.
    assert below.min() >= -1e-9
    assert below.max() <= 70.0 + 1e-9
    assert np.ptp(below) > 5.0


def test_links_are_without_a_digest_of_their_own_where_none_is_physical() -> None:
    lossy = shipped("lossy_links")
    assert lossy.with_({"links.default.channel": None}).digest() == lossy.digest()
    assert lossy.with_({"links.default.channel": RADIO_LINKS}).digest() != lossy.digest()


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("frequency", -1.0, "frequency"),
        ("modulation", "morse", "modulation"),
        ("antenna", {"kind": "array", "elements": []}, "elements"),
        ("antenna", {"kind": "beam", "peak_gain": 3.0, "beamwidth": 0.0}, "beamwidth"),
        ("required_bit_error_rate", 0.5, "required_bit_error_rate"),
        ("required_bit_error_rate", 1e-305, "required_bit_error_rate"),
        ("losses", -3.0, "losses"),
        ("losses", 4000.0, "losses"),
        ("antenna", {"kind": "isotropic", "peak_gain": 4000.0}, "peak_gain"),
        ("antenna", {"kind": "beam", "peak_gain": 4000.0, "beamwidth": 1.0}, "peak_gain"),
        ("antenna", {"kind": "beam", "peak_gain": 4.0, "beamwidth": 1.0, "floor": -4000.0}, "floor"),
    ],
)
def test_bad_links_are_rejected_with_their_field(field: str, value: Any, words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        shipped("triangle").with_({"links": {"default": {"channel": {**RADIO_LINKS, field: value}}}})


@pytest.mark.parametrize(
    ("changes", "expectation", "words"),
    [
        (
            {"links": {"default": {"loss": 0.1}}},
            {"kind": "link_margin", "above": 1.0},
            "no edge of the graph between the satellites that are meant has a radio or optical channel",
        ),
        (
            {"graph": {"kind": "line"}},
            {"kind": "link_margin", "above": 1.0, "satellites": ["sat1", "sat3"]},
            "no edge of the graph between",
        ),
        (
            {"graph": {"kind": "none"}},
            {"kind": "delivered_fraction", "above": 0.5},
            "the graph has no edge between the satellites that are meant",
        ),
        (
            {},
            {"kind": "delivered_connectivity", "above": 0.5, "window_length": 60.0, "after": 20.0},
            "window_length 60 s is longer than the stretch of 55 s",
        ),
    ],
)
def test_figures_that_the_links_cannot_give_are_rejected(
    changes: dict[str, Any], expectation: dict[str, Any], words: str
) -> None:
    base = shipped("triangle").with_(
        {"timing.duration": 75.0, "links": {"default": {"channel": RADIO_LINKS}}}, expect=[]
    )
    source = {"source": "test", "below": 9.0}
    possible = {"kind": "delivered_fraction", "above": 0.1}
    assert base.with_(expect=[{**possible, **source}]).expect
    with pytest.raises(ScenarioError, match=words):
        base.with_(changes, expect=[{**expectation, **source}])
