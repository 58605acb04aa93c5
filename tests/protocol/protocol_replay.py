# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Histories of the explorer and of the model for Spin, each followed in the other one.

A history is a list of actions in the words of the explorer. The model prints the same actions as numbers when
Spin repeats a trail, and lets only scheduled ones happen if it is given a schedule.
"""

import re
from collections import deque
from collections.abc import Sequence

from protocol_explorer import Explorer
from protocol_transitions import Action, State

NUMBERS = {
    "deliver state sat1": 0,
    "deliver state sat2": 1,
    "deliver status sat1": 2,
    "deliver status sat2": 3,
    "deliver announcement sat2 to sat1": 4,
    "deliver announcement sat1 to sat2": 5,
    "deliver command sat1": 6,
    "deliver command sat2": 7,
    "deliver lost": 8,
    "kill sat1": 10,
    "kill sat2": 11,
    "graph": 12,
    "timeout": 13,
}
"""Actions that both know, as numbered in protocol.pml; there the report of a loss is 8 or 9."""

_WORDS = {number: words for words, number in NUMBERS.items()} | {9: "deliver lost"}

_CALM = 300
"""Actions in which a flight of three steps has ended, whatever was before."""


class StuckError(Exception):
    """A flight does not end, though nothing disturbs it."""


def actions_of(printed: str) -> list[str]:
    """Actions of a trail, as Spin prints them when it repeats it."""
    return [_WORDS[int(number)] for number in re.findall(r"^\s*action (\d+)$", printed, re.MULTILINE)]


def schedule_of(history: Sequence[str]) -> list[int]:
    """Numbers of those actions of a history that the model has.

    Left out are the first status of each satellite, which announces the formation before the flight, and what
    is published again before a timeout.
    """
    numbers: list[int] = []
    announced: set[str] = set()
    again = False
    ended = 0
    for words in history:
        name = re.sub(r" \(left: .*\)", "", words)
        again = again or name == "idle"
        if name.startswith("deliver status") and name not in announced:
            announced.add(name)
        elif name == "timeout":
            again = False
            numbers.append(NUMBERS[name])
        elif not again:
            ended = int(name.startswith("kill sat2")) if name.startswith("kill") else ended
            numbers.append(NUMBERS[name] + (ended if name == "deliver lost" else 0))
    return numbers


def follow(explorer: Explorer, history: Sequence[str]) -> State:
    """State of a flight after a history of the model, and after nothing more has disturbed it until its end.

    Where the model publishes earlier than the nodes, an action comes as soon as it is possible. Of the last
    messages of a killed process those arrive that are delivered later in the history.

    Raises:
        ViolationError: an invariant does not hold on the way.
        LookupError: an action does not become possible.
        StuckError: the flight does not end.
    """
    state = explorer.start()
    for status in ("deliver status sat1", "deliver status sat2"):
        state = explorer.after(state, _possible(explorer, state)[status])
    waiting = deque(history)
    while waiting and not explorer.over(state):
        state = _next(explorer, state, waiting)
    for _ in range(_CALM):
        if explorer.over(state):
            return state
        state = explorer.after(state, calm_action(explorer, state))
    raise StuckError


def calm_action(explorer: Explorer, state: State) -> Action:
    """What happens next if nothing disturbs the flight, and no process is started again."""
    return next(
        action
        for action in explorer._everything(state)
        if action[0] in ("deliver", "release", "resume", "idle", "timeout")
    )


def _next(explorer: Explorer, state: State, waiting: deque[str]) -> State:
    """State after the first of these actions that is possible, which is taken out."""
    possible = _possible(explorer, state)
    for place, words in enumerate(waiting):
        if words == "timeout" and place == 0 and words not in possible:
            # Before it the nodes publish again, which the model leaves out.
            return explorer.after(state, calm_action(explorer, state))
        if words.startswith("kill") and place == 0:
            del waiting[0]
            return explorer.after(state, _kill(explorer, state, words, list(waiting)))
        if words in possible:
            del waiting[place]
            return explorer.after(state, possible[words])
        if words.startswith("kill"):
            break
    raise LookupError(f"none of {list(waiting)} is possible, but {sorted(possible)}")


def _possible(explorer: Explorer, state: State) -> dict[str, Action]:
    return {explorer.described(action): action for action in explorer._everything(state)}


def _kill(explorer: Explorer, state: State, words: str, later: list[str]) -> Action:
    """The end of a process of which those messages arrive that are delivered later."""
    satellite = explorer.plan.names.index(words.split()[1])
    _, _, network, _, _ = explorer._parts(state)
    left = []
    for place, channel in enumerate(explorer.channels):
        if channel[0] in ("announcement", "command", "ready") and channel[1] == satellite and network[place]:
            delivered = later.count(explorer.described(("deliver", place)))
            left.append((place, min(delivered, len(network[place]))))
    return ("kill", satellite, tuple(left))
