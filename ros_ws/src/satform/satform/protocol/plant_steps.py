# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Steps of the plant: when states are published, when a step is complete, and what a loss or a pause does.

The node of the plant hands in what arrives, and publishes what it is asked to; it has the wall clock and DDS.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Protocol

from satform.common.name_list import listed
from satform.communication.topic_table import RECORDER, RECORDER_WINDOW
from satform.flight.command_timeout import held_steps
from satform.flight.compile import FormationPlan
from satform.flight.limits import LimitCheck
from satform.flight.plant import Plant
from satform.membership.formation import Event
from satform.membership.membership_manager import ALL_LOST, Change, Loss, MembershipManager
from satform.protocol.plant_commands import StepCommands
from satform.protocol.status import FormationPhase
from satform.record.early_end import EarlyEnd


class PlantOutput(Protocol):
    """What the steps of the plant ask of the node that carries them."""

    def publish_states(self, number: int) -> None:
        """Publish the states of the present step, with the number of the formation's version."""

    def retransmit_states(self, satellites: Iterable[int]) -> None:
        """Publish the states of the present step to some satellites again."""

    def publish_status(self, phase: FormationPhase, reason: str) -> None:
        """Publish the phase of the flight and why it is so."""

    def publish_change(self, phase: FormationPhase, change: Change, final_commands: Sequence[bytes]) -> None:
        """Publish a change of the formation, with the last command of each satellite that is lost now.

        A command is empty if a satellite has not commanded since it joined. From now on another process of a
        lost satellite may publish in its name.
        """

    def republish_status(self) -> None:
        """Publish the last status again."""

    def step_begun(self) -> None:
        """Note that a step begins."""

    def step_taken(self) -> None:
        """Publish what follows from a step that has just been taken."""

    def recorder_lost(self, reason: str) -> None:
        """Report that the flight goes on without a recorder."""

    def read_loss_reports(self) -> None:
        """Hand in with `PlantSteps.lose` which ends of processes the supervisor has reported so far."""


