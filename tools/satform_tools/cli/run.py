# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The commands that fly: run, replay, recover, rejoin, conformance, gallery."""

# ruff: noqa: PLC0415

from contextlib import ExitStack
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from satform_tools import console
from satform_tools.cli.shared_options import (
    Bind,
    Changes,
    Control,
    Foxglove,
    Json,
    Junit,
    Port,
    Quiet,
    Run,
    page_options,
)
from satform_tools.errors import CommandError
from satform_tools.run.page_options import LOOPBACK

EPILOG = (
    "Exit codes: 0 done, 1 an expectation was missed, 2 bad input, 3 a process was lost, "
    "4 the flight ended early (a quantity diverged, or a satellite hit the ground), "
    "130 stopped by Ctrl-C or SIGTERM."
)


class RunMode(StrEnum):
    """How a scenario is flown."""

    LOCKSTEP = "lockstep"
    INPROCESS = "inprocess"
    REALTIME = "realtime"


def add_to(app: typer.Typer) -> None:
    """Add these commands to the program's."""
    app.command(epilog=EPILOG)(run)
    app.command()(replay)
    app.command()(recover)
    app.command()(rejoin)
    app.command(epilog="Exit codes: 0 all rules are kept, 1 a rule is broken, 2 bad input.")(conformance)
    app.command()(gallery)


def run(
    scenario: Annotated[
        str | None,
        typer.Argument(
            metavar="[SCENARIO]",
            help="Name of a scenario in scenarios/, or path of a YAML file; left out with --campaign.",
        ),
    ] = None,
    mode: Annotated[
        RunMode,
        typer.Option(
            help="lockstep: one process for each satellite, over DDS; inprocess: one process without ROS; "
            "realtime: like lockstep, but each step begins at its time of the wall clock."
        ),
    ] = RunMode.LOCKSTEP,
    record: Annotated[
        bool,
        typer.Option("--record/--no-record", help="Record the flight; needed to evaluate the expectations."),
    ] = True,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder for the files of the run, new or empty; by default a new one in ./runs.",
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="Seed of the random numbers; by default the scenario's.")
    ] = None,
    changes: Changes = None,
    json: Json = False,
    satellites_per_process: Annotated[
        int,
        typer.Option(
            min=1, help="Number of satellites in a process; each satellite has its own node and topics."
        ),
    ] = 1,
    arrays: Annotated[
        bool,
        typer.Option(
            "--arrays",
            help="With --satellites-per-process: satellites of a process exchange one array a step.",
        ),
    ] = False,
    measure_round_trip: Annotated[
        bool,
        typer.Option(
            "--measure-round-trip",
            help="Also measure the round trip of an empty message between two processes.",
        ),
    ] = False,
    rate: Annotated[
        float | None,
        typer.Option(
            min=1e-3,
            max=1e6,
            help="With --mode realtime: simulated seconds per second of wall-clock time; by default 1.",
        ),
    ] = None,
    restart: Annotated[
        bool, typer.Option("--restart", help="Restart lost satellites from their checkpoints.")
    ] = False,
    continue_without_recorder: Annotated[
        bool,
        typer.Option("--continue-without-recorder", help="Continue the flight if the recorder is lost."),
    ] = False,
    display: Annotated[
        bool,
        typer.Option("--display", help="Also publish markers, poses, paths and /tf for RViz and Foxglove."),
    ] = False,
    secure: Annotated[
        Path | None,
        typer.Option(
            metavar="KEYSTORE", help="Fly with DDS Security, with the keys that `satform security` made."
        ),
    ] = None,
    host: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Run only the nodes of this host, an entry of the scenario's field hosts."
        ),
    ] = None,
    namespace: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="Namespace of all nodes, topics and services, so that formations can share a DDS domain.",
        ),
    ] = "",
    profile: Annotated[
        bool,
        typer.Option("--profile", help="Write a trace of all processes: trace.json, trace.png."),
    ] = False,
    campaign: Annotated[
        str | None,
        typer.Option(metavar="CAMPAIGN", help="Fly a case of this campaign: its name, file or folder."),
    ] = None,
    case: Annotated[
        int | None, typer.Option(metavar="N", help="With --campaign: number of the case, from 0.")
    ] = None,
    junit: Junit = None,
    quiet: Quiet = False,
    live: Annotated[
        bool,
        typer.Option("--live", help="Also serve a page on which the flight can be watched in a browser."),
    ] = False,
    control: Control = False,
    port: Port = 0,
    bind: Bind = LOOPBACK,
    foxglove: Foxglove = False,
) -> None:
    """Fly a scenario, record a bag and evaluate the expectations."""
    if rate is not None and mode is not RunMode.REALTIME:
        raise CommandError(
            f"--rate needs --mode realtime; --mode {mode.value} does not follow the wall clock"
        )
    _require_one_subject(scenario, campaign, case, varied=bool(changes) or seed is not None)
    page = page_options("--live", enabled=live, control=control, port=port, bind=bind, foxglove=foxglove)
    from satform_tools.report import junit as junit_file

    with ExitStack() as pages:
        with junit_file.begun(junit, junit_file.FLIGHT_SUITE, scenario or campaign or "", junit_file.FLIGHT):
            if mode is not RunMode.INPROCESS:
                from satform_tools.run import dds_preparation

                dds_preparation.prepare(secured=secure is not None)
            from satform_tools.campaign import case as campaign_case
            from satform_tools.cli import names
            from satform_tools.report import flight_junit, tables
            from satform_tools.run import command as run_command
            from satform_tools.run import live_page, scenario_library

            loaded_case = None
            if campaign is not None and case is not None:
                loaded_case = campaign_case.load(campaign, case)
                flown, out = loaded_case.scenario(), loaded_case.make_folder(out)
            else:
                flown = scenario_library.load(scenario or "", changes or (), seed)
            options = run_command.RunOptions(
                measure_round_trip=measure_round_trip,
                satellites_per_process=satellites_per_process,
                arrays=arrays,
                restart=restart,
                continue_without_recorder=continue_without_recorder,
                rate=(rate or 1.0) if mode is RunMode.REALTIME else 0.0,
                display=display,
                host=host,
                keystore=secure,
                profile=profile,
                namespace=names.namespace(namespace),
                quiet=quiet,
                live=page is not None,
            )
            served = pages.enter_context(live_page.beside(page, options.namespace))
            result = run_command.run(flown, mode.value, record=record, out=out, options=options)
        flight_junit.write(result, junit)
        if loaded_case is not None:
            loaded_case.describe(result.folder)
        if profile:
            from satform_tools.report import profile as flight_profile

            flight_profile.write(result.folder)
        if json:
            console.as_json(result.data())
        else:
            tables.print_result(result, quiet=quiet)
        if not result.stopped_by_signal:
            served.wait()
    raise typer.Exit(result.exit_code)


