# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The node of the plant: it integrates the motion of all satellites, and manages membership and steps."""

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rclpy.serialization import deserialize_message
from satform_msgs.msg import Command

from satform.common.name_list import listed
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import (
    INTERFACE_VERSION,
    NODE_READY,
    PLANT,
    RECORDER,
    RECORDER_WINDOW,
    Channel,
    array_window,
    channels,
    published_by,
    subscribed_by,
)
from satform.flight.compile import FormationPlan
from satform.membership.membership_manager import Change, MembershipManager
from satform.protocol.plant_steps import PlantSteps
from satform.protocol.status import OVER, FormationPhase
from satform_nodes.plant.formation_publishers import FormationPublishers
from satform_nodes.plant.group_endpoints import GroupPublishers, GroupSubscriptions
from satform_nodes.plant.message_watch import MessageWatch
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

_WATCHED_AFTER = 0.25
"""Part of a node's timeout after which a step that does not go on is watched."""

_MOST_WATCHED = 64
"""Satellites that are watched at most."""

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
    """Carries the plant; every formula is in `satform`, and every decision about steps in `satform.protocol`.

    Attributes:
        steps: of the flight.
        subscriptions: of the plant.
        clocked: whether the flight goes by the wall clock.
    """

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
        self.membership = MembershipManager(
            plan.membership, [RECORDER] if recorded else [], lockstep=not self.clocked
        )
        self.rejections = node.rejections
        self.names = self.membership.names
        groups = plan.groups
        # Names of the satellites of a group, by its name.
        self._members: dict[str, list[str]] = {}
        if groups is not None:
            for own, members in zip(groups.names, groups.members, strict=True):
                self._members[own] = [self.names[index] for index in members]
        self.start_timeout = start_timeout(plan)
        self._timeout = plan.timing.node_timeout
        self._awaited_since = 0.0
        self._pulse = 0
        self._next_heartbeat = 0.0
        self._next_progress = 0.0
        self._next_type_check = 0.0
        self._progress = FlightProgress(self.rejections)
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        table = channels(plan.topics)
        self.subscriptions = self._subscribe(executor, subscribed_by(PLANT, table))
        self.steps = PlantSteps(
            plan,
            self.membership,
            self.subscriptions.commands,
            self,
            recorded=recorded,
            recorder_needed=settings.recorder_needed,
            clocked=self.clocked,
            window=RECORDER_WINDOW if plan.groups is None else array_window(len(plan.names)),
            processor_clock=time.thread_time,
        )
        topics = published_by(PLANT, table)
        self._publishers: FormationPublishers = (
            PlantPublishers(node, plan, self.steps.plant, topics)
            if plan.groups is None
            else GroupPublishers(node, plan, self.steps.plant, topics, plan.groups)
        )
        self._endpoints = MatchedEndpoints(node)
        self.subscriptions.require_publishers(self._endpoints)
        if recorded:
            self.subscriptions.subscribe_recorder_progress(self._endpoints, self.steps.note_recorded)
        self._publishers.require_subscribers(self._endpoints, recorded=recorded)
        self._health = Health(node, "plant: formation", "plant", self._condition, self._now)
        if recorded:
            self._endpoints.require_subscribers(self._health.publisher, [RECORDER])
        executor.add_periodic(self._health.due)
        self.watch = MessageWatch(node, executor, plan.topics, self.rejections, self._stamps)
        self._stalled_in = self.steps.progress
        self._stalled_since = 0.0
        self._services = FormationServices(node, self.steps)
        self.reconfiguration = ReconfigurationServer(node, self.steps, executor)
        executor.add_periodic(self._run_periodic)
        if plan.external:
            # A program that knows no scenario reads names and graph from it before it can be ready.
            self.publish_status(FormationPhase.WAITING, "")

    def _subscribe(
        self, executor: StepExecutor, channels: list[Channel]
    ) -> PlantSubscriptions | GroupSubscriptions:
        """Subscribe to the commands of each satellite, or of each group."""
        handlers = (self.rejections, self._on_command, self._on_ready, self._on_other_interface)
        if self.plan.groups is None:
            return PlantSubscriptions(
                self.node,
                executor,
                channels,
                self.membership,
                *handlers,
                self._stamps,
                clocked=self.clocked,
            )
        return GroupSubscriptions(
            self.node, executor, channels, self.membership, self.plan.groups, *handlers, self._stamps
        )

    @property
    def flown(self) -> bool:
        """Whether the last step has been taken."""
        return self.steps.flown

    @property
    def over(self) -> bool:
        """Whether there is nothing more to be done, for whatever reason."""
        return self.steps.over

    @property
    def stands_still(self) -> bool:
        """Whether no step is to be taken at present."""
        return self.steps.stands_still

    def tick(self) -> None:
        """On the wall clock: take the next step with the commands that there are."""
        self.steps.tick()

    def progress(self) -> tuple[int, ...]:
        """What changes as long as the flight goes on."""
        return (*self.steps.progress, self._pulse)

    # Before the flight

    def all_ready(self) -> bool:
        """Whether all nodes have published that they are ready, and their endpoints are discovered."""
        ready = not self.membership.unready and self._endpoints.complete()
        now = time.monotonic()
        if self.plan.external and self.steps.aborted is None and (ready or now >= self._next_type_check):
            self._next_type_check = now + _TYPE_CHECK_PERIOD
            self._require_same_types()
        return ready

    def _require_same_types(self) -> None:
        """End the start of the flight if an external satellite was built with other messages."""
        found = changed_types(self.node, channels(self.plan.topics), self.plan.external)
        if found:
            self.steps.aborted = (list(dict.fromkeys(each.node for each in found)), found[0].sentence)

    def not_ready(self) -> tuple[list[str], str]:
        """Nodes that keep the flight from beginning, each with the reason."""
        unready = self.membership.unready
        found = shortcomings(
            self.node, channels(self.plan.topics), recorded=self.steps.recorded, external=self.plan.external
        )
        who = list(dict.fromkeys(each.node for each in found)) or unready or [PLANT]
        reason = f"not ready within {self.start_timeout:g} s: {in_words(found, unready or [PLANT])}"
        rejected = [key for key in self.rejections.sentences() if key.startswith(NODE_READY)]
        return who, "; ".join([reason, *(f"rejected messages: {sentence}" for sentence in rejected)])

    def begin(self) -> None:
        """Publish the first states; everything else follows from the answers."""
        self.subscriptions.begin()
        self.steps.begin()

    # What arrives

    def _on_command(self, index: int, data: bytes) -> None:
        self.steps.take_command(index, data)

    def _on_ready(self, name: str, checkpoint: int) -> None:
        for own in self._members.get(name, (name,)):
            self.steps.note_ready(own, checkpoint)

    def _on_other_interface(self, name: str, version: int) -> None:
        """Before the flight: end it, since a node follows another version of the interface."""
        if not self.steps.flying and self.steps.aborted is None:
            rules = f"version {version} of the interface, and these nodes by version {INTERFACE_VERSION}"
            self.steps.aborted = ([name], f"{name} was written by {rules} (docs/interface.md)")

    # What the steps ask for

    def publish_states(self, number: int) -> None:
        """Publish the states of the present step, with the number of the formation's version."""
        self._publishers.publish_states(number)

    def retransmit_states(self, satellites: Iterable[int]) -> None:
        """Publish the states of the present step to some satellites again."""
        self._publishers.retransmit_states(satellites)

    def republish_status(self) -> None:
        """Publish the last status again."""
        self._publishers.republish_status()

    def publish_change(self, phase: FormationPhase, change: Change, final_commands: Sequence[bytes]) -> None:
        """Publish a change of the formation, and report it to the supervisor."""
        formation, step = self.membership.formation, self.membership.step
        self.subscriptions.allow_replacement(change.lost)
        for index in change.lost:
            self.report.send("loss", who=self.names[index], step=step, reason=formation.reason)
        for event in change.rejoined:
            self.report.send("return", who=self.names[event.satellite], step=step)
        final = [deserialize_message(data, Command) if data else Command() for data in final_commands]
        self._publishers.publish_status(formation, phase, formation.reason, change, final)
        self._health.changed()

    def step_begun(self) -> None:
        """Note when the step began."""
        self._awaited_since = time.monotonic()

    def step_taken(self) -> None:
        """Publish what follows from a step, and report progress."""
        self._publishers.publish_propulsion()
        self.reconfiguration.after_step()
        now = time.monotonic()
        if now >= self._next_progress:
            self._next_progress = now + _PROGRESS_PERIOD
            self.report.send_if_ready("step", step=self.steps.plant.step)

    def recorder_lost(self, reason: str) -> None:
        """Report that the flight goes on without a recorder."""
        self.node.get_logger().warning(f"{reason}; the flight continues without a recorder")
        self.report.send("loss", who=RECORDER, step=self.steps.plant.step, reason=reason)

    def read_loss_reports(self) -> None:
        """Take in which processes have ended, as the supervisor has reported it so far."""
        for event in self.report.received():
            if event["event"] == "lost":
                self._lose([event["who"]], event["reason"])

    def _lose(self, names: list[str], reason: str) -> None:
        """Go on without some nodes; without a group the flight ends."""
        groups = [name for name in names if name in self._members]
        if groups:
            self.steps.aborted = (groups, reason)
        else:
            self.steps.lose(names, reason)

    def publish_status(self, phase: FormationPhase, reason: str) -> None:
        """Publish the phase of the formation, from which step on it holds, and why."""
        steps = self.steps
        self._publishers.publish_status(self.membership.formation, phase, reason, early_end=steps.early_end)
        if phase not in OVER:
            return
        steps.flying = False
        self.reconfiguration.end(reason or "its last step has been taken")
        # The last messages would be lost when the plant ends; those that a recorder has stored are delivered.
        recorded = phase == FormationPhase.FINISHED and steps.recorded
        present = self.membership.everyone - {self.names[index] for index in self.membership.lost}
        if not self._publishers.wait_for_acknowledgement(present, recorded=recorded):
            self.node.get_logger().warning("not every node has acknowledged the final status")

    # By the wall clock

    def _run_periodic(self) -> None:
        """Outside of a step: read the supervisor's events, and publish the status while paused."""
        self.read_loss_reports()
        waits = self.membership.awaited and time.monotonic() - self._awaited_since < self.start_timeout
        if (self.steps.paused and self.membership.open) or waits:
            self._pulse += 1
            now = time.monotonic()
            if now >= self._next_heartbeat:
                # A node that receives nothing would take the plant for lost.
                self._next_heartbeat = now + _HEARTBEAT_PERIOD
                self._publishers.republish_status()

        if self.watch.step is not None and self.steps.progress != self._stalled_in:
            self.watch.end()

    def retransmit(self) -> None:
        """Publish the last messages again, and after a while watch what satellites publish."""
        self.steps.retransmit()
        progress, now = self.steps.progress, time.monotonic()
        if progress != self._stalled_in:
            self._stalled_in, self._stalled_since = progress, now
        elif self.watch.step is None and now - self._stalled_since > _WATCHED_AFTER * self._timeout:
            senders = self.steps.awaited_senders()
            if self.plan.groups is None and len(senders) <= _MOST_WATCHED:
                self.watch.begin(senders, self.membership.step)

    def end_waiting(self) -> None:
        """Go on without the nodes because of which the present step has not gone on within the timeout."""
        if isinstance(self.subscriptions, GroupSubscriptions):
            missing = self.subscriptions.missing_groups
            if missing:
                lost = self.subscriptions.unresponsive(missing, self._timeout) or missing
                self._lose(lost, f"no answer within {self._timeout:g} s from {listed(lost)}")
                return
        received = {self.names[satellite] for satellite in self.watch.received_from}
        unresponsive = self.subscriptions.unresponsive(self.steps.missing(), self._timeout)
        silent = [name for name in unresponsive if name not in received]
        unsent = dict(self.watch.unsent)
        self.watch.end()
        if unsent and silent in ([], [RECORDER]):
            self.steps.lose_without_message(unsent, self._timeout)
        else:
            self.steps.end_waiting(silent, self._timeout, self.start_timeout)

    def _now(self) -> tuple[int, int]:
        """Simulated time, as a stamp."""
        return self._stamps.at(self.steps.plant.step)

    def _condition(self) -> Condition:
        lost_at, step = self.membership.formation.lost_at, self.steps.plant.step
        lost = {self.names[index]: step - lost_at[index] for index in self.membership.lost}
        return self._progress.condition(step, lost)

    def check_rejoin_timeout(self) -> None:
        """End the flight when a satellite that the scenario brings back has been awaited for too long."""
        if self.membership.awaited and time.monotonic() - self._awaited_since > self.start_timeout:
            missing = self.steps.missing()
            self.steps.aborted = (
                missing,
                f"{listed(missing)} has not rejoined within {self.start_timeout:g} s",
            )
