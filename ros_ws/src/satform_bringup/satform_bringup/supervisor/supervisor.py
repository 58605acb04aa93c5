# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Supervisor of the processes of a flight: starts, monitors, restarts and ends them by their handles.

If a satellite's process ends, the supervisor reports this to the plant, and restarts the process if the
scenario plans a rejoin or the policy allows it. The plant decides the loss: `satform_nodes.plant.flight_loop`
detects a satellite that does not answer within its timeout, and `satform.membership.membership_manager`
removes a lost satellite from the formation and takes a rejoined one in.
"""

import os
import select
import selectors
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path

from satform.common.exit_codes import EXIT_BAD_INPUT
from satform.flight.compile import FormationPlan
from satform.membership.formation import rejoins_after
from satform_bringup.deployment.multi_host_discovery import step_reported
from satform_bringup.deployment.node_processes import NodeProcess
from satform_bringup.supervisor import process_server
from satform_bringup.supervisor.flight import Policy
from satform_bringup.supervisor.flight_reports import FlightReports
from satform_nodes.runtime.signals import StopRequest

PROCESS_SERVER = "process server"
"""Name of the process server among the lost processes."""

_STANDSTILL = 2.0
"""Wall-clock time for which all remaining processes have to be suspended before they are ended, s."""

SHUTDOWN_TIMEOUT = 15.0
"""Wall-clock time that processes have to end once the flight is over, s."""

MOST_RESTARTS = 10
"""How often one process is started again at most."""

_LOOK = 0.1
"""Wall-clock time between two looks for signals, s."""


@dataclass
class _Running:
    """A started process.

    Attributes:
        node: what it runs.
        process: its handle.
        pipe: on which it reports.
        log: what it prints.
    """

    node: NodeProcess
    process: BaseProcess
    pipe: Connection
    log: Path

    @property
    def name(self) -> str:
        """Name of the node, or of the group."""
        return self.node.name


class Supervisor:
    """Starts the processes of a flight, monitors them until it is over, and ends the remaining ones."""

    def __init__(
        self,
        plan: FormationPlan,
        signals: StopRequest,
        progress: Callable[[int, int], None],
        policy: Policy,
        logs: Path,
        domain: int,
        environment: dict[str, str],
    ) -> None:
        """Nothing has been started yet.

        Args:
            plan: of the flight's parts.
            signals: count up when the user asks to stop; after the second no process is waited for.
            progress: called now and then with the steps flown and the steps to fly.
            policy: what is done about losses.
            logs: folder for what each process prints; is made.
            domain: DDS domain of the flight.
            environment: variables for the processes.
        """
        self.reports = FlightReports(plan, progress, policy)
        self._plan = plan
        self._signals = signals
        self._policy = policy
        self._logs = logs
        self._domain = domain
        self._environment = environment
        self._restarts: Counter[str] = Counter()
        self._running: dict[str, _Running] = {}
        self._selector: selectors.BaseSelector = selectors.DefaultSelector()
        self._sees_plant: bool = True

    def start(self, nodes: list[NodeProcess]) -> None:
        """Start all processes, each with a pipe for its events and a log file."""
        self._logs.mkdir(parents=True, exist_ok=True)
        self.reports.begun = time.monotonic()
        self._sees_plant = any(node.name == "plant" for node in nodes)
        for node in nodes:
            self._start(node)

    def _start(self, node: NodeProcess) -> None:
        times = self._restarts[node.name]
        log = self._logs / (f"{node.name}.{times}.log" if times else f"{node.name}.log")
        # It exists even if the process ends before it prints anything.
        log.touch()
        process, pipe = process_server.start(
            node.executable, node.arguments(), self._domain, log, self._environment | node.environment
        )
        entry = _Running(node, process, pipe, log)
        self._running[node.name] = entry
        self._selector.register(process.sentinel, selectors.EVENT_READ, (entry, self._on_exit))
        self._selector.register(pipe, selectors.EVENT_READ, (entry, self._on_report))

    def until_over(self) -> None:
        """Monitor until every process has ended, or the timeout for their end has passed."""
        self._server = process_server.watch_server()
        try:
            self._until_over()
            self._note_server()
        finally:
            os.close(self._server)

    def _note_server(self, timeout: float = 0.0) -> None:
        """Note the death of the server of processes, at which the kernel asks all processes to end.

        What they report of it is the consequence, so it is looked at before each report.

        Args:
            timeout: for which it is waited for, s.
        """
        if PROCESS_SERVER not in self.reports.lost and select.select([self._server], [], [], timeout)[0]:
            self.reports.lost.insert(0, PROCESS_SERVER)
            sentence = f"the process server ended after step {self.reports.steps}, and with it all nodes"
            if not self._signals.count and self.reports.reason in ("", "stopped"):
                # The plant may have reported the kernel's signal before the server was gone altogether.
                self.reports.stopped, self.reports.reason = False, sentence
            self.reports.note_over()

    def _until_over(self) -> None:
        reported, moved = False, time.monotonic()
        while any(not entry.node.optional for entry in self._running.values()):
            for key, _ in self._selector.select(_LOOK):
                entry, handle = key.data
                # The one before may have done away with this one's process.
                if self._running.get(entry.name) is entry:
                    handle(entry)
            if self._signals.asked and not reported:
                reported = self.reports.stopped = True
                self.reports.reason = self.reports.reason or f"stopped by {self._signals.name}"
                self._end_flight()
            if self._signals.count >= 2:
                return
            now = time.monotonic()
            moved = moved if self.reports.over_since is not None and self._nobody_moves() else now
            if now - moved > _STANDSTILL or now - (self.reports.over_since or now) > SHUTDOWN_TIMEOUT:
                return

    def _nobody_moves(self) -> bool:
        """Whether all that are left have been stopped by SIGSTOP or its like."""
        left = [entry for entry in self._running.values() if not entry.node.optional]
        return bool(left) and all(process_server.is_stopped(entry.process) for entry in left)

    def _end_flight(self) -> None:
        """Ask the plant to end the flight; without a plant or a first step, ask all processes."""
        self.reports.note_over()
        plant = self._running.get("plant")
        asked = [plant] if plant and self.reports.flying_since else list(self._running.values())
        for entry in asked:
            entry.process.terminate()

    def _on_report(self, entry: _Running) -> None:
        self._note_server()
        try:
            event = entry.pipe.recv()
        except (EOFError, OSError):
            self._selector.unregister(entry.pipe)
            return
        self.reports.take(event)
        if not self._sees_plant:
            self.reports.steps = max(self.reports.steps, step_reported(event, self._plan.timing.steps))
        if event["event"] == "lost" and entry.name == "plant":
            # Nodes that receive this end with an exit code of their own.
            self.reports.note_over()
            # The flight is over because of it; others that end early may have been noted before.
            self.reports.reason = self.reports.reason or event["reason"]

    def _on_exit(self, entry: _Running) -> None:
        self._note_server()
        # What it reported last may still be in the pipe.
        while entry.pipe in self._selector.get_map():
            self._on_report(entry)
        entry.process.join()
        code = entry.process.exitcode or 0
        if code == process_server.NO_EXIT_CODE:
            # The kernel closes the files of a process that ends before it reports the end.
            self._note_server(SHUTDOWN_TIMEOUT)
        self._forget(entry)
        if entry.name == "plant":
            if code and self.reports.over_since is None and not self.reports.reason:
                self._note_loss(entry, code)
            if self.reports.over_since is None:
                # It has published that the flight is over, and why.
                self._end_flight()
        elif code and self.reports.over_since is None and not entry.node.optional:
            self._continue_without(entry, code)

    def _continue_without(self, entry: _Running, code: int) -> None:
        """Report a lost process to the plant, and restart it if the policy says so."""
        if self.reports.flying_since is None or "plant" not in self._running or code == EXIT_BAD_INPUT:
            self._note_loss(entry, code)
            self._end_flight()
            return
        if "plant" in self.reports.lost:
            # The nodes end by themselves after their timeout for the plant.
            self._end_flight()
            return
        satellites = entry.node.parameters.get("satellites")
        names = satellites if isinstance(satellites, list) else [entry.name]
        # A satellite reports this event before the scenario has it killed.
        expected = self.reports.killed.issuperset(names)
        self.reports.killed.difference_update(names)
        if not expected:
            self.reports.lost += [name for name in names if name not in self.reports.lost]
        for name in names:
            self.reports.lost_since.setdefault(name, time.monotonic())
            self._notify_plant(name, self._end_of(entry, code))
        if entry.name == "recorder" or not (expected or self._policy.restart):
            return
        wanted = self._rejoins(names) if expected else self._policy.restart
        if wanted and self._restarts[entry.name] < MOST_RESTARTS:
            self._restarts[entry.name] += 1
            self._start(entry.node)

    def _rejoins(self, names: list[str]) -> bool:
        """Whether the scenario brings one of these satellites back at some time."""
        plan = self._plan
        return any(
            rejoins_after(plan.membership.events, index, 0)
            for index, name in enumerate(plan.names)
            if name in names
        )

    def _notify_plant(self, name: str, reason: str) -> None:
        with suppress(OSError):
            # A plant that has gone away itself is noticed by its own end.
            self._running["plant"].pipe.send({"event": "lost", "who": name, "reason": reason})

    def _note_loss(self, entry: _Running, code: int) -> None:
        """Remember the process whose end ends the flight; those that end because of it are no losses."""
        if self.reports.reason:
            return
        if entry.name not in self.reports.lost:
            self.reports.lost.append(entry.name)
        self.reports.reason = self.reports.reason or self._end_of(entry, code)

    def _end_of(self, entry: _Running, code: int) -> str:
        """How a process ended, as text."""
        how = f"was ended by signal {-code}" if code < 0 else f"ended with exit code {code}"
        last = entry.log.read_text(errors="replace").strip().splitlines()[-1:] or ["it printed no output"]
        return f"{entry.name} {how} after step {self.reports.steps}: {last[0]}"

    def _forget(self, entry: _Running) -> None:
        if entry.pipe in self._selector.get_map():
            self._selector.unregister(entry.pipe)
        self._selector.unregister(entry.process.sentinel)
        entry.pipe.close()
        entry.process.close()
        del self._running[entry.name]

    def end_all(self) -> None:
        """End what still runs: first asked, then forced; every process is waited for."""
        if self._signals.count < 2:
            self._end_with(BaseProcess.terminate, 3.0)
        self._end_with(BaseProcess.kill, SHUTDOWN_TIMEOUT)
        self._selector.close()

    def _end_with(self, end: Callable[[BaseProcess], None], timeout: float) -> None:
        for entry in self._running.values():
            end(entry.process)
        until = time.monotonic() + timeout
        for entry in list(self._running.values()):
            entry.process.join(max(0.0, until - time.monotonic()))
            if entry.process.exitcode is not None:
                self._forget(entry)
