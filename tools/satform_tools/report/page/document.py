# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Makes one HTML file of a template, its style, its scripts and its numbers; it asks for no other file."""

import base64
import gzip
import json
from functools import cache
from importlib.metadata import distribution
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup
from numpy.typing import NDArray

from satform.numeric.elementwise import Array

_PARTS = Path(__file__).parent


def rendered(name: str, page: dict[str, Any], data: dict[str, Any], folder: Path = _PARTS) -> str:
    """A page.

    Args:
        name: of its template `NAME.html.j2` and script `NAME.js`.
        page: what the template prints.
        data: what the script draws from; numbers in it are finite.
        folder: of its template and script; what all pages share is in the folder of this module.

    Returns:
        The HTML file's text.
    """
    environment = Environment(
        loader=FileSystemLoader([folder, _PARTS]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
    )
    # In a script element only this sign could end it.
    figures = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    return environment.get_template(f"{name}.html.j2").render(
        page=page,
        style=Markup(_part(_PARTS / "report.css")),  # noqa: S704 - our own file
        script=Markup(f"{_part(_PARTS / 'figures.js')}\n{_part(folder / f'{name}.js')}"),  # noqa: S704 - likewise
        data=Markup(figures),  # noqa: S704 - escaped above
        library=Markup(_library()),  # noqa: S704 - base64
    )


def packed(values: Array | NDArray[np.int64]) -> str:
    """Numbers with the seven digits that a figure needs, as text."""
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode()


def _part(file: Path) -> str:
    return file.read_text(encoding="utf-8")


@cache
def _library() -> str:
    """The plotting script, compressed; nothing else of its Python package is used."""
    file = Path(str(distribution("plotly").locate_file("plotly/package_data/plotly.min.js")))
    return base64.b64encode(gzip.compress(file.read_bytes(), 6, mtime=0)).decode()
