# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

from satform_tools.errors import CommandError
from satform_tools.run.page_options import LOOPBACK, PageOptions

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


def page_options(flag: str, *, enabled: bool, control: bool, port: int, bind: str) -> PageOptions | None:
    """How a command serves the live page; None if it serves none.

    Args:
        flag: option by which the command serves the page.
        enabled: whether it was used.
        control: value of `Control`.
        port: value of `Port`.
        bind: value of `Bind`.

    Raises:
        CommandError: an option of the page was used without the flag, or the address is none.
    """
    if not enabled and (control or port or bind != LOOPBACK):
        raise CommandError(f"--control, --port and --bind need {flag}")
    from satform_tools.cli import names  # noqa: PLC0415 - imported when needed, as by all commands

    return PageOptions(names.address(bind), port, control) if enabled else None
