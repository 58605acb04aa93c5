# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The live page in a real browser: a flight under way with control, and a stored flight."""

import asyncio
import os
import re
import signal
import subprocess
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from flights import shortened
from flown import processes_of
from formations import formation
from satform.bag.events import Events, Status
from satform.bag.reader import read_bag
from satform.flight.simulate import simulate
from satform_tools.live.render import flight_page
from satform_tools.live.server import LiveServer
from satform_tools.live.stored_flight import StoredFlight
from satform_tools.run.page_options import PageOptions
from satform_tools.run.stored_run import StoredRun
from satform_tools.scene.browser import Browser, browsing, chromium

NO_BROWSER = "THE LIVE PAGE IS NOT TESTED: there is no Chromium here; install it (apt install chromium)"

if chromium() is None:
    warnings.warn(NO_BROWSER, stacklevel=1)
pytestmark = [
    pytest.mark.unmeasured,
    pytest.mark.skipif(chromium() is None, reason=NO_BROWSER),
]

PLACES = "live.state.scene.positions().map((point) => [...point.place])"
REPLY = "document.getElementById('reply').textContent"
CROOKED = "document.documentElement.scrollWidth - innerWidth"


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with browsing(tmp_path_factory.mktemp("profile")) as browser:
        yield browser


def replied(browser: Browser, pattern: str) -> int:
    """Wait for a reply; the step that it names."""
    text = browser.until(f"{REPLY} !== '…' && {REPLY}")
    found = re.search(pattern, text)
    assert found, text
    return int(found[1])


def click(browser: Browser, selector: str) -> None:
    browser.value(f"document.querySelector({selector!r}).click()")


def address_of(run: subprocess.Popen[str]) -> str:
    """The address that a run prints beside its progress."""
    assert run.stderr is not None
    lines = []
    for line in run.stderr:
        if line.startswith("http://"):
            return line.strip()
        lines.append(line)
    raise AssertionError("".join(lines))


