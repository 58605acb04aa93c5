# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The page on the Python library: its code is the script's, and the script runs."""

import os
import re
import subprocess
import sys
from pathlib import Path

import satform.plot
from bag_writing import messages_of, write
from flights import shortened
from satform.flight.simulate import simulate

DOCS = Path(__file__).resolve().parents[3] / "docs"
SCRIPT = DOCS / "python_library.py"
PAGE = DOCS / "python_library.md"


def cells(script: str) -> dict[str, str]:
    """Code of each cell by its heading."""
    parts = re.split(r"^# %% ", script, flags=re.MULTILINE)[1:]
    return {heading: code.strip("\n") for heading, _, code in (part.partition("\n") for part in parts)}


def test_the_page_shows_the_cells_of_the_script_under_their_headings() -> None:
    shown = re.findall(
        r"^## ([^\n]+)\n(?:(?!^## ).)*?^```python\n(.*?)\n```$",
        PAGE.read_text(encoding="utf-8"),
        re.MULTILINE | re.DOTALL,
    )
    assert dict(shown) == cells(SCRIPT.read_text(encoding="utf-8"))


def test_the_page_names_every_figure() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert [name for name in satform.plot.__all__ if f"`{name}`" not in page] == []


def test_a_scenario_takes_no_more_than_fifteen_lines() -> None:
    code = cells(SCRIPT.read_text(encoding="utf-8"))["Build a scenario"]
    built = code[code.index("scenario = ") : code.index("print(")]
    assert len(built.strip().splitlines()) <= 15


def test_the_script_builds_flies_varies_draws_and_reads_a_bag(tmp_path: Path) -> None:
    scenario = shortened("triangle", 20.0)
    write(tmp_path / "runs" / "flown" / "bag", scenario, messages_of(simulate(scenario)))
    done = subprocess.run(
        [sys.executable, SCRIPT],
        cwd=tmp_path,
        env={**os.environ, "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.stderr == ""
    said = done.stdout
    assert "<Scenario formation: 3 satellites, cw, 1500 steps of 4 s>" in said
    assert "<FlightRecord of sat1, sat2, sat3: 1500 steps of 4 s, 6000 s in all>" in said
    # Four times the coupling gain agrees sooner: the slow mode of the consensus decays faster.
    low, high = map(float, re.findall(r"phases differ by ([\d.]+) m", said))
    assert high < 0.01 * low
    assert re.search(r"largest tracking error after 3000 s: [\d.]+ m, met", said)
    assert "there is no such field; did you mean boundary_layer?" in said
    assert "<Scenario triangle: 3 satellites, cw, 40 steps of 0.5 s> <FlightRecord of" in said
    assert "complete: True" in said
    assert all((tmp_path / name).stat().st_size > 5000 for name in ("tracking_error.png", "orbits.png"))
