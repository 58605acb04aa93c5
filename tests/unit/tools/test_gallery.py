# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The gallery shows every shipped scenario, up to date, and nothing else."""

from pathlib import Path

import pytest
from PIL import Image

from flights import SCENARIOS, shipped, shortened
from satform.plot.style import figure
from satform.scenario.expectation import Verdict
from satform_tools.cli import main as cli
from satform_tools.report import gallery

NAMES = sorted(path.stem for path in SCENARIOS.glob("*.yaml"))
TWO = [Verdict("range", "m", 2.0, "2", met=True), Verdict("effort · Δv", "m/s", 3.0, "≤ 1", met=False)]


@pytest.mark.parametrize("name", NAMES)
def test_a_scenario_s_picture_shows_it_as_it_is_now(name: str) -> None:
    assert gallery.is_current(shipped(name)), f"make it anew: ./tools/satform gallery {name}"


def test_every_picture_is_of_a_shipped_scenario() -> None:
    assert sorted(file.stem for file in gallery.FOLDER.iterdir()) == NAMES


def test_the_page_is_what_scenarios_and_pictures_say() -> None:
    assert gallery.PAGE.read_text(encoding="utf-8") == gallery.page(), "run ./tools/satform gallery --stale"


def test_the_page_names_exactly_the_shipped_scenarios_and_shows_each() -> None:
    lines = gallery.PAGE.read_text(encoding="utf-8").splitlines()
    assert [line.removeprefix("## ") for line in lines if line.startswith("## ")] == NAMES
    shown = [line.rpartition("](")[2].rstrip(")") for line in lines if line.startswith("![")]
    assert shown == [f"gallery/{name}.png" for name in NAMES]


def test_the_pictures_together_are_small_enough_to_be_kept_with_the_code() -> None:
    assert sum(file.stat().st_size for file in gallery.FOLDER.iterdir()) < 3_000_000


@pytest.fixture
def elsewhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A folder in the place of the one in the project's `docs`."""
    monkeypatch.setattr(gallery, "FOLDER", tmp_path)
    return tmp_path


@pytest.mark.usefixtures("elsewhere")
def test_a_picture_is_out_of_date_as_soon_as_its_scenario_means_something_else() -> None:
    scenario = shipped("triangle")
    gallery.save(figure(2.0, 1.0), scenario, TWO, gallery.picture("triangle"))
    assert gallery.is_current(scenario)
    assert not gallery.is_current(shortened("triangle", 10.0))
    assert not gallery.is_current(shipped("triangle", "seed=1234"))


def test_a_picture_that_is_missing_or_torn_is_out_of_date(elsewhere: Path) -> None:
    assert not gallery.is_current(shipped("triangle"))
    gallery.save(figure(2.0, 1.0), shipped("triangle"), TWO, gallery.picture("triangle"))
    whole = gallery.picture("triangle").read_bytes()
    for torn in (b"", whole[:20], whole[: len(whole) // 2], b"not a picture"):
        (elsewhere / "triangle.png").write_bytes(torn)
        assert not gallery.is_current(shipped("triangle"))


def test_a_figure_that_was_missed_is_told_first(elsewhere: Path) -> None:
    gallery.save(figure(2.0, 1.0), shipped("triangle"), TWO, elsewhere / "triangle.png")
    told = "1 of 2 expectations met (1 of them regression figures): "
    assert told + "effort · Δv 3 m/s (**missed**); range 2 m." in gallery.page()


def test_a_picture_is_smaller_than_it_would_be_and_still_one(elsewhere: Path) -> None:
    gallery.save(figure(2.0, 1.0), shipped("triangle"), TWO, elsewhere / "triangle.png")
    with Image.open(elsewhere / "triangle.png") as image:
        assert image.size == (120, 60)
        assert image.mode == "P"


def test_a_name_that_is_no_shipped_scenario_is_refused_before_anything_flies(
    elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["gallery", "triangle", "triangel"]) == 2
    assert "'triangel' is not a shipped scenario" in capsys.readouterr().err
    assert not list(elsewhere.iterdir())
