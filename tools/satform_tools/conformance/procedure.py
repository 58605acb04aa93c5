# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The flight in which the rules are tried: start, steps, lost and late messages, changes, own loss, end."""

import time
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from satform_msgs.msg import FormationStatus

from satform.common.exit_codes import EXIT_DONE, EXIT_LOST
from satform.communication.topic_table import INTERFACE_VERSION
from satform.consensus.graph import Graph
from satform.membership.formation import SatelliteLost, SatelliteRejoined, TopologyChanged
from satform_tools.conformance.formation import TestedFormation
from satform_tools.conformance.message_values import (
    announced_by_command,
    announced_values,
    are_valid,
    numbers_of,
)
from satform_tools.conformance.rules import Findings

STEPS = 40
"""Steps of the flight; more than the procedure needs."""

_ANSWER = 10.0
"""Wall-clock time within which a node answers, s."""

_QUIET = 0.5
"""Wall-clock time for which a node must not answer where it has no last messages to repeat, s."""

_SHORTEST_QUIET = 0.2
"""The same where it repeats them and so shows that it has taken all messages, s."""

_REPEATED = 2.0
"""Wall-clock time within which a node repeats its last messages for a repeated status, s."""

_STANDSTILL = 2.5
"""Wall-clock time for which a step does not go on, s; the plant repeats its status at least once a second."""

_REPETITION = 0.25
"""Wall-clock time between two repeated statuses, s."""

_END = 15.0
"""Wall-clock time within which a process ends, s."""


class Stopped(Exception):  # noqa: N818 - no error: the rules that follow cannot be tried
    """The node does not go on, so that the rules that follow cannot be tried."""


class Program(Protocol):
    """The process of the node, if it was started by this command."""

    def exit_code(self, timeout: float) -> int | None:
        """Exit code, waited for; None when the process goes on."""

    def start_again(self) -> None:
        """Start it again, or ask for that."""

    @property
    def is_ours(self) -> bool:
        """Whether exit codes can be seen."""


