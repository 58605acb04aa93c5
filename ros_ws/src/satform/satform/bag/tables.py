# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages of one topic of a bag as arrays: a row for each step, also where a satellite sent nothing."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from satform.bag.errors import BagError
from satform.bag.message_types import TopicMessages, fixed_layout
from satform.communication.cdr_layout import Lengths
from satform.communication.topic_table import FRAME, LOCKSTEP_DEPTH
from satform.membership.absence_log import Absences

ANNOUNCEMENTS = frozenset({"arc_length", "motion", "navigation_estimate"})
"""Kinds of topics that have a message for the state after the last step, too."""

PUBLISHED_BY_SATELLITE = frozenset({*ANNOUNCEMENTS, "command", "tracking", "estimate", "attitude_estimate"})
"""Kinds of topics on which a satellite publishes itself."""

Rows = NDArray[Any]
"""Messages of one topic: a structured array with a field for each number."""


@dataclass(frozen=True)
class Gaps:
    """What the rows of steps without a message are filled from.

    Attributes:
        absences: when satellites did not take part.
        final_commands: what lost satellites had commanded last, by name and the step in which they were lost.
        states: number of states of the flight.
        held: on the wall clock, the steps after its own for which a command is held; None in lockstep.
    """

    absences: Absences
    final_commands: Mapping[tuple[str, int], Any]
    states: int
    held: int | None


@dataclass(frozen=True)
class Table:
    """The messages of one topic, one for each step from 0 on.

    Attributes:
        source: file and topic, for errors.
        rows: a structured array with a field for each number.
    """

    source: str
    rows: Rows

    def __len__(self) -> int:
        return len(self.rows)

    def blank(self, rows: int) -> "Table":
        """As many rows in which no number is one."""
        blank = np.zeros(max(rows, 0), dtype=self.rows.dtype)
        blank["step"] = np.arange(len(blank))
        _blank(blank, np.ones(len(blank), dtype=np.bool_))
        return Table(self.source, blank)

    def column(self, name: str) -> NDArray[np.float64]:
        """The values of one field, shape (rows,).

        Args:
            name: dotted name.

        Raises:
            BagError: the messages have no such field.
        """
        if name not in (self.rows.dtype.names or ()):
            raise BagError(f"{self.source} has no field {name}; another version recorded it")
        return self.rows[name].astype(np.float64)


def read_table(
    messages: TopicMessages, satellite: int, gaps: Gaps, file: str, lengths: Lengths = ()
) -> Table:
    """All messages of a topic about one satellite, with steps 0, 1, 2, ... without a gap.

    A satellite that was absent commanded nothing, and what else it would have published is not a number.

    Args:
        messages: of the topic.
        satellite: index of the satellite.
        gaps: what is known of steps without a message.
        file: for errors.
        lengths: name and length of each list of any length in the messages.

    Returns:
        The table; without rows where there are no messages.

    Raises:
        BagError: the messages are not of one fixed size with a step, or steps are missing.
    """
    name, _, kind = messages.topic.strip("/").partition("/")
    rows = _rows(messages, kind, file, lengths)
    if kind in PUBLISHED_BY_SATELLITE:
        spells = gaps.absences.spells[satellite]
        if gaps.held is not None:
            rows = _held(rows, kind, gaps.states, gaps.held, spells)
        else:
            rows = _with_absences(rows, (kind, name), spells, gaps.final_commands, gaps.states)
    missing = np.flatnonzero(rows["step"] != np.arange(len(rows), dtype=np.uint64))
    if missing.size:
        first = int(missing[0])
        found = int(rows["step"][first])
        raise BagError(f"{file}: {messages.topic} has step {found} where step {first} was to follow")
    return Table(f"{file}: {messages.topic}", rows)


