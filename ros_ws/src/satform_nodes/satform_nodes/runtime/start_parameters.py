# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Parameters that a node is given at its start, for its declaration and for `--help` alike.

Nothing slow is imported here: the help is printed, and a signal handled, before anything else is loaded.
"""

from dataclasses import dataclass
from typing import Any

STOPPED_EXIT_CODE = "stopped_exit_code"


@dataclass(frozen=True)
class StartParameter:
    """A parameter that never changes once a node has started.

    Attributes:
        default: its value when it is not given, by which its type is known, too.
        description: what it means.
    """

    default: Any
    description: str


START_PARAMETERS = {
    "scenario": StartParameter("", "path of the scenario file"),
    "recorded": StartParameter(
        False, "whether a recorder takes part; if so, the flight waits until it is ready"
    ),
    "recorder_needed": StartParameter(True, "whether the flight ends when the recorder is lost"),
    "rate": StartParameter(0.0, "simulated seconds per second of wall-clock time; 0 for lockstep"),
    "satellite": StartParameter("", "name of the satellite in the scenario"),
    "satellites": StartParameter([""], "names of the satellites in this process"),
    "groups": StartParameter(
        "", "file of the groups of satellites that exchange arrays; empty where each has its own topics"
    ),
    "checkpoints": StartParameter("", "folder of the checkpoints; empty to write none"),
    "bag": StartParameter("", "folder of the bag to be written"),
    "display_scale": StartParameter(1e-3, "length of one metre in the markers"),
    "frames_per_period": StartParameter(200.0, "frames per period, in simulated time"),
    "trail": StartParameter(200.0, "length of a trail, frames"),
    "frame_rate": StartParameter(10.0, "frames per second of wall-clock time, at most"),
    STOPPED_EXIT_CODE: StartParameter(
        130, "exit code after a stop by a signal or service; the launch file sets 0"
    ),
}


@dataclass(frozen=True)
class Program:
    """An executable of this package.

    Attributes:
        purpose: what its node does.
        parameters: names of those that it declares.
        specifications: prefixes of the parameters that come from the scenario.
    """

    purpose: str
    parameters: tuple[str, ...]
    specifications: tuple[str, ...] = ()


_SATELLITE = ("controller", "attitude_controller", "curve", "phase")

PROGRAMS = {
    "plant_node": Program(
        "Propagates all satellites, decides which of them take part, and publishes simulated time.",
        ("scenario", "groups", "recorded", "recorder_needed", "rate", STOPPED_EXIT_CODE),
    ),
    "satellite_node": Program(
        "Flies one satellite.",
        ("scenario", "satellite", "recorded", "checkpoints", "rate", STOPPED_EXIT_CODE),
        _SATELLITE,
    ),
    "group_node": Program(
        "Runs the flight software of several satellites in one process.",
        ("scenario", "groups", "satellites", "recorded", "checkpoints", "rate", STOPPED_EXIT_CODE),
        _SATELLITE,
    ),
    "recorder_node": Program(
        "Records the flight as a bag (MCAP).",
        ("scenario", "groups", "bag", "rate", STOPPED_EXIT_CODE),
    ),
    "display_node": Program(
        "Publishes markers, poses, paths and transforms for RViz and Foxglove.",
        ("scenario", "display_scale", "frames_per_period", "trail", "frame_rate", STOPPED_EXIT_CODE),
    ),
}


def help_of(program: str) -> str:
    """What an executable is for, and every parameter of it with type, default and meaning.

    Args:
        program: its name.
    """
    described = PROGRAMS[program]
    rows = [(name, START_PARAMETERS[name]) for name in described.parameters]
    kinds = [_kind(parameter.default) for _, parameter in rows]
    width = max(len(name) for name, _ in rows)
    kind_width = max(map(len, kinds))
    lines = [
        f"usage: ros2 run satform_nodes {program} --ros-args [-r __node:=NAME] [-r __ns:=NAMESPACE] "
        "[-p PARAMETER:=VALUE]...",
        "",
        described.purpose,
        "",
        "Parameters, read-only, set at the start:",
        *(
            f"  {name:{width}}  {kind:{kind_width}}  {_value(parameter.default):>6}  {parameter.description}"
            for (name, parameter), kind in zip(rows, kinds, strict=True)
        ),
    ]
    if described.specifications:
        prefixes = ", ".join(f"{prefix}.*" for prefix in described.specifications)
        lines += [
            "",
            f"Parameters of each satellite, as in its scenario; most can be set in flight: {prefixes}",
        ]
    lines += [
        "",
        "Exit codes: 0 flown to the end, 2 bad input, 3 another process was lost, "
        "4 the flight ended early, 130 stopped.",
    ]
    return "\n".join(lines) + "\n"


def _kind(default: Any) -> str:
    if isinstance(default, list):
        return "string[]"
    return {bool: "bool", int: "int", float: "double", str: "string"}[type(default)]


def _value(default: Any) -> str:
    if isinstance(default, bool):
        return str(default).lower()
    return f"{default:g}" if isinstance(default, int | float) else "-"
