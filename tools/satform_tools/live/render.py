# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The live page as one file: template, style and scripts, with a nonce for its content security policy."""

from collections.abc import Callable
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from satform_tools.report.page.document import PARTS, SCENE_SCRIPTS, THREE

_FOLDER = Path(__file__).parent / "page"
_UPLOT = THREE.parent / "uplot.js"
_UPLOT_STYLE = THREE.parent / "uplot.css"
_SCRIPTS = ("store", "charts", "panels", "hands", "live")


def page(title: str) -> Callable[[str], str]:
    """The live page, to be rendered with a nonce for each request.

    Args:
        title: shown until the flight is known.

    Returns:
        Gives the HTML file's text for a nonce.
    """
    environment = Environment(
        loader=FileSystemLoader(_FOLDER), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    template = environment.get_template("live.html.j2")
    files = (
        THREE,
        _UPLOT,
        PARTS / "figures.js",
        *SCENE_SCRIPTS,
        *(_FOLDER / f"{name}.js" for name in _SCRIPTS),
    )
    scripts = [Markup(file.read_text(encoding="utf-8")) for file in files]  # noqa: S704 - our own files
    styles = (PARTS / "report.css", _UPLOT_STYLE, _FOLDER / "live.css")
    style = Markup("\n".join(file.read_text(encoding="utf-8") for file in styles))  # noqa: S704 - likewise
    return lambda nonce: template.render(title=title, nonce=nonce, style=style, scripts=scripts)
