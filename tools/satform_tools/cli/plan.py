# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The commands `satform plan ...`: compute impulses and links before a flight."""

# ruff: noqa: PLC0415

from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from satform_tools.cli.shared_options import Changes, Json, ScenarioArgument

app = typer.Typer(help="Compute impulses and links before a flight.", no_args_is_help=True)

Date = Annotated[
    datetime | None,
    typer.Option(formats=["%Y-%m-%dT%H:%M", "%Y-%m-%dT%H:%M:%S"], help="Date and time of the start, UTC."),
]


class Model(StrEnum):
    """Models of relative motion, by the names of `satform.dynamics.relative_motion_models`."""

    CW = "cw"
    YAMANAKA_ANKERSEN = "yamanaka_ankersen"
    J2_ELEMENTS = "j2_elements"


@app.command()
def approach(
    start: Annotated[
        str,
        typer.Option(
            metavar="X,Y,Z[,VX,VY,VZ]",
            help="Position in LVLH at the start, m, and velocity, m/s; at rest without a velocity.",
        ),
    ],
    point: Annotated[
        list[str],
        typer.Option(
            metavar="X,Y,Z,SECONDS[,pass]",
            help="Way-point in LVLH, m, and the time to reach it, s. The satellite stops there unless `pass` "
            "is given. Repeatable.",
        ),
    ],
    period: Annotated[float, typer.Option(help="Period of the chief's orbit, s.")] = 86164.0905,
    acceleration: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z", help="Known constant acceleration that acts besides the burns, LVLH, m/s^2."
        ),
    ] = None,
    step: Annotated[
        float | None,
        typer.Option(help="Control step over which each burn is held, s; impulses without it."),
    ] = None,
    date: Date = None,
    longitude: Annotated[
        float | None,
        typer.Option(help="Longitude of a geostationary chief, deg E; for the Sun angle."),
    ] = None,
    model: Annotated[
        Model,
        typer.Option(
            help="Model of the relative motion: cw; yamanaka_ankersen, for an eccentric chief; or "
            "j2_elements, which also knows the Earth's oblateness."
        ),
    ] = Model.CW,
    eccentricity: Annotated[float, typer.Option(help="Eccentricity of the chief's orbit.")] = 0.0,
    true_anomaly: Annotated[float, typer.Option(help="True anomaly of the chief at the start, deg.")] = 0.0,
    inclination: Annotated[
        float, typer.Option(help="Inclination of the chief's orbit, deg; for j2_elements.")
    ] = 0.0,
    perigee: Annotated[
        float, typer.Option(help="Argument of perigee of the chief's orbit, deg; for j2_elements.")
    ] = 0.0,
    json: Json = False,
) -> None:
    """Compute the impulses of an approach through way-points.

    The satellite starts in any motion and is at rest at the end. Prints times, delta-v, the closest distance
    to the chief, and with --date and --longitude the Sun angle.
    """
    from satform_tools.plan import impulses

    orbit = (eccentricity, true_anomaly, inclination, perigee)
    task = impulses.ApproachTask(
        start, point, period, acceleration, step, date, longitude, model.value, orbit
    )
    impulses.approach(task, as_json=json)


@app.command()
def elements(
    start: Annotated[
        str,
        typer.Option(
            metavar="DA,DLAMBDA,DEX,DEY,DIX,DIY",
            help="Relative orbital elements at the start, times the chief's semi-major axis, m.",
        ),
    ],
    wanted: Annotated[
        str, typer.Option(metavar="DA,DLAMBDA,DEX,DEY,DIX,DIY", help="The same at the end, m.")
    ],
    argument: Annotated[
        float, typer.Option(help="Mean argument of latitude of the chief at the start, deg.")
    ] = 0.0,
    orbits: Annotated[float, typer.Option(help="Time of the change, 2 to 50 orbits.")] = 3.0,
    period: Annotated[float, typer.Option(help="Period of the chief's orbit, s.")] = 6000.0,
    json: Json = False,
) -> None:
    """Compute the impulses between two sets of relative orbital elements about a near-circular orbit.

    Three impulses along the track and one along the normal. Prints times, delta-v, its lower bound, and the
    elements that are reached.
    """
    from satform_tools.plan import elements as element_plans

    task = element_plans.ElementsTask(start, wanted, argument, orbits, period)
    element_plans.elements(task, as_json=json)


@app.command()
def hohmann(
    start: Annotated[float, typer.Option(help="Radius of the circular orbit at the start, m.")],
    end: Annotated[float, typer.Option(help="Radius of the circular orbit at the end, m.")],
    altitudes: Annotated[
        bool, typer.Option("--altitudes", help="--start and --end are altitudes above the equator.")
    ] = False,
    json: Json = False,
) -> None:
    """Compute the two burns of a Hohmann transfer between coplanar circular orbits.

    Prints burns, duration, transfer ellipse, and the angle by which a target on the end orbit has to lead.
    """
    from satform_tools.plan import orbits as orbit_plans

    orbit_plans.hohmann(start, end, altitudes=altitudes, as_json=json)


