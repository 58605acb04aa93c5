# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The command `show`: prints what is known of a scenario before it is flown."""

from itertools import repeat
from typing import Any

from satform.consensus.byzantine_robustness import (
    MAXIMUM_SATELLITES,
)
from satform.scenario import Scenario
from satform_tools import console, truncated
from satform_tools.console import Table
from satform_tools.describe import orbit as describe_orbit
from satform_tools.describe.feedback import print_attitudes, print_feedback, print_start
from satform_tools.describe.lyapunov import print_lyapunov
from satform_tools.describe.scenario import ALLOWED, describe


def show(scenario: Scenario, *, as_json: bool) -> None:
    """Print everything about a scenario.

    Args:
        scenario: to describe.
        as_json: whether to print JSON.
    """
    data = describe(scenario)
    if as_json:
        console.as_json(data)
        return
    console.heading(f"{scenario.name}: {scenario.title}")
    console.line()
    console.paragraph(scenario.text)
    _print_sources(scenario)
    _print_setting(data)
    _print_satellites(data["satellites"])
    describe_orbit.print_cw_errors(data["cw_errors"])
    _print_graph(data)
    _print_disturbances(data)
    _print_processes(data)
    _print_expectations(data["expectations"])
    truncated.lines([f"warning: {warning}" for warning in data["warnings"]])


def _print_sources(scenario: Scenario) -> None:
    for source in scenario.sources:
        console.paragraph(f"Source: {source.reference}")
        if source.printed:
            console.paragraph(f"Printed values: {source.printed}", "  ")
        if source.chosen:
            console.paragraph(f"Chosen values: {source.chosen}", "  ")


def _print_setting(data: dict[str, Any]) -> None:
    orbit, timing = data["orbit"], data["timing"]
    describe_orbit.print_orbit(orbit)
    console.line(f"flight: {timing['duration']:g} s in {timing['steps']} steps of {timing['step']:g} s")
    console.line(f"dynamics: {_fields_text(data['dynamics'])}")
    describe_orbit.print_integration(data["integration_error"])
    console.line(f"digest: {data['digest']}")
    console.line()


def _print_satellites(satellites: list[dict[str, Any]]) -> None:
    headings = (
        "satellite",
        "curve",
        "perimeter [km]",
        "scale",
        "rate [m/s]",
        "reference [m/s²]",
        "jerk [m/s³]",
    )
    rows = [
        (
            entry["name"],
            str(entry["curve"].get("kind", "")),
            f"{entry['perimeter'] / 1e3:.6g}",
            f"{entry['scale']:g}",
            f"{entry['nominal_rate']:.7g}",
            f"{entry['largest_reference_acceleration']:.5g}",
            f"{entry['largest_reference_jerk']:.3g}",
        )
        for entry in satellites
    ]
    truncated.table(Table(headings, rows, frozenset(range(2, len(headings)))))
    console.line()
    gains: dict[str, list[str]] = {}
    for entry in satellites:
        gains.setdefault(_fields_text(entry["controller"]), []).append(entry["name"])
    truncated.lines([f"controller of {truncated.names(names)}: {texts}" for texts, names in gains.items()])
    console.line()
    external = [entry["name"] for entry in satellites if entry["external"]]
    if external:
        console.line(
            f"external: {truncated.names(external)}; over DDS a run waits for the node, which somebody else "
            "starts"
        )
        console.line()
    print_feedback(satellites)
    print_start(satellites)
    print_lyapunov(satellites)
    print_attitudes(satellites)
    _print_readings(satellites)


def _print_readings(satellites: list[dict[str, Any]]) -> None:
    """Print the sensors' channels with the indices of their numbers in `measurements`, and the filters."""
    headings = ("satellite", "channel", "values", "period [s]", "latency [s]")
    rows = [
        (
            entry["name"],
            own["channel"],
            f"{own['first']}"
            if own["numbers"] == 1
            else f"{own['first']}-{own['first'] + own['numbers'] - 1}",
            f"{own['period']:g}",
            f"{own['latency']:g}",
        )
        for entry in satellites
        for own in entry["readings"]
    ]
    if not rows:
        return
    truncated.table(Table(headings, rows, frozenset({3, 4})))
    filters: dict[str, list[str]] = {}
    for entry in satellites:
        if entry["navigation"] is not None:
            filters.setdefault(_fields_text(entry["navigation"]), []).append(entry["name"])
    truncated.lines([f"navigation of {truncated.names(names)}: {text}" for text, names in filters.items()])
    console.line()


def _print_graph(data: dict[str, Any]) -> None:
    graph, consensus = data["graph"], data["consensus"]
    kind = ("directed" if graph["directed"] else "undirected") + (
        ", connected" if graph["connected"] else ", not connected"
    )
    console.line(f"graph: {graph['kind']} ({kind})")
    neighbours = graph["in_neighbours"].items()
    truncated.lines(
        [f"  {name} receives from {truncated.names(names) or 'none'}" for name, names in neighbours]
    )
    if "tracking_gain" in consensus:
        _print_robustness(graph)
    worked_out = {"modal_roots", "delay_margin", "stable_for_any_delay"}
    own = {key: value for key, value in consensus.items() if key not in worked_out}
    console.line(f"consensus: {_fields_text(own)}")
    rows = [
        (_number(value), ", ".join(_number(root) for root in roots))
        for value, roots in zip(graph["eigenvalues"], consensus["modal_roots"] or repeat([]), strict=False)
    ]
    truncated.table(Table(("Laplacian eigenvalue", "modal roots [1/s]"), rows))
    if consensus["stable_for_any_delay"]:
        console.line(
            f"delay margin with {consensus['neighbour_values']}: stable for any delay of the messages"
        )
    elif consensus["delay_margin"] is not None:
        console.line(f"delay margin with {consensus['neighbour_values']}: {consensus['delay_margin']:.6g} s")
    console.line()
    _print_loops(data["sampled_loops"])


