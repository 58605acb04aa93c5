# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The flight in which the rules are tried: start, steps, lost and late messages, changes, own loss, end."""

from typing import Protocol

from satform_msgs.msg import FormationStatus

from satform.common.exit_codes import EXIT_DONE, EXIT_LOST
from satform.communication.topic_table import INTERFACE_VERSION
from satform.consensus.graph import Graph
from satform.membership.formation import SatelliteLost, SatelliteRejoined, TopologyChanged
from satform_tools.conformance.formation import TestedFormation
from satform_tools.conformance.responses import ANSWER, QUIET, SHORTEST_QUIET, STANDSTILL, Responses, Stopped
from satform_tools.conformance.rules import Findings

STEPS = 40
"""Steps of the flight; more than the procedure needs."""

_END = 15.0
"""Wall-clock time within which a process ends, s."""


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
        self._responses = Responses(formation, findings)
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
        formation.spin(ANSWER, lambda: formation.readiness_matched)
        formation.spin(2.0 * QUIET)
        early = bool(formation.ready)
        require("R2", not early, "NodeReady came before the neighbours and the recorder were there")
        formation.add_others()
        formation.spin(self._timeout, lambda: formation.ready)
        formation.spin(ANSWER, lambda: not formation.shortcomings())
        self._note_endpoints()
        if not require("R1", formation.ready, f"no NodeReady within {self._timeout:g} s"):
            raise Stopped
        self._note_ready(first=True)
        self._senders = list(formation.neighbours)

    def _note_endpoints(self) -> None:
        lacks = self._formation.shortcomings()
        for rule, kinds in (("E1", ("endpoint", "type")), ("E2", ("QoS",)), ("V2", ("definition",))):
            found = [each.sentence for each in lacks if each.kind in kinds]
            self._findings.require(rule, not found, "; ".join(found))

    def _note_ready(self, *, first: bool) -> None:
        require, ready = self._findings.require, self._formation.ready[-1]
        name = self._formation.full_name
        require("R1", ready.node == name, f"NodeReady has the node {ready.node!r}, not {name!r}")
        exact = not self._formation.contradicts(ready, ready.step, exact=True)
        require("R1", exact, f"the stamp of NodeReady is not that of its step {ready.step}")
        if first:
            require("R1", ready.step == 0, f"NodeReady has step {ready.step}, not 0")
            require("R1", ready.checkpoint == -1, f"NodeReady has checkpoint {ready.checkpoint}, not -1")
        sentence = f"NodeReady has interface {ready.interface}; this satform has {INTERFACE_VERSION}"
        require("V1", ready.interface == INTERFACE_VERSION, sentence)

    def _require_ready_at_most(self, most: int, when: str) -> None:
        # In a flight each NodeReady after the first is taken for a request to rejoin.
        count = len(self._formation.ready)
        times = f"{count} times" if count > 1 else "again"
        self._findings.require("R1", count <= most, f"NodeReady was published {times} {when}")

    def _first_step(self) -> None:
        formation = self._formation
        formation.status()
        formation.states()
        self._responses.require_phase("S1", "no phase for step 0 after the state of step 0")
        if self._senders:
            self._responses.require_quiet("S2", "without the messages of its in-neighbours")
            formation.neighbour_messages(0, self._senders)
        self._responses.require_answer()

    def _steps(self) -> None:
        formation = self._formation
        for _ in range(3):
            formation.neighbour_messages(formation.plant.step, self._senders)
            self._responses.require_quiet("S2", "without its state")
            formation.states()
            self._responses.require_answer()

    def _repeated_state(self) -> None:
        formation = self._formation
        formation.neighbour_messages(formation.plant.step, self._senders)
        formation.states()
        self._responses.require_answer(advance=False)
        for _ in range(3):
            formation.repeat_state()
        self._responses.give_time()
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
        self._responses.stand_still(step, lambda: all(repeated()))
        # A node that has not waited has other last messages.
        if not self._responses.has_answered():
            command, phase = repeated()
            seconds = f"within {STANDSTILL:g} s in which step {step} did not go on"
            require("S8", command, f"the command of step {step - 1} was not repeated {seconds}")
            require("S8", phase, f"the phase for step {step} was not repeated {seconds}")
        if self._senders:
            formation.neighbour_messages(step, self._senders[:1])
        else:
            formation.states()
        self._responses.require_answer()

    def _late_state(self) -> None:
        formation = self._formation
        step = formation.plant.step
        formation.neighbour_messages(step, self._senders)
        self._responses.stand_still(step)
        formation.states()
        self._responses.require_answer("S9")

    def _edges(self) -> None:
        """An edge ends, and comes back."""
        formation = self._formation
        if not self._senders:
            return
        first, others = self._senders[0], self._senders[1:]
        self._change_edge(first, 0.0)
        formation.neighbour_messages(formation.plant.step, self._senders)
        formation.states()
        self._responses.require_quiet("F1", "of a version whose status it has not received")
        formation.announce_change()
        self._responses.require_answer()
        formation.neighbour_messages(formation.plant.step, others)
        formation.states()
        self._responses.require_answer("F2", f"the edge from {self._name(first)} has ended")
        self._change_edge(first, 1.0)
        formation.announce_change()
        formation.neighbour_messages(formation.plant.step, others)
        formation.states()
        self._responses.require_quiet(
            "F2", f"without the message of {self._name(first)}, whose edge is there again"
        )
        formation.neighbour_messages(formation.plant.step, [first])
        self._responses.require_answer()

    def _new_edge(self) -> None:
        """An edge from a satellite of which it has not received before."""
        formation = self._formation
        others = set(range(len(formation.formation.alive))) - {formation.index, *self._senders}
        if not others:
            every = "it receives from every other satellite of the scenario"
            self._findings.leave_out("F3", f"{every}; choose one with a sparser graph, such as ring_six")
            return
        new = min(others)
        self._change_edge(new, 1.0)
        formation.announce_change()
        formation.neighbour_messages(formation.plant.step, self._senders)
        formation.states()
        self._responses.require_quiet(
            "F3", f"without the message of {self._name(new)}, from which there is a new edge"
        )
        for _ in range(round(ANSWER / QUIET)):
            formation.neighbour_messages(formation.plant.step, [new])
            if formation.spin(QUIET, self._responses.has_answered):
                break
        self._responses.require_answer("F3", f"there is a new edge from {self._name(new)}")
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
            self._responses.require_answer("F2", f"{name} is lost")
        formation.change([SatelliteRejoined(lost, None)])
        formation.announce_change()
        formation.neighbour_messages(formation.plant.step, self._senders)
        formation.states()
        self._responses.require_answer("F2", f"{name} has rejoined")
        formation.neighbour_messages(formation.plant.step, others)
        formation.states()
        self._responses.require_quiet("F2", f"without the message of {name}, which has rejoined")
        formation.neighbour_messages(formation.plant.step, [lost])
        self._responses.require_answer()

    def _own_loss(self) -> None:
        formation, require = self._formation, self._findings.require
        step, own = formation.plant.step, formation.index
        self._require_ready_at_most(1, "before its loss")
        formation.ready.clear()
        formation.change([SatelliteLost(own, f"{formation.name} is lost")], formation.commands[-1:])
        formation.announce_change()
        formation.spin(QUIET, self._has_left)
        formation.neighbour_messages(step, self._senders)
        formation.states()
        formation.spin(2.0 * QUIET, self._has_left)
        self._responses.require_none("L1", "though it is lost", step)
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
        checkpoint = formation.ready[-1].checkpoint
        sentence = f"NodeReady has checkpoint {checkpoint}, and it was lost at step {step}"
        require("L2", -1 <= checkpoint <= step, sentence)
        # Those of the process before are no messages of the one that rejoins.
        formation.commands.clear()
        formation.announcements.clear()
        # The plant publishes states of all satellites, also of those that are lost.
        for _ in range(3):
            formation.neighbour_messages(formation.plant.step, self._senders)
            formation.states()
            formation.advance()
        formation.spin(QUIET)
        for messages, what in ((formation.commands, "command"), (formation.announcements, "phase")):
            for message in messages:
                require("L3", False, f"a {what} for step {message.step} before the step of its return")
        while formation.plant.step < STEPS - 3:
            formation.advance()
        # While it is lost it may publish NodeReady again, once it reads that it is.
        formation.ready.clear()
        formation.change([SatelliteRejoined(own, None)])
        # On another topic the status may arrive after the state.
        formation.states()
        formation.spin(SHORTEST_QUIET)
        formation.announce_change()
        self._responses.require_phase("L3", f"no phase for step {formation.plant.step}, at which it rejoins")
        formation.neighbour_messages(formation.plant.step, self._senders)
        self._responses.require_answer("L3", "it has rejoined")

    def _end(self) -> None:
        formation, require = self._formation, self._findings.require
        while formation.plant.step < STEPS:
            formation.neighbour_messages(formation.plant.step, self._senders)
            formation.states()
            self._responses.require_answer()
        formation.neighbour_messages(STEPS, self._senders)
        formation.states()
        self._responses.require_quiet("X1", "for the state after the last step")
        self._require_ready_at_most(0, "after its return")
        formation.status(FormationStatus.FINISHED)
        if self._program.is_ours:
            code = self._program.exit_code(_END)
            sentence = f"its exit code is {code}" if code is not None else f"it goes on for {_END:g} s"
            require("X1", code == EXIT_DONE, f"after FINISHED {sentence}")
        else:
            gone = formation.spin(_END, lambda: not formation.node_is_there)
            require("X1", gone, f"after FINISHED it is there for {_END:g} s")

    # The node

    def _name(self, index: int) -> str:
        return self._formation.name_of(index)

    def _has_left(self) -> bool:
        """Whether the node that is lost has ended, or is ready to rejoin."""
        return bool(self._formation.ready) or self._program.exit_code(0.0) is not None
