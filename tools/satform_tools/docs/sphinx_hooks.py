# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Hooks of Sphinx: the order of pages, the reading of docstrings, the script that draws equations."""

from __future__ import annotations

import importlib.util
import re
import shutil
from pathlib import Path
from typing import Any

HOME = "docs/index"
"""The page whose sections and links are the site's navigation."""

_SECTION = re.compile(
    r"^## (?P<caption>.+)$|^[-*] \[(?P<title>[^\]]+)\]\((?P<page>[^)#]+)\.md\)", re.MULTILINE
)
# Napoleon would take what stands before a colon in an attribute's first line for its type.
_COLON = "\ue000"
_API = "\n```{toctree}\n:hidden:\n:caption: Python API\n\napi/index\n```\n"


def connect(app: Any) -> dict[str, Any]:
    """Connect the hooks; `docs/conf.py` passes this to Sphinx as `setup`.

    Args:
        app: Sphinx's application.

    Returns:
        What Sphinx asks of an extension.
    """
    app.connect("source-read", _add_navigation)
    # Before napoleon, which makes reStructuredText of the sections of a docstring.
    app.connect("autodoc-process-docstring", _escape_docstring, priority=400)
    app.connect("autodoc-process-docstring", _restore_colons, priority=600)
    app.connect("doctree-read", _leave_equations_as_written)
    app.connect("doctree-read", _leave_folders_as_text)
    app.connect("env-updated", _allow_pages_outside_docs)
    app.connect("build-finished", _copy_equation_script)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def navigation(text: str) -> str:
    """Make tables of contents of the links of the home page.

    Args:
        text: Markdown with sections `## Caption` and list entries `- [Title](page.md)`.

    Returns:
        One hidden table of contents for each section that has such entries.
    """
    sections: dict[str, list[str]] = {}
    caption = ""
    for found in _SECTION.finditer(text):
        caption = found["caption"] or caption
        if found["page"]:
            sections.setdefault(caption, []).append(f"{found['title']} <{found['page']}>")
    blocks = []
    for name, entries in sections.items():
        blocks.append("\n".join(["```{toctree}", ":hidden:", f":caption: {name}", "", *entries, "```"]))
    return "\n\n".join(blocks)


def escape(line: str) -> str:
    """Make reStructuredText of a line of plain text with code in backticks.

    Args:
        line: of a docstring.

    Returns:
        The line with its stars, bars and last underscores escaped outside of code.
    """
    parts = line.split("`")
    if len(parts) % 2 == 0:
        return line
    parts[::2] = [re.sub(r"[\\*|]|(?<=\w)_(?!\w)", r"\\\g<0>", part) for part in parts[::2]]
    return "`".join(parts)


def _add_navigation(_app: Any, name: str, source: list[str]) -> None:
    if name == HOME:
        source[0] += "\n" + navigation(source[0]) + "\n" + _API


def _escape_docstring(_app: Any, what: str, _name: str, _thing: Any, _options: Any, lines: list[str]) -> None:
    lines[:] = [escape(line) for line in lines]
    if what in {"attribute", "data", "property"}:
        lines[:] = [line.replace(":", _COLON) for line in lines]


def _restore_colons(_app: Any, _what: str, _name: str, _thing: Any, _options: Any, lines: list[str]) -> None:
    lines[:] = [line.replace(_COLON, ":") for line in lines]


def _leave_equations_as_written(_app: Any, doctree: Any) -> None:
    # Sphinx would put an equation of several lines into an environment in which LaTeX allows no \\tag.
    for node in doctree.findall(lambda node: node.tagname == "math_block"):
        if not node.get("number") and not node.get("no-wrap"):
            node["no-wrap"] = True
            equation = node.children[0]
            node.replace(equation, type(equation)(rf"\[{equation}\]"))


def _allow_pages_outside_docs(_app: Any, environment: Any) -> None:
    # READMEs of packages and folders are reached by links; they need no place in the navigation.
    for name in environment.found_docs:
        if not name.startswith("docs/"):
            environment.metadata[name].setdefault("orphan", "")


def _leave_folders_as_text(app: Any, doctree: Any) -> None:
    # A folder of the project is worth a link in a checkout; on the site there is nothing to show for it.
    # MyST resolves its references without the event missing-reference, so that it is done before.
    page = Path(app.srcdir, app.env.docname)
    for node in list(doctree.findall(lambda node: node.tagname == "pending_xref")):
        if node.get("reftype") == "myst" and (page.parent / node["reftarget"]).is_dir():
            node.replace_self(node.children)


def _copy_equation_script(app: Any, error: Exception | None) -> None:
    package = importlib.util.find_spec("mathjax")
    if error or not package or not package.submodule_search_locations:
        return
    source = Path(package.submodule_search_locations[0]) / "static" / "mathjax"
    target = Path(app.outdir) / "_static" / "mathjax"
    target.mkdir(parents=True, exist_ok=True)
    for name in ("es5/tex-svg.js", "LICENSE"):
        shutil.copy(source / name, target)
