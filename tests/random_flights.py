# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flights and expectations at random, and figures made of blocks of flights side by side."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from flight_arrays import Flight
from satform.common.spec import specs
from satform.record.flight_block import FlightBlock
from satform.record.quantities import QUANTITIES
from satform.record.reducer import FlightShape, Reducer
from satform.scenario.expectation import Expectation

COMPONENTS = {
    **dict.fromkeys(
        (
            "arc_length",
            "rate",
            "propellant",
            "delta_v",
            "innovation",
            "rejected_measurements",
            "unsolved_plans",
        ),
        (),
    ),
    **dict.fromkeys(("saturated_steps", "below_minimum_impulse_steps", "propellant_depleted_steps"), ()),
    **dict.fromkeys(("torque_saturated_steps", "momentum_saturated_steps"), ()),
    **dict.fromkeys(("pointing_error", "panel_to_sun", "attitude_error", "attitude_rate_error"), ()),
    **dict.fromkeys(("attitude_innovation", "rejected_attitudes"), ()),
    "estimate_covariance": (6, 6),
    "attitude_covariance": (6, 6),
}
"""Shape of what a satellite has of a quantity at a time; (3,) where nothing is said."""

OF_ATTITUDE = {
    *("mrp", "angular_velocity", "wheel_momentum", "wheel_torque", "torque_saturated_steps"),
    *("momentum_saturated_steps", "pointing_error", "panel_to_sun", "attitude_error", "attitude_rate_error"),
    *("estimated_mrp", "estimated_angular_velocity", "estimated_gyro_bias", "attitude_covariance"),
    *("attitude_innovation", "rejected_attitudes"),
}
LOST = ("arc_length", "rate", "sliding_variable", "pointing_error", "estimated_position_error")
"""What a satellite that does not fly does not give, besides its reference."""

SOME_LACK = ("propellant", "delta_v", "sliding_variable", "pointing_error")
"""What a satellite may lack throughout."""

SOMETIMES_MISSING = ("position", "arc_length", "rate", "wheel_torque", "reference_position")
"""Of what a number may be missing without a reason."""


PAIRS = ("collision_probability", "passive_safety", "radial_normal_distance")
"""Kinds whose figure is made of pairs of satellites."""


def flights(rng: np.random.Generator, runs: int, fewest: int = 2) -> list[Flight]:
    """Flights of the same names and steps, in which satellites may be lost and numbers may be missing."""
    steps, names = int(rng.integers(1, 25)), ("a", "b", "c", "d")[: int(rng.integers(fewest, 5))]
    turning, step = rng.random() < 0.8, float(rng.choice([0.1, 0.5, 2.0]))
    flown = [one_flight(rng, steps, names, step, turning=turning) for _ in range(runs)]
    return [replace(own, mean_motion=0.3 + 0.1 * run) for run, own in enumerate(flown)]


def fewest_satellites(kind: str) -> int:
    """With fewer a figure of this kind is not asked for."""
    return 4 if kind.startswith("tetrahedron") else 2


def one_flight(
    rng: np.random.Generator, steps: int, names: tuple[str, ...], step: float, *, turning: bool
) -> Flight:
    count, arrays = len(names), {}
    whole = rng.random() < 0.4
    for name in QUANTITIES:
        rows = 0 if name in OF_ATTITUDE and not turning else steps + QUANTITIES[name].of_states
        shape = (rows, count, *COMPONENTS.get(name, (3,)))
        # Whole numbers are often equal to each other and to a level.
        arrays[name] = rng.integers(-3, 4, shape).astype(float) if whole else 3.0 * rng.standard_normal(shape)
    for name in ("estimate_covariance", "attitude_covariance"):
        any_matrix = arrays[name]
        arrays[name] = any_matrix @ np.swapaxes(any_matrix, -1, -2) + np.eye(6)
    for name in ("pointing_error", "panel_to_sun", "attitude_error", "attitude_rate_error"):
        arrays[name] = np.abs(arrays[name])
    for n in range(count):
        if rng.random() < 0.3:
            begin, end = sorted(rng.integers(0, steps + 2, 2).tolist())
            lose(arrays, n, begin, end, steps)
        if rng.random() < 0.2:
            arrays[str(rng.choice(SOME_LACK))][:, n] = np.nan
    if rng.random() < 0.15:
        values = arrays[str(rng.choice(SOMETIMES_MISSING))]
        if values.size:
            values[tuple(int(rng.integers(0, size)) for size in values.shape)] = np.nan
    return Flight(names, step, arrays)


def lose(arrays: dict[str, np.ndarray], satellite: int, begin: int, end: int, steps: int) -> None:
    arrays["reference_position"][begin:end, satellite] = np.nan
    arrays["reference_velocity"][begin:end, satellite] = np.nan
    arrays["acceleration"][begin:end, satellite] = 0.0
    for name in LOST:
        until = end + 1 if end >= steps else end
        arrays[name][begin:until, satellite] = np.nan


