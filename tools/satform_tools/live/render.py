# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The live page as one file: template, style and scripts, with a nonce for its content security policy."""

from collections.abc import Callable, Sequence
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from satform_tools.report.page.document import PARTS as SHARED_PARTS
from satform_tools.report.page.document import SCENE_SCRIPTS, THREE

PARTS = Path(__file__).parent / "page"
"""Folder of the templates, styles and scripts of the pages."""

_UPLOT = THREE.parent / "uplot.js"
_UPLOT_STYLE = THREE.parent / "uplot.css"


def flight_page(title: str) -> Callable[[str], str]:
    """The page of a flight, to be rendered with a nonce for each request.

    Args:
        title: shown until the flight is known.

    Returns:
        Gives the HTML file's text for a nonce.
    """
    own = [PARTS / f"{name}.js" for name in ("connection", "store", "charts", "panels", "hands", "live")]
    return _rendered(
        "live.html.j2", title, (THREE, _UPLOT, SHARED_PARTS / "figures.js", *SCENE_SCRIPTS, *own)
    )


def campaign_page(title: str) -> Callable[[str], str]:
    """The page of a campaign, as that of a flight.

    Args:
        title: of the campaign.

    Returns:
        Gives the HTML file's text for a nonce.
    """
    own = [PARTS / f"{name}.js" for name in ("connection", "campaign")]
    return _rendered("campaign.html.j2", title, (_UPLOT, SHARED_PARTS / "figures.js", *own))


def _rendered(name: str, title: str, files: Sequence[Path]) -> Callable[[str], str]:
    environment = Environment(
        loader=FileSystemLoader(PARTS), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    template = environment.get_template(name)
    scripts = [Markup(file.read_text(encoding="utf-8")) for file in files]  # noqa: S704 - our own files
    styles = (SHARED_PARTS / "report.css", _UPLOT_STYLE, PARTS / "live.css")
    style = Markup("\n".join(file.read_text(encoding="utf-8") for file in styles))  # noqa: S704 - likewise
    return lambda nonce: template.render(title=title, nonce=nonce, style=style, scripts=scripts)
