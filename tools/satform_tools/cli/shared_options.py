# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Arguments and options that several commands share."""

import importlib.util
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


Foxglove = Annotated[
    bool,
    typer.Option(
        "--foxglove", help="Serve the topics with their schemas to Foxglove instead, and print the address."
    ),
]


def page_options(
    flag: str, *, enabled: bool, control: bool, port: int, bind: str, foxglove: bool = False
) -> PageOptions | None:
    """How a command serves the live page, or its topics to Foxglove; None if it serves neither.

    Args:
        flag: option by which the command serves the page.
        enabled: whether it was used.
        control: value of `Control`.
        port: value of `Port`.
        bind: value of `Bind`.
        foxglove: value of `Foxglove`.

    Raises:
        CommandError: an option of the page was used without the flag, the address is none, or what serves
            Foxglove is not installed.
    """
    if foxglove and (enabled or control):
        raise CommandError(f"--foxglove excludes {flag} and --control")
    if not (enabled or foxglove) and (control or port or bind != LOOPBACK):
        raise CommandError(f"--control, --port and --bind need {flag}")
    if foxglove and importlib.util.find_spec("foxglove") is None:
        raise CommandError(
            "--foxglove needs the package foxglove-sdk, which is an extra: "
            ".venv/bin/uv pip install --no-deps -r requirements-foxglove.txt"
        )
    from satform_tools.cli import names  # noqa: PLC0415 - imported when needed, as by all commands

    return PageOptions(names.address(bind), port, control, foxglove) if enabled or foxglove else None