class PlantSteps:
    """The steps of a flight, as the plant takes them.

    Attributes:
        plan: of the flight's parts.
        plant: moves all satellites.
        membership: members and graph by step.
        commands: of the satellites.
        names: of the satellites.
        recorded: whether a recorder takes part, to be waited for.
        recorded_step: last step that is in the bag.
        flying: whether the flight has begun and not ended.
        aborted: the nodes because of which the flight ends, and why; None while it goes on.
        early_end: the quantity because of which it ends; None while it goes on.
        flown_steps: steps within the limits, once it ends early.
        stop_asked: whether the flight is to be stopped.
        busy_seconds: processor time of the plant's motion, s.
    """

    def __init__(
        self,
        plan: FormationPlan,
        membership: MembershipManager,
        commands: StepCommands,
        output: PlantOutput,
        *,
        recorded: bool,
        recorder_needed: bool = True,
        clocked: bool = False,
        window: int = RECORDER_WINDOW,
        processor_clock: Callable[[], float] = lambda: 0.0,
    ) -> None:
        """The flight has not begun.

        Args:
            plan: of the flight's parts.
            membership: members and graph by step.
            commands: of the satellites.
            output: publishes what follows.
            recorded: whether a recorder takes part, to be waited for.
            recorder_needed: whether the flight ends when the recorder is lost.
            clocked: whether the flight goes by the wall clock.
            window: steps that the plant may be ahead of the recorder.
            processor_clock: processor time of this thread, s.
        """
        self.plan = plan
        self.plant = Plant(plan.plant)
        self.membership = membership
        self.commands = commands
        self.names = membership.names
        self.recorded = recorded
        self.recorded_step = 0
        self.flying = False
        self.aborted: tuple[list[str], str] | None = None
        self.early_end: EarlyEnd | None = None
        self.flown_steps = 0
        self.stop_asked = False
        self.busy_seconds = 0.0
        self._output = output
        self._recorder_needed = recorder_needed
        self._clocked = clocked
        self._window = window
        self._processor_clock = processor_clock
        self._limits = LimitCheck(plan.limits)
        self._held_steps = held_steps(plan.timing.command_timeout, plan.timing.step)
        self._paused = False
        self._single_steps = 0

    @property
    def finished(self) -> bool:
        """Whether the last state has been published, and recorded if a recorder takes part."""
        return self.flown and (not self.recorded or self.recorded_step >= self.plan.timing.steps)

    @property
    def flown(self) -> bool:
        """Whether the last step has been taken."""
        return self.membership.over

    @property
    def last_step_taken(self) -> bool:
        """Whether no step follows in which something could take effect."""
        return self.membership.last_step_taken

    @property
    def over(self) -> bool:
        """Whether there is nothing more to be done, for whatever reason."""
        return self.finished or self.stop_asked or self.aborted is not None or self.early_end is not None

    @property
    def stands_still(self) -> bool:
        """Whether no step is to be taken at present."""
        return self.membership.open

    @property
    def paused(self) -> bool:
        """Whether steps are taken only when asked for."""
        return self._paused

    @property
    def paused_before(self) -> int | None:
        """The step before which a paused flight stands; None while a step is under way, or to be taken."""
        stands = self._paused and self.membership.open and not self._single_steps
        return self.membership.step if stands else None

    @property
    def waits_for_rejoin(self) -> bool:
        """Whether a satellite is awaited that the scenario brings back at this step."""
        return bool(self.membership.awaited)

    @property
    def progress(self) -> tuple[int, ...]:
        """What changes as long as the flight goes on."""
        membership = self.membership
        return (
            membership.step,
            len(membership.commanded),
            self.recorded_step,
            membership.formation.number,
        )

    def missing(self) -> list[str]:
        """Nodes whose messages the present step lacks."""
        membership = self.membership
        satellites = membership.awaited or not (membership.open or membership.over)
        return membership.missing if satellites else [RECORDER]

    def begin(self) -> None:
        """Publish the first states; everything else follows from the answers."""
        self.flying = True
        self._output.publish_status(FormationPhase.FLYING, "")
        if self._within_limits():
            self._begin_step()

    # Membership

    def lose(self, names: Iterable[str], reason: str) -> None:
        """Go on without some satellites, or end the flight if none is left or the recorder is needed.

        Args:
            names: of nodes that are lost.
            reason: of the loss, as text; published with the status.
        """
        for name in names:
            if name == RECORDER:
                self._lose_recorder(reason)
            elif name in self.names:
                self._lose(self.names.index(name), reason)
        self.advance_if_complete()

    def _lose(self, index: int, reason: str) -> None:
        self._apply_loss(self.membership.lose(index, reason), index)

    def _apply_loss(self, loss: Loss, index: int) -> None:
        self._publish_change(loss.change)
        if loss.end:
            self.aborted = ([self.names[index]], loss.end)

    def _lose_recorder(self, reason: str) -> None:
        if not self.recorded:
            return
        if self._recorder_needed:
            self.aborted = ([RECORDER], reason)
            return
        self.recorded = False
        self._output.recorder_lost(reason)
        self.publish_due_states()

    def _publish_change(self, change: Change | None) -> None:
        """Publish a change of the formation that holds from the present step on."""
        if change is None:
            return
        self.commands.change(change)
        phase = FormationPhase.PAUSED if self._paused else FormationPhase.FLYING
        final_commands = [self.commands.final_command(index) or b"" for index in change.lost]
        self._output.publish_change(phase, change, final_commands)

    def schedule_event(self, event: Event) -> int:
        """Take up an event for the next step; the step's number."""
        return self.membership.schedule(event)

    def phase(self, satellite: int) -> float | None:
        """What a satellite has announced as its phase for the present step, m; None if nothing."""
        return self.commands.announced_arc_length(satellite)

    def note_ready(self, name: str, checkpoint: int) -> None:
        """Note that a node is ready; in flight, that a satellite could rejoin.

        Args:
            name: of the node.
            checkpoint: step of the checkpoint that a satellite has; -1 for none.
        """
        self.membership.note_ready(name)
        if self.flying and name in self.names:
            # The end of a process is reported before the next one is started. Read after this offer, the
            # report of the former process would count against the present one.
            self._output.read_loss_reports()
            self.membership.request_rejoin(self.names.index(name), checkpoint)
            self.publish_due_states()

    def note_recorded(self, step: int) -> None:
        """Note that the bag has all messages up to a step."""
        self.recorded_step = max(self.recorded_step, min(step, self.membership.step))
        self.publish_due_states()

    # Steps

    def take_command(self, sender: int, data: bytes) -> None:
        """Take in a command message, and take the step if it was the last one that was missing.

        Args:
            sender: index of the satellite, or of the group of them, whose node has published it.
            data: the message.
        """
        if self.commands.take(sender, data):
            self.advance_if_complete()

    def _begin_step(self) -> None:
        """Let happen what is due at this step, and publish its states when nothing stands against it."""
        self._publish_change(self.membership.begin(self.plant.step))
        self._output.step_begun()
        self.publish_due_states()

    def publish_due_states(self) -> None:
        """Publish the states that are due, unless someone has to be waited for."""
        if not self.membership.open or self.early_end:
            return
        behind = self.plant.step - self.recorded_step
        if self.recorded and not self._clocked and behind > self._window:
            return
        if self._paused and not self._single_steps:
            return
        if not self.membership.rejoins_ready:
            return
        self._single_steps = max(0, self._single_steps - 1)
        change = self.membership.close()
        self._publish_change(change)
        if change is not None and change.lost and self.membership.is_empty:
            names = [self.names[index] for index in change.lost]
            self.aborted = (names, f"{self.membership.formation.reason}; {ALL_LOST}")
            return
        self._output.publish_states(self.membership.formation.number)

    def pause(self) -> int:
        """Take no more steps; the number of the first one that is not taken."""
        self._paused = True
        self._output.publish_status(FormationPhase.PAUSED, "paused")
        return self.membership.next_step

    def resume(self) -> int:
        """Take steps again; the number of the first one."""
        self._paused = False
        self._single_steps = 0
        self.commands.timing.begin()
        self._output.publish_status(FormationPhase.FLYING, "resumed")
        step = self.membership.next_step
        self.publish_due_states()
        return step

    def single_step(self) -> int:
        """Take one step and pause again, after those that have been asked for and are not taken yet.

        Returns:
            The number of the step that is taken.

        Raises:
            ValueError: the last step is taken already, or asked for.
        """
        step = self.membership.next_step + self._single_steps
        if step > self.plan.timing.steps:
            raise ValueError("the last step has been taken")
        if not self._paused:
            self.pause()
        self._single_steps += 1
        self.publish_due_states()
        return step

    def retransmit(self) -> None:
        """Publish the last messages again: the step does not go on, and one of them may have been lost."""
        # A node that has not received a change of the formation cannot answer.
        self._output.republish_status()
        if not (self.membership.open or self.membership.over):
            self._output.retransmit_states(self.membership.not_commanded)

    def awaited_senders(self) -> list[int]:
        """Satellites without whose messages for the present step it may not go on, ascending.

        Those that have not commanded and their in-neighbours; all that fly when the recorder is behind.
        """
        membership = self.membership
        flying, step = membership.flying, membership.step
        if self._clocked or membership.awaited:
            return []
        if membership.open or membership.over:
            return flying if self.recorded and not self._paused else []
        missing = membership.not_commanded
        graph = membership.formation.graph
        senders = {sender for satellite in missing for sender in graph.neighbours(satellite)}
        used = {sender for sender in senders if membership.formation.is_used_by_neighbours(sender, step)}
        return sorted({*missing, *(used & {*flying})})

    def lose_without_message(self, unsent: Mapping[int, str], timeout: float) -> None:
        """Go on without satellites that do not publish what others wait for, from the present step on.

        They may have commanded in this step; the command is dropped.

        Args:
            unsent: by the index of a satellite, the topic on which it has published nothing for this step.
            timeout: of a node, s.
        """
        step, membership = self.membership.step, self.membership
        for satellite, topic in unsent.items():
            self._lose(satellite, f"no {topic} for step {step} within {timeout:g} s")
        pending = membership.about_to_be_lost
        if pending:
            self._apply_loss(membership.lose_now(), pending[0])
        if self.aborted is None:
            self.publish_due_states()
            self.advance_if_complete()

    def end_waiting(self, unresponsive: Sequence[str], timeout: float, start_timeout: float) -> None:
        """Go on without the nodes that the present step lacks, since it has not gone on within the timeout.

        Args:
            unresponsive: those of the missing nodes that have not even retransmitted.
            timeout: of a node, s.
            start_timeout: of a satellite that the scenario brings back, s.
        """
        if self.waits_for_rejoin:
            missing = self.missing()
            self.aborted = (missing, f"{listed(missing)} has not rejoined within {start_timeout:g} s")
            return
        if not unresponsive and self.membership.about_to_be_lost:
            # Those that are missing wait for the last message of one that has commanded and ended.
            index = self.membership.about_to_be_lost[0]
            self._apply_loss(self.membership.lose_now(), index)
            self.advance_if_complete()
            return
        # If all missing nodes have retransmitted, none is at fault, but the step does not go on either.
        lost = list(unresponsive) or self.missing()
        self.lose(lost, f"no answer within {timeout:g} s from {listed(lost)}")

    def tick(self) -> None:
        """On the wall clock: take the next step with the commands that there are.

        A command that is too old is none any more.
        """
        timeout, timing = self.plan.timing.node_timeout, self.commands.timing
        for index in timing.count_missing(self.membership.flying, self.plant.step, timeout):
            self._lose(index, f"no answer within {timeout:g} s from {self.names[index]}")
        for index in timing.expired(self.membership.flying, self.plant.step, self._held_steps):
            self.commands.values[index] = 0.0
        if not self.over and self.plant.step < self.plan.timing.steps:
            self._advance()

    def advance_if_complete(self) -> None:
        """Take the step if all commands are there."""
        if (
            self._clocked
            or self.membership.open
            or not self.flying
            or self.aborted
            or not self.membership.complete
        ):
            return
        if self.plant.step < self.plan.timing.steps:
            self._advance()

    def _within_limits(self) -> bool:
        """Whether the states of the present step are finite and within the limits; else the flight ends."""
        self.early_end = self._limits.of_plant(self.plant)
        # The step that led to states beyond the limits is no part of the flight.
        self.flown_steps = max(0, self.plant.step - 1)
        return self.early_end is None

    def _commands_within_limits(self) -> bool:
        """Whether no satellite has computed anything that it must not fly by; else the flight ends."""
        step = self.plant.step
        self.early_end = self._limits.computed_end(self.commands.violations, step)
        self.flown_steps = step
        return self.early_end is None

    def _advance(self) -> None:
        if not self._commands_within_limits():
            return
        commands = self.commands.values
        # Processor time: wall-clock time would include other threads that run meanwhile.
        begin = self._processor_clock()
        self.plant.advance(commands[:, :3], commands[:, 3:])
        within = self._within_limits()
        self.busy_seconds += self._processor_clock() - begin
        if not within:
            return
        self._output.step_taken()
        self._begin_step()