def _print_loops(loops: list[dict[str, Any]]) -> None:
    """Print each sampled loop with its spectral radius."""
    rows = [
        (
            loop["kind"],
            truncated.names(loop["satellites"]),
            loop["words"],
            "not analysed" if loop["radius"] is None else f"{loop['radius']:.6g}",
        )
        for loop in loops
    ]
    if rows:
        truncated.table(Table(("loop", "of", "control", "spectral radius per step"), rows, frozenset({3})))
        console.line()


def _print_robustness(graph: dict[str, Any]) -> None:
    found, promised = graph["robustness"], graph["promise"]
    if found["exact"]:
        pairs = ", ".join(f"({r}, {s})" for r, s in enumerate(found["s"], 1))
        console.line(f"robustness: {found['r']}-robust{f'; (r, s)-robust for {pairs}' if pairs else ''}")
    else:
        console.line(
            f"robustness: at least {found['r']}-robust (exact up to {MAXIMUM_SATELLITES} satellites)"
        )
    if promised["largest_local"] is not None:
        least = "" if promised["exact"] else "at least "
        console.line(
            f"Byzantine agents that resilient_arc_length tolerates on this graph: {least}"
            f"{promised['largest_local']} among the neighbours of each, "
            f"{least}{promised['largest_total']} in the whole formation"
        )
    console.line(f"promise: {promised['sentence']}")


def _print_disturbances(data: dict[str, Any]) -> None:
    """Print links, faults, checkpoints and topology changes, if any."""
    links, schedule, faults, period = (
        data[key] for key in ("links", "schedule", "faults", "checkpoint_period")
    )
    if links is not None:
        console.line(f"links: {_link_text(links['default'])}")
        truncated.lines([_edge_text(edge) for edge in links["edges"]])
    truncated.lines([_fault_text(fault) for fault in faults])
    if period is not None:
        console.line(f"checkpoints: every {period:g} s")
    if data["tolerated_losses"]:
        console.line(f"tolerated unplanned losses: {data['tolerated_losses']}")
    if schedule:
        rows = [
            (
                f"{entry['at']:g}",
                entry["reason"],
                str(entry["flying"]),
                str(entry["edges"]),
                _number(entry["connectivity"]) + ("" if entry["connected"] else ", not connected"),
            )
            for entry in schedule
        ]
        headings = ("from [s]", "reason", "flying", "edges", "lambda_2 of the flying satellites")
        truncated.table(Table(headings, rows, frozenset({0, 2, 3})))
    if links is not None or schedule or faults or period is not None:
        console.line()


def _edge_text(edge: dict[str, Any]) -> str:
    own = {key: edge[key] for key in edge if key not in {"sender", "receiver"}}
    return f"  from {edge['sender']} to {edge['receiver']}: {_link_text(own)}"


def _fault_text(fault: dict[str, Any]) -> str:
    own = {key: fault[key] for key in fault if key not in {"kind", "satellite"}}
    return f"fault: {fault['kind']} of {fault['satellite']}, {_fields_text(own)}"


def _link_text(fields: dict[str, Any]) -> str:
    """The fields of a link that are not zero."""
    own = {key: value for key, value in fields.items() if value}
    return _fields_text(own) or "ideal"


def _print_processes(data: dict[str, Any]) -> None:
    listed = [f"{process['node']} ({process['executable']})" for process in data["processes"]]
    console.line(f"processes: {truncated.names(listed)}")
    rows = [(topic["topic"], topic["from"], truncated.names(topic["to"])) for topic in data["topics"]]
    truncated.table(Table(("topic", "from", "to, besides the recorder"), rows))
    console.line()


def _print_expectations(expectations: list[dict[str, Any]]) -> None:
    if not expectations:
        return
    rows = [
        (
            entry["label"],
            entry["unit"],
            _fields_text({key: entry[key] for key in entry if key in ALLOWED}),
            entry["source"] or "regression figure of this software",
        )
        for entry in expectations
    ]
    truncated.table(Table(("expectation", "unit", "allowed", "source"), rows))


def _fields_text(fields: dict[str, Any]) -> str:
    """Fields of a specification as texts; equal components are printed once."""
    texts = [
        f"{key} {_value(value)}"
        for key, value in fields.items()
        if key != "kind" and value not in (None, [], ())
    ]
    return ", ".join([str(fields.get("kind", "")), *texts]).lstrip(", ")


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return f"({_fields_text(value)})"
    if isinstance(value, list | tuple):
        texts = [_value(item) for item in value]
        return texts[0] if len(set(texts)) == 1 else f"[{', '.join(texts)}]"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _number(value: float | list[float]) -> str:
    if isinstance(value, list):
        return f"{value[0]:.6g} {'+' if value[1] >= 0.0 else '-'} {abs(value[1]):.6g}i"
    return f"{0.0 if abs(value) < 1e-12 else value:.6g}"
