# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The chief from elements, states and files, and satellites that start by elements, states and files."""

import csv
import json
import math
from datetime import UTC, datetime
from pathlib import Path

import brahe
import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from orbit_texts import ELEMENTS, OMM, TLE, kepler, oem
from satform.dynamics.protocol import DynamicsSetting
from satform.flight.chief_motion import chief_motion
from satform.flight.compile_satellite import flight_setting, motion_at_start
from satform.flight.simulate import simulate
from satform.scenario import Scenario, ScenarioError, load_scenario, save_scenario
from satform.scenario.environment import environment_of

DATA = Path(__file__).parents[2] / "data"
MANIFEST = json.loads((DATA / "manifest.json").read_text())
RADIANS = brahe.AngleFormat.RADIANS
KEPLERIAN = {
    "kind": "keplerian",
    "semi_major_axis": 7.0e6,
    "eccentricity": 0.01,
    "inclination": 1.0,
    "right_ascension": 0.5,
    "argument_of_perigee": 0.3,
    "mean_anomaly": 0.1,
    "epoch": "2024-01-01T00:00:00",
}
"""The chief of the ephemeris."""
INERTIAL = {"kind": "inertial", "gravity": {"degree": 0}}
OFFSET = st.floats(-1000.0, 1000.0)


def scenario(chief=None, dynamics=INERTIAL, satellites=({},), **fields):
    orbit = {"chief": chief} if chief else {"period": 6000.0}
    data = {
        "name": "small",
        "orbit": orbit,
        "timing": {"step": 10.0, "duration": 60.0},
        "dynamics": dynamics,
        "graph": {"kind": "complete"},
        "consensus": {"kind": "arc_length", "tracking_gain": 1e-3, "coupling_gain": 1e-6, "rate_gain": 1e-3},
        "nominal_motion": {"period": 6000.0},
        "satellite_defaults": {"curve": {"kind": "circle", "radius": 500.0}, "controller": {"kind": "coast"}},
        "satellites": [{"name": f"sat{index}", **own} for index, own in enumerate(satellites)],
    }
    return {**data, **fields}


def built(*arguments, **fields):
    return Scenario(**scenario(*arguments, **fields))


def started(start, chief=KEPLERIAN, dynamics=INERTIAL):
    """LVLH motion of the only satellite at time zero, position and velocity, shape (6,)."""
    motion = motion_at_start(built(chief, dynamics, ({"start": start},)))
    return np.concatenate((motion.position[0], motion.velocity[0]))


def inertial(whole):
    """Inertial states of the chief and of the satellites at time zero, shape (1 + N, 6)."""
    start = motion_at_start(whole)
    setting = DynamicsSetting(whole.orbit.rate, whole.timing.step, len(whole.satellites))
    state = whole.dynamics.build(setting).start(start.position, start.velocity)
    return np.concatenate((state.motion[0], state.motion[1]), axis=1)


def sentences(*arguments, **fields):
    with pytest.raises(ScenarioError) as caught:
        built(*arguments, **fields)
    return [(problem.field, problem.sentence) for problem in caught.value.problems]


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "chief.tle").write_text("\n".join(("VANGUARD 1", *TLE)) + "\n")
    (tmp_path / "chief.omm").write_text(OMM)
    (tmp_path / "chief.oem").write_text(oem())
    return tmp_path


def read(folder, *arguments, **fields):
    path = folder / "small.yaml"
    path.write_text(yaml.safe_dump(scenario(*arguments, **fields)))
    return load_scenario(path)


CARTESIAN = {
    "kind": "cartesian",
    "position": kepler(0.0)[:3].tolist(),
    "velocity": kepler(0.0)[3:].tolist(),
    "epoch": "2024-01-01T00:00:00Z",
}
SAME_CHIEF = {
    "keplerian": KEPLERIAN,
    "true anomaly": {
        **{key: value for key, value in KEPLERIAN.items() if key != "mean_anomaly"},
        "true_anomaly": brahe.anomaly_mean_to_true(0.1, 0.01, angle_format=RADIANS),
    },
    "degrees": {**KEPLERIAN, "inclination": "57.29577951308232 deg"},
    "cartesian": CARTESIAN,
    "EME2000": {
        **CARTESIAN,
        "position": brahe.state_gcrf_to_eme2000(kepler(0.0))[:3].tolist(),
        "velocity": brahe.state_gcrf_to_eme2000(kepler(0.0))[3:].tolist(),
        "frame": "EME2000",
    },
    "TAI": {**KEPLERIAN, "epoch": "2024-01-01T00:00:37", "time_scale": "TAI"},
    "oem": {"kind": "oem", "file": "chief.oem"},
}


