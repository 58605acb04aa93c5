# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Dates in UTC, TAI, TT or GPS time, brought to UTC, in which time zero is counted, and to brahe's epochs."""

from datetime import UTC, datetime, timedelta
from typing import Any, Literal

from satform.orbits.chief import as_utc

TimeScale = Literal["UTC", "TAI", "TT", "GPS"]
"""Time scale of a date."""


def utc_of(date: datetime, scale: TimeScale) -> datetime:
    """The same instant in UTC, to a microsecond.

    Args:
        date: with or without a time zone; one of another scale than UTC has none.
        scale: of the date.

    Raises:
        ValueError: a date of another scale has a time zone, or lies within a leap second of UTC.
    """
    if scale == "UTC":
        return as_utc(date)
    if date.tzinfo is not None:
        raise ValueError(
            f"the epoch {date.isoformat()} has a time zone, and {scale} knows none: leave it out"
        )
    return utc_datetime(_brahe_epoch(date, scale))


def brahe_epoch(date: datetime) -> Any:
    """The epoch, in brahe, of a date; one without a time zone is in UTC."""
    return _brahe_epoch(as_utc(date), "UTC")


def utc_datetime(epoch: Any) -> datetime:
    """The date in UTC of an epoch of brahe, to a microsecond.

    Raises:
        ValueError: it lies within a leap second or beyond the years 1 to 9999, which no date here can say.
    """
    import brahe  # noqa: PLC0415  slow to import

    scale: Any = brahe.TimeSystem.UTC
    try:
        year, month, day, hour, minute, second, nanosecond = epoch.to_datetime_as_time_system(scale)
    except OverflowError:
        raise ValueError(f"the epoch {epoch} is no date in UTC") from None
    if second >= 60.0:
        raise ValueError("the epoch lies within a leap second; give one a second earlier or later")
    microseconds = round(second * 1e6 + nanosecond * 1e-3)
    try:
        start = datetime(int(year), int(month), int(day), int(hour), int(minute), tzinfo=UTC)
        return start + timedelta(microseconds=microseconds)
    except (ValueError, OverflowError):
        raise ValueError(f"the epoch lies in the year {year}; years go from 1 to 9999 in UTC") from None


def _brahe_epoch(date: datetime, scale: TimeScale) -> Any:
    import brahe  # noqa: PLC0415  slow to import

    clock = (date.hour, date.minute, float(date.second), 1e3 * date.microsecond)
    system: Any = getattr(brahe.TimeSystem, scale)
    return brahe.Epoch.from_datetime(date.year, date.month, date.day, *clock, system)
