# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A flight depends on the Earth orientation that its own scenario names, and on no other."""

import json
import math
from datetime import UTC, datetime

import brahe
import numpy as np
import pytest
from pydantic import ValidationError

from earth_orientation_table import finals
from satform.dynamics.orbital_forces import FullEarthRotation
from satform.dynamics.protocol import DynamicsSetting
from satform.dynamics.specs import GravitySpec
from satform.dynamics.truth_models import InertialDynamicsSpec
from satform.files.named_file import FileSource, NamedFile
from satform.flight.simulate import simulate
from satform.orbits.earth_orientation import from_file, without_file
from satform.orbits.time_scales import brahe_epoch
from satform.scenario import ScenarioError, load_scenario, parse_scenario, save_scenario
from satform_tools import check
from satform_tools.check import files as check_files
from satform_tools.report.formats import CheckFormat
from satform_tools.run import command as run_command

EPOCH = datetime(2024, 1, 1, tzinfo=UTC)
SCENARIO = """\
name: base
title: Two satellites on circles
text: small
orbit: {period: 6000.0}
timing: {step: 10.0, duration: 60.0}
dynamics:
  kind: inertial
  gravity:
    degree: 2
    rotation: full
    orientation_file: eop.txt
graph: {kind: complete}
consensus: {kind: arc_length, tracking_gain: 1.0e-3, coupling_gain: 1.0e-6, rate_gain: 1.0e-3}
nominal_motion: {period: 6000.0}
satellite_defaults:
  controller: {kind: sliding_mode, proportional_gain: 0.01, switching_gain: 0.1, reaching_gain: 0.1}
satellites:
  - {name: sat1, curve: {kind: circle, radius: 1000.0}}
  - {name: sat2, curve: {kind: circle, radius: 1000.0}, arc_length: 500.0}
"""
LINE_OF_THE_FILE = SCENARIO.splitlines().index("    orientation_file: eop.txt") + 1


def written(folder, content=None):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scenario.yaml").write_text(SCENARIO)
    if content is not None:
        (folder / "eop.txt").write_text(content)
    return folder / "scenario.yaml"


def disturb():
    """What another scenario of the same process, or the user's own program, may do to brahe."""
    brahe.set_global_eop_provider_from_static_provider(
        brahe.StaticEOPProvider.from_values(0.3, 1e-6, 1e-6, 0.0, 0.0, 0.0)
    )


def test_one_scenario_has_one_digest_whatever_was_set_before(tmp_path):
    plain = parse_scenario(SCENARIO.replace("    orientation_file: eop.txt\n", ""))
    with_file = load_scenario(written(tmp_path, finals(difference=0.5)))
    first = simulate(plain).digest()
    other = simulate(with_file).digest()
    assert other != first
    assert simulate(plain).digest() == first
    disturb()
    assert simulate(plain).digest() == first
    disturb()
    assert simulate(with_file).digest() == other


def test_flights_that_take_turns_do_not_see_each_other(tmp_path):
    files = [
        NamedFile("a", finals(difference=0.5).encode()),
        NamedFile("b", finals(pole=(9.0, 9.0)).encode()),
    ]
    specs = [
        InertialDynamicsSpec(gravity={"degree": 3, "rotation": "full", "orientation_file": file})
        for file in (*files, None)
    ]
    setting = DynamicsSetting(1e-3, 30.0, 1)
    start = np.array([[100.0, 200.0, 300.0]]), np.zeros((1, 3))

    def fly(models):
        states = [model.start(*start) for model in models]
        for step in range(4):
            states = [
                model.advance(state, np.zeros((1, 3)), step)
                for model, state in zip(models, states, strict=True)
            ]
            disturb()
        return [model.lvlh(state)[0].tobytes() for model, state in zip(models, states, strict=True)]

    single = [fly([spec.build(setting)])[0] for spec in specs]
    assert fly([spec.build(setting) for spec in specs]) == single
    assert len(set(single)) == 3


def test_the_file_turns_the_earth_by_ut1_and_moves_its_pole():
    epoch = brahe_epoch(EPOCH)
    none = FullEarthRotation(epoch).matrix(0.0)
    late = FullEarthRotation(epoch, from_file(NamedFile("a", finals(0.5, (0.0, 0.0)).encode()))).matrix(0.0)
    # The Earth turns by 1.00273781191135448 revolutions in a day of UT1 (IERS Conventions 2010, 5.15).
    turned = late @ none.T
    angle = math.atan2(turned[0, 1], turned[0, 0])
    assert angle == pytest.approx(0.5 * 1.00273781191135448 * math.tau / 86400.0, rel=1e-6)
    tilted = FullEarthRotation(epoch, from_file(NamedFile("a", finals(0.0, (0.2, 0.3)).encode()))).matrix(0.0)
    # Polar motion W = R2(x) R1(y), transposed: the pole of the crust lies x along the Greenwich
    # meridian and y to its left, 90 degrees west.
    pole = tilted @ none.T @ np.array([0.0, 0.0, 1.0])
    arcsecond = math.pi / 648000.0
    np.testing.assert_allclose(pole[:2], [0.2 * arcsecond, -0.3 * arcsecond], rtol=1e-4)


