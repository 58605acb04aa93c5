# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The pages of equations name functions that exist, and what checks each figure."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[3] / "docs" / "controllers"
PAGES = sorted(FOLDER.glob("*.md"))
CODE_LINK = re.compile(r"\[`([\w.]+)`\]\(([^)#\s]+\.py)\)")


def tables(page: Path) -> Iterator[tuple[str, list[str], list[list[str]]]]:
    """Every table of a page: the paragraph before it, its header, its rows."""
    blocks = page.read_text(encoding="utf-8").split("\n\n")
    for before, block in zip(["", *blocks], blocks, strict=False):
        lines = [line for line in block.splitlines() if line.startswith("|")]
        if len(lines) > 2:
            cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
            yield before, cells[0], cells[2:]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_each_function_linked_from_a_page_is_defined_in_the_linked_file(page: Path) -> None:
    links = CODE_LINK.findall(page.read_text(encoding="utf-8"))
    assert links
    for name, path in links:
        text = (page.parent / path).read_text(encoding="utf-8")
        last = name.rpartition(".")[2]
        assert re.search(rf"^ *(def|class) {last}\b", text, flags=re.MULTILINE), f"{name} is not in {path}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_equations_of_a_page_are_numbered_from_one_without_a_gap(page: Path) -> None:
    tags = [int(tag) for tag in re.findall(r"\\tag\{(\d+)\}", page.read_text(encoding="utf-8"))]
    assert tags == list(range(1, len(tags) + 1))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_each_figure_names_the_scenario_or_test_that_checks_it(page: Path) -> None:
    for _, header, rows in tables(page):
        if header[-1] == "checked by":
            for row in rows:
                assert len(row) == len(header), row
                assert re.search(r"\]\(\.\./\.\./(scenarios|tests)/", row[-1]), row
