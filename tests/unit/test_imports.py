# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What imports what: packages and rooms (sub-packages) stand in layers, and nothing imports in a circle.

Imports inside functions and under TYPE_CHECKING count like any other: grimp reads them from the source.
"""

import ast
import functools
import importlib.util
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import grimp
import networkx
import pytest

PACKAGES = ("satform", "satform_nodes", "satform_bringup", "satform_tools")
"""From the lowest layer to the highest."""

ROOMS = (
    "common",
    "numeric",
    "files",
    "orbits",
    "dynamics",
    "control",
    "consensus",
    "planning",
    "equipment",
    "navigation",
    "membership",
    "communication",
    "attitude",
    "record",
    "scenario",
    "flight",
    "protocol",
    "evaluation",
    "campaign",
    "display",
    "bag",
    "plot",
)
"""Of the library, from the lowest layer to the highest."""

TAKE_A_SCENARIO = {
    "satform.campaign.case_template",
    "satform.campaign.cases",
    "satform.campaign.chunk",
    "satform.campaign.model",
    "satform.campaign.paths",
    "satform.campaign.plan_digest",
    "satform.campaign.scenario_file",
    "satform.campaign.stacked_cases",
    "satform.evaluation.conclusion",
    "satform.evaluation.evaluate",
    "satform.evaluation.sampled_loops",
    "satform.evaluation.stability_borders",
    "satform.flight.array_exchange",
    "satform.flight.chief_motion",
    "satform.flight.scenario_record",
    "satform.flight.compile",
    "satform.flight.compile_satellite",
    "satform.flight.geodetic_fixes",
    "satform.flight.orbit_states",
    "satform.flight.truth",
    "satform.flight.simulate",
    "satform.plot.formation",
    "satform.plot.time_series",
    "satform.plot.prediction",
    "satform_bringup.deployment.multi_host_discovery",
    "satform_bringup.supervisor.launch_report",
    "satform_bringup.supervisor.run",
    "satform.bag.reader",
    "satform_nodes.bag.writer",
    "satform_nodes.recorder.node",
    "satform_nodes.runtime.lifecycle",
    "satform_nodes.runtime.shared_plan",
}
"""Modules outside the room of scenarios that take a whole one: what varies it case by case, compiles it into
plans, flies it, judges it, plots it, starts it, or keeps it in a bag. Every other part of a flight takes its
own plan. Tools check and show scenarios, and are not among them."""

SAYS_WHAT_IT_IMPORTS = ("satform", "satform_nodes", "satform_bringup")
"""Packages whose rooms say in their docstrings which rooms of the package they may import."""


@pytest.fixture(scope="module")
def imports() -> networkx.DiGraph:
    """An edge from each module of the packages to each that it imports."""
    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    edges = [
        (module, imported)
        for module in graph.modules
        for imported in graph.find_modules_directly_imported_by(module)
    ]
    found = networkx.DiGraph(edges)
    # What the packages are known to import: nothing is held if the source was not read.
    assert found.has_edge("satform.flight.compile", "satform.flight.plans")
    assert found.has_edge("satform_nodes.plant.node", "satform.protocol.plant_steps")
    return found


def room_of(module: str) -> str:
    """Package and sub-package of a module; the package alone for a module at its top."""
    return ".".join(module.split(".")[:2])


def circles(edges: Iterable[tuple[str, str]]) -> list[list[str]]:
    components = networkx.strongly_connected_components(networkx.DiGraph(edges))
    return [sorted(component) for component in components if len(component) > 1]


@functools.cache
def rooms_of(package: str) -> list[str]:
    """Names of a package's sub-packages."""
    spec = importlib.util.find_spec(package)
    assert spec is not None
    assert spec.origin is not None
    return sorted(path.parent.name for path in Path(spec.origin).parent.glob("*/__init__.py"))


def edges_between_rooms(imports: networkx.DiGraph, package: str) -> Iterator[tuple[str, str, str, str]]:
    """Importing module and its room, imported module and its room, of one package."""
    for module, imported in imports.edges:
        parts, others = module.split("."), imported.split(".")
        within = parts[0] == others[0] == package and len(parts) > 1 and len(others) > 1
        # A module at the top of a package may gather what its rooms have.
        if within and parts[1] in rooms_of(package) and parts[1] != others[1]:
            yield module, parts[1], imported, others[1]


def test_a_package_imports_none_above_it(imports: networkx.DiGraph) -> None:
    layer = {package: place for place, package in enumerate(PACKAGES)}
    upward = [
        f"{module} imports {imported}"
        for module, imported in imports.edges
        if layer[imported.split(".")[0]] > layer[module.split(".")[0]]
    ]
    assert upward == []


def test_a_room_of_the_library_imports_none_above_it(imports: networkx.DiGraph) -> None:
    layer = {room: place for place, room in enumerate(ROOMS)}
    upward = [
        f"{module} imports {imported}"
        for module, room, imported, other in edges_between_rooms(imports, "satform")
        if layer[other] >= layer[room]
    ]
    assert upward == []


def test_the_rooms_of_the_library_are_those_in_the_list() -> None:
    assert set(rooms_of("satform")) == set(ROOMS)


def test_no_modules_import_each_other_in_a_circle(imports: networkx.DiGraph) -> None:
    assert circles(imports.edges) == []


def test_no_rooms_import_each_other_in_a_circle(imports: networkx.DiGraph) -> None:
    pairs = ((room_of(module), room_of(imported)) for module, imported in imports.edges)
    assert circles((one, other) for one, other in pairs if one != other) == []


@pytest.mark.parametrize(
    ("package", "room"), [(package, room) for package in SAYS_WHAT_IT_IMPORTS for room in rooms_of(package)]
)
def test_a_room_imports_what_its_docstring_says(imports: networkx.DiGraph, package: str, room: str) -> None:
    sentence = re.search(r"Imports ([^.]*)\.", documentation(f"{package}.{room}"))
    assert sentence, f"the docstring of {package}.{room} says which rooms it may import"
    named = re.findall(r"`(\w+)`", sentence[1])
    assert set(named) <= set(rooms_of(package))
    below = set(ROOMS[: ROOMS.index(named[0])]) if sentence[1].endswith("and below") else set()
    imported = {other for _, own, _, other in edges_between_rooms(imports, package) if own == room}
    assert imported <= below | set(named)


def test_a_whole_scenario_is_taken_only_where_it_is_compiled_flown_judged_or_kept(
    imports: networkx.DiGraph,
) -> None:
    takers = {
        module
        for module in imports
        if not module.startswith(("satform.scenario", "satform_tools")) and takes_a_scenario(module)
    }
    # What a package offers at its top is no part of a flight.
    assert takers - {"satform"} == TAKE_A_SCENARIO


def takes_a_scenario(module: str) -> bool:
    return any(
        isinstance(node, ast.ImportFrom)
        and (node.module or "").startswith("satform.scenario")
        and any(alias.name == "Scenario" for alias in node.names)
        for node in ast.walk(source(module))
    )


def documentation(module: str) -> str:
    return " ".join((ast.get_docstring(source(module)) or "").split())


def source(module: str) -> ast.Module:
    spec = importlib.util.find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    return ast.parse(Path(spec.origin).read_text(encoding="utf-8"))
