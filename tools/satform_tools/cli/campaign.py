# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The commands of campaigns: run, resume, report, case, gallery."""

# ruff: noqa: PLC0415

from contextlib import AbstractContextManager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from satform_tools import console
from satform_tools.cli.run import RunMode
from satform_tools.cli.shared_options import Bind, Json, Junit, Port, Quiet, page_options
from satform_tools.errors import CommandError
from satform_tools.report.formats import Format
from satform_tools.run.page_options import LOOPBACK

if TYPE_CHECKING:
    from satform_tools.campaign.summary import Summary

EPILOG = (
    "Exit codes: 0 as expected, 1 an expectation of the campaign was missed, 2 bad input, 3 cases have no "
    "result (the disk is full, no worker can be started), 130 stopped by Ctrl-C or SIGTERM."
)

app = typer.Typer(
    help=f"Fly many cases of a scenario, sampled from dispersions, and judge them together. {EPILOG}",
    no_args_is_help=True,
)


class EngineName(StrEnum):
    """Where cases are flown."""

    LOCAL = "local"
    DASK = "dask"


CampaignArgument = Annotated[
    str,
    typer.Argument(metavar="CAMPAIGN", help="Name of a campaign in scenarios/campaigns/, or path of a file."),
]
Folder = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a campaign.")]
Workers = Annotated[
    int | None,
    typer.Option(min=1, max=1024, help="Processes on this machine; by default one for each processor."),
]
EngineOption = Annotated[
    EngineName, typer.Option(help="local: processes of this machine; dask: workers of a dask scheduler.")
]
Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Of the dask scheduler, e.g. tcp://10.0.0.1:8786.")
]
Timeout = Annotated[
    float | None,
    typer.Option(
        min=0.1,
        metavar="SECONDS",
        help="Wall-clock time in which a case flown alone has to end; by default that of the campaign.",
    ),
]


Live = Annotated[
    bool,
    typer.Option("--live", help="Also serve a page on which success rate and distributions can be watched."),
]


@app.command(epilog=EPILOG)
def run(
    campaign: CampaignArgument,
    workers: Workers = None,
    engine: EngineOption = EngineName.LOCAL,
    scheduler: Scheduler = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "--output",
            metavar="DIR",
            help="Folder of the campaign, new or empty; by default a new one in ./runs.",
        ),
    ] = None,
    timeout: Timeout = None,
    json: Json = False,
    junit: Junit = None,
    quiet: Quiet = False,
    live: Live = False,
    port: Port = 0,
    bind: Bind = LOOPBACK,
) -> None:
    """Fly all cases of a campaign and judge them; Ctrl-C keeps what is done."""
    from satform_tools.campaign import command

    page = page_options("--live", enabled=live, control=False, port=port, bind=bind)
    options = command.Options(workers, engine.value, scheduler, timeout, junit, quiet, page)
    with _junit_of(junit, campaign):
        summary = command.run(campaign, out, options)
    _end(summary, as_json=json, quiet=quiet)


@app.command(epilog=EPILOG)
def resume(
    campaign: Annotated[
        Path,
        typer.Argument(metavar="DIR|FILE", help="Folder of a campaign, or its file: the newest in ./runs."),
    ],
    workers: Workers = None,
    engine: EngineOption = EngineName.LOCAL,
    scheduler: Scheduler = None,
    timeout: Timeout = None,
    repair: Annotated[
        bool,
        typer.Option("--repair", help="Put damaged files of results aside, and fly their cases again."),
    ] = False,
    retry: Annotated[
        bool,
        typer.Option("--retry", help="Also fly cases again that ended by a timeout or with their worker."),
    ] = False,
    stored: Annotated[
        bool,
        typer.Option(
            "--stored", help="Fly the copy of the campaign in the folder, though its file has changed since."
        ),
    ] = False,
    json: Json = False,
    junit: Junit = None,
    quiet: Quiet = False,
    live: Live = False,
    port: Port = 0,
    bind: Bind = LOOPBACK,
) -> None:
    """Fly the cases of a campaign that have no result yet, and judge all."""
    from satform_tools.campaign import command

    page = page_options("--live", enabled=live, control=False, port=port, bind=bind)
    options = command.Options(workers, engine.value, scheduler, timeout, junit, quiet, page)
    resumption = command.Resumption(repair=repair, retry=retry, stored=stored)
    with _junit_of(junit, str(campaign)):
        summary = command.resume(campaign, options, resumption)
    _end(summary, as_json=json, quiet=quiet)


@app.command(epilog=EPILOG)
def report(
    folder: Folder,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "--output", metavar="DIR", help="Folder of the report; by default `report` in DIR."
        ),
    ] = None,
    export: Annotated[
        list[Format] | None, typer.Option(help="Also write this format. Repeatable.", show_choices=True)
    ] = None,
    json: Json = False,
    junit: Junit = None,
) -> None:
    """Report a campaign: print success rate, figures and failures, write a page for a browser and files."""
    from satform_tools.campaign import command

    with _junit_of(junit, str(folder)):
        summary = command.report(folder, junit, out, export or ())
    _end(summary, as_json=json)


@app.command()
def case(
    campaign: CampaignArgument,
    number: Annotated[int, typer.Argument(metavar="N", help="Number of the case, from 0.")],
    fly: Annotated[
        bool, typer.Option("--fly", help="Fly it: the same as satform run --campaign CAMPAIGN --case N.")
    ] = False,
    mode: Annotated[RunMode, typer.Option(help="With --fly: as for satform run.")] = RunMode.LOCKSTEP,
    out: Annotated[
        Path | None, typer.Option("--out", "--output", metavar="DIR", help="With --fly: folder of the run.")
    ] = None,
    json: Json = False,
) -> None:
    """Show what a case of a campaign sets, by path of the scenario's fields."""
    from satform_tools.campaign import case as campaign_case
    from satform_tools.cli import run as run_commands

    if fly:
        run_commands.run(None, mode, out=out, json=json, campaign=campaign, case=number)
        return
    if out is not None:
        raise CommandError("--out is for --fly")
    found = campaign_case.load(campaign, number)
    if json:
        about = {"campaign": found.campaign.name, "file": str(found.file), "case": number}
        console.as_json({**about, "changes": found.changes})
        return
    rows = [
        (path, f"{value:.9g}" if isinstance(value, float) else str(value))
        for path, value in found.changes.items()
    ]
    console.table(console.Table(("field", "value"), rows, right=frozenset({1})))


@app.command()
def gallery(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help="Campaigns to fly; by default all.")
    ] = None,
    stale: Annotated[
        bool,
        typer.Option("--stale", help="Only the campaigns that have changed since their figure was made."),
    ] = False,
    workers: Workers = None,
    folders: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Keep the campaigns in this folder, and resume those that are there already."
        ),
    ] = None,
) -> None:
    """Fly the shipped campaigns and write docs/campaign_gallery.md and its figures."""
    from satform_tools.campaign import gallery as campaign_gallery
    from satform_tools.run import shipped_files

    shipped_files.require_checkout("the gallery is made")
    raise typer.Exit(campaign_gallery.make(names or (), workers, stale=stale, folders=folders))


def _junit_of(file: Path | None, campaign: str) -> AbstractContextManager[None]:
    from satform_tools.report import junit

    return junit.begun(file, junit.CAMPAIGN_SUITE, campaign, junit.FLIGHTS)


def _end(summary: "Summary", *, as_json: bool, quiet: bool = False) -> None:
    from satform_tools.campaign import tables

    if as_json:
        console.as_json(summary.data())
    else:
        tables.print_summary(summary, quiet=quiet)
    raise typer.Exit(summary.exit_code)
