# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What imports what: packages and rooms (sub-packages) stand in layers, and nothing imports in a circle.

Imports inside functions and under TYPE_CHECKING count like any other: grimp reads them from the source.
"""

import ast
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
    "membership",
    "communication",
    "attitude",
    "record",
    "scenario",
    "flight",
    "evaluation",
    "display",
)
"""Of the library, from the lowest layer to the highest."""

TAKE_A_SCENARIO = {
    "satform.evaluation.conclusion",
    "satform.evaluation.evaluate",
    "satform.evaluation.sampled_loops",
    "satform.flight.compile",
    "satform.flight.simulate",
    "satform_bringup.deployment.multi_host_discovery",
    "satform_bringup.supervisor.launch_report",
    "satform_bringup.supervisor.run",
    "satform_nodes.bag.reader",
    "satform_nodes.bag.writer",
    "satform_nodes.recorder.node",
    "satform_nodes.runtime.lifecycle",
}
"""Modules outside the room of scenarios that take a whole one: what compiles it into plans, flies it, judges
it, starts it, or keeps it in a bag. Every other part of a flight takes its own plan. The tools, which check
and show scenarios, are not among them."""

CIRCLES_OF_ROOMS = {
    frozenset(
        f"satform_nodes.{room}"
        for room in ("bag", "display", "plant", "recorder", "runtime", "satellite", "transport")
    ),
    frozenset({"satform_bringup.deployment", "satform_bringup.supervisor"}),
}
"""Rooms that import each other in a circle, and are to be taken apart."""

CIRCLES_OF_MODULES = {
    frozenset(
        f"satform_nodes.{module}"
        for module in ("runtime.flight_loop", "satellite.batched_step", "satellite.node")
    )
}
"""Modules that import each other in a circle, and are to be taken apart."""


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
    assert found.has_edge("satform_nodes.plant.node", "satform.flight.plant")
    return found


def room_of(module: str) -> str:
    """Package and sub-package of a module; the package alone for a module at its top."""
    return ".".join(module.split(".")[:2])


def circles(edges: Iterable[tuple[str, str]]) -> set[frozenset[str]]:
    components = networkx.strongly_connected_components(networkx.DiGraph(edges))
    return {frozenset(component) for component in components if len(component) > 1}


def library_edges(imports: networkx.DiGraph) -> Iterator[tuple[str, str, str, str]]:
    """Importing module and its room, imported module and its room, of the library, between two rooms."""
    for module, imported in imports.edges:
        parts, others = module.split("."), imported.split(".")
        if (
            parts[0] == others[0] == "satform"
            and len(parts) > 2
            and len(others) > 1
            and parts[1] != others[1]
        ):
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
        for module, room, imported, other in library_edges(imports)
        if layer[other] >= layer[room]
    ]
    assert upward == []


def test_the_rooms_of_the_library_are_those_in_the_list() -> None:
    spec = importlib.util.find_spec("satform")
    assert spec is not None
    assert spec.origin is not None
    folders = {path.parent.name for path in Path(spec.origin).parent.glob("*/__init__.py")}
    assert folders == set(ROOMS)


def test_no_modules_import_each_other_in_a_circle(imports: networkx.DiGraph) -> None:
    assert circles(imports.edges) == CIRCLES_OF_MODULES


def test_no_rooms_import_each_other_in_a_circle(imports: networkx.DiGraph) -> None:
    # A module at the top of a package may gather what its rooms have: it is a room of its own.
    pairs = ((room_of(module), room_of(imported)) for module, imported in imports.edges)
    assert circles((one, other) for one, other in pairs if one != other) == CIRCLES_OF_ROOMS


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_what_its_docstring_says(imports: networkx.DiGraph, room: str) -> None:
    sentence = re.search(r"Imports (.*?)\.\s*$", " ".join((documentation(f"satform.{room}") or "").split()))
    assert sentence, f"the docstring of satform/{room}/__init__.py ends with what the room may import"
    named = re.findall(r"`(\w+)`", sentence[1])
    allowed = set(named)
    if sentence[1].endswith("and below"):
        allowed |= set(ROOMS[: ROOMS.index(named[0])])
    assert all(ROOMS.index(other) < ROOMS.index(room) for other in allowed)
    imported = {other for _, own, _, other in library_edges(imports) if own == room}
    assert imported <= allowed


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


def documentation(module: str) -> str | None:
    return ast.get_docstring(source(module))


def source(module: str) -> ast.Module:
    spec = importlib.util.find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    return ast.parse(Path(spec.origin).read_text(encoding="utf-8"))
