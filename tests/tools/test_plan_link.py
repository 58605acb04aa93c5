# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Budgets of links over time as the command line gives them."""

import csv
import json
import math
from pathlib import Path

import pytest

from satform_tools.cli import main as cli

SHORT = ("plan", "link", "radio_links_spread", "--set", "timing.duration=3200.0")


def margin(distance: float) -> float:
    """Closed form of the scenario's budget: 0.1 W, 2.2 GHz, 300 K, 256 kbit/s, 25 - 40j ohm at both ends."""
    loss = (4.0 * math.pi * distance * 2.2e9 / 299792458.0) ** 2
    ratio = 0.1 * (5000.0 / 7225.0) ** 2 / (loss * 1.380649e-23 * 300.0 * 256e3)
    # Q(4.26489) is 1e-5.
    return 10.0 * math.log10(ratio / (0.5 * 4.264891**2))


def test_budgets_of_all_links_are_printed_and_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "links.csv"
    assert cli.main([*SHORT, "--json", "--csv", str(file), "--every", "400"]) == 0
    links = {
        (entry["sender"], entry["receiver"]): entry for entry in json.loads(capsys.readouterr().out)["links"]
    }
    assert len(links) == 20
    entry = links["sat1", "sat5"]
    assert entry["mismatch_loss"] == pytest.approx(2.0 * 1.59868, abs=1e-4)
    assert entry["worst"]["time"] == pytest.approx(3000.0, abs=60.0)
    for name in ("worst", "best"):
        assert entry[name]["margin"] == pytest.approx(margin(entry[name]["distance"]), abs=1e-4)
    assert entry["worst"]["distance"] > 179e3
    assert entry["worst"]["margin"] < -17.0 < 1.0 < entry["best"]["margin"]
    assert entry["blocked"] == 0.0
    assert 0.0 < entry["delivered"] < 1.0 - entry["closed"] + 0.2
    with file.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 20 * 8
    assert sorted({float(row["time_s"]) for row in rows}) == [400.0 * number for number in range(8)]
    for row in rows:
        assert float(row["margin_db"]) == pytest.approx(margin(float(row["distance_m"])), abs=1e-4)
        assert float(row["light_time_s"]) == pytest.approx(float(row["distance_m"]) / 299792458.0)
    assert cli.main([*SHORT]) == 0
    shown = capsys.readouterr().out
    assert "mismatch 3.20 dB, required Eb/N0 9.59 dB: all links" in shown
    assert shown.count("at 180 km") == 2


def test_a_terminal_that_cannot_point_at_the_other_satellite_has_no_gain(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    laser = (
        "links.default.channel={kind: optical, wavelength: 1.55e-6, power: 1.0, rate: 1.0e9, "
        "divergence: 1.0e-4, aperture: 0.1, field_of_regard: 0.1, boresight: [0, 0, 1]}"
    )
    file = tmp_path / "links.csv"
    words = ["plan", "link", "radio_links_spread", "--set", "timing.duration=100.0", "--set", laser]
    assert cli.main([*words, "--csv", str(file)]) == 0
    shown = capsys.readouterr().out
    assert shown.count("no gain") >= 20
    assert "-3009" not in shown
    assert "inf" not in shown.replace("/", " ").split()
    with file.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert {(row["blocked"], row["ratio_db"], row["margin_db"]) for row in rows} == {("0", "", "")}
    assert cli.main([*words, "--json"]) == 0
    (entry, *_) = json.loads(capsys.readouterr().out)["links"]
    assert (entry["blocked"], entry["no_gain"], entry["worst"], entry["best"]) == (0.0, 1.0, None, None)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ("plan", "link", "triangle"),
            "triangle: no link has a radio or optical channel; give one a `channel`",
        ),
        ((*SHORT, "--every", "-1"), "--every -1: takes a positive time in s"),
        ((*SHORT, "--set", "graph={kind: none}"), "the graph has no edge over a radio or optical link"),
        ((*SHORT, "--csv", "/nowhere/at/all.csv"), "/nowhere/at/all.csv: cannot be written"),
    ],
)
def test_what_has_no_budget_is_one_sentence(
    words: tuple[str, ...], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(list(words)) == 2
    shown = capsys.readouterr().err
    assert sentence in shown
    assert "Traceback" not in shown
