# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The node of the plant: it integrates the motion of all satellites, and manages membership and steps."""

import time
from collections.abc import Iterable
from dataclasses import dataclass

from satform_msgs.msg import FormationStatus

from satform.common.name_list import listed
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import (
    INTERFACE_VERSION,
    NODE_READY,
    PLANT,
    RECORDER,
    RECORDER_WINDOW,
    channels,
    published_by,
    subscribed_by,
)
from satform.flight.command_timeout import held_steps
from satform.flight.compile import FormationPlan
from satform.flight.limits import LimitCheck
from satform.flight.plant import Plant
from satform.membership.formation import Event
from satform.membership.membership_manager import ALL_LOST, Change, MembershipManager
from satform.record.early_end import EarlyEnd
from satform_nodes.plant.publishers import PlantPublishers
from satform_nodes.plant.reconfiguration import ReconfigurationServer
from satform_nodes.plant.services import FormationServices
from satform_nodes.plant.subscriptions import PlantSubscriptions
from satform_nodes.runtime.diagnostics import Condition, FlightProgress, Health
from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.runtime.lifecycle import start_timeout
from satform_nodes.runtime.supervisor_pipe import SupervisorPipe
from satform_nodes.transport.executor import StepExecutor
from satform_nodes.transport.matched_endpoints import MatchedEndpoints
from satform_nodes.transport.missing_endpoints import changed_types, in_words, shortcomings

_PROGRESS_PERIOD = 0.1
"""Wall-clock time between two reports of progress, s."""

_TYPE_CHECK_PERIOD = 0.5
"""Wall-clock time between two checks of the message types of external satellites before the flight, s."""

_HEARTBEAT_PERIOD = 0.5
"""Wall-clock time between two statuses while no step is taken, s; a fraction of any timeout."""


@dataclass(frozen=True)
class PlantSettings:
    """Settings of the plant's node at its start beside the scenario.

    Attributes:
        recorded: whether a recorder takes part, to be waited for.
        recorder_needed: whether the flight ends when the recorder is lost.
        rate: simulated seconds in each second of the wall clock; 0 for lockstep.
    """

    recorded: bool
    recorder_needed: bool
    rate: float