@app.command()
def drift(
    offset: Annotated[
        float | None,
        typer.Option(help="Semi-major axis of the drifting orbit less that of the other orbit, m."),
    ] = None,
    rate: Annotated[
        float | None, typer.Option(help="Drift rate, positive eastward, deg/day; finds the offset.")
    ] = None,
    radius: Annotated[
        float, typer.Option(help="Radius of the other orbit, m; by default geostationary.")
    ] = 42164169.6,
    angle: Annotated[
        float | None, typer.Option(help="Angle to drift, deg; prints the time that it takes.")
    ] = None,
    json: Json = False,
) -> None:
    """Compute the drift rate of a circular orbit relative to another one, or the offset for a rate.

    Give either --offset or --rate.
    """
    from satform_tools.plan import orbits as orbit_plans

    orbit_plans.drift(offset, rate, radius, angle, as_json=json)


@app.command()
def passing(
    inclination: Annotated[float, typer.Option(help="Angle between the two orbit planes, deg.")],
    distance: Annotated[float | None, typer.Option(help="Closest distance at the node, m.")] = None,
    rate: Annotated[
        float | None, typer.Option(help="Angular rate of the pass, deg/s; finds the distance.")
    ] = None,
    radius: Annotated[
        float, typer.Option(help="Radius of both circular orbits, m; by default geostationary.")
    ] = 42164169.6,
    json: Json = False,
) -> None:
    """Compute the angular rate at which a satellite passes another one at the node of their orbits.

    Give either --distance or --rate.
    """
    from satform_tools.plan import orbits as orbit_plans

    orbit_plans.passing(inclination, distance, rate, radius, as_json=json)


@app.command()
def patrol(
    target: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LONGITUDE,INCLINATION,NODE",
            help="A satellite to pass: longitude, inclination, node, deg. Give them in the order of the "
            "passes; by default the three of the scenario "
            "patrol_three. Repeatable.",
        ),
    ] = None,
    longitude: Annotated[
        float, typer.Option(help="Longitude of the patrolling satellite at the start, deg E.")
    ] = 53.5,
    below: Annotated[
        float, typer.Option(help="Distance of its orbit below the geostationary radius at the start, km.")
    ] = 50.0,
    days: Annotated[float, typer.Option(help="Duration of the patrol, days.")] = 7.7,
    budget: Annotated[float, typer.Option(help="Largest delta-v, m/s.")] = 0.45,
    keep_out: Annotated[
        float, typer.Option(help="Smallest distance to every target at all times, km.")
    ] = 35.0,
    date: Date = None,
    chief: Annotated[
        float,
        typer.Option(help="Longitude of the geostationary chief of the LVLH frame, deg E."),
    ] = 56.0,
    json: Json = False,
) -> None:
    """Compute the burns of a patrol along the geostationary belt.

    The burns lead to near passes of the targets with the Sun behind the observer. Prints also the passes of a
    drift without burns.
    """
    from satform_tools.plan import impulses

    impulses.patrol(target, longitude, below, days, budget, keep_out, date, chief, as_json=json)


@app.command()
def match(
    load: Annotated[
        str, typer.Option(metavar="IMPEDANCE", help="Impedance of the antenna, such as 25-40j, ohm.")
    ],
    z0: Annotated[float, typer.Option(help="Characteristic impedance of the line, ohm.")] = 50.0,
    length: Annotated[float, typer.Option(help="Length of the line, m.")] = 0.0,
    frequency: Annotated[float, typer.Option(help="Frequency, Hz.")] = 2.2e9,
    velocity_factor: Annotated[
        float, typer.Option(help="Speed of a wave on the line, divided by that of light in vacuum.")
    ] = 1.0,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the Smith chart; by default a new one in ./runs.")
    ] = None,
    json: Json = False,
) -> None:
    """Compute how an antenna at the end of a lossless line is matched, and draw its Smith chart.

    Prints reflection coefficient, standing-wave ratio, input impedance, return and mismatch loss, and both
    shunt stubs that match the antenna. Writes the chart as a picture and as a page for the browser, on which
    the load can be moved.
    """
    from satform_tools.links import matching

    task = matching.MatchTask(load, z0, length, frequency, velocity_factor, out)
    matching.match(task, as_json=json)


@app.command()
def link(
    scenario: ScenarioArgument,
    csv: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Also write the budget of each link over time.")
    ] = None,
    every: Annotated[
        float | None, typer.Option(help="Time between two rows of the file, s; by default one step.")
    ] = None,
    changes: Changes = None,
    json: Json = False,
) -> None:
    """Compute the budget of each radio and optical link of a scenario over the time of its flight.

    Flies the scenario in this process. Prints the margin of each link at some times, its worst and best
    margin, the part of the time in which it is blocked or below the required bit error rate, and the part of
    its messages that is delivered.
    """
    from satform_tools.links import budget_table
    from satform_tools.run import scenario_library

    budget_table.link(scenario_library.load(scenario, changes or ()), every, csv, as_json=json)
