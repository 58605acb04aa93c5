"""The commands `satform plan ...`: what is worked out before a flight by impulses."""

# ruff: noqa: PLC0415

from datetime import datetime
from typing import Annotated

import typer

app = typer.Typer(help="Work out impulses before a flight.", no_args_is_help=True)

Json = Annotated[bool, typer.Option("--json", help="Print JSON for machines, in SI units.")]
Date = Annotated[
    datetime | None,
    typer.Option(formats=["%Y-%m-%dT%H:%M", "%Y-%m-%dT%H:%M:%S"], help="Date and time of the start, UTC."),
]


@app.command()
def approach(
    start: Annotated[str, typer.Option(metavar="X,Y,Z", help="Where it starts at rest, LVLH, m.")],
    point: Annotated[
        list[str],
        typer.Option(
            metavar="X,Y,Z,SECONDS[,pass]",
            help="A way-point, LVLH, m, and the time to it; it stops there, or passes on. Repeatable.",
        ),
    ],
    period: Annotated[float, typer.Option(help="Of the chief's orbit, s.")] = 86164.0905,
    date: Date = None,
    longitude: Annotated[
        float | None, typer.Option(help="Of a geostationary chief, deg E; with --date it gives the light.")
    ] = None,
    json: Json = False,
) -> None:
    """Impulses of a tour from rest to rest: times, delta-v, closest distance, light."""
    from satform_tools.run import impulse_plans

    impulse_plans.approach(start, point, period, date, longitude, as_json=json)


@app.command()
def patrol(
    target: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LONGITUDE,INCLINATION,NODE",
            help="A satellite to be passed, deg, in the order of the passes; by default the three of the "
            "scenario patrol_three. Repeatable.",
        ),
    ] = None,
    longitude: Annotated[float, typer.Option(help="Of the watcher at the start, deg E.")] = 53.5,
    below: Annotated[float, typer.Option(help="Depth of the watcher's orbit below the belt, km.")] = 50.0,
    days: Annotated[float, typer.Option(help="Length of the patrol, days.")] = 7.7,
    budget: Annotated[float, typer.Option(help="Delta-v that is not exceeded, m/s.")] = 0.45,
    keep_out: Annotated[
        float, typer.Option(help="Distance kept to every target from the start to the end, km.")
    ] = 35.0,
    date: Date = None,
    chief: Annotated[
        float, typer.Option(help="Longitude of the geostationary chief in whose LVLH burns are given, deg E.")
    ] = 56.0,
    json: Json = False,
) -> None:
    """Small burns that pass satellites of the geostationary belt near and well lit, beside plain drift."""
    from satform_tools.run import impulse_plans

    impulse_plans.patrol(target, longitude, below, days, budget, keep_out, date, chief, as_json=json)
