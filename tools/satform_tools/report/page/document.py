# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Makes one HTML file of a template, its style, its scripts and its numbers; it asks for no other file."""

import base64
import gzip
import json
from collections.abc import Sequence
from functools import cache
from importlib.metadata import distribution
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup
from numpy.typing import NDArray

from satform.numeric.elementwise import Array
from satform_tools import scene

PARTS = Path(__file__).parent
"""Folder of what pages share."""

_SCENE = Path(scene.__file__).parent
"""Folder of the scene's scripts, and of the libraries in `vendor/`."""

SCENE_SCRIPTS = tuple(_SCENE / f"{name}.js" for name in ("geometry", "objects", "labels", "pointer", "scene"))
"""Scripts of the 3-D scene, in the order in which they are read."""

THREE = _SCENE / "vendor" / "three.js"
"""What the scene needs of three.js, and coastlines."""


def rendered(
    name: str,
    page: dict[str, Any],
    data: dict[str, Any],
    folder: Path = PARTS,
    *,
    scripts: Sequence[Path] = (),
    libraries: Sequence[Path] = (),
) -> str:
    """A page.

    Args:
        name: of its template `NAME.html.j2` and script `NAME.js`.
        page: what the template prints.
        data: what the script draws from; numbers in it are finite.
        folder: of its template and script; what all pages share is in the folder of this module.
        scripts: further ones, read before that of the page.
        libraries: further ones beside that for charts, compressed in the page.

    Returns:
        The HTML file's text.
    """
    environment = Environment(
        loader=FileSystemLoader([folder, PARTS]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
    )
    shared = (PARTS / "figures.js", *scripts, folder / f"{name}.js")
    return environment.get_template(f"{name}.html.j2").render(
        page=page,
        style=Markup(_part(PARTS / "report.css")),  # noqa: S704 - our own file
        script=Markup("\n".join(_part(file) for file in shared)),  # noqa: S704 - likewise
        data=Markup(_as_script_data(data)),  # noqa: S704 - escaped
        libraries=[Markup(text) for text in (_plotly(), *map(_compressed, libraries))],  # noqa: S704 - base64
    )


def _as_script_data(data: Any) -> str:
    """Data as JSON that can stand in a script element.

    Args:
        data: numbers in it are finite.
    """
    # In a script element only this sign could end it.
    return json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def packed(values: Array | NDArray[np.int64], *, double: bool = False) -> str:
    """Numbers as base64 of their little-endian bytes.

    Args:
        values: any number of them.
        double: whether each has 64 bits instead of 32, which are enough for the seven digits of a figure.
    """
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f8" if double else "<f4").tobytes()).decode()


def _part(file: Path) -> str:
    return file.read_text(encoding="utf-8")


@cache
def _plotly() -> str:
    """The plotting script, compressed; nothing else of its Python package is used."""
    return _compressed(Path(str(distribution("plotly").locate_file("plotly/package_data/plotly.min.js"))))


@cache
def _compressed(file: Path) -> str:
    """A script, compressed, as text."""
    return base64.b64encode(gzip.compress(file.read_bytes(), 6, mtime=0)).decode()
