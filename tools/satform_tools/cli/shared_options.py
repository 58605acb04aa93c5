# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

ScenarioArgument = Annotated[
    str, typer.Argument(metavar="SCENARIO", help="Name of a scenario in scenarios/, or path of a YAML file.")
]
Changes = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Change a field of the scenario, e.g. timing.step=1.0. Repeatable."
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, in SI units.")]
Run = Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a run, bag folder, or .mcap file.")]
Junit = Annotated[Path | None, typer.Option(metavar="FILE", help="Also write the result as JUnit XML.")]
Quiet = Annotated[
    bool,
    typer.Option(
        "--quiet",
        help="Print neither progress nor times of the wall clock: equal flights print the same text.",
    ),
]

LOOPBACK = "127.0.0.1"
"""Address of this machine that no other one can reach."""

Port = Annotated[
    int, typer.Option(min=0, max=65535, metavar="N", help="Port of the page; 0 for any that is free.")
]
Bind = Annotated[
    str,
    typer.Option(
        metavar="ADDRESS",
        help="IP address of this machine on which the page is served; the printed address "
        "opens it from other machines, too.",
    ),
]
Control = Annotated[
    bool,
    typer.Option(
        "--control",
        help="Let the page pause, step, resume and stop the flight, and change its parameters and its graph.",
    ),
]