def _require_one_subject(
    scenario: str | None, campaign: str | None, case: int | None, *, varied: bool
) -> None:
    """Check that either a scenario or a case of a campaign is named.

    Raises:
        CommandError: neither is, or both are.
    """
    if (campaign is None) != (case is None):
        raise CommandError("--campaign and --case belong together: --campaign CAMPAIGN --case N")
    if campaign is None and scenario is None:
        raise CommandError("name a SCENARIO to fly, or a case: --campaign CAMPAIGN --case N")
    if campaign is not None and scenario is not None:
        raise CommandError(f"name either the scenario {scenario} or a case of a campaign, not both")
    if campaign is not None and varied:
        raise CommandError(
            "--set and --seed are for scenarios; the values of a case are those of its campaign. Its flight "
            "leaves scenario.json in the folder of the run, which satform run takes with --set"
        )


def replay(run: Run, json: Json = False) -> None:
    """Repeat a recorded flight in one process and compare the bits.

    The flight is repeated with all its recorded events, such as losses and changed parameters.
    """
    from satform_tools.run import replay as replay_command

    raise typer.Exit(replay_command.replay(run, as_json=json))


def recover(
    run: Run,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder of the new bag; by default beside the damaged bag, with the ending _recovered.",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Make a complete bag from the bag of a killed recorder.

    The damaged bag is not changed.
    """
    from satform_tools.run import recover as recover_command

    recover_command.recover(run, out, as_json=json)


def rejoin(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a running flight.")],
    satellite: Annotated[str, typer.Argument(help="Name of the lost satellite.")],
) -> None:
    """Restart a lost satellite of a running flight.

    Prints the step from which the satellite takes part, and runs until the satellite's process ends.
    """
    from satform_tools.run import ros_packages

    ros_packages.require()
    from satform_bringup.supervisor.rejoin import RejoinError
    from satform_bringup.supervisor.rejoin import rejoin as start_again

    try:
        raise typer.Exit(start_again(run, satellite))
    except RejoinError as error:
        raise CommandError(str(error)) from None


def conformance(
    node: Annotated[str, typer.Argument(metavar="NODE", help="Name of the node, e.g. /sat2.")],
    scenario: Annotated[
        str, typer.Option(metavar="SCENARIO", help="Scenario in which the satellite flies.")
    ] = "triangle",
    command: Annotated[
        str,
        typer.Option(
            metavar="COMMAND",
            help="Command that starts the node; {scenario} stands for the path of the scenario. Without it "
            "somebody else starts the node.",
        ),
    ] = "",
    timeout: Annotated[
        float, typer.Option(min=1.0, help="Seconds within which the node has to be there, and ready.")
    ] = 60.0,
    changes: Changes = None,
    json: Json = False,
) -> None:
    """Test the node of a satellite by the rules of the interface.

    Plays the plant, the neighbours and the recorder to it, with lost, late and repeated messages and
    changes of the formation.
    """
    from satform_tools.run import ros_packages, scenario_library

    ros_packages.require()
    from satform_tools.conformance import command as conformance_command

    test = conformance_command.Test(node, scenario_library.load(scenario, changes or ()), command, timeout)
    raise typer.Exit(conformance_command.conformance(test, as_json=json))


def gallery(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help="Scenarios to fly; by default all.")
    ] = None,
    stale: Annotated[
        bool,
        typer.Option("--stale", help="Only the scenarios that have changed since their figure was made."),
    ] = False,
) -> None:
    """Fly the shipped scenarios, write docs/gallery.md, and draw the pages of the triangle for docs/."""
    from satform_tools.docs import page_pictures
    from satform_tools.report import gallery as gallery_page
    from satform_tools.run import shipped_files

    shipped_files.require_checkout("the gallery is made")
    code = gallery_page.make(names or (), stale=stale)
    if not names or page_pictures.SCENARIO in names:
        page_pictures.make(stale=stale)
    raise typer.Exit(code)
