# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Orbit messages, time and frames against Orekit, which shares no code with satform or brahe."""

import json
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import brahe
import numpy as np
import pytest

from flights import shipped
from satform.dynamics.orbital_forces import FullEarthRotation, brahe_epoch
from satform.flight.orbit_messages import ephemerides, fitted_elements, oem_text, omm_text
from satform.flight.simulate import simulate
from satform.orbits.chief import ChiefOrbitSpec
from satform.orbits.earth import GRAVITATIONAL_PARAMETER
from satform.orbits.frames import lvlh_frame
from satform.orbits.orbit_files import from_lines

ROOT = Path(__file__).parents[2]
PACKAGES = ROOT / ".venv" / "orekit"
pytestmark = [
    pytest.mark.unmeasured,
    pytest.mark.skipif(
        not PACKAGES.is_dir(), reason="NOT TESTED: Orekit is not installed; requirements-orekit.txt says how"
    ),
]
LINES = (
    "1 25544U 98067A   24065.25486111  .00016717  00000-0  10270-3 0  9005",
    "2 25544  51.6400 208.9163 0006317  69.9862  25.2906 15.49815301 10008",
)
DATES = ("2018-02-03T04:05:06", "2024-03-05T06:07:08")


def checked(line: str) -> str:
    """Two-line elements with their checksum."""
    digits = sum(int(own) if own.isdigit() else own == "-" for own in line[:68])
    return f"{line[:68]}{digits % 10}"


def elements() -> np.ndarray:
    generator = np.random.default_rng(2)
    rows = generator.uniform(0.05, 3.0, (12, 6))
    rows[:, 0], rows[:, 1] = generator.uniform(7.0e6, 4.5e7, 12), np.linspace(0.0, 0.95, 12)
    return rows


def states() -> np.ndarray:
    """Of a chief on an eccentric orbit and of others around it, shape (n, 6)."""
    spec = ChiefOrbitSpec(
        eccentricity=0.4, inclination=1.0, argument_of_perigee=2.0, argument_of_latitude=1.0
    )
    chief = np.concatenate(spec.state(4e-4, GRAVITATIONAL_PARAMETER))
    around = np.random.default_rng(4).normal(size=(5, 6)) * np.repeat([1e4, 10.0], 3)
    return np.concatenate((chief[None], chief + around))


@pytest.fixture(scope="module")
def flown() -> Any:
    """Ephemeris of a satellite of the shipped scenario with a chief by two-line elements."""
    return ephemerides(simulate(shipped("ground_contacts").with_({"timing.duration": 4000.0})))[1]


@pytest.fixture(scope="module")
def orekit(flown: Any, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Everything that is asked of Orekit, from one Java machine."""
    folder = tmp_path_factory.mktemp("orekit")
    (folder / "flown.oem").write_text(oem_text(flown, "a comment"))
    (folder / "flown.omm").write_text(omm_text(flown, fitted_elements(flown)))
    own = states().tolist()
    (folder / "asked.json").write_text(
        json.dumps(
            {
                "ephemeris": {"path": str(folder / "flown.oem"), "times": [10.0, 1990.0, 3990.0]},
                "mean_elements": {"path": str(folder / "flown.omm"), "times": flown.times.tolist()},
                "from_lines": {"lines": [checked(line) for line in LINES], "times": [0.0]},
                "earth_fixed": {"dates": list(DATES)},
                "relative": {"chief": own[0], "others": own[1:]},
                "from_elements": {"rows": elements().tolist(), "parameter": brahe.GM_EARTH},
            }
        )
    )
    program = [sys.executable, str(ROOT / "tests" / "orekit_values.py"), str(PACKAGES)]
    done = subprocess.run(
        [*program, str(folder / "asked.json")], capture_output=True, text=True, timeout=120.0, check=False
    )
    assert done.returncode == 0, done.stderr
    answers: dict[str, Any] = json.loads(done.stdout)
    return answers


def test_an_ephemeris_has_in_orekit_the_states_of_the_flight(flown: Any, orekit: dict[str, Any]) -> None:
    read = orekit["ephemeris"]
    assert read["object"] == flown.name.upper()
    assert read["frame"] == "GCRF"
    assert read["times"] == flown.times.tolist()
    begin = datetime.fromisoformat(read["begin"])
    assert abs((begin - flown.epoch.astimezone(UTC)).total_seconds()) < 1e-3
    found = np.array(read["states"])
    assert np.abs(found[:, :3] - flown.position).max() <= 0.5e-3 + 1e-8
    assert np.abs(found[:, 3:] - flown.velocity).max() <= 0.5e-6 + 1e-11
    # Between two states 20 s apart a cubic is h^4/384 times the fourth derivative n^4 a off, 3.6 mm.
    middle = np.array(read["between"])
    exact = simulate(shipped("ground_contacts").with_({"timing.duration": 4000.0, "timing.step": 10.0}))
    position = exact.inertial_position[[1, 199, 399], 0]
    assert np.linalg.norm(middle[:, :3] - position, axis=-1).max() < 6e-3


def test_mean_elements_have_in_orekit_the_motion_that_was_fitted(flown: Any, orekit: dict[str, Any]) -> None:
    residual = fitted_elements(flown).residual
    chosen = np.unique(np.linspace(0, len(flown.times) - 1, 60).round().astype(int))
    off = np.array(orekit["mean_elements"])[chosen, :3] - flown.position[chosen]
    assert np.sqrt(np.mean(np.sum(off**2, axis=-1))) == pytest.approx(residual, abs=0.1)


def test_two_line_elements_are_in_orekit_where_brahe_has_them(orekit: dict[str, Any]) -> None:
    motion = from_lines([checked(line) for line in LINES], "these lines")
    found, expected = motion.state_at(motion.epoch), np.array(orekit["from_lines"][0])
    # brahe's SGP4 has the constants of WGS 84, Orekit's those of WGS 72.
    assert 1.0 < np.linalg.norm(found.position - expected[:3]) < 30.0
    assert np.linalg.norm(found.velocity - expected[3:]) < 0.03


def test_the_earth_turns_as_orekit_says(orekit: dict[str, Any]) -> None:
    for date, expected in zip(DATES, orekit["earth_fixed"], strict=True):
        found = FullEarthRotation(brahe_epoch(datetime.fromisoformat(date).replace(tzinfo=UTC))).matrix(0.0)
        # 0.6 mm on the ground.
        assert np.abs(found - np.array(expected)).max() < 1e-10


def test_motion_relative_to_a_chief_is_that_in_orekits_local_orbital_frame(orekit: dict[str, Any]) -> None:
    own = states()
    frame = lvlh_frame(own[:1, :3], own[:1, 3:])
    found = np.concatenate(frame.to_lvlh(own[1:, :3], own[1:, 3:]), axis=-1)
    np.testing.assert_allclose(found[:, :3], np.array(orekit["relative"])[:, :3], rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(found[:, 3:], np.array(orekit["relative"])[:, 3:], rtol=0.0, atol=1e-10)


def test_elements_become_the_states_that_orekit_has(orekit: dict[str, Any]) -> None:
    found = brahe.state_koe_to_eci(elements(), brahe.AngleFormat.RADIANS)
    np.testing.assert_allclose(found, np.array(orekit["from_elements"]), rtol=1e-11, atol=1e-6)