def _rows(messages: TopicMessages, kind: str, file: str, lengths: Lengths) -> Rows:
    """The messages as they are in the bag."""
    if not messages.messages and not messages.definition:
        return np.empty(0, dtype=[("step", np.uint64)])
    try:
        form = fixed_layout(messages.type_name, messages.definition, FRAME, lengths)
        fits = form.dtype["step"] == np.uint64 and all(len(data) == form.size for data in messages.messages)
    except Exception:
        fits = False
    if not fits:
        raise BagError(f"{file}: {messages.topic} has messages of another form than satform's {kind} message")
    return np.frombuffer(b"".join(messages.messages), dtype=form.dtype)


def _held(table: Rows, kind: str, states: int, held: int, spells: list[tuple[int, int]]) -> Rows:
    """A satellite's messages on the wall clock, one a step: a command is held on, all else is missed.

    Args:
        table: the messages.
        kind: of the topic.
        states: of the flight.
        held: steps after its own for which a command is held; after them nothing is commanded.
        spells: from which step to which the satellite was lost and commanded nothing.
    """
    rows = states if kind in ANNOUNCEMENTS else states - 1
    present = table["step"].astype(np.int64)
    latest = np.searchsorted(present, np.arange(max(rows, 0)), side="right") - 1
    whole = np.zeros(len(latest), dtype=table.dtype)
    received = latest >= 0
    whole[received] = table[latest[received]]
    if kind == "command":
        step = np.arange(len(latest))
        old = step - whole["step"].astype(np.int64) > held
        for begin, end in spells:
            old |= (step >= begin) & (step < end)
        whole[old] = np.zeros(1, dtype=table.dtype)
    else:
        missed = ~received | (whole["step"] != np.arange(len(latest), dtype=np.uint64))
        _blank(whole, missed)
    whole["step"] = np.arange(len(latest))
    return whole


def _blank(table: Rows, rows: NDArray[np.bool_]) -> None:
    """Make the numbers of some rows not a number."""
    for name in table.dtype.names or ():
        if table.dtype[name].kind == "f":
            table[name][rows] = np.nan


def _with_absences(
    table: Rows,
    whose: tuple[str, str],
    spells: list[tuple[int, int]],
    final_commands: Mapping[tuple[str, int], Any],
    states: int,
) -> Rows:
    """A satellite's messages with a row for each step in which it was absent.

    Messages of such a step are left out: a process that was suspended and goes on does not know yet that it
    no longer takes part. Messages sent shortly before may not have reached the recorder and are not a
    number; the plant publishes its last command.
    """
    kind, name = whose
    for begin, end in spells:
        silent_from = begin + 1 if kind in ANNOUNCEMENTS else begin
        table = table[(table["step"] < silent_from) | (table["step"] >= end)]
        first = max(0, begin - LOCKSTEP_DEPTH)
        # Back at once, its last announcement is still the one for the step of its loss.
        until = min(max(end, silent_from), states - (kind not in ANNOUNCEMENTS))
        present = set(table["step"].tolist())
        missing = [step for step in range(first, until) if step not in present]
        absent = np.zeros(len(missing), dtype=table.dtype)
        absent["step"] = missing
        # Who is absent commands nothing.
        _blank(absent, (absent["step"] < begin) | (kind != "command"))
        last_command = final_commands.get((name, begin))
        if last_command is not None and kind in ANNOUNCEMENTS and begin in missing:
            _fill_in(absent, missing.index(begin), last_command, "announced_")
        if last_command is not None and kind == "command" and begin - 1 in missing:
            _fill_in(absent, missing.index(begin - 1), last_command)
        table = np.concatenate([table, absent])
        table = table[np.argsort(table["step"], kind="stable")]
    return table


def _fill_in(table: Rows, row: int, command: Any, prefix: str = "") -> None:
    """What a lost satellite had commanded and announced last, as the plant had it."""
    for name in table.dtype.names or ():
        try:
            table[name][row] = reduce(getattr, f"{prefix}{name}".split("."), command)
        except AttributeError:
            # The command has no field of that name.
            continue
