# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Builds the documentation site with Sphinx, and checks what Sphinx does not."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path

from satform_tools import console
from satform_tools.docs import api_pages
from satform_tools.docs.sphinx_hooks import HOME
from satform_tools.errors import CommandError
from satform_tools.run.scenario_library import ROOT

PACKAGES = ROOT / ".venv" / "docs"
"""Where the set-up installs Sphinx and what belongs to it."""

_RESOURCES = {
    "script": "src",
    "link": "href",
    "img": "src",
    "iframe": "src",
    "source": "src",
    "object": "data",
}


def build(out: Path | None) -> None:
    """Build the site.

    Args:
        out: its folder; `site` in the project's folder when left out.

    Raises:
        CommandError: Sphinx is not installed or reports a problem, a public function is missing, or a page
            would load something from elsewhere.
    """
    site = (out or ROOT / "site").resolve()
    if not (PACKAGES / "sphinx").is_dir():
        raise CommandError(f"Sphinx is not installed in {PACKAGES}; run ./tools/satform docs")
    if site.is_dir() and any(site.iterdir()) and not (site / "objects.inv").is_file():
        raise CommandError(f"{site} has other files in it; give --out a new or empty folder")
    console.note("building the documentation site (a minute)")
    api_pages.write(ROOT / "docs" / "api")
    _run_sphinx(site)
    (site / "index.html").write_text(
        f'<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="0; url={HOME}.html">'
        f'<title>satform</title><a href="{HOME}.html">satform</a>\n',
        encoding="utf-8",
    )
    problems = [
        f"{name}: public, but not on the API pages" for name in api_pages.missing(site / "objects.inv")
    ]
    problems += outside_resources(site)
    if problems:
        raise CommandError("the documentation site is not as it must be:\n" + "\n".join(problems))
    console.line(f"site: {site / 'index.html'}")


def outside_resources(site: Path) -> list[str]:
    """What pages of a built site would load from another host when they are opened.

    Args:
        site: its folder.

    Returns:
        A sentence for each; links that a reader follows do not count.
    """
    return [
        f"{page.relative_to(site)}: loads {address}"
        for page in sorted(site.rglob("*.html"))
        for address in loaded(page.read_text(encoding="utf-8"))
        if address.startswith(("http:", "https:", "//"))
    ] + [
        f"{sheet.relative_to(site)}: loads something from another host"
        for sheet in sorted(site.rglob("*.css"))
        if any(mark in sheet.read_text(encoding="utf-8") for mark in ("url(http", "url(//", '@import "http'))
    ]


def loaded(page: str) -> Iterator[str]:
    """Addresses of the scripts, style sheets, pictures and frames of a page.

    Args:
        page: HTML.
    """
    reader = _ResourceReader()
    reader.feed(page)
    yield from reader.found


class _ResourceReader(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = dict(attrs)
        address = attributes.get(_RESOURCES.get(tag, ""))
        # rel="canonical" and the like are read by search engines and load nothing.
        loads = tag != "link" or (attributes.get("rel") or "") not in {"canonical", "next", "prev", "search"}
        if address and loads:
            self.found.append(address)


def _run_sphinx(site: Path) -> None:
    search = os.pathsep.join([str(PACKAGES), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-P", "-m", "sphinx", "--builder", "html", "--conf-dir", str(ROOT / "docs")]
    command += ["--doctree-dir", str(site / ".doctrees"), "--fail-on-warning", "--jobs", "2", "--quiet"]
    ended = subprocess.run(
        [*command, str(ROOT), str(site)],
        env={**os.environ, "PYTHONPATH": search},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        errors="replace",
        check=False,
    )
    if ended.returncode:
        raise CommandError(f"the documentation site has errors:\n{ended.stderr.strip()}")
