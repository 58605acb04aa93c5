# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Result of one case of a campaign, the columns that all cases of a campaign have, and the hash over them."""

import hashlib
import json
import math
import struct
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal, TypeAlias, get_args

from satform.numeric.elementwise import Array

ChangeValue: TypeAlias = float | int | str | bool
"""Value to which a case sets a field of the scenario."""

Kind: TypeAlias = Literal["number", "integer", "boolean", "text"]
"""Type of a column of changes: float64, int64, bool, or UTF-8 text."""

_CANONICAL_NAN = struct.pack("<d", math.nan)


@dataclass(frozen=True, slots=True)
class CaseResult:
    """Result of one case.

    Attributes:
        number: of the case, from 0.
        changes: value that the case sets, by path of the scenario's field; the seed among them.
        figures: by name, in the unit of the figure; NaN where the flight has none.
        met: whether the figure is as expected, by name, for figures with a limit.
        success: whether the flight went to its end and every expectation was met.
        reason: why it was no success, in a sentence without a full stop; empty when it was one.
        lost: whether the machine and not the flight ended the case: a timeout, or its worker process died.
        state_hash: of the flight's record; None where the record was not made.
        stacked: whether it was flown in one stack with other cases.
        series: retained quantities over time by name, shape (T, N, ...).
        record_path: folder of the retained record, from the campaign's folder; None where there is none.
    """

    number: int
    changes: Mapping[str, ChangeValue]
    figures: Mapping[str, float] = field(default_factory=dict)
    met: Mapping[str, bool] = field(default_factory=dict)
    success: bool = False
    reason: str = ""
    lost: bool = False
    state_hash: str | None = None
    stacked: bool = False
    series: Mapping[str, Array] = field(default_factory=dict)
    record_path: str | None = None


@dataclass(frozen=True)
class Columns:
    """Columns that all cases of a campaign have, whatever became of each.

    Attributes:
        changes: type of each change by its path.
        figures: names of all figures.
        judged: names of the figures that have a limit.
        of_loops: names of the figures of sampled loops. LAPACK computes them, whose last bits depend on the
            processor; they are not part of the hash.
    """

    changes: Mapping[str, Kind]
    figures: tuple[str, ...]
    judged: tuple[str, ...] = ()
    of_loops: tuple[str, ...] = ()

    def complete(self, result: CaseResult) -> CaseResult:
        """A result with exactly these columns, as it is read from a file.

        A figure that the case does not have is NaN, and its expectation not met; a change that it does not
        make stays out.

        Args:
            result: of a case of this campaign.

        Raises:
            ValueError: it has a change, figure or verdict that the campaign has not.
        """
        unknown = [
            *(path for path in result.changes if path not in self.changes),
            *(name for name in result.figures if name not in self.figures),
            *(name for name in result.met if name not in self.judged),
        ]
        if unknown:
            raise ValueError(
                f"case {result.number} has {', '.join(unknown)}, which the campaign does not have"
            )
        return replace(
            result,
            changes={
                path: converted(result.changes[path], kind)
                for path, kind in self.changes.items()
                if path in result.changes
            },
            figures={name: float(result.figures.get(name, math.nan)) for name in self.figures},
            met={name: bool(result.met.get(name, False)) for name in self.judged},
        )

    def data(self) -> dict[str, Any]:
        """As plain data."""
        return {**asdict(self), "changes": dict(self.changes)}

    @classmethod
    def of_data(cls, data: Mapping[str, Any]) -> "Columns":
        """From what `data` gave, read again from JSON.

        Raises:
            KeyError: something is missing.
            TypeError: something is of another type.
        """
        of_loops = tuple(data.get("of_loops", ()))
        found = cls(dict(data["changes"]), tuple(data["figures"]), tuple(data["judged"]), of_loops)
        names = (*found.changes, *found.figures, *found.judged, *found.of_loops)
        kinds = set(get_args(Kind))
        if not all(isinstance(name, str) for name in names) or not set(found.changes.values()) <= kinds:
            raise TypeError("a name of a column is no text, or a type of a column is unknown")
        return found


def failure_text(error: Exception) -> str:
    """What went wrong, in a sentence without a full stop."""
    if isinstance(error, MemoryError):
        return "there was not enough memory for it"
    return f"{type(error).__name__}: {' '.join(str(error).split())}" if str(error) else type(error).__name__


def converted(value: ChangeValue, kind: Kind) -> ChangeValue:
    """A value as its column holds it; text that stands beside numbers is JSON."""
    match kind:
        case "number":
            return float(value)
        case "integer":
            return int(value)
        case "boolean":
            return bool(value)
        case "text":
            return value if isinstance(value, str) else json.dumps(value)


class ResultsHash:
    """Hash over the results of a campaign: number, changes, figures, verdicts and reason of every case.

    It does not depend on how, where or when the cases were flown. Figures of sampled loops are left out.
    Of a case that an exception ended, its class is hashed and its text is not, which may name addresses and
    paths. Results are added in order of their numbers. A lost case says what the machine did: a campaign that
    has one is not hashed.
    """

    def __init__(self, columns: Columns) -> None:
        self._columns = columns
        self._hash = hashlib.sha256()
        self._last = -1

    def add(self, result: CaseResult) -> None:
        """Add the next result, with all columns of the campaign.

        Raises:
            ValueError: it does not come after the one before.
        """
        if result.number <= self._last:
            raise ValueError(f"case {result.number} comes after case {self._last}")
        self._last = result.number
        self._hash.update(_encoded(result, self._columns))

    def hexdigest(self) -> str:
        """SHA-256, hexadecimal."""
        return self._hash.hexdigest()


def _encoded(result: CaseResult, columns: Columns) -> bytes:
    """Canonical bytes of a result: each value behind its name and type, so that no two results share them."""
    parts = [struct.pack("<q?", result.number, result.success), _text(_hashed_reason(result.reason))]
    for path, kind in columns.changes.items():
        if path in result.changes:
            parts += [_text(path), _value(result.changes[path], kind)]
    for name in columns.figures:
        if name in columns.of_loops:
            continue
        parts += [_text(name), _float(result.figures[name])]
    for name in columns.judged:
        parts += [_text(name), struct.pack("<?", result.met[name])]
    return _text(b"".join(parts))


def _hashed_reason(reason: str) -> str:
    """A reason; of an exception its class alone. Only `failure_text` writes one word before a colon."""
    name = reason.partition(":")[0]
    return name if name.isidentifier() else reason


def _value(value: ChangeValue, kind: Kind) -> bytes:
    if kind == "number":
        return b"d" + _float(float(value))
    return kind[:1].encode() + _text(str(value))


def _float(value: float) -> bytes:
    """Bits of a float64; all NaNs have the same, since theirs depend on who made them."""
    return _CANONICAL_NAN if math.isnan(value) else struct.pack("<d", value)


def _text(text: str | bytes) -> bytes:
    encoded = text.encode() if isinstance(text, str) else text
    return struct.pack("<q", len(encoded)) + encoded
