# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Arrays of a flight's record from its topics' tables: a row for each step, a column for each satellite."""

import numpy as np

from satform.bag.tables import Table
from satform.communication.topic_table import TopicPlan
from satform.consensus.arc_length import Announces
from satform.numeric.elementwise import Array
from satform.record.navigation_history import NavigationHistory
from satform.record.quantities import ATTITUDE_VECTORS, WHEEL_COUNTERS, without
from satform.scenario.parts import SatelliteSpec


def vectors(tables: list[Table], field: str, rows: int) -> Array:
    """A vector of every satellite's messages, shape (rows, N, 3).

    Args:
        tables: of one kind of message, of each of the N satellites.
        field: name of the vector in it.
        rows: number of messages, from the first one on.
    """
    return _series(tables, tuple(f"{field}.{axis}" for axis in "xyz"), rows)


def _series(tables: list[Table], fields: tuple[str, ...], rows: int) -> Array:
    """Fields of every satellite's messages, shape (rows, N, fields)."""
    columns = [np.stack([table.column(field)[:rows] for field in fields], axis=-1) for table in tables]
    return np.stack(columns, axis=1)


def phases(tables: list[Table], announces: Announces, rows: int) -> dict[str, Array]:
    """Arc lengths and their rates as announced; zero where satellites announce something else.

    Args:
        tables: of the announcements of each satellite.
        announces: what they are of.
        rows: number of steps, with the last state.

    Returns:
        By quantity, m and m/s, shape (rows, N) each.
    """
    if announces != "arc_length":
        return {name: np.zeros((rows, len(tables))) for name in ("arc_length", "rate")}
    return {name: _series(tables, (name,), rows)[..., 0] for name in ("arc_length", "rate")}


def propulsion(tables: list[Table], satellites: list[SatelliteSpec], steps: int) -> dict[str, Array]:
    """What the thrusters counted at each state; at the first one the tanks are as the scenario fills them.

    Args:
        tables: of the propulsion messages of each satellite with a thruster.
        satellites: by the scenario.
        steps: number of steps.

    Returns:
        By quantity, shape (steps + 1, N); not a number for satellites without a thruster.
    """
    found = without("thruster", len(satellites), steps)
    for column, (table, satellite) in enumerate(zip(tables, satellites, strict=True)):
        if satellite.thruster is None:
            continue
        for name, values in found.items():
            values[0, column] = satellite.thruster.propellant if name == "propellant" else 0.0
            values[1:, column] = table.column(name)[:steps]
    return found


def attitudes(
    tables: list[Table], commands: list[Table], satellites: list[SatelliteSpec], steps: int
) -> dict[str, Array]:
    """Measured attitudes and commanded torques of the satellites that have an attitude.

    Args:
        tables: of the attitude messages of each satellite that has one.
        commands: of the commands of each satellite.
        satellites: by the scenario.
        steps: number of steps.

    Returns:
        By quantity, shape (steps + 1, N, ...), of torques (steps, N, 3); not a number for the others.
    """
    turning = [column for column, satellite in enumerate(satellites) if satellite.attitude is not None]
    found = without("attitude", len(satellites), steps if turning else None)
    for column in turning:
        for name in ATTITUDE_VECTORS:
            found[name][:, column] = vectors([tables[column]], name, steps + 1)[:, 0]
        for name in WHEEL_COUNTERS:
            found[name][:, column] = tables[column].column(name)[: steps + 1]
        found["wheel_torque"][:, column] = vectors([commands[column]], "wheel_torque", steps)[:, 0]
    return found


