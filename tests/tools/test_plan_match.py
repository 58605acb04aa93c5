# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Matching of an antenna as the command line gives it, and its Smith chart in a browser."""

import json
from pathlib import Path

import pytest

from satform.common.physical_constants import SPEED_OF_LIGHT
from satform.communication.line_matching import Line
from satform_tools.cli import main as cli
from satform_tools.scene.browser import browsing, chromium

EXAMPLE = ("plan", "match", "--load", "25-40j", "--z0", "50", "--length", "0.18", "--frequency", "2.2e9")
WAVELENGTH = SPEED_OF_LIGHT / 2.2e9
LINE = Line(25.0 - 40.0j, 50.0, 0.18 / WAVELENGTH)


def test_figures_are_printed_as_json_and_as_text(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main([*EXAMPLE, "--json", "--out", str(tmp_path / "json")]) == 0
    found = json.loads(capsys.readouterr().out)
    assert complex(*found["reflection"]) == LINE.reflection
    assert complex(*found["input_impedance"]) == LINE.input_impedance
    for name in ("standing_wave_ratio", "return_loss", "mismatch_loss"):
        assert found[name] == getattr(LINE, name)
    for entry, stub in zip(found["stubs"], LINE.stubs(), strict=True):
        lengths = [entry[name] / WAVELENGTH for name in ("position", "short", "open")]
        assert lengths == pytest.approx([stub.position, stub.short, stub.open], rel=1e-12)
    assert (tmp_path / "json" / "smith_chart.png").read_bytes().startswith(b"\x89PNG")
    assert cli.main([*EXAMPLE, "--out", str(tmp_path / "text")]) == 0
    shown = capsys.readouterr().out
    for text in ("0.55494 at -93.9329 deg", "3.49378", "86.7438+79.8129j ohm", "5.11508 dB", "1.59868 dB"):
        assert text in shown


@pytest.mark.parametrize(
    ("load", "sentence"),
    [
        ("50", "The load is matched: no stub is needed."),
        ("-30j", "The load takes no power: no stub matches it."),
        ("j", "The load takes no power: no stub matches it."),
        ("-j", "The load takes no power: no stub matches it."),
        ("1e-20+1j", "The load takes no power: no stub matches it."),
        ("1e16", "The load takes no power: no stub matches it."),
    ],
)
def test_a_load_that_no_stub_helps_is_said(
    load: str, sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["plan", "match", f"--load={load}", "--out", str(tmp_path / "out")]) == 0
    shown = capsys.readouterr().out
    assert sentence in shown
    assert "-0 dB" not in shown


def test_a_short_circuit_at_a_quarter_wavelength_has_an_infinite_input_impedance(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("plan", "match", "--load", "0", "--z0", "50", "--frequency", "2.2e9")
    quarter = ("--length", "0.034067324772727275")
    assert cli.main([*words, *quarter, "--out", str(tmp_path / "text")]) == 0
    shown = capsys.readouterr().out
    assert "infinite ohm" in shown
    assert "-0 dB" not in shown
    assert cli.main([*words, *quarter, "--out", str(tmp_path / "json"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["input_impedance"] is None
    assert found["return_loss"] == 0.0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--load", "soft"), "--load soft: takes an impedance in ohm such as 75, 25-40j or 25-j40"),
        (("--load=-5+1j",), "--load -5+1j: the load is -5+1j ohm; its resistance is not negative"),
        (("--load", "75", "--z0", "0"), "--z0 0: takes more than 0"),
        (("--load", "75", "--length", "-1"), "--length -1: takes 0 to"),
        (("--load", "75", "--frequency", "nan"), "--frequency nan: takes more than 0"),
        (
            ("--load", "75", "--velocity-factor", "1.5"),
            "--velocity-factor 1.5: takes more than 0 and at most 1",
        ),
    ],
)
def test_bad_input_is_one_sentence(
    options: tuple[str, ...], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["plan", "match", *options]) == 2
    shown = capsys.readouterr().err
    assert words in shown
    assert "Traceback" not in shown


@pytest.mark.unmeasured
@pytest.mark.skipif(chromium() is None, reason="there is no Chromium here, in which the page is opened")
def test_the_load_is_dragged_on_the_page_and_its_figures_are_those_of_the_library(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main([*EXAMPLE, "--out", str(tmp_path / "out")]) == 0
    page = tmp_path / "out" / "smith_chart.html"
    with browsing(tmp_path / "profile") as browser:
        browser.look(page, 1200, "light")

        def compare(line: Line) -> None:
            found = browser.value("JSON.parse(JSON.stringify(solved))")
            assert complex(*found["load"]) == pytest.approx(line.reflection, abs=1e-12)
            assert complex(*found["impedance"]) == pytest.approx(line.input_impedance, rel=1e-9)
            for name, value in (
                ("ratio", line.standing_wave_ratio),
                ("returned", line.return_loss),
                ("mismatch", line.mismatch_loss),
            ):
                assert found[name] == pytest.approx(value, rel=1e-9)
            for drawn, stub in zip(found["stubs"], line.stubs(), strict=True):
                for name in ("position", "short", "open"):
                    assert drawn[name] == pytest.approx(getattr(stub, name), rel=1e-9)

        compare(LINE)
        left, top, width = browser.value(
            "(() => { const b = document.getElementById('chart').getBoundingClientRect();"
            " return [b.left, b.top, b.width]; })()"
        )

        def mouse(kind: str, point: complex) -> None:
            x = left + (point.real + 1.18) / 2.36 * width
            y = top + (1.18 - point.imag) / 2.36 * width
            browser.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

        target = 0.236 + 0.118j
        mouse("mousePressed", LINE.reflection)
        mouse("mouseMoved", target)
        mouse("mouseReleased", target)
        state = browser.value("state")
        moved = Line(complex(state["resistance"], state["reactance"]), 50.0, LINE.length)
        # A pixel of the chart is 1 / 300 of a reflection coefficient.
        assert moved.reflection == pytest.approx(target, abs=5e-3)
        compare(moved)
        entry = browser.value("['cx', 'cy'].map((n) => +document.getElementById('input').getAttribute(n))")
        assert complex(entry[0], -entry[1]) == pytest.approx(moved.reflection_at(moved.length), abs=1e-9)
        assert browser.complaints == []
        assert browser.requests == [page.as_uri()]