@pytest.mark.parametrize("chief", SAME_CHIEF.values(), ids=SAME_CHIEF.keys())
def test_the_truth_models_chief_is_that_of_the_orbit(folder, chief):
    whole = read(folder, chief)
    assert np.allclose(inertial(whole)[0], kepler(0.0), rtol=1e-9, atol=1e-6)
    assert whole.orbit.rate == pytest.approx(math.sqrt(brahe.GM_EARTH / 7.0e6**3), rel=1e-9)
    assert whole.orbit.radius == pytest.approx(7.0e6, rel=1e-9)
    assert whole.dynamics.epoch == datetime(2024, 1, 1, tzinfo=UTC)
    assert environment_of(whole.dynamics).epoch == whole.dynamics.epoch
    assert whole.chief.eccentricity == pytest.approx(0.01, rel=1e-9)
    assert whole.chief.mean_anomaly == pytest.approx(0.1, rel=1e-8)


@pytest.mark.parametrize("kind", ["tle", "omm"])
def test_a_chief_of_sgp4_starts_in_its_state(folder, kind):
    whole = read(folder, {"kind": kind, "file": f"chief.{kind}", "epoch": "2000-06-28T12:00:00"})
    brahe.set_global_eop_provider_from_static_provider(brahe.StaticEOPProvider.from_zero())
    epoch = brahe.Epoch.from_datetime(2000, 6, 28, 12, 0, 0.0, 0.0, brahe.TimeSystem.UTC)
    expected = brahe.SGPPropagator.from_tle(*TLE).state_gcrf(epoch)
    assert np.allclose(inertial(whole)[0], expected, rtol=1e-9, atol=1e-3)


def test_without_an_epoch_time_zero_is_that_of_the_elements():
    whole = built({"kind": "tle", "lines": list(TLE)})
    assert whole.dynamics.epoch == datetime(2000, 6, 27, 18, 50, 19, 733568, tzinfo=UTC)


def test_a_linear_model_takes_the_mean_motion():
    whole = built(KEPLERIAN, {"kind": "cw"})
    assert whole.orbit.rate == pytest.approx(math.sqrt(brahe.GM_EARTH / 7.0e6**3), rel=1e-9)
    assert whole.chief.inclination == pytest.approx(1.0, rel=1e-9)
    assert built(KEPLERIAN, {"kind": "linear_j2"}).dynamics.chief.inclination == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize(
    "dynamics",
    [
        {"kind": "cw"},
        {"kind": "velocity_dependent"},
        {"kind": "formula", "acceleration": ["0.0", "0.0", "0.0"]},
        {"kind": "linear_j2"},
        {"kind": "cw_perturbed", "chief_motion": "circular"},
    ],
    ids=lambda dynamics: dynamics["kind"],
)
def test_laws_and_figures_know_the_circle_that_a_linear_model_flies_the_chief_on(dynamics):
    """It begins where the given orbit has the chief at time zero."""
    whole = built({**KEPLERIAN, "eccentricity": 0.05}, dynamics)
    eccentric = built({**KEPLERIAN, "eccentricity": 0.05}).chief
    assert eccentric.eccentricity == pytest.approx(0.05, rel=1e-9)
    for chief in (whole.chief, whole.setting.chief, flight_setting(whole, 0).chief):
        assert chief.eccentricity == 0.0
        assert chief.mean_motion == pytest.approx(whole.orbit.rate, rel=1e-12)
        assert (chief.inclination, chief.right_ascension) == (
            eccentric.inclination,
            eccentric.right_ascension,
        )
        latitude = eccentric.argument_of_perigee + eccentric.true_anomaly(0.0)
        assert chief.argument_of_perigee + chief.mean_anomaly == pytest.approx(latitude, abs=1e-9)