class Procedure:
    """Tries all rules on one node."""

    def __init__(
        self, formation: TestedFormation, findings: Findings, program: Program, timeout: float
    ) -> None:
        """Nothing has been tried yet.

        Args:
            formation: about the node.
            findings: get what is found.
            program: of the node.
            timeout: wall-clock time within which the node has to be there and ready, s.
        """
        self._formation, self._findings = formation, findings
        self._program, self._timeout = program, timeout
        self._senders: list[int] = []

    def run(self) -> None:
        """Try all rules, as far as the node goes along."""
        try:
            for part in (
                self._start,
                self._first_step,
                self._steps,
                self._repeated_state,
                self._lost_message,
                self._late_state,
                self._edges,
                self._new_edge,
                self._lost_neighbour,
                self._own_loss,
                self._end,
            ):
                part()
        except Stopped:
            pass

    # Parts

    def _start(self) -> None:
        formation, require = self._formation, self._findings.require
        formation.status(FormationStatus.WAITING)
        if not formation.spin(self._timeout, lambda: formation.node_is_there):
            require("E1", False, f"there is no node {formation.name} after {self._timeout:g} s")
            raise Stopped
        # It cannot be ready yet; a message that says so would come now.
        formation.spin(_ANSWER, lambda: formation.readiness_matched)
        formation.spin(2.0 * _QUIET)
        early = bool(formation.ready)
        require("R2", not early, "NodeReady came before the neighbours and the recorder were there")
        formation.add_others()
        formation.spin(self._timeout, lambda: formation.ready)
        formation.spin(_ANSWER, lambda: not formation.shortcomings())
        self._note_endpoints()
        if not require("R1", formation.ready, f"no NodeReady within {self._timeout:g} s"):
            raise Stopped
        self._note_ready(first=True)
        self._senders = list(formation.neighbours)

    def _note_endpoints(self) -> None:
        lacks = [each.sentence for each in self._formation.shortcomings()]
        changed = [sentence for sentence in lacks if "another definition" in sentence]
        unfit = [sentence for sentence in lacks if "its readers want" in sentence]
        missing = [sentence for sentence in lacks if sentence not in (*changed, *unfit)]
        for rule, found in (("E1", missing), ("E2", unfit), ("V2", changed)):
            self._findings.require(rule, not found, "; ".join(found))

    def _note_ready(self, *, first: bool) -> None:
        require, ready = self._findings.require, self._formation.ready[-1]
        named = ready.node.rpartition("/")[2]
        require("R1", named == self._formation.name, f"NodeReady has the node {ready.node!r}")
        exact = not self._formation.contradicts(ready, ready.step, exact=True)
        require("R1", exact, f"the stamp of NodeReady is not that of its step {ready.step}")
        if first:
            require("R1", ready.step == 0, f"NodeReady has step {ready.step}, not 0")
            require("R1", ready.checkpoint == -1, f"NodeReady has checkpoint {ready.checkpoint}, not -1")
        sentence = f"NodeReady has interface {ready.interface}; this satform has {INTERFACE_VERSION}"
        require("V1", ready.interface == INTERFACE_VERSION, sentence)

    def _first_step(self) -> None:
        formation = self._formation
        formation.status()
        formation.states()
        self._require_phase("S1", "no phase for step 0 after the state of step 0")
        if self._senders:
            self._quiet("S2", "without the messages of its in-neighbours")
            formation.neighbour_messages(0, self._senders)
        self._answer()

    def _steps(self) -> None:
        formation = self._formation
        for _ in range(3):
            formation.neighbour_messages(formation.plant.step, self._senders)
            self._quiet("S2", "without its state")
            formation.states()
            self._answer()

    def _repeated_state(self) -> None:
        formation = self._formation
        formation.neighbour_messages(formation.plant.step, self._senders)
        formation.states()
        self._answer(advance=False)
        for _ in range(3):
            formation.repeat_state()
        self._give_time()
        step = formation.plant.step
        own = [command for command in formation.commands if command.step == step]
        # As text, in which a number that is none equals itself.
        same = len({str(command) for command in own}) == 1
        self._findings.require("S7", same, f"several commands for step {step}, which differ")
        later = [command for command in formation.commands if command.step > step]
        self._findings.require("S7", not later, f"a command for step {step + 1} after a repeated state")
        formation.advance()

    def _lost_message(self) -> None:
        """A message to it, or the answer to it, has been lost: nothing goes on for a while."""
        formation, require = self._formation, self._findings.require
        step = formation.plant.step
        before = len(formation.commands), len(formation.announcements)

        def repeated() -> tuple[bool, bool]:
            again = formation.commands[before[0] :], formation.announcements[before[1] :]
            return any(each.step == step - 1 for each in again[0]), any(
                each.step == step for each in again[1]
            )

        if self._senders:
            formation.neighbour_messages(step, self._senders[1:])
            formation.states()
        else:
            formation.neighbour_messages(step, self._senders)
        self._stand_still(step, lambda: all(repeated()))
        # A node that has not waited has other last messages.
        if not self._has_answered():
            command, phase = repeated()
            seconds = f"within {_STANDSTILL:g} s in which step {step} did not go on"
            require("S8", command, f"the command of step {step - 1} was not repeated {seconds}")
            require("S8", phase, f"the phase for step {step} was not repeated {seconds}")
        if self._senders:
            formation.neighbour_messages(step, self._senders[:1])
        else:
            formation.states()
        self._answer()

    def _late_state(self) -> None:
        formation = self._formation
        step = formation.plant.step
        formation.neighbour_messages(step, self._senders)
        self._stand_still(step)
        formation.states()
        self._answer("S9")

    def _stand_still(self, step: int, until: Callable[[], bool] = lambda: False) -> None:
        expected = len(self._repeated_messages())
        for _ in range(round(_STANDSTILL / _REPETITION)):
            expected += 1
            self._formation.repeat_status()
            if self._formation.spin(_REPETITION, until):
                break
        # Those that come late would later be taken for answers to other statuses.
        self._wait_for_repetitions(expected, _REPEATED)
        self._require_none("S2", "while a message of the step was missing", step)

    def _edges(self) -> None:
        """An edge ends, and comes back."""
        formation = self._formation
        if not self._senders:
            return
        first, others = self._senders[0], self._senders[1:]
        self._change_edge(first, 0.0)
        formation.neighbour_messages(formation.plant.step, self._senders)
        formation.states()
        self._quiet("F1", "of a version whose status it has not received")
        formation.announce_change()
        self._answer()
        formation.neighbour_messages(formation.plant.step, others)
        formation.states()
        self._answer("F2", f"the edge from {self._name(first)} has ended")
        self._change_edge(first, 1.0)
        formation.announce_change()
        formation.neighbour_messages(formation.plant.step, others)
        formation.states()
        self._quiet("F2", f"without the message of {self._name(first)}, whose edge is there again")
        formation.neighbour_messages(formation.plant.step, [first])
        self._answer()

    def _new_edge(self) -> None:
        """An edge from a satellite of which it has not received before."""
        formation = self._formation
        others = set(range(len(formation.formation.alive))) - {formation.index, *self._senders}
        if not others:
            return
        new = min(others)
        self._change_edge(new, 1.0)
        formation.announce_change()
        formation.neighbour_messages(formation.plant.step, self._senders)
        formation.states()
        self._quiet("F3", f"without the message of {self._name(new)}, of which a new edge is")
        for _ in range(round(_ANSWER / _QUIET)):
            formation.neighbour_messages(formation.plant.step, [new])
            if formation.spin(_QUIET, self._has_answered):
                break
        self._answer("F3", f"there is a new edge from {self._name(new)}")
        self._change_edge(new, 0.0)
        formation.announce_change()

    def _change_edge(self, sender: int, weight: float) -> None:
        adjacency = self._formation.formation.graph.adjacency.copy()
        adjacency[self._formation.index, sender] = weight
        self._formation.change([TopologyChanged(Graph(adjacency), "an edge changes")])

    def _lost_neighbour(self) -> None:
        formation = self._formation
        if not self._senders:
            return
        lost, others = self._senders[0], self._senders[1:]
        name = self._name(lost)
        formation.change(
            [SatelliteLost(lost, f"{name} is lost")], [formation.final_command(lost, formation.plant.step)]
        )
        formation.announce_change()
        for _ in range(2):
            formation.neighbour_messages(formation.plant.step, others)
            formation.states()
            self._answer("F2", f"{name} is lost")
        formation.change([SatelliteRejoined(lost, None)])
        formation.announce_change()
        formation.neighbour_messages(formation.plant.step, self._senders)
        formation.states()
        self._answer("F2", f"{name} has rejoined")
        formation.neighbour_messages(formation.plant.step, others)
        formation.states()
        self._quiet("F2", f"without the message of {name}, which has rejoined")
        formation.neighbour_messages(formation.plant.step, [lost])
        self._answer()

    def _own_loss(self) -> None:
        formation, require = self._formation, self._findings.require
        step, own = formation.plant.step, formation.index
        formation.ready.clear()
        formation.change([SatelliteLost(own, f"{formation.name} is lost")], formation.commands[-1:])
        formation.announce_change()
        formation.spin(_QUIET, self._has_left)
        formation.neighbour_messages(step, self._senders)
        formation.states()
        formation.spin(2.0 * _QUIET, self._has_left)
        self._require_none("L1", "though it is lost", step)
        code = self._program.exit_code(0.0 if formation.ready else _END)
        if not formation.ready:
            if self._program.is_ours:
                sentence = f"it is lost, and its exit code is {code}" if code is not None else "it goes on"
                require("L1", code == EXIT_LOST, sentence)
            self._program.start_again()
        if not require(
            "L2",
            formation.spin(self._timeout, lambda: formation.ready),
            f"no NodeReady within {self._timeout:g} s after it was lost",
        ):
            raise Stopped
        self._note_ready(first=False)
        # Those of the process before are no messages of the one that rejoins.
        formation.commands.clear()
        formation.announcements.clear()
        # The plant publishes states of all satellites, also of those that are lost.
        for _ in range(3):
            formation.neighbour_messages(formation.plant.step, self._senders)
            formation.states()
            formation.advance()
        formation.spin(_QUIET)
        for command in formation.commands:
            require("L3", False, f"a command for step {command.step} before the step of its return")
        while formation.plant.step < STEPS - 3:
            formation.advance()
        formation.change([SatelliteRejoined(own, None)])
        formation.announce_change()
        formation.states()
        self._require_phase("L3", f"no phase for step {formation.plant.step}, at which it rejoins")
        formation.neighbour_messages(formation.plant.step, self._senders)
        self._answer("L3", "it has rejoined")

    def _end(self) -> None:
        formation, require = self._formation, self._findings.require
        while formation.plant.step < STEPS:
            formation.neighbour_messages(formation.plant.step, self._senders)
            formation.states()
            self._answer()
        formation.neighbour_messages(STEPS, self._senders)
        formation.states()
        self._quiet("X1", "for the state after the last step")
        formation.status(FormationStatus.FINISHED)
        if self._program.is_ours:
            code = self._program.exit_code(_END)
            sentence = f"its exit code is {code}" if code is not None else f"it goes on for {_END:g} s"
            require("X1", code == EXIT_DONE, f"after FINISHED {sentence}")
        else:
            gone = formation.spin(_END, lambda: not formation.node_is_there)
            require("X1", gone, f"after FINISHED it is there for {_END:g} s")

    # What a node does

    def _name(self, index: int) -> str:
        return self._formation.name_of(index)

    def _has_answered(self) -> bool:
        formation = self._formation
        step = formation.plant.step
        return any(command.step == step for command in formation.commands) and any(
            message.step == step + 1 for message in formation.announcements
        )

    def _answer(self, rule: str = "S3", why: str = "", *, advance: bool = True) -> None:
        """Wait for the command of the present step and the next phase, look at both, and go on."""
        formation, require = self._formation, self._findings.require
        step = formation.plant.step
        answered = formation.spin(_ANSWER, self._has_answered)
        commands = [command for command in formation.commands if command.step == step]
        announced = [message for message in formation.announcements if message.step == step + 1]
        because = f", though {why}" if why else ""
        missing = "command" if not commands else f"phase for step {step + 1}"
        sentence = f"no {missing} within {_ANSWER:g} s after all messages of step {step}{because}"
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

    def _require_phase(self, rule: str, sentence: str) -> None:
        formation = self._formation
        step = formation.plant.step
        came = formation.spin(
            _ANSWER, lambda: any(message.step == step for message in formation.announcements)
        )
        self._findings.require(rule, came, sentence)

    def _quiet(self, rule: str, why: str) -> None:
        """Look that the node does not answer, though it had the time to."""
        self._give_time()
        self._require_none(rule, why, self._formation.plant.step)

    def _give_time(self) -> None:
        """Give the node time to take what was published.

        It has taken it when statuses, repeated one after the other, have each been answered by the last
        command (rule S8); one answer may be that to the status of a change before.
        """
        self._formation.spin(_SHORTEST_QUIET)
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

    def _has_left(self) -> bool:
        """Whether the node that is lost has ended, or is ready to rejoin."""
        return bool(self._formation.ready) or self._program.exit_code(0.0) is not None

    def _require_none(self, rule: str, why: str, step: int) -> None:
        # A node that waits for nobody breaks one rule, not all that say for whom it is to wait.
        rule = "S2" if rule in ("F2", "F3") and "S2" in self._findings.broken else rule
        none = not any(command.step == step for command in self._formation.commands)
        self._findings.require(rule, none, f"a command for step {step} {why}")