def test_beyond_its_dates_a_file_does_not_cover_an_epoch():
    orientation = from_file(NamedFile("a", finals().encode()))
    assert orientation.covers(brahe_epoch(EPOCH))
    assert not orientation.covers(brahe_epoch(datetime(2025, 1, 1, tzinfo=UTC)))


def test_check_warns_of_a_flight_that_the_file_does_not_reach(tmp_path):
    covered = load_scenario(written(tmp_path, finals()))
    assert not [said for said in check.warnings(covered) if "has no entry" in said]
    late = load_scenario(tmp_path / "scenario.yaml", ["dynamics.epoch=2025-01-01T00:00:00Z"])
    (said,) = [said for said in check.warnings(late) if "has no entry" in said]
    assert "eop.txt has no entry for 2025-01-01T00:00:00+00:00" in said


def test_the_path_counts_from_the_scenario_and_the_content_is_in_its_digest(tmp_path, monkeypatch):
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    here = load_scenario(written(tmp_path / "one", finals()))
    same = load_scenario(written(tmp_path / "two", finals()))
    other = load_scenario(written(tmp_path / "three", finals(difference=0.2)))
    assert here.digest() == same.digest() != other.digest()
    # The file of a scenario that is read already does not matter any more.
    before = simulate(here).digest()
    (tmp_path / "one" / "eop.txt").write_text(finals(difference=0.3))
    assert simulate(here).digest() == before


def test_a_setting_may_name_another_file_in_the_same_folder(tmp_path):
    file = written(tmp_path, finals())
    (tmp_path / "other.txt").write_text(finals(difference=0.2))
    changed = load_scenario(file, ["dynamics.gravity.orientation_file=other.txt"])
    assert changed.digest() != load_scenario(file).digest()


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "eop.txt (in {folder}) cannot be read: No such file or directory"),
        ("not an eop file\n", "eop.txt is not a file of Earth orientation parameters"),
        ("", "eop.txt is not a file of Earth orientation parameters"),
    ],
)
def test_a_file_that_is_missing_or_something_else_is_named_with_line_and_field(
    tmp_path, capsys, content, says
):
    file = written(tmp_path, content)
    with pytest.raises(ScenarioError) as caught:
        load_scenario(file)
    (problem,) = caught.value.problems
    assert (problem.line, problem.field) == (LINE_OF_THE_FILE, "dynamics.gravity.orientation_file")
    assert says.format(folder=tmp_path) in problem.sentence
    assert str(tmp_path / "tmp") not in problem.sentence
    assert check_files.check([str(file)], CheckFormat.TEXT) == 2
    assert "eop.txt" in capsys.readouterr().err.replace("\n", "")


def test_a_folder_in_the_place_of_the_file_is_refused(tmp_path):
    file = written(tmp_path)
    (tmp_path / "eop.txt").mkdir()
    with pytest.raises(ScenarioError, match="is a folder, not a file"):
        load_scenario(file)


def test_a_run_keeps_a_copy_and_can_be_read_where_it_has_been_moved(tmp_path):
    scenario = load_scenario(written(tmp_path / "from", finals()))
    run = tmp_path / "run"
    outcome = run_command.run(scenario, "inprocess", record=True, out=run)
    (tmp_path / "from" / "eop.txt").unlink()
    moved = run.rename(tmp_path / "moved")
    again = load_scenario(moved / "scenario.json")
    assert again.digest() == scenario.digest()
    assert simulate(again).digest() == outcome.state_hash
    name = json.loads((moved / "scenario.json").read_text())["dynamics"]["gravity"]["orientation_file"]
    assert (moved / name).read_text() == finals()
    # A copy of the copy has the same name and does not grow.
    save_scenario(again, tmp_path / "copy.json")
    assert (tmp_path / name).read_text() == finals()
    assert load_scenario(tmp_path / "copy.json").digest() == scenario.digest()


def test_files_of_one_name_and_of_unlike_content_have_copies_of_their_own():
    names = {NamedFile("x/eop.txt", text).copy_name for text in (b"1", b"2")}
    assert len(names) == 2
    assert NamedFile.read("within", FileSource(attached={"within": b"3"})).content == b"3"


def test_without_a_file_time_is_utc():
    rotation = without_file().inertial_to_fixed(brahe_epoch(EPOCH))
    brahe.set_global_eop_provider_from_static_provider(brahe.StaticEOPProvider.from_zero())
    assert np.array_equal(rotation, brahe.rotation_gcrf_to_itrf(brahe_epoch(EPOCH)))


def test_a_file_does_not_go_with_an_earth_that_turns_evenly():
    file = NamedFile("a", finals().encode())
    with pytest.raises(ValidationError, match="orientation_file belongs to rotation: full"):
        GravitySpec(orientation_file=file)
