# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Which processes a scenario needs: the one list behind the command line and the launch file."""

import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeAlias

from satform.flight.compile import FormationPlan
from satform.scenario.deployment import HostSpec

Value: TypeAlias = str | bool | float | list[str]
"""Of a ROS parameter."""


@dataclass(frozen=True)
class NodeProcess:
    """One process, with one node or with a group of satellites' nodes.

    Attributes:
        name: of the node, or of the group.
        executable: of the package `satform_nodes`.
        parameters: ROS parameters that are given at the start.
        optional: whether the flight goes on without it, however it ends, and nobody waits for its end.
        enclave: where its keys are in a keystore; empty when it has none.
        namespace: of all nodes in it and of their topics; empty for the root.
        environment: variables that it has beside or instead of those of all processes.
    """

    name: str
    executable: str
    parameters: dict[str, Value] = field(default_factory=dict)
    optional: bool = False
    enclave: str = ""
    namespace: str = ""
    environment: dict[str, str] = field(default_factory=dict)

    def arguments(self) -> list[str]:
        """Command line after the executable: the node's name and its parameters."""
        # Only the group's own node takes the group's name; its satellites keep theirs.
        whose = "group:" if self.executable == "group_node" else ""
        arguments = ["--ros-args", "-r", f"{whose}__node:={self.name}"]
        if self.namespace:
            arguments += ["-r", f"__ns:={self.namespace}"]
        for name, value in self.parameters.items():
            # Quoted, since a bare `on` or `1` would be read as something else than a string.
            arguments += ["-p", f"{name}:={json.dumps(value, ensure_ascii=False)}"]
        return [*arguments, "--enclave", self.enclave] if self.enclave else arguments


def processes(
    plan: FormationPlan,
    scenario_file: Path,
    bag: Path | None,
    group: int = 1,
    checkpoints: Path | None = None,
    recorder_needed: bool = True,
    rate: float = 0.0,
    *,
    groups_file: Path | None = None,
    display: bool = False,
    host: HostSpec | None = None,
    namespace: str = "",
) -> list[NodeProcess]:
    """The processes of a scenario, the plant first.

    Args:
        plan: of the flight's parts.
        scenario_file: where every node reads it.
        bag: folder of the bag to be recorded; None when nothing is recorded.
        group: how many satellites share a process.
        checkpoints: folder of the satellites' checkpoints; None to keep none.
        recorder_needed: whether the flight ends when the recorder is lost.
        rate: simulated seconds in each second of the wall clock; 0 for lockstep.
        groups_file: where every node reads the groups of the plan; None where it has none.
        display: whether the flight is shown on topics that RViz and Foxglove draw.
        host: of which only the part is wanted; None for all.
        namespace: in which all nodes and their topics are; empty for the root.

    Returns:
        Plant, the satellites in their order without the external ones, the recorder if there is a bag, and
        the display if asked for.
    """
    common: dict[str, Value] = {"scenario": str(scenario_file)}
    if groups_file is not None:
        common["groups"] = str(groups_file)
    if rate > 0.0:
        common["rate"] = rate
    recorded = {**common, "recorded": bag is not None}
    found: list[NodeProcess] = []
    if _runs(host, "plant"):
        found.append(NodeProcess("plant", "plant_node", {**recorded, "recorder_needed": recorder_needed}))
    if checkpoints is not None:
        recorded["checkpoints"] = str(checkpoints)
    names = [name for name in plan.names if name not in plan.external and _runs(host, name)]
    if plan.groups is not None:
        found += [NodeProcess(name, "group_node", recorded) for name in plan.groups.names]
    elif group == 1:
        found += [NodeProcess(name, "satellite_node", {**recorded, "satellite": name}) for name in names]
    else:
        found += [
            NodeProcess(
                f"group{first // group}",
                "group_node",
                {**recorded, "satellites": names[first : first + group]},
            )
            for first in range(0, len(names), group)
        ]
    if bag is not None and _runs(host, "recorder"):
        found.append(NodeProcess("recorder", "recorder_node", {**common, "bag": str(bag)}))
    if display:
        found.append(NodeProcess("display", "display_node", common, optional=True))
    return [replace(process, namespace=namespace) for process in found]


def _runs(host: HostSpec | None, part: str) -> bool:
    return host is None or part in host.runs
