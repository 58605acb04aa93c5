# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The commands `satform bench ...`: measure speed, as ratios to a reference measured in the same run."""

# ruff: noqa: PLC0415

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from satform_tools.cli.shared_options import Json

HISTORY = Path("runs/bench")

_ALL = "Measure speed. Without a command: runs all measurements and writes a file for `bench compare`."

app = typer.Typer(help=_ALL)

History = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR", help="Folder to which the results are written as a JSON file for `bench compare`."
    ),
]
Repetitions = Annotated[
    int, typer.Option(min=1, help="Number of repetitions; each alternates with the reference measurement.")
]
Counts = Annotated[
    list[int] | None, typer.Option("--satellites", "-n", min=1, help="Number of satellites. Repeatable.")
]


@app.callback(invoke_without_command=True, help=_ALL)
def measure_all(
    context: typer.Context,
    repetitions: Repetitions = 3,
    history: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder to which the results are written as a JSON file.")
    ] = HISTORY,
    json: Json = False,
) -> None:
    """Run all measurements of this group that take a few minutes."""
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
        found += suite.lockstep([3], 1, 500, repetitions, record=True)
        found += suite.lockstep([3], 1, 500, repetitions, record=False)
        found += suite.lockstep([3], 1, 200, repetitions, record=False, executors=["single"])
        found += suite.lockstep([16], 16, 200, repetitions, record=False)
        found += suite.start_up([3], repetitions)
    bench_output.show(found, history, as_json=json)


@app.command("ping-pong")
def ping_pong(repetitions: Repetitions = 3, history: History = None, json: Json = False) -> None:
    """Measure the round trip of an empty message.

    The round trip is between two processes. It is the reference of all measurements over DDS.
    """
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite

    with _over_dds():
        found = suite.round_trip(repetitions)
    bench_output.show(found, history, as_json=json)


@app.command()
def plant(json: Json = False) -> None:
    """Measure the speed of the inertial propagation.

    Gravity is of degree 10. Measures also brahe's propagator and SciPy's DOP853, for comparison.
    """
    from satform_tools.bench import output as bench_output

    bench_output.plant(as_json=json)


@app.command()
def coast(
    days: Annotated[
        float,
        typer.Option(
            min=0.01, max=365.0, help="Length of the flight, rounded up to whole periods of 1200 s."
        ),
    ] = 30.0,
    repetitions: Repetitions = 3,
    history: History = None,
    json: Json = False,
) -> None:
    """Measure a long flight without commands, beside brahe's RKN1210.

    Two satellites at 500 km with gravity of degree 20, drag, Sun and Moon fly in process, with all their
    flight software. The ratio is the CPU time of the flight, divided by that of brahe's RKN1210 for the same
    two trajectories. Prints also the largest distance at the end from brahe's RKF78 with steps of 30 s.
    RKN1210 is no reference of accuracy here: its method is for forces that do not depend on the velocity, and
    with drag it is 46 m off after one day.
    """
    from satform_tools.bench import coast as measurement
    from satform_tools.bench import output as bench_output
    from satform_tools.errors import CommandError

    try:
        found = [measurement.measure(days, repetitions)]
    except RuntimeError as error:
        raise CommandError(str(error)) from None
    bench_output.show(found, history, as_json=json)
    if not json:
        bench_output.details(found)


@app.command()
def models(
    separation: Annotated[
        float, typer.Option(min=1.0, help="Distance of the satellites from the chief, m.")
    ] = 1000.0,
    json: Json = False,
) -> None:
    """Compute the error of the linear truth models.

    The reference is inertial propagation. Prints a table of docs/models.md.
    """
    from satform_tools.bench import output as bench_output

    bench_output.models(separation, as_json=json)


