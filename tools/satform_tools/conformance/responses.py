# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the tested node answers: waiting for its messages, looking at them, and that none comes too early."""

import time
from collections.abc import Callable, Sequence
from typing import Any

from satform_tools.conformance.formation import TestedFormation
from satform_tools.conformance.message_values import (
    announced_by_command,
    announced_values,
    are_valid,
    numbers_of,
)
from satform_tools.conformance.rules import Findings

ANSWER = 10.0
"""Wall-clock time within which a node answers, s."""

QUIET = 0.5
"""Wall-clock time for which a node must not answer where it has no last messages to repeat, s."""

STANDSTILL = 2.5
"""Wall-clock time for which a step does not go on, s; the plant repeats its status at least once a second."""

SHORTEST_QUIET = 0.2
"""As `QUIET`, where a node repeats its last messages and so shows that it has taken all messages, s."""

_REPEATED = 2.0
"""Wall-clock time within which a node repeats its last messages for a repeated status, s."""

_REPETITION = 0.25
"""Wall-clock time between two repeated statuses, s."""


class Stopped(Exception):  # noqa: N818 - no error: the rules that follow cannot be tried
    """The node does not go on, so that the rules that follow cannot be tried."""


class Responses:
    """Waits for what the node publishes, and notes which rules it keeps."""

    def __init__(self, formation: TestedFormation, findings: Findings) -> None:
        """Nothing has been received yet.

        Args:
            formation: about the node.
            findings: get what is found.
        """
        self._formation, self._findings = formation, findings

    def has_answered(self) -> bool:
        """Whether the command of the present step and the next phase have come."""
        formation = self._formation
        step = formation.plant.step
        return any(command.step == step for command in formation.commands) and any(
            message.step == step + 1 for message in formation.announcements
        )

    def require_answer(self, rule: str = "S3", why: str = "", *, advance: bool = True) -> None:
        """Wait for the command of the present step and the next phase, look at both, and go on.

        Args:
            rule: that is broken when there is no command.
            why: what has changed before, for the sentence.
            advance: whether the plant takes the step.

        Raises:
            Stopped: one of both does not come.
        """
        formation, require = self._formation, self._findings.require
        step = formation.plant.step
        answered = formation.spin(ANSWER, self.has_answered)
        commands = [command for command in formation.commands if command.step == step]
        announced = [message for message in formation.announcements if message.step == step + 1]
        because = f", though {why}" if why else ""
        missing = "command" if not commands else f"phase for step {step + 1}"
        sentence = f"no {missing} within {ANSWER:g} s after all messages of step {step}{because}"
        # Without a command it is the rule that is broken under which it had to come.
        if not require("S3" if commands else rule, answered, sentence):
            raise Stopped
        require(rule, True, "")
        self._look_at(commands[0], announced[0], step)
        if advance:
            formation.advance()

    def _look_at(self, command: Any, announced: Any, step: int) -> None:
        formation, require = self._formation, self._findings.require
        wrong = formation.contradicts(command, step, exact=True)
        require("S4", not wrong, f"the stamp of the command of step {step} is not that of its step")
        wrong = formation.contradicts(announced, step + 1, exact=False)
        require("S4", not wrong, f"the stamp of the phase for step {step + 1} contradicts its step")
        for message, what in ((command, "command"), (announced, "phase")):
            frame = message.header.frame_id
            require("S4", frame == "lvlh", f"the frame_id of the {what} is {frame!r}")
        sound = are_valid([*numbers_of(command), *numbers_of(announced)])
        require("S5", sound, f"a number at step {step} is not finite, or beyond 1e15")
        if sound:
            same = announced_by_command(command) == announced_values(announced)
            require("S6", same, f"announced_* at step {step} are not those of the next phase")
        stamp = announced.header.stamp
        require("S6", command.announced_at == stamp, f"announced_at at step {step} is not the next stamp")

    def require_phase(self, rule: str, sentence: str) -> None:
        """Wait for the phase of the present step."""
        formation = self._formation
        step = formation.plant.step
        came = formation.spin(
            ANSWER, lambda: any(message.step == step for message in formation.announcements)
        )
        self._findings.require(rule, came, sentence)

    def require_quiet(self, rule: str, why: str) -> None:
        """Look that the node does not answer, though it had the time to."""
        self.give_time()
        self.require_none(rule, why, self._formation.plant.step)

    def give_time(self) -> None:
        """Give the node time to take what was published.

        It has taken it when statuses, repeated one after the other, have each been answered by the last
        command (rule S8); one answer may be that to the status of a change before.
        """
        self._formation.spin(SHORTEST_QUIET)
        end = time.monotonic() + _REPEATED
        for _ in range(3):
            before = len(self._repeated_messages())
            self._formation.repeat_status()
            self._wait_for_repetitions(before + 1, end - time.monotonic())

    def _repeated_messages(self) -> Sequence[Any]:
        """What the node repeats once for a repeated status: its last command, before the first its phase."""
        return self._formation.commands or self._formation.announcements

    def _wait_for_repetitions(self, count: int, seconds: float) -> None:
        self._formation.spin(seconds, lambda: len(self._repeated_messages()) >= count)

    def require_none(self, rule: str, why: str, step: int) -> None:
        """Look that there is no command for a step.

        Args:
            rule: that forbids it.
            why: what the node should have waited for, for the sentence.
            step: of the command.
        """
        # A node that waits for nobody breaks one rule, not all that say for whom it is to wait.
        rule = "S2" if rule in ("F2", "F3") and "S2" in self._findings.broken else rule
        none = not any(command.step == step for command in self._formation.commands)
        self._findings.require(rule, none, f"a command for step {step} {why}")

    def stand_still(self, step: int, until: Callable[[], bool] = lambda: False) -> None:
        """Repeat the status for `STANDSTILL` while a message of a step is missing; no command may come.

        Args:
            step: that does not go on.
            until: ends it earlier.
        """
        expected = len(self._repeated_messages())
        for _ in range(round(STANDSTILL / _REPETITION)):
            expected += 1
            self._formation.repeat_status()
            if self._formation.spin(_REPETITION, until):
                break
        # Those that come late would later be taken for answers to other statuses.
        self._wait_for_repetitions(expected, _REPEATED)
        self.require_none("S2", "while a message of the step was missing", step)
