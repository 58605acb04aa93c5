"""The gallery in `docs/`: every scenario that comes with the project, flown, judged and drawn.

A picture carries the digest of the scenario that it shows and the figures of its flight, as text inside
the PNG file. The page is made of these, so that whoever holds a picture against its scenario sees
whether it is of today.
"""

import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from satform.common.exit_codes import EXIT_DONE, EXIT_MISSED
from satform.evaluation.tracking import Verdict, judge
from satform.flight.simulate import simulate
from satform.scenario import Scenario
from satform_tools import console
from satform_tools.errors import CommandError
from satform_tools.report.plots.overview import overview
from satform_tools.report.plots.style import STYLE
from satform_tools.run import scenario_library

FOLDER = scenario_library.ROOT / "docs" / "gallery"
"""Where the pictures are."""

PAGE = scenario_library.ROOT / "docs" / "gallery.md"
"""The page that shows them."""

_DIGEST = "Scenario digest"
_FIGURES = "Figures"
_DOTS_PER_INCH = 60
_COLOURS = 256
_FIGURES_SHOWN = 4
_INTRODUCTION = """# Gallery

Every scenario that comes with the project, as `./tools/satform gallery` flew, judged and drew it. What is
expected comes from papers, theory and other programs, or is a regression figure of this software
([expectations](expectations.md)).
"""


def make(names: Sequence[str], *, stale: bool) -> int:
    """Fly scenarios, draw them, and write the page that shows every picture there is.

    Args:
        names: of the scenarios to fly; all when empty.
        stale: whether to pass over those whose picture shows the scenario as it is now.

    Returns:
        Exit code: 1 when a scenario did not give what it expects.

    Raises:
        CommandError: a name is not that of a scenario that comes with the project.
        ScenarioError: a scenario cannot fly.
        OSError: the pictures or the page cannot be written.
    """
    known = scenario_library.names()
    for name in names:
        if name not in known:
            raise CommandError(
                f"{name!r} is no scenario that comes with the project; name some of {', '.join(known)}"
            )
    FOLDER.mkdir(parents=True, exist_ok=True)
    for file in FOLDER.glob("*.png"):
        if file.stem not in known:
            file.unlink()
    missed = 0
    for name in names or known:
        scenario = scenario_library.load(name)
        if not (stale and is_current(scenario)):
            missed += not _fly_and_draw(scenario)
    PAGE.write_text(page(), encoding="utf-8")
    console.line(f"{PAGE.relative_to(scenario_library.ROOT)} is written")
    return EXIT_MISSED if missed else EXIT_DONE


def page() -> str:
    """The text of the page: title, picture and figures of each scenario, in the order of their names."""
    parts = [_INTRODUCTION]
    for name in scenario_library.names():
        parts.append(_entry(scenario_library.load(name)))
    return "\n".join(parts)


def picture(name: str) -> Path:
    """Where the picture of a scenario is."""
    return FOLDER / f"{name}.png"


def is_current(scenario: Scenario) -> bool:
    """Whether the picture of a scenario shows it as it is now."""
    return _text(scenario.name).get(_DIGEST) == scenario.digest()


def save(drawn: Figure, scenario: Scenario, verdicts: Sequence[Verdict], file: Path) -> None:
    """Write a picture, small, with what it shows inside.

    Args:
        drawn: the picture.
        scenario: what was flown.
        verdicts: on the flight.
        file: PNG; replaced if it is there.

    Raises:
        OSError: the file cannot be written.
    """
    buffer = io.BytesIO()
    drawn.savefig(buffer, format="png", dpi=_DOTS_PER_INCH)
    figures = [
        {
            "label": verdict.label,
            "figure": console.number(verdict.figure),
            "unit": verdict.unit,
            "met": verdict.met,
        }
        for verdict in verdicts
    ]
    text = PngInfo()
    text.add_text(_DIGEST, scenario.digest())
    text.add_itxt(_FIGURES, json.dumps(figures, ensure_ascii=False))
    with Image.open(buffer) as image:
        few = image.convert("RGB").quantize(_COLOURS, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
        few.save(file, optimize=True, pnginfo=text)


def _fly_and_draw(scenario: Scenario) -> bool:
    record = simulate(scenario)
    verdicts = judge(scenario.expect, record, scenario)
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
    """How many figures are as expected, and the first of them; those that are not come first."""
    met = sum(figure["met"] for figure in figures)
    shown = sorted(figures, key=lambda figure: bool(figure["met"]))[:_FIGURES_SHOWN]
    words = [
        f"{figure['label']} {figure['figure']} {figure['unit']}".rstrip()
        + ("" if figure["met"] else " (**missed**)")
        for figure in shown
    ]
    more = "; ..." if len(figures) > len(shown) else "."
    own = sum(expectation.regression for expectation in scenario.expect)
    regression = f" ({own} of them regression figures)" if own else ""
    return f"{met} of {len(figures)} figures as expected{regression}: {'; '.join(words)}{more}"


def _text(name: str) -> dict[str, str]:
    """What is written inside the picture of a scenario; nothing when there is none that can be read."""
    try:
        with Image.open(picture(name)) as image:
            image.load()
            return {str(key): str(value) for key, value in image.info.items() if key in {_DIGEST, _FIGURES}}
    except OSError:
        return {}
