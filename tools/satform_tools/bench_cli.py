"""The commands `satform bench ...`: how fast it is, each figure beside its yardstick from the same run."""

# ruff: noqa: PLC0415

from typing import Annotated

import typer

app = typer.Typer(help="Measure speed; figures to compare are of one run.", no_args_is_help=True)

Json = Annotated[bool, typer.Option("--json", help="Print JSON for machines, in SI units.")]


@app.command()
def plant(json: Json = False) -> None:
    """Inertial propagation at gravity of degree 10, beside brahe's own propagator and SciPy's DOP853."""
    from satform_tools import benching

    benching.plant(as_json=json)


@app.command()
def lockstep(
    satellites: Annotated[
        list[int] | None,
        typer.Option("--satellites", "-n", help="Number of satellites on a ring. Repeatable; 3, 8 and 16."),
    ] = None,
    group: Annotated[int, typer.Option(min=1, help="Satellites that share a process.")] = 1,
    steps: Annotated[int, typer.Option(min=10, help="Steps of each flight.")] = 1000,
    record: Annotated[
        bool, typer.Option("--record/--no-record", help="Whether a recorder takes part.")
    ] = True,
    json: Json = False,
) -> None:
    """Steps in a second over DDS against the number of satellites, beside a bare round trip."""
    from satform_tools import benching

    benching.lockstep(satellites or [3, 8, 16], group, steps, record=record, as_json=json)


@app.command()
def inprocess(
    satellites: Annotated[
        list[int] | None,
        typer.Option("--satellites", "-n", help="Number of satellites on a ring. Repeatable; 1 to 10000."),
    ] = None,
    json: Json = False,
) -> None:
    """Steps in a second of the in-process run, whole formations in one step over arrays."""
    from satform_tools import benching

    benching.inprocess(satellites or [1, 10, 100, 1000, 10_000], as_json=json)
