"""The commands and their options; what they do is in the modules beside this one.

Each command loads those modules itself, so that none waits for what another one needs.
"""

# ruff: noqa: PLC0415

import sys
import warnings
from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_DONE, EXIT_STOPPED
from satform_nodes.runtime.signals import interrupting
from satform_tools import console, output_streams
from satform_tools.cli import bench as bench_cli
from satform_tools.cli import inspect as inspect_cli
from satform_tools.cli import plan as plan_cli
from satform_tools.errors import CommandError, fault_sentences, sentence_of
from satform_tools.report.formats import Format

_EXIT_CODES = (
    "Exit codes: 0 as expected, 1 an expectation was missed, 2 bad input, 3 a process was lost, "
    "4 the flight ended early (a quantity diverged, or a satellite hit the ground), "
    "130 stopped by Ctrl-C or SIGTERM."
)

app = typer.Typer(
    name="satform",
    help=f"Fly, judge and report satellite formations. {_EXIT_CODES}",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich" if console.is_terminal(sys.stdout) else None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


app.add_typer(plan_cli.app, name="plan")
app.add_typer(bench_cli.app, name="bench")
inspect_cli.add_to(app)


class RunMode(StrEnum):
    """How a scenario is flown."""

    LOCKSTEP = "lockstep"
    INPROCESS = "inprocess"
    REALTIME = "realtime"


ScenarioArgument = Annotated[
    str, typer.Argument(metavar="SCENARIO", help="Name of a scenario in scenarios/, or path of a YAML file.")
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON for machines.")]
Changes = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Change a field of the scenario, e.g. timing.step=1.0. Repeatable."
    ),
]


def _look_at_environment(*, secured: bool) -> None:
    """Name what cannot work before any process starts, and say which variables a flight does without.

    Raises:
        CommandError: a flight cannot work here.
    """
    from satform_bringup.deployment import preflight

    try:
        preflight.require(secured=secured)
    except preflight.PreflightError as error:
        raise CommandError(str(error)) from None
    for name in preflight.set_in_vain():
        console.note(f"{name} is set; the nodes of a flight do without it")
    preflight.neutralise()


@app.command(epilog=_EXIT_CODES)
def run(
    scenario: ScenarioArgument,
    mode: Annotated[
        RunMode,
        typer.Option(
            help="lockstep: a process for each satellite, over DDS; inprocess: one process, no ROS; "
            "realtime: as lockstep, but on the wall clock."
        ),
    ] = RunMode.LOCKSTEP,
    record: Annotated[
        bool, typer.Option("--record/--no-record", help="Keep the flight; it is judged from that.")
    ] = True,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of the run, new or empty; by default a new one in ./runs."),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="Seed of everything random, instead of the scenario's.")
    ] = None,
    changes: Changes = None,
    json: Json = False,
    group: Annotated[
        int, typer.Option(min=1, help="Satellites that share a process; they talk over DDS all the same.")
    ] = 1,
    measure: Annotated[
        bool,
        typer.Option("--measure", help="Also measure a bare message there and back between two processes."),
    ] = False,
    rate: Annotated[
        float | None,
        typer.Option(
            min=1e-3,
            max=1e6,
            help="With --mode realtime: simulated seconds in a second of the wall clock; by default 1.",
        ),
    ] = None,
    restart: Annotated[
        bool, typer.Option("--restart", help="Start satellites again that are lost, from their checkpoints.")
    ] = False,
    without_recorder: Annotated[
        bool,
        typer.Option("--without-recorder", help="Fly on when the recorder is lost, instead of stopping."),
    ] = False,
    display: Annotated[
        bool,
        typer.Option("--display", help="Also publish markers, poses, paths and /tf for RViz and Foxglove."),
    ] = False,
    secure: Annotated[
        Path | None,
        typer.Option(
            metavar="KEYSTORE", help="Fly over DDS with the keys that `security` made, or not at all."
        ),
    ] = None,
    host: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Run only the part of this machine, by its name in the scenario's hosts."
        ),
    ] = None,
    namespace: Annotated[
        str,
        typer.Option(
            metavar="NAME", help="Namespace of all nodes and topics, by which formations can share a domain."
        ),
    ] = "",
    profile: Annotated[
        bool,
        typer.Option("--profile", help="Keep what every process did when: trace.json, trace.png."),
    ] = False,
) -> None:
    """Fly a scenario, keep the flight and judge it by what the scenario expects."""
    if rate is not None and mode is not RunMode.REALTIME:
        raise CommandError(f"--rate is for the wall clock: --mode {mode.value} has none, --mode realtime has")
    if mode is not RunMode.INPROCESS:
        from satform_tools.run import ros

        ros.require()
        from satform_bringup.supervisor import process_server

        _look_at_environment(secured=secure is not None)
        # It imports what nodes need while this process imports and checks the scenario.
        process_server.prepare()
    from satform_tools.cli import names
    from satform_tools.report import tables
    from satform_tools.run import command as run_command
    from satform_tools.run import scenario_library

    flown = scenario_library.load(scenario, changes or (), seed)
    clock = (rate or 1.0) if mode is RunMode.REALTIME else 0.0
    manner = run_command.Manner(
        measure=measure,
        group=group,
        restart=restart,
        without_recorder=without_recorder,
        rate=clock,
        display=display,
        host=host,
        keystore=secure,
        profile=profile,
        namespace=names.namespace(namespace),
    )
    run_result = run_command.run(flown, mode.value, record=record, out=out, manner=manner)
    if json:
        console.as_json(run_result.data())
    else:
        tables.print_outcome(run_result)
    raise typer.Exit(run_result.exit_code)