def expectation_of(kind: str, rng: np.random.Generator, flight: Flight) -> Expectation:
    """An expectation of a kind with fields at random; what is allowed does not matter."""
    spec = specs("satform.metrics")[kind]
    end = flight.steps * flight.step
    fields = {
        "satellites": lambda: satellites(kind, rng, flight.names),
        "satellite": lambda: str(rng.choice(flight.names)),
        "after": lambda: float(rng.choice([0.0, 0.3 * end, rng.integers(0, flight.steps + 1) * flight.step])),
        "before": lambda: rng.choice(
            [None, 0.7 * end + 0.01, rng.integers(1, flight.steps + 2) * flight.step]
        ),
        "at": lambda: rng.choice([None, 0.4 * end, rng.integers(0, flight.steps + 2) * flight.step]),
        "axis": lambda: str(rng.choice(["x", "y", "z"])),
        "level": lambda: float(rng.choice([1.0, 3.0, 6.0])),
        "within": lambda: float(rng.choice([4.0, 9.0])),
        "fraction": lambda: float(rng.choice([0.5, 0.9])),
        "nominal_rate": lambda: 0.7,
        "epoch": lambda: "2020-06-01T12:00:00Z",
        "chief_longitude": lambda: 0.4,
        "quantity": lambda: str(rng.choice(quantities(kind))),
        "statistic": lambda: str(rng.choice(statistics(kind))),
        "limit": lambda: str(rng.choice(["torque", "momentum"])),
        "combined_radius": lambda: 2.0,
        "standard_deviation": lambda: [None, (1.0, 2.0, 3.0)][rng.integers(2)],
        "orbits": lambda: float(rng.choice([0.02, 0.05])),
        "every": lambda: int(rng.integers(1, 4)),
        "quality": lambda: str(rng.choice(["glassmeier", "robert_roux", "volume"])),
    }
    data = {name: fields[name]() for name in spec.model_fields if name in fields}
    if kind == "response_time":
        data["event"] = str(rng.choice(["crossing", "peak", "settled"]))
        data["band"] = 0.5 if data["event"] == "settled" else None
    return spec.model_validate({"kind": kind, "below": 0.0, "source": "none", **data})


def satellites(kind: str, rng: np.random.Generator, names: tuple[str, ...]) -> tuple[str, ...] | None:
    if kind == "distance" or kind.startswith("pass"):
        return tuple(rng.permutation(names)[:2].tolist())
    if rng.random() < 0.4:
        return None
    if kind.startswith("tetrahedron"):
        return tuple(rng.permutation(names)[:4].tolist())
    fewest = 2 if kind in PAIRS else 1
    return tuple(rng.permutation(names)[: int(rng.integers(fewest, len(names) + 1))].tolist())


def quantities(kind: str) -> list[str]:
    return ["pointing_error", "panel_to_sun"] if kind == "attitude_settling" else ["x", "y", "z", "range"]


def statistics(kind: str) -> list[str]:
    return {
        "control": ["mean", "minimum", "maximum"],
        "tetrahedron_quality": ["mean", "minimum", "maximum"],
        "navigation_error": ["maximum", "rms"],
        "estimation_error": ["maximum", "rms"],
        "nees": ["mean", "maximum"],
        "attitude_estimation_error": ["maximum", "rms"],
        "attitude_nees": ["mean", "maximum"],
        "nis": ["mean", "maximum"],
    }.get(kind, ["minimum", "maximum"])


def blocks(flown: list[Flight], cuts: list[int], needs: frozenset[str]) -> Iterator[FlightBlock]:
    """Flights side by side, cut before some steps, with only what is needed."""
    steps = flown[0].steps
    for begin, end in zip([0, *cuts], [*cuts, steps], strict=True):
        last = end == steps
        held = {
            name: np.stack(
                [own.arrays[name][begin : end + (last and QUANTITIES[name].of_states)] for own in flown],
                axis=1,
            )
            for name in needs
        }
        yield FlightBlock(flown[0].names, flown[0].step, begin, end - begin, len(flown), last, held)


def shape(*flown: Flight) -> FlightShape:
    """Of flights side by side."""
    first = flown[0]
    return FlightShape(first.names, first.step, first.steps, tuple(own.setting for own in flown))


def reduced(reducer: Reducer | None, flown: list[Flight], cuts: list[int]) -> np.ndarray:
    assert reducer is not None
    for block in blocks(flown, cuts, reducer.needs):
        reducer.update(block)
    return reducer.figures()


def bits(figures: Any) -> list[int]:
    """The bits of numbers, those of what is not a number all alike."""
    values = np.atleast_1d(np.asarray(figures, dtype=np.float64))
    return np.where(np.isnan(values), np.nan, values).view(np.int64).tolist()