def test_inertial_states_of_a_linear_model_are_those_of_the_given_orbit():
    motion = chief_motion(built({**KEPLERIAN, "eccentricity": 0.05}, {"kind": "cw"}), 1)
    axis, anomaly = 7.0e6, brahe.anomaly_mean_to_true(0.1, 0.05, angle_format=RADIANS)
    assert np.linalg.norm(motion.position[0]) == pytest.approx(
        axis * (1.0 - 0.05**2) / (1.0 + 0.05 * math.cos(anomaly)), rel=1e-9
    )


def test_a_chief_is_given_once():
    chief = {"inclination": 1.0}
    found = sentences(KEPLERIAN, {**INERTIAL, "chief": chief, "epoch": "2024-01-01T00:00:00"})
    assert [field for field, _ in found] == ["dynamics.chief", "dynamics.epoch"]
    assert all("orbit.chief gives" in sentence for _, sentence in found)
    ((_, sentence),) = sentences(orbit={"chief": KEPLERIAN, "period": 6000.0})
    assert "give exactly one of" in sentence
    assert "period and chief" in sentence


def test_files_go_with_copies_of_the_scenario(folder, tmp_path_factory):
    whole = read(
        folder,
        {"kind": "tle", "file": "chief.tle"},
        satellites=({"start": {"kind": "tle", "file": "chief.tle"}},),
    )
    target = tmp_path_factory.mktemp("copy") / "small.yaml"
    save_scenario(whole, target)
    again = load_scenario(target)
    assert again.digest() == whole.digest()
    assert list(whole.files().values()) == [(folder / "chief.tle").read_bytes()]
    assert np.array_equal(motion_at_start(again).position, motion_at_start(whole).position)
    assert whole.with_({"timing.duration": 50.0}).dynamics == whole.dynamics


def test_the_digest_counts_the_orbit_and_not_what_follows_from_it():
    whole = built(KEPLERIAN)
    assert whole.digest() == built(dict(KEPLERIAN)).digest()
    assert whole.digest() != built({**KEPLERIAN, "mean_anomaly": 0.2}).digest()


@settings(max_examples=25)
@given(st.tuples(*[OFFSET] * 6).map(np.array))
def test_relative_elements_are_those_of_the_inertial_states(elements):
    names = (
        "semi_major_axis",
        "mean_longitude",
        "eccentricity_x",
        "eccentricity_y",
        "inclination_x",
        "inclination_y",
    )
    start = {"kind": "relative_elements", **dict(zip(names, elements.tolist(), strict=True))}
    chief, deputy = inertial(built(KEPLERIAN, satellites=({"start": start},)))
    found = brahe.state_eci_to_roe(chief, deputy, RADIANS)
    found[[1, 4, 5]] = np.remainder(found[[1, 4, 5]] + math.pi, math.tau) - math.pi
    assert np.allclose(found, elements / 7.0e6, rtol=0.0, atol=1e-12)


def test_magnitude_and_phase_are_those_of_the_vectors():
    phases = {"eccentricity_phase": "30 deg", "inclination_phase": "-60 deg", "along_track_offset": 40.0}
    by_phase = {"kind": "eccentricity_inclination", "eccentricity": 300.0, "inclination": 200.0, **phases}
    vectors = {
        "kind": "relative_elements",
        "mean_longitude": 40.0,
        "eccentricity_x": 300.0 * math.sqrt(0.75),
        "eccentricity_y": 150.0,
        "inclination_x": 100.0,
        "inclination_y": -200.0 * math.sqrt(0.75),
    }
    assert np.allclose(started(by_phase), started(vectors), rtol=0.0, atol=1e-7)


def test_a_linear_model_starts_on_its_own_ellipse():
    # Equations of D'Amico 2010 for a circular chief, of argument of latitude 0.7 and rate n.
    chief = {**KEPLERIAN, "eccentricity": 0.0, "argument_of_perigee": 0.0, "mean_anomaly": 0.7}
    start = {
        "kind": "eccentricity_inclination",
        "eccentricity": 300.0,
        "inclination": 200.0,
        "inclination_phase": 0.2,
    }
    n, cosine, sine = math.sqrt(brahe.GM_EARTH / 7.0e6**3), math.cos(0.7), math.sin(0.7)
    expected = (
        *(-300.0 * cosine, 600.0 * sine, 200.0 * math.sin(0.5)),
        *(300.0 * n * sine, 600.0 * n * cosine, 200.0 * n * math.cos(0.5)),
    )
    assert np.allclose(started(start, chief, {"kind": "cw"}), expected, rtol=1e-9)
    # Of 300 m at 7000 km, to first order.
    assert np.allclose(started(start, chief)[:3], expected[:3], rtol=0.0, atol=2.0 * 600.0**2 / 7.0e6)