@app.command("list")
def list_scenarios(json: Json = False) -> None:
    """List the scenarios that come with the project."""
    from satform_tools.describe import scenario_list

    raise typer.Exit(scenario_list.show(as_json=json))


@app.command()
def check(
    files: Annotated[
        list[str], typer.Argument(metavar="FILE...", help="Scenario files, or names of scenarios.")
    ],
    json: Json = False,
) -> None:
    """Check scenario files: all that is wrong in all of them, and what is unwise."""
    from satform_tools.check import files as check_files

    raise typer.Exit(check_files.check(files, as_json=json))


@app.command()
def show(scenario: ScenarioArgument, changes: Changes = None, json: Json = False) -> None:
    """Show what a scenario means: graph, gains, modal roots, processes, topics, expectations."""
    from satform_tools.describe import scenario as describe_scenario
    from satform_tools.run import scenario_library

    describe_scenario.show(scenario_library.load(scenario, changes or ()), as_json=json)


@app.command()
def report(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN [OTHER]", help="Folder of a run, bag folder, or .mcap file; two are compared."
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Where it is written; by default a folder `report` beside the bag."),
    ] = None,
    export: Annotated[
        list[Format] | None, typer.Option(help="Write this, too. Repeatable.", show_choices=True)
    ] = None,
    json: Json = False,
) -> None:
    """Tell of a flight as a table, a page for a browser and files; or compare two flights."""
    from satform_tools.report import command as report_command

    report_command.report(runs, out, export or (), as_json=json)


@app.command()
def replay(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a run, bag folder, or .mcap file.")],
    json: Json = False,
) -> None:
    """Fly a recorded flight once more in one process, with all that happened in it, and compare the bits."""
    from satform_tools.run import replay as replay_command

    raise typer.Exit(replay_command.replay(run, as_json=json))


@app.command()
def recover(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a run, bag folder, or .mcap file.")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of the new bag; by default one beside the old."),
    ] = None,
    json: Json = False,
) -> None:
    """Make a whole bag of one whose recorder was killed; the old one stays as it is."""
    from satform_tools.run import recover as recover_command

    recover_command.recover(run, out, as_json=json)