def navigation(
    readings: list[Table], estimates: dict[int, Table], topics: TopicPlan, time: tuple[int, float]
) -> NavigationHistory | None:
    """Readings of sensors, and what satellites estimated of the whole formation; None without sensors.

    Args:
        readings: tables of the measurements of each satellite with sensors.
        estimates: tables of the joint estimates, by index of the satellite.
        topics: of the flight.
        time: number of steps, and length of a step, s.
    """
    steps, step = time
    widths = [own.readings for own in topics.satellites]
    if not any(widths):
        return None
    found = NavigationHistory.empty(steps, len(widths), max(widths))
    for column, (table, width) in enumerate(zip(readings, widths, strict=True)):
        for number in range(width):
            found.readings[:, column, number] = table.column(f"values[{number}]")[: steps + 1]
    for column, table in estimates.items():
        # The estimate of a step goes with the message for the next one; one that rejoins sends an old one.
        made = table.column("header.stamp.sec") + 1e-9 * table.column("header.stamp.nanosec")
        current = np.rint(made[1 : steps + 1] / step) == np.arange(steps)
        for number in range(topics.satellites[column].estimated):
            mean = table.column(f"mean[{number}]")[1 : steps + 1]
            found.mean[:, column, number] = np.where(current, mean, np.nan)
    return found


def unsolved_plans(tables: list[Table], satellites: list[SatelliteSpec], steps: int) -> dict[str, Array]:
    """Plans that were not finished; not a number for satellites without plans and while they are absent.

    Args:
        tables: of the tracking messages of each satellite.
        satellites: by the scenario.
        steps: number of steps.

    Returns:
        By quantity, shape (steps, N); no array where no satellite makes plans.
    """
    planning = [
        column
        for column, satellite in enumerate(satellites)
        if satellite.controller is not None and satellite.controller.makes_plans
    ]
    found = without("plans", len(satellites), steps if planning else None)
    for column in planning:
        absent = np.isnan(vectors([tables[column]], "sliding_variable", steps)[:, 0, 0])
        unsolved = tables[column].column("unsolved_plans")[:steps]
        found["unsolved_plans"][:, column] = np.where(absent, np.nan, unsolved)
    return found


def attitude_estimates(tables: list[Table], satellites: list[SatelliteSpec], steps: int) -> dict[str, Array]:
    """Estimated attitudes; not a number for satellites without a filter of it and while they are absent.

    Args:
        tables: of the attitude estimates of each satellite that has a filter of it.
        satellites: by the scenario.
        steps: number of steps.

    Returns:
        By quantity, shape (steps, N, ...); no array where no satellite has such a filter.
    """
    estimating = [column for column, satellite in enumerate(satellites) if satellite.estimates_attitude]
    found = without("attitude_filter", len(satellites), steps if estimating else None)
    for column in estimating:
        table = tables[column]
        for name, vector in (
            ("estimated_mrp", "mrp"),
            ("estimated_angular_velocity", "angular_velocity"),
            ("estimated_gyro_bias", "gyro_bias"),
        ):
            found[name][:, column] = vectors([table], vector, steps)[:, 0]
        covariance, innovation, rejected = _consistency(table, steps)
        found["attitude_covariance"][:, column] = covariance
        found["attitude_innovation"][:, column] = innovation
        found["rejected_attitudes"][:, column] = rejected
    return found


def motion_estimates(tables: list[Table], satellites: list[SatelliteSpec], steps: int) -> dict[str, Array]:
    """What filters of motion estimated; not a number for satellites without one and while they are absent.

    Args:
        tables: of the estimates of each satellite that has such a filter.
        satellites: by the scenario.
        steps: number of steps.

    Returns:
        By quantity, shape (steps, N, ...); no array where no satellite has such a filter.
    """
    filtering = [column for column, satellite in enumerate(satellites) if satellite.estimates_motion]
    found = without("filter", len(satellites), steps if filtering else None)
    for column in filtering:
        covariance, innovation, rejected = _consistency(tables[column], steps)
        found["estimate_covariance"][:, column] = covariance
        found["innovation"][:, column] = innovation
        found["rejected_measurements"][:, column] = rejected
    return found


def _consistency(table: Table, steps: int) -> tuple[Array, Array, Array]:
    """What a filter says of its own errors: covariance, normalised innovation squared, rejected measurements.

    Shapes (steps, 6, 6), (steps,) and (steps,); not a number while the satellite is absent.
    """
    elements = [table.column(f"covariance[{index}]")[:steps] for index in range(36)]
    covariance = np.stack(elements, axis=-1).reshape(-1, 6, 6)
    rejected = np.where(np.isnan(covariance[:, 0, 0]), np.nan, table.column("rejected")[:steps])
    return covariance, table.column("innovation")[:steps], rejected