AHEAD = ELEMENTS + np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1e-4])
SAME_START = {
    "keplerian": {
        "kind": "keplerian",
        "semi_major_axis": 7.0e6,
        "eccentricity": 0.01,
        "inclination": 1.0,
        "right_ascension": 0.5,
        "argument_of_perigee": 0.3,
        "mean_anomaly": 0.1 + 1e-4,
    },
    "relative_elements": {"kind": "relative_elements", "mean_longitude": 700.0},
    "cartesian": {
        "kind": "cartesian",
        "frame": "GCRF",
        "position": kepler(0.0, AHEAD)[:3].tolist(),
        "velocity": kepler(0.0, AHEAD)[3:].tolist(),
    },
}


@pytest.mark.parametrize(
    "dynamics", [INERTIAL, {"kind": "cw"}, {"kind": "cw_perturbed"}, {"kind": "linear_j2"}]
)
def test_the_same_start_in_other_words_is_the_same(dynamics):
    first, *others = (started(start, dynamics=dynamics) for start in SAME_START.values())
    for other in others:
        assert np.allclose(other, first, rtol=0.0, atol=1e-6)
    # 1 % of eccentricity is what a linear model is off by.
    assert first[1] == pytest.approx(700.0, abs=700.0 * 0.025)


def test_a_cartesian_start_in_lvlh_is_taken_as_it_is():
    start = {"kind": "cartesian", "position": [1.0, 2.0, 3.0], "velocity": [0.1, 0.2, 0.3]}
    assert np.array_equal(started(start), [1.0, 2.0, 3.0, 0.1, 0.2, 0.3])
    assert np.array_equal(started(start, None, {"kind": "cw"}), [1.0, 2.0, 3.0, 0.1, 0.2, 0.3])


@pytest.mark.parametrize("kind", ["tle", "omm", "oem"])
def test_a_satellite_of_the_chiefs_own_file_starts_at_the_chief(folder, kind):
    file = {"kind": kind, "file": f"chief.{kind}"}
    whole = read(folder, file, satellites=({"start": file},))
    start = motion_at_start(whole)
    assert np.allclose(start.position, 0.0, atol=1e-7)
    assert np.allclose(start.velocity, 0.0, atol=1e-9)


def test_a_pair_of_states_flies_as_orekit_has_it():
    setup = MANIFEST["setups"]["B"]
    deputy = setup["deputies"]["ellipse"]
    numbers = lambda texts: [float(text) for text in texts]  # noqa: E731  short
    whole = built(
        {
            "kind": "cartesian",
            "position": numbers(setup["chief"]["r"]),
            "velocity": numbers(setup["chief"]["v"]),
            "epoch": "2024-01-01T00:00:00",
        },
        {
            "kind": "inertial",
            "gravity": {"degree": 10, "earth_angle": float(MANIFEST["closed_rotation"]["theta0_rad"])},
        },
        (
            {
                "start": {
                    "kind": "cartesian",
                    "frame": "GCRF",
                    "position": numbers(deputy["r"]),
                    "velocity": numbers(deputy["v"]),
                }
            },
        ),
        timing={"step": 60.0, "duration": 5820.0},
    )
    rows = list(csv.DictReader((DATA / "B_ellipse_orekit.csv").open()))
    expected = {
        float(row["t_s"]): [
            float(row[name]) for name in ("hx", "hy", "hz", "hvx_exact", "hvy_exact", "hvz_exact")
        ]
        for row in rows
    }
    start = motion_at_start(whole)
    assert np.allclose(start.position[0], expected[0.0][:3], rtol=0.0, atol=1e-6)
    assert np.allclose(start.velocity[0], expected[0.0][3:], rtol=0.0, atol=1e-9)
    flight = simulate(whole)
    for step in (48, 97):
        assert np.allclose(flight.position[step, 0], expected[60.0 * step][:3], rtol=0.0, atol=1e-3)