@app.command()
def rejoin(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a run that is under way.")],
    satellite: Annotated[str, typer.Argument(help="Name of the satellite that was lost.")],
) -> None:
    """Start a lost satellite again: it takes part from a step that the run names, and ends with the run."""
    from satform_tools.run import ros

    ros.require()
    from satform_bringup.supervisor.rejoin import RejoinError
    from satform_bringup.supervisor.rejoin import rejoin as start_again

    try:
        raise typer.Exit(start_again(run, satellite))
    except RejoinError as error:
        raise CommandError(str(error)) from None


@app.command()
def gallery(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help="Scenarios to fly; all when left out.")
    ] = None,
    stale: Annotated[
        bool, typer.Option("--stale", help="Only those that have changed since their picture was made.")
    ] = False,
) -> None:
    """Fly the scenarios that come with the project and make docs/gallery.md and its pictures anew."""
    from satform_tools.report import gallery as pictures

    raise typer.Exit(pictures.make(names or (), stale=stale))


@app.command()
def security(
    scenario: ScenarioArgument,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of the keystore, new or empty; by default in ./keystores."),
    ] = None,
    days: Annotated[int, typer.Option(min=1, max=36500, help="For which the keys hold.")] = 365,
    domain: Annotated[
        int | None, typer.Option(min=0, max=230, help="The only DDS domain for which they hold; else all.")
    ] = None,
    changes: Changes = None,
    json: Json = False,
) -> None:
    """Make the keys and signed permissions (SROS 2) by which each node does its own work and no other."""
    from satform_tools.run import scenario_library
    from satform_tools.security import command

    command.secure(scenario_library.load(scenario, changes or ()), out, days, domain, as_json=json)


@app.command()
def schema(
    markdown: Annotated[
        bool, typer.Option("--markdown", help="Print docs/reference.md, the same for people, instead.")
    ] = False,
) -> None:
    """Print the JSON Schema of scenario files, by which editors complete and check them."""
    from satform_tools.describe import json_schema, scenario_reference

    output_streams.write(scenario_reference.text() if markdown else json_schema.text())


@app.command(
    context_settings={"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []}
)
def test(context: typer.Context) -> None:
    """Check code and run all tests; with arguments, run pytest with these alone."""
    from satform_tools import run_tests

    raise typer.Exit(run_tests.run(context.args))


@app.command()
def version(json: Json = False) -> None:
    """Print the versions of everything that flies."""
    from satform_tools.run import run_result

    found = run_result.versions()
    if json:
        console.as_json(found)
    else:
        for name, number in found.items():
            console.line(f"{name} {number}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: the words after the program's name; those of this process when left out.

    Returns:
        Exit code.
    """
    output_streams.prepare()
    # What is not finite ends a flight with a sentence; numpy's warning would say the same less well.
    warnings.filterwarnings("ignore", category=RuntimeWarning)
    code = _run(arguments)
    try:
        output_streams.finish()
    except OSError as error:
        console.error(sentence_of(error))
        return code or EXIT_BAD_INPUT
    return code


def _run(arguments: Sequence[str] | None) -> int:
    """Run the command line; what goes wrong is said in sentences."""
    try:
        with interrupting():
            app(args=None if arguments is None else list(arguments), prog_name="satform")
    except SystemExit as end:
        if type(sys.stdout).__name__ == "PacifyFlushWrapper":
            # Typer's own pages, read by someone who has seen enough.
            return EXIT_DONE
        return end.code if isinstance(end.code, int) else EXIT_BAD_INPUT
    except KeyboardInterrupt:
        return EXIT_STOPPED
    except Exception as error:
        sentences = fault_sentences(error)
        if not sentences:
            # A mistake of ours, which is found by its traceback.
            raise
        for sentence in sentences:
            console.error(sentence)
        return error.exit_code if isinstance(error, CommandError) else EXIT_BAD_INPUT
    return EXIT_DONE