class PlantNode:
    """Carries the plant; every formula is in `satform`."""

    def __init__(
        self,
        node: FormationNode,
        executor: StepExecutor,
        plan: FormationPlan,
        settings: "PlantSettings",
        report: SupervisorPipe,
    ) -> None:
        recorded = settings.recorded
        self.clocked = settings.rate > 0.0
        self.node = node
        self.plan = plan
        self.report = report
        self.plant = Plant(plan.plant)
        self.membership = MembershipManager(
            plan.membership, [RECORDER] if recorded else [], lockstep=not self.clocked
        )
        self.recorded = recorded
        self.rejections = node.rejections
        self.busy_seconds = 0.0
        self.flying = False
        self.aborted: tuple[list[str], str] | None = None
        self.early_end: EarlyEnd | None = None
        self.flown_steps = 0
        self._limits = LimitCheck(plan.limits)
        self._held_steps = held_steps(plan.timing.command_timeout, plan.timing.step)
        self.stop_asked = False
        self.names = self.membership.names
        self.start_timeout = start_timeout(plan)
        self._settings = settings
        self._awaited_since = 0.0
        self._paused = False
        self._single_steps = 0
        self._pulse = 0
        self._next_heartbeat = 0.0
        self._next_progress = 0.0
        self._next_type_check = 0.0
        self._progress = FlightProgress(self.rejections)
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)

        table = channels(plan.topics)
        self._publishers = PlantPublishers(node, plan, self.plant, published_by(PLANT, table))
        self.subscriptions = PlantSubscriptions(
            node,
            executor,
            subscribed_by(PLANT, table),
            self.membership,
            self.rejections,
            self._advance_if_complete,
            self._on_ready,
            self._on_other_interface,
            self._stamps,
            clocked=self.clocked,
        )
        self._endpoints = MatchedEndpoints(node)
        self.subscriptions.require_publishers(self._endpoints)
        if recorded:
            self.subscriptions.subscribe_recorder_progress(self._endpoints, self._publish_due_states)
        self._publishers.require_subscribers(self._endpoints, recorded=recorded)
        self._health = Health(node, "plant: formation", "plant", self._condition, self._now)
        if recorded:
            self._endpoints.require_subscribers(self._health.publisher, [RECORDER])
        executor.add_periodic(self._health.due)
        self._services = FormationServices(node, self)
        self.reconfiguration = ReconfigurationServer(node, self, executor)
        executor.add_periodic(self._run_periodic)
        if plan.external:
            # A program that knows no scenario reads names and graph from it before it can be ready.
            self.publish_status(FormationStatus.WAITING, "")

    @property
    def finished(self) -> bool:
        """Whether the last state has been published, and recorded if a recorder takes part."""
        return self.flown and (
            not self.recorded or self.subscriptions.recorded_step >= self.plan.timing.steps
        )

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

    def progress(self) -> tuple[int, ...]:
        """What changes as long as the flight goes on."""
        membership = self.membership
        return (
            membership.step,
            len(membership.commanded),
            self.subscriptions.recorded_step,
            membership.formation.number,
            self._pulse,
        )

    def all_ready(self) -> bool:
        """Whether all nodes have published that they are ready, and their endpoints are discovered."""
        ready = not self.membership.unready and self._endpoints.complete()
        now = time.monotonic()
        if self.plan.external and self.aborted is None and (ready or now >= self._next_type_check):
            self._next_type_check = now + _TYPE_CHECK_PERIOD
            self._require_same_types()
        return ready

    def _require_same_types(self) -> None:
        """End the start of the flight if an external satellite was built with other messages."""
        found = changed_types(self.node, channels(self.plan.topics), self.plan.external)
        if found:
            self.aborted = (list(dict.fromkeys(each.node for each in found)), found[0].sentence)

    def not_ready(self) -> tuple[list[str], str]:
        """Nodes that keep the flight from beginning, each with the reason."""
        unready = self.membership.unready
        found = shortcomings(
            self.node, channels(self.plan.topics), recorded=self.recorded, external=self.plan.external
        )
        who = list(dict.fromkeys(each.node for each in found)) or unready or [PLANT]
        reason = f"not ready within {self.start_timeout:g} s: {in_words(found, unready or [PLANT])}"
        rejected = [key for key in self.rejections.sentences() if key.startswith(NODE_READY)]
        return who, "; ".join([reason, *(f"rejected messages: {sentence}" for sentence in rejected)])

    @property
    def waits_for_rejoin(self) -> bool:
        """Whether a satellite is awaited that the scenario brings back at this step."""
        return bool(self.membership.awaited)

    def missing(self) -> list[str]:
        """Nodes whose messages the present step lacks."""
        membership = self.membership
        satellites = membership.awaited or not (membership.open or membership.over)
        return membership.missing if satellites else [RECORDER]

    def begin(self) -> None:
        """Publish the first states; everything else follows from the answers."""
        self.flying = True
        self.subscriptions.begin()
        self.publish_status(FormationStatus.FLYING, "")
        if self._within_limits():
            self._begin_step()

    # Membership

    def lose(self, names: Iterable[str], reason: str) -> None:
        """Go on without some satellites, or end the flight if none is left or the recorder is needed.

        Args:
            names: of satellites, or `recorder`.
            reason: of the loss, as text; published with the status.
        """
        for name in names:
            if name == RECORDER:
                self._lose_recorder(reason)
            elif name in self.names:
                self._lose(self.names.index(name), reason)
        self._advance_if_complete()

    def _lose(self, index: int, reason: str) -> None:
        loss = self.membership.lose(index, reason)
        self._publish_change(loss.change)
        if loss.end:
            self.aborted = ([self.names[index]], loss.end)

    def _lose_recorder(self, reason: str) -> None:
        if not self.recorded:
            return
        if self._settings.recorder_needed:
            self.aborted = ([RECORDER], reason)
            return
        self.recorded = False
        self.node.get_logger().warning(f"{reason}; the flight continues without a recorder")
        self.report.send("loss", who=RECORDER, step=self.plant.step, reason=reason)
        self._publish_due_states()

    def _publish_change(self, change: Change | None) -> None:
        """Publish a change of the formation that holds from the present step on."""
        if change is None:
            return
        formation, step = self.membership.formation, self.membership.step
        self.subscriptions.take(change)
        for index in change.lost:
            self.report.send("loss", who=self.names[index], step=step, reason=formation.reason)
        for event in change.rejoined:
            self.report.send("return", who=self.names[event.satellite], step=step)
        phase = FormationStatus.PAUSED if self._paused else FormationStatus.FLYING
        final_commands = [self.subscriptions.final_command(index) for index in change.lost]
        self._publishers.publish_status(formation, phase, formation.reason, change, final_commands)
        self._health.changed()

    def schedule_event(self, event: Event) -> int:
        """Take up an event for the next step; the step's number."""
        return self.membership.schedule(event)

    def phase(self, satellite: int) -> float | None:
        """What a satellite has announced as its phase for the present step, m; None if nothing."""
        return self.subscriptions.announced_arc_length(satellite)

    def _on_ready(self, name: str, checkpoint: int) -> None:
        self.membership.note_ready(name)
        if self.flying and name in self.names:
            self.membership.request_rejoin(self.names.index(name), checkpoint)
            self._publish_due_states()

    def _on_other_interface(self, name: str, version: int) -> None:
        """Before the flight: end it, since a node follows another version of the interface."""
        if not self.flying and self.aborted is None:
            rules = f"version {version} of the interface, and these nodes by version {INTERFACE_VERSION}"
            self.aborted = ([name], f"{name} was written by {rules} (docs/interface.md)")

    # Steps

    def _begin_step(self) -> None:
        """Let happen what is due at this step, and publish its states when nothing stands against it."""
        self._publish_change(self.membership.begin(self.plant.step))
        self._awaited_since = time.monotonic()
        self._publish_due_states()

    def _publish_due_states(self) -> None:
        """Publish the states that are due, unless someone has to be waited for."""
        if not self.membership.open or self.early_end:
            return
        behind = self.plant.step - self.subscriptions.recorded_step
        if self.recorded and not self.clocked and behind > RECORDER_WINDOW:
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
        self._publishers.publish_states(self.membership.formation.number)

    def pause(self) -> int:
        """Take no more steps; the number of the first one that is not taken."""
        self._paused = True
        self.publish_status(FormationStatus.PAUSED, "paused")
        return self.membership.next_step

    def resume(self) -> int:
        """Take steps again; the number of the first one."""
        self._paused = False
        self._single_steps = 0
        self.subscriptions.command_monitor.begin()
        self.publish_status(FormationStatus.FLYING, "resumed")
        step = self.plant.step
        self._publish_due_states()
        return step

    def single_step(self) -> int:
        """Take one step and pause again; the number of the step that is taken."""
        step = self.membership.next_step
        if not self._paused:
            self.pause()
        self._single_steps += 1
        self._publish_due_states()
        return step

    @property
    def paused(self) -> bool:
        """Whether steps are taken only when asked for."""
        return self._paused

    def retransmit(self) -> None:
        """Publish the last messages again: the step does not go on, and one of them may have been lost."""
        # A node that has not received a change of the formation cannot answer.
        self._publishers.republish_status()
        if not (self.membership.open or self.membership.over):
            self._publishers.retransmit_states(self.membership.not_commanded)

    def _run_periodic(self) -> None:
        """Outside of a step: read the supervisor's events, and publish the status while paused."""
        for event in self.report.received():
            if event["event"] == "lost":
                self.lose([event["who"]], event["reason"])
        waits = self.membership.awaited and time.monotonic() - self._awaited_since < self.start_timeout
        if (self._paused and self.membership.open) or waits:
            self._pulse += 1
            now = time.monotonic()
            if now >= self._next_heartbeat:
                # A node that receives nothing would take the plant for lost.
                self._next_heartbeat = now + _HEARTBEAT_PERIOD
                self._publishers.republish_status()

    def _now(self) -> tuple[int, int]:
        """Simulated time, as a stamp."""
        return self._stamps.at(self.plant.step)

    def _condition(self) -> Condition:
        lost_at = self.membership.formation.lost_at
        lost = {self.names[index]: self.plant.step - lost_at[index] for index in self.membership.lost}
        return self._progress.condition(self.plant.step, lost)

    def publish_status(self, phase: int, reason: str) -> None:
        """Publish the phase of the formation, from which step on it holds, and why."""
        self._publishers.publish_status(self.membership.formation, phase, reason, early_end=self.early_end)
        if phase not in (FormationStatus.FINISHED, FormationStatus.ABORTED):
            return
        self.flying = False
        self.reconfiguration.end(reason or "its last step has been taken")
        # The last messages would be lost when the plant ends; those that a recorder has stored are delivered.
        recorded = phase == FormationStatus.FINISHED and self.recorded
        present = self.membership.everyone - {self.names[index] for index in self.membership.lost}
        if not self._publishers.wait_for_acknowledgement(present, recorded=recorded):
            self.node.get_logger().warning("not every node has acknowledged the final status")

    @property
    def stands_still(self) -> bool:
        """Whether no step is to be taken at present."""
        return self.membership.open

    def check_rejoin_timeout(self) -> None:
        """End the flight when a satellite that the scenario brings back has been awaited for too long."""
        if self.membership.awaited and time.monotonic() - self._awaited_since > self.start_timeout:
            missing = self.missing()
            self.aborted = (missing, f"{listed(missing)} has not rejoined within {self.start_timeout:g} s")

    def tick(self) -> None:
        """Take the next step with the commands that there are; one that is too old is none any more."""
        timeout = self.plan.timing.node_timeout
        for index in self.subscriptions.command_monitor.count_missing(
            self.membership.flying, self.plant.step, timeout
        ):
            self._lose(index, f"no answer within {timeout:g} s from {self.names[index]}")
        for index in self.subscriptions.command_monitor.expired(
            self.membership.flying, self.plant.step, self._held_steps
        ):
            self.subscriptions.commands[index] = 0.0
        if not self.over and self.plant.step < self.plan.timing.steps:
            self._advance()

    def _advance_if_complete(self) -> None:
        if (
            self.clocked
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
        self.early_end, self.flown_steps = (
            self._limits.computed_end(self.subscriptions.violations, step),
            step,
        )
        return self.early_end is None

    def _advance(self) -> None:
        if not self._commands_within_limits():
            return
        commands = self.subscriptions.commands
        # Processor time: wall-clock time would include other threads that run meanwhile.
        begin = time.thread_time()
        self.plant.advance(commands[:, :3], commands[:, 3:])
        within = self._within_limits()
        self.busy_seconds += time.thread_time() - begin
        if not within:
            return
        self._publishers.publish_propulsion()
        self.reconfiguration.after_step()
        self._begin_step()
        now = time.monotonic()
        if now >= self._next_progress:
            self._next_progress = now + _PROGRESS_PERIOD
            self.report.send_if_ready("step", step=self.plant.step)
