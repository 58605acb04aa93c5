"""Which processes a scenario needs: the one list behind the command line and the launch file."""

import json
from dataclasses import dataclass, field
from pathlib import Path

from satform.scenario import Scenario


@dataclass(frozen=True)
class NodeProcess:
    """One process with one node.

    Attributes:
        name: of the node.
        executable: of the package `satform_nodes`.
        parameters: ROS parameters that are given at the start.
    """

    name: str
    executable: str
    parameters: dict[str, str | bool] = field(default_factory=dict)

    def arguments(self) -> list[str]:
        """Command line after the executable: the node's name and its parameters."""
        words = ["--ros-args", "-r", f"__node:={self.name}"]
        for name, value in self.parameters.items():
            # Quoted, since a bare `on` or `1` would be read as something else than a string.
            words += ["-p", f"{name}:={json.dumps(value, ensure_ascii=False)}"]
        return words


def processes(scenario: Scenario, scenario_file: Path, bag: Path | None) -> list[NodeProcess]:
    """The processes of a scenario, the plant first.

    Args:
        scenario: what is flown.
        scenario_file: where every node reads it.
        bag: folder of the bag to be recorded; None when nothing is recorded.

    Returns:
        Plant, one satellite after another, and the recorder if there is a bag.
    """
    common: dict[str, str | bool] = {"scenario": str(scenario_file)}
    recorded = {**common, "recorded": bag is not None}
    found = [NodeProcess("plant", "plant_node", recorded)]
    found += [
        NodeProcess(satellite.name, "satellite_node", {**recorded, "satellite": satellite.name})
        for satellite in scenario.satellites
    ]
    if bag is not None:
        found.append(NodeProcess("recorder", "recorder_node", {**common, "bag": str(bag)}))
    return found
