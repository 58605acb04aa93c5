# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The pictures of a report and of the live page in `docs/`, drawn by a browser, with a digest inside."""

import asyncio
import hashlib
import io
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image

from satform.bag.events import Events
from satform.flight.simulate import simulate
from satform.scenario import Scenario
from satform_tools import console
from satform_tools.live.render import PARTS as LIVE_PARTS
from satform_tools.live.render import flight_page
from satform_tools.live.server import LiveServer
from satform_tools.live.stored_flight import StoredFlight
from satform_tools.report import gallery_picture
from satform_tools.report.page.document import PARTS, SCENE_SCRIPTS
from satform_tools.report.page.render import page_of
from satform_tools.run import scenario_library
from satform_tools.run.page_options import PageOptions
from satform_tools.run.stored_run import StoredRun
from satform_tools.scene.browser import Browser, browsing, chromium

SCENARIO = "triangle"
"""Scenario whose flight is shown."""

REPORT = scenario_library.ROOT / "docs" / "report.png"
LIVE_PAGE = scenario_library.ROOT / "docs" / "live_page.png"

_DIGEST = "Page digest"
_SHOWN_AT = 5000.0
"""Simulated time at which the live page is shown, s."""


def make(*, stale: bool) -> None:
    """Fly the scenario and draw both pictures; without a browser they stay as they are, and a note says so.

    Args:
        stale: whether to draw them only if scenario or pages have changed since.

    Raises:
        BrowserError: the browser fails.
        OSError: a picture cannot be written.
    """
    if chromium() is None:
        console.note(f"{REPORT.name} and {LIVE_PAGE.name} are not drawn: there is no Chromium here")
        return
    scenario = scenario_library.load(SCENARIO)
    if stale and _are_current(scenario):
        return
    stored = StoredRun(Path(scenario.name), scenario, simulate(scenario), True, {}, Events((), ()))
    with tempfile.TemporaryDirectory() as name, browsing(Path(name) / "profile") as browser:
        report = Path(name) / "report.html"
        report.write_text(page_of(stored), encoding="utf-8")
        browser.open(report.as_uri(), 1280, "light")
        _draw(browser, REPORT, scenario, (1280, 1200))
        with _served(stored) as address:
            browser.open(address, 1440, "light")
            browser.until("live.store.rows > 0 && live.state.scene")
            browser.value(f"live.seek({_SHOWN_AT})")
            for end, index in (("from", 0), ("to", 2)):
                browser.value(f"document.getElementById('measure-{end}').value = '{index}'")
            browser.value("document.getElementById('measure-to').onchange()")
            browser.value("live.state.charts.mark(live.state.now)")
            _draw(browser, LIVE_PAGE, scenario, (1440, 900))
            browser.call("Page.navigate", url="about:blank")
    console.line(f"{REPORT.name} and {LIVE_PAGE.name} are drawn")


def _are_current(scenario: Scenario) -> bool:
    wanted = _digest(scenario)
    return all(gallery_picture.texts(file, {_DIGEST}).get(_DIGEST) == wanted for file in (REPORT, LIVE_PAGE))


@contextmanager
def _served(stored: StoredRun) -> Iterator[str]:
    """The address of the live page of a flight, served by a thread for the length of the block."""
    server = LiveServer(StoredFlight(stored), flight_page(stored.scenario.title), None, PageOptions())
    over = threading.Event()
    thread = threading.Thread(target=lambda: asyncio.run(server.serve(lambda _viewers: over.is_set())))
    thread.start()
    try:
        yield server.url
    finally:
        over.set()
        thread.join()


def _draw(browser: Browser, file: Path, scenario: Scenario, size: tuple[int, int]) -> None:
    buffer = io.BytesIO()
    browser.picture(buffer, {"x": 0, "y": 0, "width": size[0], "height": size[1]})
    with Image.open(buffer) as image:
        gallery_picture.save_few_colours(image, file, {_DIGEST: _digest(scenario)})


def _digest(scenario: Scenario) -> str:
    """Digest of the scenario and of all that pages are made from."""
    found = hashlib.sha256(scenario.digest().encode())
    for folder in (PARTS, SCENE_SCRIPTS[0].parent, LIVE_PARTS):
        for file in sorted(folder.iterdir()):
            if file.suffix in {".js", ".css", ".j2"}:
                found.update(file.read_bytes())
    return found.hexdigest()