def test_equal_mean_semi_major_axes_drift_by_the_secular_rate_of_j2():
    # Rate of the mean longitude by a difference of inclination (Koenig, Guffanti & D'Amico 2017).
    start = {"kind": "eccentricity_inclination", "elements": "mean", "eccentricity": 500.0}
    whole = built(
        {**KEPLERIAN, "eccentricity": 1e-3},
        {"kind": "inertial", "gravity": {"degree": 2, "order": 0}},
        ({"start": {**start, "inclination": 500.0}}, {"start": {**start, "inclination": 0.0}}),
        timing={"step": 60.0, "duration": 60.0 * 194},
    )
    along_track = simulate(whole).position[:, :, 1]
    tilted, coplanar = along_track[97:194].mean(axis=0) - along_track[:97].mean(axis=0)
    strength = 0.5 * 1.0826e-3 * (6378.1 / 7000.0) ** 2
    assert tilted - coplanar == pytest.approx(-math.tau * 10.5 * strength * math.sin(2.0) * 500.0, rel=0.02)
    assert abs(coplanar) < 1.0


def test_what_cannot_be_is_named(folder):
    start = {"kind": "eccentricity_inclination", "eccentricity": 100.0, "inclination": 100.0}
    bad = [
        (
            {"start": start, "position_error": [1.0, 0.0, 0.0]},
            "the start of satellite sat0: it says where the satellite is; leave position_error out",
        ),
        ({"start": {**start, "eccentricity": -1.0}}, "greater than or equal to 0"),
        ({"start": {"kind": "keplerian", "semi_major_axis": 7e6, "inclination": 1.0}}, "found none"),
        ({"start": {"kind": "tle"}}, "give exactly one of file and lines"),
        ({"start": {"kind": "oem", "file": "none.oem"}}, "the file none.oem"),
        ({"start": {"kind": "cartesian", "frame": "GCRF", "position": [0, 0, 0], "velocity": [0, 0, 0]}}, ""),
    ]
    for own, expected in bad[:-1]:
        ((_, sentence),) = sentences(KEPLERIAN, satellites=(own,))
        assert expected in sentence
    ((_, sentence),) = sentences(None, {"kind": "cw"}, ({"start": bad[-1][0]["start"]},))
    assert "give orbit.chief, or a truth model that has both" in sentence
    with pytest.raises(ScenarioError, match="has states from"):
        read(
            folder,
            {**KEPLERIAN, "epoch": "2024-01-02T00:00:00"},
            satellites=({"start": {"kind": "oem", "file": "chief.oem"}},),
        )
    with pytest.raises(ScenarioError, match="has states from"):
        read(folder, {"kind": "oem", "file": "chief.oem", "epoch": "2024-01-02T00:00:00"})


def test_a_chief_that_cannot_fly_is_named():
    ((field, sentence),) = sentences({**CARTESIAN, "velocity": [20_000.0, 0.0, 0.0]})
    assert "makes no ellipse" in sentence
    assert field.startswith("orbit.chief")
    ((field, sentence),) = sentences({**KEPLERIAN, "eccentricity": 0.5})
    assert "lies inside the Earth" in sentence
    ((_, sentence),) = sentences({**KEPLERIAN, "epoch": "2024-01-01T00:00:00Z", "time_scale": "TAI"})
    assert "has a time zone, and TAI knows none" in sentence


@pytest.mark.parametrize("epoch", ["0001-01-01T00:00:00+05:00", "9999-12-31T23:59:59-05:00"])
def test_an_epoch_that_utc_does_not_know_is_named(epoch):
    ((field, sentence),) = sentences({**KEPLERIAN, "epoch": epoch})
    assert field.startswith("orbit.chief")
    assert f"the epoch {epoch} lies beyond the years 1 to 9999 in UTC" in sentence
    for kind in ("inertial", "cw_perturbed"):
        ((field, sentence),) = sentences(None, {"kind": kind, "epoch": epoch})
        assert field == "dynamics.epoch"
        assert "lies beyond the years 1 to 9999 in UTC" in sentence


def test_a_start_for_all_is_no_default():
    ((field, _),) = sentences(
        satellites=({},),
        satellite_defaults={
            "start": {"kind": "tle"},
            "curve": {"kind": "circle", "radius": 1.0},
            "controller": {"kind": "coast"},
        },
    )
    assert field == "satellite_defaults.start"