def test_a_flight_is_watched_and_controlled_and_the_bag_has_what_the_page_did(
    browser: Browser, start_run: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    endless = ("--set", "timing.duration=100000.0", "--set", "expect=[]", "--set", "node_timeout=3.0")
    run = start_run("triangle", *endless, "--live", "--control")
    address = address_of(run)
    browser.complaints.clear()
    browser.requests.clear()
    browser.open(address, 900, "light")

    # It moves.
    first = browser.value(PLACES)
    browser.until(f"live.store.rows > 5 && {PLACES}[0][0] !== {first[0][0]}")

    # The slider goes back, stays there while more arrives, and returns to now.
    browser.value("live.seek(live.store.time(1))")
    rows = browser.value("live.store.rows")
    browser.until(f"live.store.rows > {rows + 3}")
    assert browser.value("live.state.now === live.store.time(1) && live.state.row === 1")
    click(browser, "#now")
    assert browser.value("live.state.now === live.store.lastTime()")

    # Pause and step.
    click(browser, "[data-ask=pause]")
    paused = replied(browser, "pauses before step ([0-9]+)")
    browser.until("document.getElementById('phase').textContent === 'paused'")
    click(browser, "[data-ask=step]")
    assert replied(browser, "takes step ([0-9]+)") == paused

    # A gain.
    browser.value("""(() => {
      const choice = document.getElementById("gain-satellite");
      choice.value = "sat1";
      choice.onchange();
    })()""")
    field = "document.getElementById('value-controller.reaching_gain')"
    browser.until(f"{field} !== null")
    browser.value(f"{field}.value = '0.05'; {field}.nextSibling.click()")
    changed = replied(browser, "reaching_gain: takes effect at step ([0-9]+)")

    # An edge.
    box = "document.querySelector('[aria-label=\"sat1 receives from sat3\"]')"
    browser.value(f"{box}.click()")
    cut = replied(browser, "takes effect at step ([0-9]+)")

    # Resume.
    click(browser, "[data-ask=resume]")
    assert replied(browser, "continues with step ([0-9]+)") == paused + 1
    browser.until("!live.store.graphs.at(-1).pairs.some(([to, from]) => to === 0 && from === 2)")

    # A lost satellite.
    os.kill(processes_of(tmp_path / "run")["sat2"], signal.SIGKILL)
    browser.until("document.getElementById('health').rows[2].cells[1].textContent === 'lost'")
    assert browser.value("live.state.scene.positions().map((point) => point.symbol)") == [0, 1, 0]
    browser.until("[...document.querySelectorAll('#events li')].some((one) => /sat2/.test(one.textContent))")

    # The end.
    click(browser, "#stop")
    click(browser, "#stop")
    browser.until("['finished', 'aborted'].includes(document.getElementById('phase').textContent)")
    assert browser.complaints == []
    assert browser.requests == [address]
    browser.call("Page.navigate", url="about:blank")
    run.communicate(timeout=180)

    bag = read_bag(tmp_path / "run" / "bag")
    changes = [(one.step, one.satellite, one.name, list(one.value)) for one in bag.history.gain_changes]
    assert changes == [(changed, "sat1", "controller.reaching_gain", [0.05] * 3)]
    statuses = bag.history.statuses
    assert any(one.phase == "paused" for one in statuses)
    assert next(one.step for one in statuses if not one.adjacency[0][2]) == cut
    assert any(not one.alive[1] for one in statuses)


def test_a_killed_browser_and_a_frozen_tab_change_no_bit_of_the_flight(
    browser: Browser, start_run: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    run = start_run(
        "triangle", "--set", "timing.duration=100000.0", "--set", "expect=[]", "--live", "--control"
    )
    address = address_of(run)
    browser.open(address, 900, "light")
    browser.until("live.store.rows > 2")
    browser.call("Page.setWebLifecycleState", state="frozen")
    frozen_at = browser.value("live.store.status.step")
    with browsing(tmp_path / "killed") as killed:
        killed.open(address, 900, "light")
        killed_at = killed.until(f"live.store.status.step > {frozen_at} && live.store.status.step")
        assert browser.value("live.store.status.step") == frozen_at
        os.kill(killed.process, signal.SIGKILL)
    # The tab gets what it has missed when it is seen again, and the flight goes on.
    browser.call("Page.setWebLifecycleState", state="active")
    browser.call("Emulation.setFocusEmulationEnabled", enabled=True)  # as if its tab were chosen again
    browser.until(f"live.store.status.step > {killed_at + 100}")
    times = browser.value("[...live.store.columns.time.data.subarray(0, live.store.rows)]")
    assert np.all(np.diff(times) > 0.0)
    click(browser, "#stop")
    click(browser, "#stop")
    browser.until("['finished', 'aborted'].includes(document.getElementById('phase').textContent)")
    browser.call("Page.navigate", url="about:blank")
    run.communicate(timeout=180)

    bag = read_bag(tmp_path / "run" / "bag")
    steps = bag.record.steps
    assert steps > killed_at
    undisturbed = simulate(shortened("triangle", steps * bag.record.step))
    assert undisturbed.differences(bag.record) == []


@pytest.fixture(scope="module")
def stored() -> StoredRun:
    """A short flight with attitudes in which a satellite is lost."""
    scenario = shortened("formation_pointing", 60.0)
    record = simulate(scenario)
    complete = ((0, 1, 1), (1, 0, 1), (1, 1, 0))

    def status(step: int, alive: tuple[bool, ...], connectivity: float) -> Status:
        return Status(step, "flying", 120, record.satellites, alive, complete, connectivity, "")

    statuses = (status(0, (True, True, True), 3.0), status(80, (True, False, True), 2.0))
    return StoredRun(Path("run/bag"), scenario, record, True, {}, Events(statuses, ()))


@contextmanager
def served(stored: StoredRun, like: LiveServer | None = None) -> Iterator[LiveServer]:
    """A server of a stored flight in a thread; with the address of another one that has ended."""
    options = PageOptions(port=like.port if like else 0)
    server = LiveServer(StoredFlight(stored), flight_page("flight"), None, options)
    server.source.period = 0.05
    server.token = like.token if like else server.token
    over = threading.Event()
    thread = threading.Thread(target=lambda: asyncio.run(server.serve(lambda _viewers: over.is_set())))
    thread.start()
    try:
        yield server
    finally:
        over.set()
        thread.join(30)
        assert not thread.is_alive()


def test_a_stored_flight_is_shown_at_every_time_and_in_both_frames(
    browser: Browser, stored: StoredRun, tmp_path: Path
) -> None:
    record = stored.record
    browser.complaints.clear()
    browser.requests.clear()
    with served(stored) as server:
        browser.open(server.url, 1280, "light")
        browser.until(f"live.store.rows === {record.steps + 1}")
        assert np.allclose(browser.value(PLACES), record.position[-1], rtol=1e-6)
        browser.value("live.seek(20.0)")
        assert np.allclose(browser.value(PLACES), record.position[40], rtol=1e-6)
        assert browser.value("document.getElementById('health').rows[2].cells[1].textContent") == "flying"
        browser.value("live.seek(50.0)")
        assert browser.value("document.getElementById('health').rows[2].cells[1].textContent") == "lost"

        for end, index in (("from", 0), ("to", 2)):
            browser.value(f"document.getElementById('measure-{end}').value = '{index}'")
        browser.value("document.getElementById('measure-to').onchange()")
        apart = np.linalg.norm(record.position[100, 0] - record.position[100, 2]) / 1e3
        shown = browser.value("document.getElementById('distance').textContent")
        assert float(shown.removesuffix(" km")) == pytest.approx(apart, rel=1e-5)

        # The inertial view is that of the same positions: their distances stay.
        click(browser, "#frame-inertial")
        chief = browser.value("[...live.store.values('chief', 100)]")
        assert np.linalg.norm(chief[:3]) == pytest.approx(stored.scenario.orbit.radius, rel=1e-9)
        click(browser, "#frame-lvlh")
        browser.value("live.state.scene.follow(0)")
        browser.value("live.state.scene.draw()")
        middle = browser.value("live.state.scene.screen()[0]")
        size = browser.value(
            "((one) => [one.clientWidth, one.clientHeight])(document.getElementById('scene'))"
        )
        assert middle["x"] == pytest.approx(size[0] / 2, abs=1.0)
        assert middle["y"] == pytest.approx(size[1] / 2, abs=1.0)

        lines = browser.value("live.state.charts.data()")
        assert set(lines) == {"error", "spread", "control", "delta_v", "connectivity"}
        assert all(set(points) == {record.steps + 1} for points in lines.values())
        for width, scheme in ((400, "dark"), (2560, "light")):
            browser.resize(width, 1400)
            browser.scheme(scheme)
            assert browser.value(CROOKED) <= 0, f"at {width} pixels the page is wider than the window"
        assert browser.value("document.getElementById('hands').hidden") is True
        assert browser.complaints == []
        assert browser.requests == [server.url]

    # The server goes, and comes back.
    browser.until("!document.getElementById('trouble').hidden")
    assert np.allclose(browser.value(PLACES), record.position[100], rtol=1e-6)
    with served(stored, server):
        browser.until(f"document.getElementById('trouble').hidden && live.store.rows === {record.steps + 1}")


def test_of_many_satellites_three_are_labelled_and_the_one_that_is_followed(
    browser: Browser, tmp_path: Path
) -> None:
    scenario = formation([{"arc_length": 10.0 * index} for index in range(90)], 5.0)
    record = simulate(scenario)
    stored = StoredRun(Path("run/bag"), scenario, record, True, {}, Events((), ()))
    with served(stored) as server:
        browser.open(server.url, 1280, "light")
        browser.until(f"live.store.rows === {record.steps + 1}")
        browser.complaints.clear()  # the page before this one had lost its server
        browser.value("live.state.scene.look([0, 0, 1])")
        browser.value("live.state.scene.draw()")
        assert len(browser.value("live.state.scene.positions()")) == 90
        labelled = browser.value("live.state.scene.labelled()")
        assert 0 < len(labelled) <= 3
        assert 47 not in labelled
        browser.value("live.state.scene.follow(47)")
        browser.value("live.state.scene.draw()")
        assert 47 in browser.value("live.state.scene.labelled()")
        # All are on one circle, which is drawn once.
        assert browser.value("live.store.formation.orbits.filter(Boolean).length") == 1
        assert browser.value("live.state.charts.data().error") == [record.steps + 1] * 4
        assert browser.complaints == []


def test_a_flight_that_is_over_before_its_page_is_there_ends_without_it(
    start_run: Callable[..., subprocess.Popen[str]],
) -> None:
    run = start_run("triangle", "--set", "timing.duration=0.5", "--set", "expect=[]", "--live")
    _, printed = run.communicate(timeout=100)
    assert run.returncode == 0, printed
    assert "the flight was over before its page could be served" in printed


def test_the_page_is_used_by_keyboard_and_its_texts_have_contrast(
    browser: Browser, stored: StoredRun
) -> None:
    with served(stored) as server:
        browser.open(server.url, 1280, "dark")
        browser.until(f"live.store.rows === {stored.record.steps + 1}")
        before = browser.value("live.state.scene.draw(), live.state.scene.screen()[0]")
        browser.value("document.getElementById('scene').focus()")
        for kind in ("keyDown", "keyUp"):
            browser.call("Input.dispatchKeyEvent", type=kind, key="ArrowLeft", code="ArrowLeft")
        assert browser.value("live.state.scene.draw(), live.state.scene.screen()[0]") != before
        nameless = browser.value(NAMELESS)
        assert nameless == []
        for scheme in ("dark", "light"):
            browser.scheme(scheme)
            assert min(browser.value(CONTRASTS)) >= 4.5


NAMELESS = """[...document.querySelectorAll("button, input, select, [role=application]")]
  .filter((one) => !one.hidden && one.closest("[hidden]") === null)
  .filter((one) => !(one.getAttribute("aria-label") || one.textContent.trim() || one.labels?.length))
  .map((one) => one.outerHTML)"""
"""Controls that a screen reader could not name."""

CONTRASTS = """(() => {
  const linear = (part) => (part /= 255) <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4;
  const light = (css) => {
    const [r, g, b] = css.match(/[0-9a-f]{2}/gi).map((hex) => linear(parseInt(hex, 16)));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const of = (name) => light(getComputedStyle(document.documentElement).getPropertyValue(name));
  const ratio = (one, other) => (Math.max(one, other) + 0.05) / (Math.min(one, other) + 0.05);
  const names = ["--ink", "--soft", "--accent", "--good", "--bad", "--partial"];
  return names.map((name) => ratio(of(name), of("--paper")));
})()"""
"""Contrast of each colour of texts with the paper, by WCAG 2."""