@app.command()
def lockstep(
    satellites: Counts = None,
    satellites_per_process: Annotated[
        int, typer.Option(min=1, help="Number of satellites in a process.")
    ] = 1,
    arrays: Annotated[
        bool, typer.Option("--arrays", help="Satellites of a process exchange one array a step.")
    ] = False,
    steps: Annotated[int, typer.Option(min=10, help="Number of steps of each flight.")] = 1000,
    record: Annotated[
        bool, typer.Option("--record/--no-record", help="Fly with or without a recorder.")
    ] = True,
    executor: Annotated[
        list[str] | None,
        typer.Option(
            help="own: satform's executor; python: the same without its compiled part; events, single: "
            "those of rclpy. Repeatable: their flights alternate. By default own."
        ),
    ] = None,
    repetitions: Repetitions = 1,
    history: History = None,
    json: Json = False,
) -> None:
    """Measure the time of a lockstep step over DDS, in round trips.

    By default for 3, 8 and 16 satellites on a ring.
    """
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import scaling as lockstep_flights
    from satform_tools.bench import suite
    from satform_tools.errors import CommandError

    if arrays and satellites_per_process == 1:
        raise CommandError("--arrays needs --satellites-per-process N with at least 2, the size of a group")
    executors = executor or [lockstep_flights.OWN]
    for name in executors:
        if name not in lockstep_flights.EXECUTORS:
            raise CommandError(f"--executor {name}: is one of {', '.join(lockstep_flights.EXECUTORS)}")
    with _over_dds():
        found = suite.lockstep(
            satellites or [3, 8, 16],
            satellites_per_process,
            steps,
            repetitions,
            record=record,
            arrays=arrays,
            executors=executors,
        )
    bench_output.show(found, history, as_json=json)


@app.command()
def scaling(
    satellites: Counts = None,
    steps: Annotated[int, typer.Option(min=10, help="Number of steps of each flight.")] = 100,
    write: Annotated[
        bool,
        typer.Option("--write", help="Write the table and the plot to docs/scaling.md of this checkout."),
    ] = False,
) -> None:
    """Measure speed, memory and start-up time.

    By default for 3, 8, 16, 32, 64, 128, 256 and 1000 satellites on a ring and on a random graph of degree 4,
    with a process for each satellite and with shared processes. A flight that fails has a row in the table,
    too.
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
    """Measure the CPU time of a satellite's step.

    Under each control law, without messages.
    """
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite
    from satform_tools.run import scenario_library

    bench_output.show(suite.satellite(scenario_library.SCENARIOS, repetitions), history, as_json=json)


@app.command()
def startup(
    satellites: Counts = None, repetitions: Repetitions = 5, history: History = None, json: Json = False
) -> None:
    """Measure the time until the first step.

    It begins at the start of the command. By default for 3 satellites.
    """
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite

    with _over_dds():
        found = suite.start_up(satellites or [3], repetitions)
    bench_output.show(found, history, as_json=json)


@app.command()
def recorder(repetitions: Repetitions = 3, history: History = None, json: Json = False) -> None:
    """Measure the CPU time of writing a message to a bag."""
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite

    with _over_dds():
        found = suite.recorder(repetitions)
    bench_output.show(found, history, as_json=json)


@app.command()
def inprocess(
    satellites: Counts = None, repetitions: Repetitions = 1, history: History = None, json: Json = False
) -> None:
    """Measure a step of the in-process flight.

    By default for 1 to 10000 satellites.
    """
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite

    bench_output.show(
        suite.in_process(satellites or [1, 10, 100, 1000, 10_000], repetitions), history, as_json=json
    )


@app.command()
def campaign(
    quick: Annotated[bool, typer.Option("--quick", help="Few and short cases, for trying it out.")] = False,
    runs: Annotated[
        int | None, typer.Option(min=10, help="Cases of the triangle; 1000 when left out.")
    ] = None,
    workers: Annotated[int, typer.Option(min=1, max=1024, help="Processes that fly cases.")] = 2,
    repetitions: Repetitions = 1,
    history: History = None,
    json: Json = False,
) -> None:
    """Cases of a campaign beside the same cases one by one, the engine's share of short cases, memory.

    1000 runs of the triangle, 10,000 short cases; a satellite's step beside Basilisk's if it is installed.
    """
    from dataclasses import replace

    from satform_tools.bench import campaign as measurement
    from satform_tools.bench import output as bench_output
    from satform_tools.errors import CommandError

    size = replace(measurement.QUICK if quick else measurement.Size(), workers=workers)
    size = size if runs is None else replace(size, runs=runs)
    try:
        found = measurement.measure(size, repetitions)
    except RuntimeError as error:
        raise CommandError(str(error)) from None
    bench_output.show(found, history, as_json=json)
    if not json:
        bench_output.details(found)


@app.command()
def compare(
    before: Annotated[Path, typer.Argument(metavar="BEFORE", help="Earlier history file.")],
    after: Annotated[
        Path | None,
        typer.Argument(metavar="AFTER", help="Later history file; by default the newest of runs/bench."),
    ] = None,
    json: Json = False,
) -> None:
    """List the measurements that have become slower.

    Compares ratios to the reference. The exit code is 0 also if something has become slower.
    """
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
