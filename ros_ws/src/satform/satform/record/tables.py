# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A flight's arrays as tables: columns with units, an xarray dataset, a pandas frame."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from satform.numeric.elementwise import Array
from satform.orbits.inertial_motion import RELATIVE_ELEMENTS
from satform.record.quantities import ORBITAL, QUANTITIES

_STATE = ("x", "y", "z", "vx", "vy", "vz")
"""Components of an estimated motion, by which those of its covariance are named."""

_COVARIANCE = re.compile(r"estimate_covariance_(v?[xyz])_(v?[xyz])")
"""A column with an element of a covariance."""

_KNOWN = {**QUANTITIES, **ORBITAL}

_COMPONENTS = {3: tuple("xyz"), 6: RELATIVE_ELEMENTS}
"""Names of a vector's components by their number."""


def known(quantities: Mapping[str, Array]) -> dict[str, Array]:
    """The quantities of which a flight has a number.

    Args:
        quantities: by name, shape (K or K + 1, N, ...) or without rows.
    """
    return {
        name: values for name, values in quantities.items() if len(values) and not np.all(np.isnan(values))
    }


def at_states(values: Array, states: int) -> Array:
    """A quantity with a row for each state; NaN after the last step, in which nothing is decided.

    Args:
        values: shape (K, N, ...) or (K + 1, N, ...).
        states: K + 1.
    """
    missing = np.full((states - len(values), *values.shape[1:]), np.nan)
    return np.concatenate((values, missing))


def columns(satellites: Sequence[str], time: Array, quantities: Mapping[str, Array]) -> dict[str, Array]:
    """All quantities as columns of one table, with a row for each step and satellite, satellites in turn.

    Quantities that are decided in a step are not numbers in the rows of the last state, after which nothing
    is decided; quantities that the flight does not have are left out.

    Args:
        satellites: N names.
        time: of every state, s, shape (K + 1,).
        quantities: of the flight by name, shape (K or K + 1, N, ...).

    Returns:
        Columns of (K + 1) N numbers by their names; vectors have one for each axis.
    """
    found: dict[str, Array] = {"time": np.repeat(time, len(satellites))}
    for name, values in known(quantities).items():
        whole = at_states(values, len(time))
        if whole.ndim == 2:
            found[name] = whole.ravel()
        elif whole.ndim == 4:
            found.update(
                {
                    f"{name}_{row}_{column}": whole[..., i, j].ravel()
                    for i, row in enumerate(_STATE)
                    for j, column in enumerate(_STATE)
                    if j >= i
                }
            )
        else:
            components = enumerate(_COMPONENTS[whole.shape[-1]])
            found.update({f"{name}_{part}": whole[..., column].ravel() for column, part in components})
    return found


def unit_of(column: str) -> str:
    """The unit of a column."""
    if column == "time":
        return "s"
    covariance = _COVARIANCE.fullmatch(column)
    if covariance:
        rates = sum(part.startswith("v") for part in covariance.groups())
        return ("m²", "m²/s", "m²/s²")[rates]
    return _KNOWN[column if column in _KNOWN else column.rpartition("_")[0]].unit


def dataset(satellites: Sequence[str], time: Array, quantities: Mapping[str, Array]) -> Any:
    """A flight as an xarray dataset.

    Args:
        satellites: N names.
        time: of every state, s, shape (K + 1,).
        quantities: of the flight by name, shape (K or K + 1, N, ...).

    Returns:
        `xarray.Dataset` with a variable for each quantity, its unit in `attrs["units"]`, over the dimensions
        `time`, `satellite` and, for vectors, `axis`; a covariance is over `component` and `other_component`,
        relative elements over `element`.
        Quantities decided in a step are NaN at the last time.

    Raises:
        ImportError: xarray is not installed.
    """
    try:
        import xarray  # noqa: PLC0415 - an optional dependency
    except ImportError:
        raise ImportError("to_xarray needs xarray: pip install 'satform[xarray]'") from None
    inner = {(): (), (3,): ("axis",), (6,): ("element",), (6, 6): ("component", "other_component")}
    variables = {
        name: (
            ("time", "satellite", *inner[values.shape[2:]]),
            at_states(values, len(time)),
            {"units": _KNOWN[name].unit},
        )
        for name, values in known(quantities).items()
    }
    names = {
        "axis": list("xyz"),
        "element": list(RELATIVE_ELEMENTS),
        "component": list(_STATE),
        "other_component": list(_STATE),
    }
    used = {dimension for dimensions, _, _ in variables.values() for dimension in dimensions}
    coordinates = {
        "time": ("time", time, {"units": "s"}),
        "satellite": list(satellites),
        **{name: labels for name, labels in names.items() if name in used},
    }
    return xarray.Dataset(variables, coordinates)


def frame(satellites: Sequence[str], time: Array, quantities: Mapping[str, Array]) -> Any:
    """A flight as a pandas frame.

    Args:
        satellites: N names.
        time: of every state, s, shape (K + 1,).
        quantities: of the flight by name, shape (K or K + 1, N, ...).

    Returns:
        `pandas.DataFrame` with a row for each time and satellite (the index) and the columns of `columns`;
        units by column in `attrs["units"]`.

    Raises:
        ImportError: pandas is not installed.
    """
    try:
        import pandas  # noqa: PLC0415 - an optional dependency
    except ImportError:
        raise ImportError("to_pandas needs pandas: pip install 'satform[pandas]'") from None
    table = columns(satellites, time, quantities)
    del table["time"]
    index = pandas.MultiIndex.from_product([time, list(satellites)], names=["time", "satellite"])
    made = pandas.DataFrame(table, index=index)
    made.attrs["units"] = {name: unit_of(name) for name in table}
    return made
