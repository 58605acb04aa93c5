# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The commands before and after a flight: list, check, show, schema, interface, security, report."""

# ruff: noqa: PLC0415

from pathlib import Path
from typing import Annotated

import typer

from satform_tools import output_streams
from satform_tools.cli.shared_options import Bind, Changes, Json, Port, Run, ScenarioArgument
from satform_tools.errors import CommandError
from satform_tools.report.formats import CheckFormat, FlightFormat
from satform_tools.run.page_options import LOOPBACK, PageOptions
from satform_tools.templates.kinds import PartKind


def add_to(app: typer.Typer) -> None:
    """Add these commands to the program's."""
    app.command("list")(list_scenarios)
    app.command()(check)
    app.command()(show)
    app.command()(schema)
    app.command()(new)
    app.command()(interface)
    app.command()(security)
    app.command()(report)
    app.command()(view)


def list_scenarios(json: Json = False) -> None:
    """List the shipped scenarios."""
    from satform_tools.describe import scenario_list

    raise typer.Exit(scenario_list.show(as_json=json))


def check(
    files: Annotated[
        list[str],
        typer.Argument(metavar="FILE...", help="Scenario or campaign files, or names of shipped ones."),
    ],
    form: Annotated[
        CheckFormat | None,
        typer.Option(
            "--format",
            help="text; json; github: annotations of GitHub Actions; sarif: a SARIF 2.1.0 log, as code "
            "scanning reads it. By default text.",
        ),
    ] = None,
    changes: Changes = None,
    json: Json = False,
) -> None:
    """Validate scenario and campaign files; print errors and warnings.

    With --set, scenarios are checked as run would fly them.
    """
    from satform_tools.check import files as check_files

    if json and form not in {None, CheckFormat.JSON}:
        raise CommandError(f"--json and --format {form} exclude each other: name one form of output")
    shown_as = CheckFormat.JSON if json else form or CheckFormat.TEXT
    raise typer.Exit(check_files.check(files, shown_as, changes or ()))


def show(scenario: ScenarioArgument, changes: Changes = None, json: Json = False) -> None:
    """Describe a scenario: graph, gains, modes, topics, expectations."""
    from satform_tools.describe import scenario_text
    from satform_tools.run import scenario_library

    scenario_text.show(scenario_library.load(scenario, changes or ()), as_json=json)


def schema(
    markdown: Annotated[
        bool, typer.Option("--markdown", help="Print the page of the documentation instead.")
    ] = False,
    campaign: Annotated[
        bool, typer.Option("--campaign", help="For campaign files instead of scenario files.")
    ] = False,
) -> None:
    """Print the JSON Schema of scenario or campaign files."""
    if campaign:
        from satform_tools.describe import campaign_reference, campaign_schema

        output_streams.write(campaign_reference.text() if markdown else campaign_schema.text())
        return
    from satform_tools.describe import json_schema, scenario_reference

    output_streams.write(scenario_reference.text() if markdown else json_schema.text())


def new(
    kind: Annotated[PartKind, typer.Argument(help="Kind of the part.")],
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="Name by which scenarios select it, and of its module.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of the package, new or empty; by default ./NAME."),
    ] = None,
) -> None:
    """Make a package with a part of your own, and a scenario and a test for it.

    A part is what a scenario selects by its kind, such as a controller or a reference curve.
    """
    from satform_tools.templates import package

    package.describe(package.make(kind, name, out), name)


def interface() -> None:
    """Print the topics, QoS and messages of the interface, as a page of the documentation."""
    from satform_tools.run import ros_packages

    ros_packages.require()
    from satform_tools.describe import interface_reference

    output_streams.write(interface_reference.text())


def security(
    scenario: ScenarioArgument,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Folder of the keystore, new or empty; by default ./keystores/NAME."
        ),
    ] = None,
    days: Annotated[int, typer.Option(min=1, max=36500, help="Days for which the keys are valid.")] = 365,
    domain: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=230,
            help="The only DDS domain for which the keys are valid; by default all from 0 to 230.",
        ),
    ] = None,
    possible_graph: Annotated[
        str | None,
        typer.Option(
            metavar="GRAPH",
            help="Further edges that /formation/set_graph may use in flight, as the field graph of a "
            "scenario, for example '{kind: complete}'; by default none.",
        ),
    ] = None,
    changes: Changes = None,
    json: Json = False,
) -> None:
    """Make keys and signed permissions (SROS 2) for each node.

    With them, a node can publish and subscribe only to the topics of its role.
    """
    from satform_tools.run import scenario_library
    from satform_tools.security import command

    loaded = scenario_library.load(scenario, changes or ())
    further = None
    if possible_graph is not None:
        further = command.further_graph(scenario, changes or (), possible_graph)
    command.secure(loaded, out, days, domain, further, as_json=json)


def view(run: Run, port: Port = 0, bind: Bind = LOOPBACK) -> None:
    """Serve a page in which a stored flight can be watched again, until Ctrl-C.

    Prints the page's address, which has a token; the page needs no network.
    """
    from satform_tools.cli import names
    from satform_tools.live import command as live

    raise typer.Exit(live.view(run, PageOptions(names.address(bind), port)))


def report(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN [OTHER]",
            help="Folder of a run, bag folder, or .mcap file; if two are given, they are compared.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of the report; by default `report` beside the bag."),
    ] = None,
    export: Annotated[
        list[FlightFormat] | None,
        typer.Option(help="Also write a file of this format. Repeatable.", show_choices=True),
    ] = None,
    json: Json = False,
) -> None:
    """Print a flight's figures and write a page, or compare two.

    The page is report.html, for a browser; flight.png is an overview as a picture.
    """
    from satform_tools.report import command as report_command

    report_command.report(runs, out, export or (), as_json=json)
