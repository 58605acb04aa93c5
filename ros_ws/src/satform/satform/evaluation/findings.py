# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a flight shows besides its expectations: saturation most of the time, inconsistent filters."""

import numpy as np

from satform.numeric.elementwise import Array
from satform.record.flight_record import FlightRecord

MOST = 0.5
"""Share of the steps from which on a limit counts as met most of the time."""

CONSISTENT = 6.0
"""Mean of the normalised squared errors of a consistent filter: the number of its states."""

INCONSISTENT = 2.0
"""Times by which such a mean may be above that before it is a finding."""

_SETTLING = 0.2
"""Share of a flight in which a filter may settle."""

_LIMITS = (
    ("saturated_steps", "commands saturated at the thrust limit in"),
    ("propellant_depleted_steps", "tank empty, commands not applied in"),
    ("torque_saturated_steps", "wheels at their torque limit in"),
    ("momentum_saturated_steps", "wheels at their momentum limit in"),
)


def findings(record: FlightRecord) -> tuple[str, ...]:
    """Sentences about a flight that a user should know of although nothing was expected of it.

    Args:
        record: of the flight.

    Returns:
        One sentence for each satellite and finding.
    """
    found: list[str] = []
    for column, name in enumerate(record.satellites):
        found += [f"{name}: {sentence}" for sentence in _of_limits(record, column)]
        found += [f"{name}: {sentence}" for sentence in _of_filter(record, column)]
    return tuple(found)


def mean_after_settling(series: Array, column: int) -> float:
    """Mean of a satellite's series without the flight's first fifth, nor steps without a number.

    Args:
        series: shape (K, N), or without rows.
        column: index of the satellite.

    Returns:
        NaN where there is nothing.
    """
    values = series[int(_SETTLING * len(series)) :, column] if len(series) else np.empty(0)
    numbers = values[~np.isnan(values)]
    return float(numbers.mean()) if numbers.size else float("nan")


def _of_limits(record: FlightRecord, column: int) -> list[str]:
    flown = record.steps - int(np.count_nonzero(record.absent[:, column]))
    found = []
    for quantity, words in _LIMITS:
        series = getattr(record, quantity)
        if not len(series) or not flown:
            continue
        count = float(series[-1, column])
        if count > MOST * flown:
            found.append(f"{words} {count:.0f} of {flown} steps")
    return found


def _of_filter(record: FlightRecord, column: int) -> list[str]:
    squared = mean_after_settling(record.estimation_error_squared, column)
    innovation = mean_after_settling(record.innovation, column)
    if np.isnan(squared) or max(squared, innovation) <= INCONSISTENT * CONSISTENT:
        return []
    rejected = np.nanmax(record.rejected_measurements[:, column])
    return [
        f"filter inconsistent: its normalised estimation error squared is {squared:.3g} on average and its "
        f"normalised innovation squared {innovation:.3g}, where {CONSISTENT:g} is consistent; "
        f"{rejected:.0f} measurements rejected. The motion is not the filter's model, or its noise is not "
        "what the filter assumes"
    ]
