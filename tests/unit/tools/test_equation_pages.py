# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The pages of equations name functions, fields and defaults that exist, and say what checks each figure."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pydantic.fields import FieldInfo

from satform.attitude.ground_pointing import GroundPointingSpec
from satform.attitude.mrp_tracking import AttitudeTrackingSpec
from satform.attitude.satellite_pointing import SatellitePointingSpec
from satform.common.spec import Spec, specs
from satform.control.adaptive_approximation import PartitionOfUnitySpec

FOLDER = Path(__file__).resolve().parents[3] / "docs" / "controllers"
PAGES = sorted(FOLDER.glob("*.md"))
CODE_LINK = re.compile(r"\[`([\w.]+)`\]\(([^)#\s]+\.py)\)")
SPECS: dict[str, type[Spec]] = {
    **specs("satform.controllers"),
    **specs("satform.consensus"),
    "mrp_tracking": AttitudeTrackingSpec,
    "ground_pointing": GroundPointingSpec,
    "satellite_pointing": SatellitePointingSpec,
    "partition_of_unity": PartitionOfUnitySpec,
}


def tables(page: Path) -> Iterator[tuple[str, list[str], list[list[str]]]]:
    """Every table of a page: the paragraph before it, its header, its rows."""
    blocks = page.read_text(encoding="utf-8").split("\n\n")
    for before, block in zip(["", *blocks], blocks, strict=False):
        lines = [line for line in block.splitlines() if line.startswith("|")]
        if len(lines) > 2:
            cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
            yield before, cells[0], cells[2:]


def default_text(field: FieldInfo) -> str:
    """The default of a field as the pages write it."""
    if field.is_required():
        return ""
    value: Any = field.default
    if isinstance(value, bool):
        return str(value).lower()
    if value is None or value == ():
        return "none"
    if isinstance(value, Spec):
        return str(getattr(value, "kind", ""))
    if isinstance(value, tuple):
        return str(value[0]) if len(set(value)) == 1 else ", ".join(map(str, value))
    return str(value)


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


def test_parameter_tables_list_every_field_with_its_default() -> None:
    found: dict[str, dict[str, str]] = {}
    for page in PAGES:
        for before, header, rows in tables(page):
            kind = re.search(r"kind: (\w+)", before)
            if header[0] == "field" and kind:
                column = header.index("default")
                found[kind[1]] = {row[0].strip("`"): row[column] for row in rows}
    without_table = {"coast", "motion", "resilient_arc_length"}
    assert set(found) == {kind for kind, spec in SPECS.items() if is_ours(spec)} - without_table
    for kind, fields in found.items():
        declared = SPECS[kind].model_fields
        assert fields == {name: default_text(field) for name, field in declared.items() if name != "kind"}


def is_ours(spec: type[Spec]) -> bool:
    """Whether a specification comes with satform, and not from another installed package."""
    return spec.__module__.startswith("satform.")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_each_figure_names_the_scenario_or_test_that_checks_it(page: Path) -> None:
    for _, header, rows in tables(page):
        if header[-1] == "checked by":
            for row in rows:
                assert len(row) == len(header), row
                assert re.search(r"\]\(\.\./\.\./(scenarios|tests)/", row[-1]), row
