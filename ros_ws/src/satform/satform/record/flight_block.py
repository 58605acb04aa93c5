# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Some consecutive steps of one flight or of several flown side by side, from which figures are made."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from satform.numeric.elementwise import Array
from satform.record.derived import COLUMNS, DERIVED, DerivedQuantities
from satform.record.flight_record import FlightRecord
from satform.record.quantities import QUANTITIES


@dataclass(frozen=True, repr=False)
class FlightBlock(DerivedQuantities):
    """Consecutive steps of R flights of N satellites each, of the same names and control period.

    Each quantity of a `FlightRecord` that the block holds is an attribute with an axis of runs before that of
    the satellites: `block.position` has shape (rows, R, N, 3). What is decided in a step has a row for each
    of the block's K steps; what is known at the start of a step has K rows too, and in the last block K + 1,
    the state after the last step. A quantity that no satellite has may have no rows, as in the record.
    The blocks of a flight follow each other without gaps, the first begins at step 0, and each holds at
    least one step (the last one of a flight without steps holds its state alone).
    Derived quantities have the formulas, and the bits, of the record's; each is computed once, shape
    (K, R, N, ...).

    Attributes:
        satellites: N names, in the order of the columns.
        step: control period, s.
        first_step: of the flight that this block holds, 0 for the first.
        steps: K, steps that it holds.
        runs: R, flights side by side. A run that has ended early keeps its place; its numbers mean nothing
            from there on.
        last: whether the flight ends with this block.
        quantities: by the names of `FlightRecord`, shape (rows, R, N, ...); those that were asked for.
        clocked: whether the flight went by the wall clock; it is then a single block.
    """

    keeps_derived = True

    satellites: tuple[str, ...]
    step: float
    first_step: int
    steps: int
    runs: int
    last: bool
    quantities: Mapping[str, Array]
    clocked: bool = False

    @classmethod
    def of(cls, record: FlightRecord) -> "FlightBlock":
        """A whole flight as its only block, with R = 1; the arrays are views of the record's."""
        quantities = {name: values[:, None] for name, values in record.quantities().items()}
        return cls(
            record.satellites, record.step, 0, record.steps, 1, True, quantities, clocked=record.clocked
        )

    def __getattr__(self, quantity: str) -> Array:
        """A quantity by its name, shape (rows, R, N, ...)."""
        # Asked for by copying before the fields are set, too: then there is nothing to look into.
        held = self.__dict__.get("quantities", {})
        if quantity in held:
            values: Array = held[quantity]
            return values
        needed = DERIVED[quantity].inputs if quantity in DERIVED else (quantity,)
        missing = [name for name in needed if name not in held]
        raise AttributeError(
            f"this block of a flight holds no {', '.join(missing)}; it holds {', '.join(held)}"
        )

    def __repr__(self) -> str:
        end = self.first_step + self.steps
        last = ", the last" if self.last else ""
        return f"<FlightBlock of {self.runs} runs, steps {self.first_step} to {end}{last}>"

    @cached_property
    def any_not_flown(self) -> bool:
        """Whether a satellite of any run computes nothing in one of these steps."""
        return bool(self.not_flown.any())

    @cached_property
    def any_absent(self) -> bool:
        """Whether a satellite of any run does not fly in one of these steps."""
        return bool(self.absent.any())


class StepEnds:
    """Turns the blocks of a flight into blocks that hold the state after each of their steps.

    The last step of each block but the last is held back until the next one begins. Memory: one row of the
    quantities that are asked for; all other rows are views.
    """

    def __init__(self, quantities: Iterable[str]) -> None:
        """Which quantities the blocks hold.

        Args:
            quantities: names of a `FlightRecord`.
        """
        self._names = tuple(sorted(quantities))
        self._held: dict[str, Array] = {}

    def take(self, block: FlightBlock) -> Iterator[FlightBlock]:
        """The steps whose ends are known now: the one that was held back, and those of the block.

        Args:
            block: the next one of the flight.
        """
        rows = {name: getattr(block, name) for name in self._names}
        if self._held:
            both = {
                name: np.concatenate((held, rows[name][:1])) if QUANTITIES[name].of_states else held
                for name, held in self._held.items()
            }
            yield replace(block, first_step=block.first_step - 1, steps=1, last=False, quantities=both)
        if block.last:
            yield block
            return
        self._held = {name: values[-1:].copy() for name, values in rows.items()}
        steps = block.steps - 1
        if steps:
            known = {name: own if QUANTITIES[name].of_states else own[:steps] for name, own in rows.items()}
            yield replace(block, steps=steps, last=False, quantities=known)


def base_quantities(names: Iterable[str]) -> frozenset[str]:
    """The quantities of a record from which these are made, derived ones among them.

    Args:
        names: of quantities of a `FlightRecord` or of derived ones.

    Raises:
        KeyError: there is no quantity of a name.
    """
    found: set[str] = set()
    for name in names:
        found.update(COLUMNS[name].inputs or (name,))
    return frozenset(found)
