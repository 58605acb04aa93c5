# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The documentation site has every page and every public module, before Sphinx builds it."""

import re
from pathlib import Path

import pytest

from satform_tools.docs import api_pages
from satform_tools.docs.build import loaded
from satform_tools.docs.sphinx_hooks import escape, navigation

ROOT = Path(__file__).resolve().parents[3]
DOCS = ROOT / "docs"


def test_every_page_has_a_place_in_the_navigation() -> None:
    shown = re.findall(r" <(.+)>$", navigation((DOCS / "index.md").read_text(encoding="utf-8")), re.MULTILINE)
    pages = {str(path.relative_to(DOCS).with_suffix("")) for path in DOCS.rglob("*.md")} - {"index"}
    assert pages - set(shown) == set()
    assert len(shown) == len(set(shown))


def test_every_public_module_of_the_sources_is_on_an_api_page(tmp_path: Path) -> None:
    api_pages.write(tmp_path)
    shown = {
        name
        for page in tmp_path.glob("*.rst")
        for name in re.findall(r"^\.\. automodule:: (\S+)$", page.read_text(), re.MULTILINE)
    }
    sources = ROOT / "ros_ws" / "src"
    modules = {
        ".".join(path.relative_to(sources / package).with_suffix("").parts).removesuffix(".__init__")
        for package in api_pages.PACKAGES
        for path in (sources / package / package).rglob("*.py")
        if not any(part.startswith("_") and part != "__init__.py" for part in path.parts)
    }
    assert len(modules) > 100
    assert modules - shown == set()


SOURCES = ROOT / "ros_ws" / "src"


@pytest.mark.parametrize(
    ("page", "heading", "package"),
    [
        (DOCS / "architecture.md", "### satform: the library", SOURCES / "satform" / "satform"),
        (
            DOCS / "architecture.md",
            "### satform_nodes: the nodes",
            SOURCES / "satform_nodes" / "satform_nodes",
        ),
        (
            DOCS / "architecture.md",
            "### satform_bringup: starting and supervising",
            SOURCES / "satform_bringup" / "satform_bringup",
        ),
        (DOCS / "architecture.md", "### tools: the command line", ROOT / "tools" / "satform_tools"),
        (SOURCES / "satform" / "README.md", "## Sub-packages", SOURCES / "satform" / "satform"),
    ],
    ids=["library", "nodes", "bringup", "tools", "readme of the library"],
)
def test_the_table_of_a_package_has_every_sub_package_and_no_other(
    page: Path, heading: str, package: Path
) -> None:
    section = page.read_text(encoding="utf-8").partition(f"\n{heading}\n")[2].partition("\n#")[0]
    firsts = [line.split("|")[1] for line in section.splitlines() if line.startswith("|")]
    listed = [name.rstrip("/") for cell in firsts for name in re.findall(r"`([a-z_]+/?)`", cell)]
    assert sorted(listed) == sorted(path.parent.name for path in package.glob("*/__init__.py"))


def test_pages_of_modules_that_are_gone_are_removed(tmp_path: Path) -> None:
    (tmp_path / "satform.gone.rst").write_text("old")
    api_pages.write(tmp_path)
    assert not (tmp_path / "satform.gone.rst").exists()
    assert (tmp_path / "satform.consensus.rst").exists()


@pytest.mark.parametrize(
    ("page", "expected"),
    [
        ('<script src="https://a.example/x.js"></script>', ["https://a.example/x.js"]),
        ('<link rel="stylesheet" href="//b.example/x.css">', ["//b.example/x.css"]),
        ('<img src="picture.png"><a href="https://c.example">text</a>', ["picture.png"]),
        ('<link rel="canonical" href="https://d.example">', []),
    ],
)
def test_resources_are_told_from_links(page: str, expected: list[str]) -> None:
    assert list(loaded(page)) == expected


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("|x| times *y*", r"\|x\| times \*y\*"),
        ("`a|b*` stays", "`a|b*` stays"),
        ("names_ with an underscore_", r"names\_ with an underscore\_"),
        ("sliding_variable", "sliding_variable"),
    ],
)
def test_plain_text_of_docstrings_is_escaped_outside_of_code(line: str, expected: str) -> None:
    assert escape(line) == expected
