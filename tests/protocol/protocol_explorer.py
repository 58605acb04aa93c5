# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""An explicit-state model checker that drives the objects that fly through every order of what may happen.

States are visited breadth first, so that the first violation that is found has a shortest history.
"""

import random
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from protocol_actions import Actions
from protocol_processes import PlantProcess
from protocol_transitions import Action, Channel, State, ViolationError

CALM = frozenset({"deliver", "release", "resume", "idle", "timeout"})
"""Kinds of actions that are no disturbance."""

STUCK = "the flight does not go on, though nothing disturbs it any more"
"""What does not hold where no sequence of deliveries leads to the end."""

DISTURBED = 0.05
"""Probability with which a random walk is disturbed where it can be."""


@dataclass
class Outcome:
    """What an exploration has found.

    Attributes:
        states: number of states that were visited.
        transitions: between them.
        ends: states in which the flight is over.
        reactions: of processes that were computed.
        violation: what does not hold; empty when all does.
        history: actions from the start to the violation.
        complete: whether every reachable state was visited.
        frontier: largest number of states that were still to be followed at once, in a compiled search.
        depth: largest number of actions from the start to a state, likewise.
    """

    states: int = 0
    transitions: int = 0
    ends: int = 0
    reactions: int = 0
    violation: str = ""
    history: list[str] = field(default_factory=list)
    complete: bool = True
    frontier: int = 0
    depth: int = 0


class Explorer(Actions):
    """Explores the flights of one scenario."""

    def explore(self, limit: int = 10**9) -> Outcome:
        """Visit every reachable state, breadth first, until an invariant does not hold.

        Args:
            limit: of the number of states.
        """
        outcome = Outcome()
        self.parents: dict[State, Any] = {}
        try:
            first = self.start()
        except ViolationError as error:
            outcome.violation = str(error)
            return outcome
        parents: dict[State, tuple[State, Action] | None] = self.parents
        parents[first] = None
        calm: dict[State, State] = {}
        queue = deque([first])
        while queue and not outcome.violation:
            state = queue.popleft()
            if self.over(state):
                outcome.ends += 1
                continue
            try:
                actions = self.actions(state)
                for action in actions:
                    outcome.transitions += 1
                    following = self.after(state, action)
                    if following not in parents:
                        parents[following] = (state, action)
                        queue.append(following)
                    if state not in calm and (len(actions) == 1 or self._goes_on_by(state, action)):
                        calm[state] = following
            except ViolationError as error:
                outcome.violation = str(error)
                outcome.history = [*self._history(parents, state), self.described(action)]
            if len(parents) > limit:
                outcome.complete = False
                break
        stuck = None if outcome.violation or not outcome.complete else self._stuck(parents, calm)
        if stuck is not None:
            outcome.violation = STUCK
            outcome.history = self._history(parents, stuck)
        outcome.states, outcome.reactions = len(parents), len(self._reactions)
        return outcome

    def ended_plants(self) -> list[PlantProcess]:
        """The plants of all visited states in which the flight is over."""
        return self.ended_in(self.parents)

    def ended_in(self, states: Iterable[State]) -> list[PlantProcess]:
        """The plants of those states in which the flight is over."""
        return [self._objects[state[0]] for state in states if self.over(state)]

    def _goes_on_by(self, state: State, action: Action) -> bool:
        """Whether an action happens next if nothing disturbs the flight."""
        if action[0] == "restart":
            return action[1] in self._objects[state[0]].membership.awaited
        return action[0] in ("deliver", "resume", "idle", "timeout")

    def _stuck(self, states: Iterable[State], calm: dict[State, State]) -> State | None:
        """A state from which the flight does not end if messages are delivered and nothing else happens."""
        ending: set[State] = set()
        for first in states:
            chain: dict[State, None] = {}
            state = first
            while state not in ending and not self.over(state):
                if state in chain or state not in calm:
                    return first
                chain[state] = None
                state = calm[state]
            ending.update(chain)
        return None

    def _history(self, parents: dict[State, Any], state: State) -> list[str]:
        found: list[str] = []
        step = parents[state]
        while step is not None:
            state, action = step
            found.append(self.described(action))
            step = parents[state]
        return found[::-1]

    def follow(self, history: Iterable[str]) -> State:
        """The state after actions in words, as a history has them.

        Raises:
            ViolationError: an invariant does not hold on the way.
            LookupError: an action is not possible.
        """
        state = self.start()
        for words in history:
            possible = {self.described(action): action for action in self._everything(state)}
            state = self.after(state, possible[words])
        return state

    def walk(self, seed: int, walks: int) -> Outcome:
        """Follow random walks from the start to the end of a flight.

        Args:
            seed: of the random numbers.
            walks: how many.
        """
        numbers = random.Random(seed)
        outcome = Outcome(complete=False)
        visited: set[State] = set()
        history: list[str] = []
        try:
            for _ in range(walks):
                history = []
                state = self.start()
                while not self.over(state):
                    visited.add(state)
                    action = self._drawn(list(self._everything(state)), numbers)
                    history.append(self.described(action))
                    outcome.transitions += 1
                    state = self.after(state, action)
                outcome.ends += 1
        except ViolationError as error:
            outcome.violation, outcome.history = str(error), history
        outcome.states, outcome.reactions = len(visited), len(self._reactions)
        return outcome

    def _drawn(self, possible: list[Action], numbers: random.Random) -> Action:
        """One of the possible actions; a disturbance now and then."""
        calm = [each for each in possible if each[0] in CALM]
        others = [each for each in possible if each[0] not in CALM]
        return numbers.choice(others if others and (not calm or numbers.random() < DISTURBED) else calm)

    def described(self, action: Action) -> str:
        """An action in words."""
        if action[0] in ("deliver", "delay", "duplicate"):
            return f"{action[0]} {self._named(self.channels[action[1]])}"
        if action[0] == "release":
            return f"release {self._named(self.channels[action[1][0]])}"
        if action[0] == "kill":
            kept = ", ".join(f"{count} of {self._named(self.channels[place])}" for place, count in action[2])
            return f"kill {self.plan.names[action[1]]}" + (f" (left: {kept})" if kept else "")
        if action[0] in ("silent", "restart"):
            return f"{action[0]} {self.plan.names[action[1]]}"
        return str(action[0])

    def _named(self, channel: Channel) -> str:
        kind, *ends = channel
        if kind == "announcement":
            return f"announcement {self.plan.names[ends[0]]} to {self.plan.names[ends[1]]}"
        return f"{kind} {self.plan.names[ends[0]]}" if ends else str(kind)
