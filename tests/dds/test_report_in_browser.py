# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A report as its reader sees it: in a real browser, wide and narrow, light and dark."""

import dataclasses
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flights import shortened
from satform.bag.events import Events, Status
from satform.flight.simulate import simulate
from satform_tools.report.comparison import compare
from satform_tools.report.page.render import page_of, page_of_both
from satform_tools.run.stored_run import StoredRun
from satform_tools.scene.browser import Browser, browsing, chromium

NO_BROWSER = "THE REPORT'S PAGE IS NOT TESTED: there is no Chromium here; install it (apt install chromium)"

if chromium() is None:
    warnings.warn(
        NO_BROWSER,
        stacklevel=1,
    )
pytestmark = [
    pytest.mark.unmeasured,
    pytest.mark.skipif(
        chromium() is None,
        reason=NO_BROWSER,
    ),
]

DRAWN = """[...document.querySelectorAll(".plot")].map((plot) => [
  plot.id, [...plot.querySelectorAll(".scatterlayer .trace path.js-line")]
    .filter((line) => (line.getAttribute("d") || "").length > 10).length])"""
POSITIONS = "page.scene.positions().map((point) => [...point.place])"
SYMBOLS = "page.scene.positions().map((point) => point.symbol)"
PLACE = """(() => {
  const { x, y, width, height } = document.getElementById("scene").getBoundingClientRect();
  return { x: x + scrollX, y: y + scrollY, width, height };
})()"""


def colourful_pixels(browser: Browser, file: Path) -> int:
    """How many pixels of the scene are of some colour and not grey, as a screen shows it."""
    browser.picture(file, area=browser.value(PLACE))
    pixels = np.asarray(Image.open(file).convert("RGB"), dtype=int)
    return int(np.sum(np.ptp(pixels, axis=-1) > 60))


@pytest.fixture(scope="module")
def stored() -> StoredRun:
    """A short flight of the triangle in which a satellite is lost for a while."""
    scenario = shortened("triangle", 100.0)
    record = simulate(scenario)
    complete = ((0, 1, 1), (1, 0, 1), (1, 1, 0))

    def status(step: int, alive: tuple[bool, ...], connectivity: float) -> Status:
        return Status(step, "flying", 200, record.satellites, alive, complete, connectivity, "")

    everyone = (True, True, True)
    statuses = (status(0, everyone, 3.0), status(80, (True, False, True), 2.0), status(120, everyone, 3.0))
    return StoredRun(Path("run/bag"), scenario, record, True, {}, Events(statuses, ()))


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with browsing(tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.fixture(scope="module")
def page(stored: StoredRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("page") / "report.html"
    file.write_text(page_of(stored))
    return file


@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (400, "dark")])
def test_every_figure_is_drawn_without_a_complaint_wide_and_narrow_light_and_dark(
    width: int, scheme: str, browser: Browser, page: Path, tmp_path: Path
) -> None:
    browser.complaints.clear()
    browser.requests.clear()
    browser.look(page, width, scheme)
    assert browser.complaints == []
    assert browser.requests == [page.as_uri()]
    assert browser.value("document.getElementById('trouble').hidden") is True
    lines = dict(browser.value(DRAWN))
    assert len(lines) >= 8
    assert all(count > 0 for count in lines.values()), lines
    assert lines["chart-tracking_error"] == 3
    assert lines["chart-arc_length_spread"] == 2
    assert colourful_pixels(browser, tmp_path / "scene.png") > 200
    assert browser.value("document.documentElement.scrollWidth") == width
    paper, ink = browser.value(
        "[getComputedStyle(document.body).backgroundColor, getComputedStyle(document.body).color]"
        ".map((text) => text.match(/\\d+/g).slice(0, 3).reduce((sum, part) => sum + Number(part), 0) / 765)"
    )
    assert (paper > 0.9 and ink < 0.3) if scheme == "light" else (paper < 0.2 and ink > 0.8)


def test_the_slider_moves_the_satellites_to_where_they_were(
    browser: Browser, page: Path, stored: StoredRun
) -> None:
    browser.look(page, 1280, "light")
    at_the_end = browser.value(POSITIONS)
    browser.value("""(() => {
      const slider = document.getElementById("slider");
      slider.value = "500";
      slider.dispatchEvent(new Event("input"));
      return new Promise((done) => requestAnimationFrame(() => setTimeout(done, 0)));
    })()""")
    halfway = browser.value(POSITIONS)
    assert halfway != at_the_end
    for row, places in ((100, halfway), (-1, at_the_end)):
        for place, flown in zip(places, stored.record.position[row] / 1e3, strict=True):
            assert place == pytest.approx(flown, rel=1e-6)
    assert browser.value("document.getElementById('moment').textContent") == "50.0 s"
    assert browser.value(SYMBOLS) == [0, 1, 0]  # a cross for the lost one


def test_a_satellite_that_is_switched_off_leaves_every_figure(browser: Browser, page: Path) -> None:
    browser.look(page, 1280, "light")
    browser.value("document.querySelectorAll('#chips button')[1].click()")
    shown = "document.getElementById('chart-tracking_error').data.map((trace) => trace.visible)"
    assert browser.value(shown) == [True, False, True]
    assert browser.value("page.scene.positions().map((point) => point.satellite)") == [0, 2]


def test_a_page_that_is_open_follows_the_change_to_dark(browser: Browser, page: Path) -> None:
    browser.look(page, 1280, "light")
    before = browser.value("document.getElementById('chart-control').data[0].line.color")
    changed = (
        "new Promise((done) => document.getElementById('chart-control').once('plotly_react', () => done()))"
    )
    browser.value(f"window.changed = {changed}; 0")
    browser.scheme("dark")
    browser.value("window.changed")
    assert browser.value("document.getElementById('chart-control').data[0].line.color") != before


def test_two_flights_are_drawn_on_one_page(browser: Browser, stored: StoredRun, tmp_path: Path) -> None:
    other = simulate(shortened("triangle", 50.0, "consensus.coupling_gain=2.0e-6"))
    second = dataclasses.replace(stored, record=other, complete=False, path=Path("other/bag"))
    file = tmp_path / "both.html"
    file.write_text(page_of_both(stored, second, compare(stored, second)))
    browser.complaints.clear()
    browser.look(file, 400, "light")
    assert browser.complaints == []
    lines = dict(browser.value(DRAWN))
    assert lines["chart-tracking_error"] == 6
    assert lines["chart-apart"] == 3
    assert browser.value(SYMBOLS) == [0, 0, 0, 2, 1, 2]  # diamonds for the second flight
    assert browser.value("document.documentElement.scrollWidth") == 400
