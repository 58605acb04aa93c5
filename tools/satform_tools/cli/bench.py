# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The commands `satform bench ...`: measure speed, each figure beside a yardstick of the same run."""

# ruff: noqa: PLC0415

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from satform_tools.cli.shared_options import Json

HISTORY = Path("runs/bench")

_ALL = "Measure speed. Without a command: all measurements, written to the history for `bench compare`."

app = typer.Typer(help=_ALL)

History = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Folder in which the figures become a JSON file for `bench compare`."),
]
Repetitions = Annotated[int, typer.Option(min=1, help="Repetitions, alternating with the yardstick.")]
Counts = Annotated[
    list[int] | None, typer.Option("--satellites", "-n", min=1, help="Number of satellites. Repeatable.")
]


@app.callback(invoke_without_command=True, help=_ALL)
def measure_all(
    context: typer.Context,
    repetitions: Repetitions = 3,
    history: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder in which the figures become a JSON file.")
    ] = HISTORY,
    json: Json = False,
) -> None:
    """Measure everything that the commands of this group measure in a few minutes."""
    if context.invoked_subcommand is not None:
        return
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite
    from satform_tools.run import scenario_library

    with _over_dds():
        found = suite.round_trip(repetitions)
        found += suite.satellite(scenario_library.SCENARIOS, repetitions)
        found += suite.in_process([1, 100], repetitions)
        found += suite.recorder(repetitions)
        found += suite.lockstep([3], 1, 500, repetitions, record=True, stock=False)
        found += suite.lockstep([3], 1, 500, repetitions, record=False, stock=False)
        found += suite.lockstep([3], 1, 200, repetitions, record=False, stock=True)
        found += suite.lockstep([16], 16, 200, repetitions, record=False, stock=False)
        found += suite.start_up([3], repetitions)
    bench_output.show(found, history, as_json=json)


@app.command("ping-pong")
def ping_pong(repetitions: Repetitions = 3, history: History = None, json: Json = False) -> None:
    """Round trip of a bare message between two processes: the yardstick of all figures over DDS."""
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite

    with _over_dds():
        found = suite.round_trip(repetitions)
    bench_output.show(found, history, as_json=json)


@app.command()
def plant(json: Json = False) -> None:
    """Inertial propagation with gravity of degree 10, beside brahe's propagator and SciPy's DOP853."""
    from satform_tools.bench import output as bench_output

    bench_output.plant(as_json=json)


@app.command()
def models(
    separation: Annotated[
        float, typer.Option(min=1.0, help="Distance of the satellites from the chief, m.")
    ] = 1000.0,
    json: Json = False,
) -> None:
    """Error of the linear truth models against inertial propagation: the table of docs/models.md."""
    from satform_tools.bench import output as bench_output

    bench_output.models(separation, as_json=json)


@app.command()
def lockstep(
    satellites: Counts = None,
    satellites_per_process: Annotated[int, typer.Option(min=1, help="Satellites that share a process.")] = 1,
    steps: Annotated[int, typer.Option(min=10, help="Steps of each flight.")] = 1000,
    record: Annotated[bool, typer.Option("--record/--no-record", help="With or without a recorder.")] = True,
    executor: Annotated[
        str,
        typer.Option(
            help="own: that of the nodes; stock: rclpy's SingleThreadedExecutor; both: one after another."
        ),
    ] = "own",
    repetitions: Repetitions = 1,
    history: History = None,
    json: Json = False,
) -> None:
    """A lockstep step over DDS of satellites on a ring (3, 8 and 16), beside a bare round trip."""
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite
    from satform_tools.errors import CommandError

    if executor not in ("own", "stock", "both"):
        raise CommandError(f"--executor {executor}: is one of own, stock, both")
    with _over_dds():
        found = []
        for stock in {"own": (False,), "stock": (True,), "both": (False, True)}[executor]:
            found += suite.lockstep(
                satellites or [3, 8, 16],
                satellites_per_process,
                steps,
                repetitions,
                record=record,
                stock=stock,
            )
    bench_output.show(found, history, as_json=json)


@app.command()
def scaling(
    satellites: Counts = None,
    steps: Annotated[int, typer.Option(min=10, help="Steps of each flight.")] = 100,
    write: Annotated[
        bool, typer.Option("--write", help="Write table and figure to docs/scaling.md of this checkout.")
    ] = False,
) -> None:
    """Speed, memory and start-up time over the number of satellites, in one process each and in groups.

    3, 8, 16, 32, 64, 128, 256 and 1000 satellites on a ring and on a random graph of degree 4. A flight that
    fails is a row of the table, too.
    """
    from satform_tools.bench import scaling_page

    with _over_dds():
        found = []
        for row in scaling_page.measure(satellites or scaling_page.COUNTS, steps):
            found.append(row)
            if write:
                # After each: the large ones take long, and the command may be stopped.
                scaling_page.write(found)


@app.command()
def satellite(repetitions: Repetitions = 3, history: History = None, json: Json = False) -> None:
    """CPU time of one satellite's step under each control law, without messages."""
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite
    from satform_tools.run import scenario_library

    bench_output.show(suite.satellite(scenario_library.SCENARIOS, repetitions), history, as_json=json)


@app.command()
def startup(
    satellites: Counts = None, repetitions: Repetitions = 5, history: History = None, json: Json = False
) -> None:
    """Wall-clock time from the command to the first step, of whole commands (3 satellites)."""
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite

    with _over_dds():
        found = suite.start_up(satellites or [3], repetitions)
    bench_output.show(found, history, as_json=json)


@app.command()
def recorder(repetitions: Repetitions = 3, history: History = None, json: Json = False) -> None:
    """CPU time of writing a message to a bag, without its transport."""
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite

    with _over_dds():
        found = suite.recorder(repetitions)
    bench_output.show(found, history, as_json=json)


@app.command()
def inprocess(
    satellites: Counts = None, repetitions: Repetitions = 1, history: History = None, json: Json = False
) -> None:
    """A step of the in-process run, batched over arrays (1 to 10000 satellites)."""
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite

    bench_output.show(
        suite.in_process(satellites or [1, 10, 100, 1000, 10_000], repetitions), history, as_json=json
    )


@app.command()
def compare(
    before: Annotated[Path, typer.Argument(metavar="BEFORE", help="Earlier history file.")],
    after: Annotated[
        Path | None,
        typer.Argument(metavar="AFTER", help="Later history file; the newest of runs/bench when left out."),
    ] = None,
    json: Json = False,
) -> None:
    """List what has got slower beyond the noise, by ratios to their yardsticks; exits with 0 all the same."""
    from satform_tools.bench import output as bench_output

    bench_output.compare(before, after, HISTORY, as_json=json)


@contextmanager
def _over_dds() -> Iterator[None]:
    """Require ROS, and turn a failed flight into an error sentence."""
    from satform_tools.errors import CommandError
    from satform_tools.run import ros_packages

    ros_packages.require()
    try:
        yield
    except RuntimeError as error:
        raise CommandError(str(error)) from None
