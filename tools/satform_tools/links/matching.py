# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Prints the matching of an antenna and draws its Smith chart; formulas: `communication.line_matching`."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from satform.common.physical_constants import SPEED_OF_LIGHT
from satform.communication.line_matching import Line, impedance_text, parse_impedance
from satform_tools import console
from satform_tools.console import Table
from satform_tools.errors import CommandError
from satform_tools.run import output_folders

PICTURE, PAGE = "smith_chart.png", "smith_chart.html"

_LONGEST = 1e6
"""Wavelengths of the longest line: beyond it, its phase has no digits that mean anything."""


@dataclass(frozen=True)
class MatchTask:
    """What `plan match` takes, as the command line gives it.

    Attributes:
        load: impedance of the load as text, ohm.
        characteristic: impedance of the line, ohm.
        length: of the line, m.
        frequency: Hz.
        velocity_factor: speed of a wave on the line over that of light.
        out: folder of the charts; None for a new one.
    """

    load: str
    characteristic: float
    length: float
    frequency: float
    velocity_factor: float
    out: Path | None


def match(task: MatchTask, *, as_json: bool) -> None:
    """Print the matching of a load, and draw its Smith chart as a picture and as a page.

    Args:
        task: what is asked.
        as_json: whether to print JSON.

    Raises:
        CommandError: a value is out of range, or the charts cannot be written.
    """
    wavelength = _wavelength(task)
    line = _line(task, wavelength)
    found = figures(line, wavelength)
    folder = output_folders.make(task.out, "match")
    found["picture"], found["page"] = str(folder / PICTURE), str(folder / PAGE)
    _write(folder, line, task, wavelength)
    if as_json:
        console.as_json(found)
        return
    _print(line, wavelength, found)


def figures(line: Line, wavelength: float) -> dict[str, Any]:
    """The figures of a load on a line, as JSON has them.

    Args:
        line: with its load.
        wavelength: on the line, m.
    """
    entry = line.input_impedance
    return {
        "load": _pair(line.load),
        "characteristic_impedance": line.characteristic,
        "wavelength": wavelength,
        "electrical_length": line.length,
        "reflection": _pair(line.reflection),
        "reflection_magnitude": abs(line.reflection),
        "input_reflection": _pair(line.reflection_at(line.length)),
        "input_impedance": _pair(entry) if math.isfinite(entry.real) else None,
        "standing_wave_ratio": _finite(line.standing_wave_ratio),
        "return_loss": _finite(line.return_loss),
        "mismatch_loss": _finite(line.mismatch_loss),
        "stubs": [
            {
                "position": stub.position * wavelength,
                "short": stub.short * wavelength,
                "open": stub.open * wavelength,
                "in_wavelengths": asdict(stub),
            }
            for stub in _stubs(line)
        ],
    }


def page_of(line: Line, wavelength: float, frequency: float) -> str:
    """The Smith chart as one HTML file that needs a browser, no network and no other file.

    Args:
        line: with its load.
        wavelength: on the line, m.
        frequency: Hz.
    """
    data = {
        "load": _pair(line.load),
        "characteristic": line.characteristic,
        "length": line.length,
        "wavelength": wavelength,
        "frequency": frequency,
    }
    text = (Path(__file__).parent / "smith_chart.html").read_text(encoding="utf-8")
    return text.replace("/*data*/null", json.dumps(data))


def _wavelength(task: MatchTask) -> float:
    for option, value, unit in (
        ("--z0", task.characteristic, "ohm"),
        ("--frequency", task.frequency, "Hz"),
    ):
        if not (math.isfinite(value) and 0.0 < value <= 1e15):
            raise CommandError(f"{option} {value:g}: takes more than 0 and at most 1e15 {unit}")
    if not 0.0 < task.velocity_factor <= 1.0:
        raise CommandError(f"--velocity-factor {task.velocity_factor:g}: takes more than 0 and at most 1")
    return task.velocity_factor * SPEED_OF_LIGHT / task.frequency


def _line(task: MatchTask, wavelength: float) -> Line:
    longest = _LONGEST * wavelength
    if not 0.0 <= task.length <= longest:
        raise CommandError(
            f"--length {task.length:g}: takes 0 to {longest:g} m, a million wavelengths at this frequency"
        )
    try:
        load = parse_impedance(task.load)
    except ValueError:
        raise CommandError(
            f"--load {task.load}: takes an impedance in ohm such as 75, 25-40j or 25-j40"
        ) from None
    try:
        return Line(load, task.characteristic, task.length / wavelength)
    except ValueError as error:
        raise CommandError(f"--load {task.load}: {error}") from None


def _write(folder: Path, line: Line, task: MatchTask, wavelength: float) -> None:
    import matplotlib as mpl  # noqa: PLC0415 - only drawing needs it

    from satform.plot.smith_chart import smith_chart  # noqa: PLC0415 - likewise
    from satform.plot.style import STYLE, figure  # noqa: PLC0415 - likewise

    try:
        with mpl.rc_context(STYLE):
            drawn = figure(6.4, 7.2)
            smith_chart(line, drawn.add_subplot())
            drawn.savefig(folder / PICTURE, bbox_inches="tight")
        (folder / PAGE).write_text(page_of(line, wavelength, task.frequency), encoding="utf-8")
    except OSError as error:
        raise CommandError(f"{folder}: the Smith chart cannot be written: {error.strerror}") from None


def _stubs(line: Line) -> tuple[Any, ...]:
    return line.stubs() if line.takes_power else ()


def _print(line: Line, wavelength: float, found: Mapping[str, Any]) -> None:
    reflection = line.reflection
    degrees = math.degrees(math.atan2(reflection.imag, reflection.real))
    rows = [
        ("wavelength on the line", f"{wavelength:.6g} m, of which the line has {line.length:.6g}"),
        ("reflection coefficient", f"{abs(reflection):.6g} at {degrees:.6g} deg"),
        ("standing-wave ratio", f"{line.standing_wave_ratio:.6g}"),
        ("input impedance", f"{impedance_text(line.input_impedance)} ohm"),
        ("return loss", f"{line.return_loss:.6g} dB"),
        ("mismatch loss", f"{line.mismatch_loss:.6g} dB"),
    ]
    console.table(Table(("quantity", "value"), rows))
    console.line()
    if found["stubs"]:
        headings = ("shunt stub", "from the load [m]", "short-circuited [m]", "open [m]", "wavelengths")
        table = [
            (
                str(number),
                f"{stub['position']:.6g}",
                f"{stub['short']:.6g}",
                f"{stub['open']:.6g}",
                "{position:.4f}, {short:.4f}, {open:.4f}".format(**stub["in_wavelengths"]),
            )
            for number, stub in enumerate(found["stubs"], start=1)
        ]
        console.table(Table(headings, table, frozenset(range(1, 4))))
    elif line.takes_power:
        console.line("The load is matched: no stub is needed.")
    else:
        console.line("The load takes no power: no stub matches it.")
    console.line()
    console.line(f"Smith chart: {found['picture']} and {found['page']}")


def _pair(value: complex) -> list[float]:
    return [value.real, value.imag]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
