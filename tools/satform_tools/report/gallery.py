# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes the gallery in `docs/`: a picture and the figures of one flight of every shipped scenario.

Each PNG file contains the digest of its scenario and the figures of the flight as text. The page is
written from these texts; a digest that differs from the scenario's shows that a picture is out of date.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from satform.common.exit_codes import EXIT_DONE, EXIT_MISSED
from satform.evaluation.evaluate import evaluate
from satform.flight.simulate import simulate
from satform.plot.style import STYLE
from satform.scenario import Scenario
from satform.scenario.expectation import Verdict
from satform_tools import console
from satform_tools.report import gallery_picture
from satform_tools.report.plots.overview import overview
from satform_tools.run import scenario_library

FOLDER = scenario_library.ROOT / "docs" / "gallery"
"""Folder of the pictures."""

PAGE = scenario_library.ROOT / "docs" / "gallery.md"
"""The page with the pictures."""

_DIGEST = "Scenario digest"
_FIGURES = "Figures"
_DOTS_PER_INCH = 60
_FIGURES_SHOWN = 4
_INTRODUCTION = """# Gallery

One flight of every shipped scenario: its picture and the figures that it is judged by, made by
`./tools/satform gallery`. The expected values come from papers, closed forms and other programs, or are
regression figures of satform ([expectations](expectations.md)). The equations of the control laws and the
printed figures of the papers are on the pages of the [controllers](controllers/index.md).
"""


def make(names: Sequence[str], *, stale: bool) -> int:
    """Fly scenarios, draw them, and write the page with all pictures.

    Args:
        names: of the scenarios to fly; all when empty.
        stale: whether to skip scenarios whose picture is up to date.

    Returns:
        Exit code: 1 when a scenario missed an expectation.

    Raises:
        CommandError: a name is not that of a shipped scenario.
        ScenarioError: a scenario cannot fly.
        OSError: the pictures or the page cannot be written.
    """
    known = scenario_library.names()
    gallery_picture.prepare(FOLDER, names, known, "scenario")
    missed = 0
    for name in names or known:
        scenario = scenario_library.load(name)
        if not (stale and is_current(scenario)):
            missed += not _fly_and_draw(scenario)
    PAGE.write_text(page(), encoding="utf-8")
    console.line(f"{PAGE.relative_to(scenario_library.ROOT)} is written")
    return EXIT_MISSED if missed else EXIT_DONE


def page() -> str:
    """The text of the page: title, picture and figures of each scenario, sorted by name."""
    parts = [_INTRODUCTION]
    for name in scenario_library.names():
        parts.append(_entry(scenario_library.load(name)))
    return "\n".join(parts)


def picture(name: str) -> Path:
    """Path of the picture of a scenario."""
    return FOLDER / f"{name}.png"


def is_current(scenario: Scenario) -> bool:
    """Whether the picture of a scenario was made from its present content."""
    return _text(scenario.name).get(_DIGEST) == scenario.digest()


def save(drawn: Figure, scenario: Scenario, verdicts: Sequence[Verdict], file: Path) -> None:
    """Write a picture in reduced size, with digest and figures as text inside.

    Args:
        drawn: the picture.
        scenario: of the flight.
        verdicts: on the flight.
        file: PNG; replaced if it is there.

    Raises:
        OSError: the file cannot be written.
    """
    figures = [
        {
            "label": verdict.label,
            "figure": console.number(verdict.figure),
            "unit": verdict.unit,
            "met": verdict.met,
        }
        for verdict in verdicts
    ]
    text = (_FIGURES, json.dumps(figures, ensure_ascii=False))
    gallery_picture.save(drawn, file, _DOTS_PER_INCH, (_DIGEST, scenario.digest()), text)


def _fly_and_draw(scenario: Scenario) -> bool:
    record = simulate(scenario)
    verdicts = evaluate(scenario, record)
    with mpl.rc_context(STYLE):
        save(overview(scenario, record), scenario, verdicts, picture(scenario.name))
    met = all(verdict.met for verdict in verdicts)
    console.line(f"{scenario.name}: {'as expected' if met else 'MISSED'}", "" if met else "bold red")
    return met


def _entry(scenario: Scenario) -> str:
    name, title = scenario.name, " ".join(scenario.title.split())
    lines = [f"## {name}", "", f"{title} ([scenario](../scenarios/{name}.yaml))."]
    text = _text(name)
    if text:
        lines += ["", f"![{title}](gallery/{name}.png)", "", _judgement(json.loads(text[_FIGURES]), scenario)]
    return "\n".join([*lines, ""])


def _judgement(figures: Sequence[dict[str, Any]], scenario: Scenario) -> str:
    """How many expectations are met, and the first figures; missed ones come first."""
    met = sum(figure["met"] for figure in figures)
    shown = sorted(figures, key=lambda figure: bool(figure["met"]))[:_FIGURES_SHOWN]
    parts = [
        f"{figure['label']} {figure['figure']} {figure['unit']}".rstrip()
        + ("" if figure["met"] else " (**missed**)")
        for figure in shown
    ]
    more = "; ..." if len(figures) > len(shown) else "."
    own = sum(expectation.regression for expectation in scenario.expect)
    regression = f" ({own} of them regression figures)" if own else ""
    return f"{met} of {len(figures)} expectations met{regression}: {'; '.join(parts)}{more}"


def _text(name: str) -> dict[str, str]:
    """The text inside the picture of a scenario; empty when there is no readable picture."""
    return gallery_picture.texts(picture(name), {_DIGEST, _FIGURES})
