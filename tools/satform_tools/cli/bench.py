"""The commands `satform bench ...`: how fast it is, each figure beside its yardstick from the same run."""

# ruff: noqa: PLC0415

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

HISTORY = Path("runs/bench")

app = typer.Typer(help="Measure speed. Without a command: everything, kept for `bench compare`.")

Json = Annotated[bool, typer.Option("--json", help="Print JSON for machines, in SI units.")]
Keep = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Keep the figures there as a JSON file for `bench compare`."),
]
Times = Annotated[int, typer.Option(min=1, help="Repetitions, in turns with the yardstick.")]
Counts = Annotated[
    list[int] | None, typer.Option("--satellites", "-n", min=1, help="Number of satellites. Repeatable.")
]


@app.callback(invoke_without_command=True)
def everything(
    context: typer.Context,
    times: Times = 3,
    keep: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder of the history, of which this becomes a file.")
    ] = HISTORY,
    json: Json = False,
) -> None:
    """Measure speed. Without a command: everything, kept for `bench compare`."""
    if context.invoked_subcommand is not None:
        return
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite
    from satform_tools.run import scenario_library

    with _flying():
        found = suite.round_trip(times)
        found += suite.satellite(scenario_library.SCENARIOS, times)
        found += suite.in_process([1, 100], times)
        found += suite.recorder(times)
        found += suite.lockstep([3], 1, 500, times, record=True, stock=False)
        found += suite.lockstep([3], 1, 500, times, record=False, stock=False)
        found += suite.lockstep([3], 1, 200, times, record=False, stock=True)
        found += suite.lockstep([16], 16, 200, times, record=False, stock=False)
        found += suite.start_up([3], times)
    bench_output.show(found, keep, as_json=json)


@app.command("ping-pong")
def ping_pong(times: Times = 3, keep: Keep = None, json: Json = False) -> None:
    """A bare message there and back between two processes: the yardstick of all that goes over DDS."""
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite

    with _flying():
        found = suite.round_trip(times)
    bench_output.show(found, keep, as_json=json)


@app.command()
def plant(json: Json = False) -> None:
    """Inertial propagation at gravity of degree 10, beside brahe's own propagator and SciPy's DOP853."""
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
    group: Annotated[int, typer.Option(min=1, help="Satellites that share a process.")] = 1,
    steps: Annotated[int, typer.Option(min=10, help="Steps of each flight.")] = 1000,
    record: Annotated[
        bool, typer.Option("--record/--no-record", help="Whether a recorder takes part.")
    ] = True,
    executor: Annotated[
        str,
        typer.Option(help="own: the nodes'; stock: rclpy's SingleThreadedExecutor; both: one after another."),
    ] = "own",
    times: Times = 1,
    keep: Keep = None,
    json: Json = False,
) -> None:
    """A step over DDS of satellites on a ring (3, 8 and 16), beside a bare round trip."""
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite
    from satform_tools.errors import CommandError

    if executor not in ("own", "stock", "both"):
        raise CommandError(f"--executor {executor}: is one of own, stock, both")
    with _flying():
        found = []
        for stock in {"own": (False,), "stock": (True,), "both": (False, True)}[executor]:
            found += suite.lockstep(satellites or [3, 8, 16], group, steps, times, record=record, stock=stock)
    bench_output.show(found, keep, as_json=json)


@app.command()
def scaling(
    satellites: Counts = None,
    steps: Annotated[int, typer.Option(min=10, help="Steps of each flight.")] = 100,
    write: Annotated[
        bool, typer.Option("--write", help="Put table and figure into docs/scaling.md of this checkout.")
    ] = False,
) -> None:
    """How speed, memory and start grow with the number of satellites, as processes and as groups.

    3, 8, 16, 32, 64, 128, 256 and 1000 satellites on a ring and on a random graph of degree 4. What does not
    fly is a line of the table too.
    """
    from satform_tools.bench import scaling_page

    with _flying():
        found = []
        for row in scaling_page.measure(satellites or scaling_page.COUNTS, steps):
            found.append(row)
            if write:
                # After each: the large ones take long, and someone may lose patience.
                scaling_page.write(found)


@app.command()
def satellite(times: Times = 3, keep: Keep = None, json: Json = False) -> None:
    """One satellite's own step under each control law: processor time without any message."""
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite
    from satform_tools.run import scenario_library

    bench_output.show(suite.satellite(scenario_library.SCENARIOS, times), keep, as_json=json)


@app.command()
def startup(satellites: Counts = None, times: Times = 5, keep: Keep = None, json: Json = False) -> None:
    """From the command to the first step, of whole commands as a user types them (3 satellites)."""
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite

    with _flying():
        found = suite.start_up(satellites or [3], times)
    bench_output.show(found, keep, as_json=json)


@app.command()
def recorder(times: Times = 3, keep: Keep = None, json: Json = False) -> None:
    """A message written into a bag: processor time without the message's way there."""
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite

    with _flying():
        found = suite.recorder(times)
    bench_output.show(found, keep, as_json=json)


@app.command()
def inprocess(satellites: Counts = None, times: Times = 1, keep: Keep = None, json: Json = False) -> None:
    """A step of the in-process run, whole formations at once over arrays (1 to 10000 satellites)."""
    from satform_tools.bench import output as bench_output
    from satform_tools.bench import suite

    bench_output.show(suite.in_process(satellites or [1, 10, 100, 1000, 10_000], times), keep, as_json=json)


@app.command()
def compare(
    before: Annotated[Path, typer.Argument(metavar="BEFORE", help="Earlier history file.")],
    after: Annotated[
        Path | None,
        typer.Argument(metavar="AFTER", help="Later one; the newest of runs/bench when left out."),
    ] = None,
    json: Json = False,
) -> None:
    """Name what has got slower beyond the noise, by ratios to yardsticks; never fails because of it."""
    from satform_tools.bench import output as bench_output

    bench_output.compare(before, after, HISTORY, as_json=json)


@contextmanager
def _flying() -> Iterator[None]:
    """For what flies over DDS: it is there, and a flight that fails is a sentence."""
    from satform_tools.errors import CommandError
    from satform_tools.run import ros

    ros.require()
    try:
        yield
    except RuntimeError as error:
        raise CommandError(str(error)) from None
