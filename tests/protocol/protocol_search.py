# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The explorer with its search in C++: the reactions of the processes are computed here, once each.

`search.cpp` has the actions and the states of `protocol_actions` and `protocol_transitions` once more, on
small integers. A history that it finds is followed again by the latter, which say what does not hold.
"""

import ctypes
import functools
import hashlib
import os
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from protocol_explorer import DISTURBED, STUCK, Explorer, Outcome
from protocol_processes import PlantProcess
from protocol_transitions import ALL_FAULTS, KINDS, Interned, State, ViolationError

from satform.scenario import Scenario

SOURCE = Path(__file__).with_name("search.cpp")
FOLDER = Path(__file__).parents[2] / "ros_ws" / "install" / "cache" / "protocol_search"
"""Of the compiled search; nobody else may write there, unlike the shared folder of temporary files."""

_COMPILE_TIMEOUT = 300.0
"""Wall-clock time for the compiler, s; it takes about five."""

_LONGEST = 5000
"""Number of actions that a history has at most."""

_PUT_STATUS, _PUT_STATE, _PUT_COMMAND, _PUT_ANNOUNCEMENT, _PUT_READY, _ACTED, _READ, _OTHER = range(8)
_VIOLATION, _LIMIT, _NOT_GOING_ON = 1, 3, 4

_INTS = ctypes.POINTER(ctypes.c_int32)
_ASK = ctypes.CFUNCTYPE(ctypes.c_int, *[ctypes.c_int] * 5, _INTS, _INTS)


@functools.cache
def library() -> ctypes.CDLL:
    """The compiled search, made once for each version of its source."""
    name = f"search_{hashlib.sha256(SOURCE.read_bytes()).hexdigest()[:16]}.so"
    path = FOLDER / name
    if not path.exists():
        FOLDER.mkdir(mode=0o700, parents=True, exist_ok=True)
        compiler = os.environ.get("CXX", "c++")
        with tempfile.TemporaryDirectory(dir=path.parent) as folder:
            new = Path(folder) / name
            subprocess.run(
                [*compiler.split(), "-std=c++17", "-O2", "-shared", "-fPIC", "-o", str(new), str(SOURCE)],
                check=True,
                timeout=_COMPILE_TIMEOUT,
            )
            new.rename(path)
    found = ctypes.CDLL(str(path))
    pointer, count = ctypes.c_void_p, ctypes.c_int
    figures = ctypes.POINTER(ctypes.c_uint64)
    found.search_new.restype = pointer
    found.search_new.argtypes = [count, count, _INTS, count, count, count, _ASK]
    found.search_delete.argtypes = found.search_width.argtypes = [pointer]
    found.search_sequence.argtypes = [pointer, _INTS, count]
    found.search_explore.argtypes = [pointer, _INTS, ctypes.c_uint64, figures]
    found.search_history.argtypes = [pointer, ctypes.c_uint64, _INTS]
    found.search_walk.argtypes = [pointer, _INTS, ctypes.c_uint64, count, count, figures, _INTS]
    found.search_ended.argtypes = [pointer, _INTS]
    return found


class CompiledExplorer(Explorer):
    """Explores the flights of one scenario, with a compiled search."""

    def __init__(
        self, scenario: Scenario, *, cuts: bool = False, reduced: bool = True, **options: Any
    ) -> None:
        """Nothing has been visited yet.

        Args:
            scenario: as of `Transitions`.
            cuts: whether it is chosen at each message, instead of at a kill, if a kill loses it.
            reduced: as of `Transitions`.
            options: as of `Transitions`.
        """
        super().__init__(scenario, reduced=reduced, **options)
        self._reduction = 2 if cuts else int(reduced)

    def explore(self, limit: int = 2**32 - 2) -> Outcome:
        """Visit every reachable state, breadth first, until an invariant does not hold.

        States are known by fingerprints of 64 bits: of n states one is taken for another one with a
        probability of about n^2 / 2^65.
        """
        figures = (ctypes.c_uint64 * 8)()
        outcome = Outcome()
        with self._search() as (search, first):
            if first is None:
                outcome.violation = self._error_at_start
                return outcome
            result = library().search_explore(search, first, limit, figures)
            self._raise_error()
            broken = result in (_VIOLATION, _NOT_GOING_ON)
            self._note(outcome, figures)
            outcome.complete = result != _LIMIT
            self._ended = self._ended_of(search)
            if broken and self._reduction < 2:
                actions = (ctypes.c_int32 * _LONGEST)()
                length = library().search_history(search, figures[3], actions)
                numbers = [*actions[:length], *([figures[4]] if result == _VIOLATION else [])]
                self._retrace(outcome, numbers, everything=False, stuck=result == _NOT_GOING_ON)
        if broken and self._reduction == 2:
            # A shortest history has kills and no cuts.
            self._reduction = 1
            return self.explore(limit)
        return outcome

    def walk(self, seed: int, walks: int) -> Outcome:
        """Follow random walks from the start to the end of a flight.

        Args:
            seed: of the random numbers.
            walks: how many.
        """
        figures, actions = (ctypes.c_uint64 * 8)(), (ctypes.c_int32 * (_LONGEST + 1))()
        outcome = Outcome(complete=False)
        with self._search() as (search, first):
            disturbed = round(1000 * DISTURBED)
            result = library().search_walk(search, first, seed, walks, disturbed, figures, actions)
            self._raise_error()
            self._note(outcome, figures)
            if result:
                stuck = result == _NOT_GOING_ON
                self._retrace(outcome, list(actions[: figures[3]]), everything=True, stuck=stuck)
        return outcome

    def ended_plants(self) -> list[PlantProcess]:
        """The plants of all visited states in which the flight is over, each once."""
        return [self._objects[number] for number in self._ended]

    def _note(self, outcome: Outcome, figures: Any) -> None:
        outcome.states, outcome.transitions, outcome.ends = figures[0], figures[1], figures[2]
        outcome.frontier, outcome.depth = figures[5], figures[6]
        outcome.reactions = len(self._reactions)

    def _raise_error(self) -> None:
        if self._error is not None:
            raise self._error

    def _ended_of(self, search: int) -> list[int]:
        found = (ctypes.c_int32 * max(1, library().search_ended(search, None)))()
        return list(found[: library().search_ended(search, found)])

    def _retrace(self, outcome: Outcome, numbers: list[int], *, everything: bool, stuck: bool) -> None:
        """Follow a history by the states in Python, which say what does not hold."""
        state = self.start()
        try:
            for number in numbers:
                action = (list(self._everything(state)) if everything else self.actions(state))[number]
                outcome.history.append(self.described(action))
                state = self.after(state, action)
        except ViolationError as error:
            outcome.violation = str(error)
            return
        assert stuck, "the compiled search has found what does not follow from its history"
        outcome.violation = STUCK

    @contextmanager
    def _search(self) -> Iterator[tuple[int, Any]]:
        """A compiled search and its first state; None if an invariant does not hold in it."""
        self._error: BaseException | None = None
        self._error_at_start = ""
        self._contents, self._views = Interned(), Interned()
        self._others, self._progress = Interned(), Interned()
        table = [number for channel in self.channels for number in _described(channel)]
        ask = _ASK(self._asked)
        faults = sum(1 << number for number, fault in enumerate(ALL_FAULTS) if fault in self._faults)
        search = library().search_new(
            self.count,
            len(self.channels),
            (ctypes.c_int32 * len(table))(*table),
            faults,
            self._restarts,
            self._reduction,
            ask,
        )
        try:
            yield search, self._first(search)
        finally:
            library().search_delete(search)

    def _first(self, search: int) -> Any:
        try:
            state: State = self.start()
        except ViolationError as error:
            self._error_at_start = str(error)
            return None
        plant, satellites, network, _, rest = self._parts(state)
        queues = []
        for messages in network:
            values = (ctypes.c_int32 * max(1, len(messages)))(*messages)
            queues.append(library().search_sequence(search, values, len(messages)))
        numbers = [plant, *satellites, *queues, 0, rest.budget, -1, *rest.incarnations, *rest.acted, 0, 0]
        assert len(numbers) == library().search_width(search)
        return (ctypes.c_int32 * len(numbers))(*numbers)

    # Questions of the compiled search

    def _asked(self, question: int, *given: Any) -> int:
        answers = (
            self._reaction,
            self._input_number,
            self._facts_of_plant,
            self._facts_of_satellite,
            self._message_number,
            self._view,
            self._new_process,
        )
        try:
            return answers[question](*given)
        except ViolationError:
            return -1
        except BaseException as error:
            self._error = error
            return -1

    def _reaction(self, process: int, number: int, _3: int, _4: int, _more: Any, answer: Any) -> int:
        given = self._inputs.values[number]
        after, events, why = self._react(process, given)
        unchanged = after == process and not events and not why and given[0] in (*KINDS[3:], "status")
        answer[0], answer[1] = after, bool(why)
        answer[2] = unchanged and self._is_old(process, given[0], given)
        answer[3] = len(events)
        _fill(answer, 4, [number for event in events for number in self._event(event)])
        return 0

    def _event(self, event: Any) -> tuple[int, int, int]:
        match event[0]:
            case "publish":
                name, _, kind = event[1].rpartition("/")
                if kind == "status":
                    return _PUT_STATUS, self._messages.number(event[2]), 0
                if kind == "state" and name in self.plan.names:
                    return _PUT_STATE, self.plan.names.index(name), self._messages.number(event[2])
                if kind in ("command", "arc_length"):
                    put = _PUT_COMMAND if kind == "command" else _PUT_ANNOUNCEMENT
                    return put, self._contents.number(event[2]), 0
            case "ready":
                return _PUT_READY, self._contents.number(event[1]), 0
            case "acted":
                return _ACTED, event[1], self._views.number(event[2])
            case "reports read":
                return _READ, 0, 0
        return _OTHER, self._others.number(event), 0

    def _input_number(self, kind: int, one: int, two: int, extra: int, more: Any, _answer: Any) -> int:
        simple = {1: "resume", 2: "retransmit", 6: "pause", 7: "step", 8: "begin"}
        given: tuple[Any, ...]
        if kind == 0:
            given = self._of_message(self.channels[one], self._messages.values[two], extra, more)
        elif kind == 3:
            given = ("timeout", tuple(name for index, name in enumerate(self.plan.names) if one >> index & 1))
        elif kind == 4:
            given = ("silent", one)
        elif kind == 5:
            given = ("graph", self._graphs[0])
        else:
            given = (simple[kind],)
        return self._inputs.number(given)

    def _of_message(self, channel: Any, message: Any, extra: int, more: Any) -> tuple[Any, ...]:
        kind, *ends = channel
        match kind:
            case "lost":
                return (kind, message, b"" if extra < 0 else b"%d#%d" % (message, extra))
            case "ready":
                reports = tuple(self._messages.values[each] for each in more[1 : 1 + more[0]])
                return (kind, ends[0], *message, reports)
            case "command" | "announcement":
                return (kind, ends[0], *message)
        return (kind, message)

    def _facts_of_plant(self, plant: int, _2: int, _3: int, _4: int, _more: Any, answer: Any) -> int:
        process: PlantProcess = self._objects[plant]
        steps, membership, names = process.steps, process.membership, self.plan.names
        answer[0], answer[1], answer[2] = steps.flying, steps.paused, steps.last_step_taken
        answer[3] = self._progress.number(steps.progress)
        answer[4] = sum(1 << satellite for satellite in membership.awaited)
        answer[5] = sum(1 << names.index(name) for name in steps.missing() if name in names)
        answer[6] = sum(1 << satellite for satellite in membership.flying)
        statuses = [self._messages.number(data) for data in process.statuses]  # type: ignore[attr-defined]
        _fill(answer, 7, [len(statuses), *statuses])
        return 0

    def _facts_of_satellite(self, process: int, _2: int, _3: int, _4: int, _more: Any, answer: Any) -> int:
        one = self._objects[process]
        answer[0], answer[1] = one.steps.flying, self._disks.number(one.checkpoint.data)
        return 0

    def _message_number(self, sender: int, one: int, content: int, _4: int, _more: Any, _answer: Any) -> int:
        if sender == -1:
            return int(self._messages.values[one])
        if sender == -2:
            return self._messages.number(one)
        if sender == -3:
            return int(self._messages.values[one][0].rpartition(b"#")[2])
        return self._messages.number((b"%d#%d" % (sender, one), self._contents.values[content]))

    def _view(self, plant: int, number: int, satellite: int, _4: int, _more: Any, _answer: Any) -> int:
        view = self._views.values[number]
        return int(bool(view[2][satellite]) and self._objects[plant].versions.get(view[0]) == view)

    def _new_process(self, satellite: int, disk: int, _3: int, _4: int, _more: Any, _answer: Any) -> int:
        return self._number_of(self._satellite_class(self.plan, satellite, self._disks.values[disk]))


def _fill(answer: Any, place: int, numbers: list[int]) -> None:
    """Write numbers from a place on."""
    for each, number in enumerate(numbers, place):
        answer[each] = number


def _described(channel: Any) -> tuple[int, int, int]:
    """Kind of a channel, its sender and its receiver; -1 for the plant."""
    kind, *ends = channel
    number = KINDS.index(kind)
    if kind == "announcement":
        return number, ends[0], ends[1]
    if kind in ("ready", "command"):
        return number, ends[0], -1
    return number, -1, ends[0] if ends else -1
