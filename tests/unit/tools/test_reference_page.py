# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of everything that a scenario may say is of today, and says what nodes declare."""

import re
from dataclasses import dataclass, field
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import pytest

from flights import SCENARIOS, shipped
from satform.common.spec import Spec
from satform.flight.compile_satellite import parameter_plan
from satform.flight.online_parameters import OnlineParameters
from satform_nodes.runtime.parameters import declare_spec
from satform_tools.cli import main as cli
from satform_tools.describe import scenario_reference

DOCS = Path(__file__).resolve().parents[3] / "docs"
PAGE = DOCS / "scenario_reference.md"
PAGES = (PAGE, DOCS / "campaign_reference.md")
NAMES = sorted(path.stem for path in SCENARIOS.glob("*.yaml"))


@pytest.mark.parametrize(("page", "options"), list(zip(PAGES, ([], ["--campaign"]), strict=True)))
def test_the_page_is_what_the_command_prints(
    capsys: pytest.CaptureFixture[str], page: Path, options: list[str]
) -> None:
    assert cli.main(["schema", *options, "--markdown"]) == 0
    printed = capsys.readouterr().out
    command = " ".join(["./tools/satform schema", *options, "--markdown"])
    assert page.read_text(encoding="utf-8") == printed, f"run {command} > docs/{page.name}"


def test_interface_page_is_what_the_command_prints(capsys: pytest.CaptureFixture[str]) -> None:
    page = DOCS / "interface_reference.md"
    assert cli.main(["interface"]) == 0
    command = "./tools/satform interface"
    assert page.read_text(encoding="utf-8") == capsys.readouterr().out, f"run {command} > docs/{page.name}"


KINDS = {
    group: list(entry_points(group=group)) for group in entry_points().groups if group.startswith("satform.")
}


@pytest.mark.parametrize("group", sorted(KINDS))
def test_every_kind_that_a_scenario_can_choose_has_a_section(group: str) -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    headings = re.findall(r"^### (.+)$", text, flags=re.MULTILINE)
    assert [entry.name for entry in KINDS[group] if headings.count(entry.name) < 1] == []


@pytest.mark.parametrize(("page", "least"), list(zip(PAGES, (200, 50), strict=True)))
def test_every_field_says_what_it_means(page: Path, least: int) -> None:
    rows = [line for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("| `")]
    silent = [row for row in rows if not re.split(r"(?<!\\)\|", row)[5].strip() and "`kind`" not in row]
    assert len(rows) > least
    assert silent == []


@pytest.mark.parametrize("page", PAGES)
def test_no_field_has_the_name_of_a_class_for_its_type(page: Path) -> None:
    rows = [line for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("| `")]
    types = [re.split(r"(?<!\\)\|", row)[2] for row in rows]
    assert [text for text in types if "<class" in text or "satform." in text] == []


@dataclass
class Declared:
    """Stands for a node: keeps what is declared, and whether it is read-only."""

    found: dict[str, bool] = field(default_factory=dict)
    forms: dict[str, Any] = field(default_factory=dict)
    _parameter_overrides: dict[str, Any] = field(default_factory=dict)

    def declare_parameter(self, name: str, _value: Any, descriptor: Any) -> None:
        self.found[name] = bool(descriptor.read_only)


def in_flight(spec: Spec) -> set[str]:
    """Parameters that the page has for a specification, of the fields that have a value."""
    return {
        name
        for field in type(spec).model_fields
        for name, changes in [scenario_reference.parameter(type(spec), field)]
        if changes and getattr(spec, field) is not None
    }


@pytest.mark.parametrize("name", NAMES)
def test_what_the_page_calls_a_parameter_is_declared_by_the_node_and_nothing_else(name: str) -> None:
    scenario = shipped(name)
    for index in range(min(len(scenario.satellites), 3)):
        for prefix, spec in OnlineParameters(parameter_plan(scenario, index)).specs.items():
            node = Declared()
            declare_spec(node, prefix, spec)  # type: ignore[arg-type]
            own = scenario.satellite(index) if prefix == "phase" else spec
            direct = {name for name in node.found if name.count(".") == 1}
            assert {name for name in direct if not node.found[name]} == in_flight(own)
            fixed = {
                name
                for field in type(own).model_fields
                for name, changes in [scenario_reference.parameter(type(own), field)]
                if name and not changes and not name.endswith(".")
            }
            assert {name for name in direct if node.found[name]} == fixed
