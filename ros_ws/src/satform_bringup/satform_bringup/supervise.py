"""The life of a formation's processes: started together, watched, and ended by their own handles."""

import json
import selectors
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from satform.exit_codes import EXIT_BAD_INPUT
from satform.faults import SatelliteLostSpec
from satform.formation import Lost, planned
from satform.scenario import Scenario
from satform.scenario.hosts import HostSpec
from satform_bringup import (
    BAG_FOLDER,
    CHECKPOINT_FOLDER,
    LOG_FOLDER,
    PROCESSES_FILE,
    SCENARIO_FILE,
    discovery,
    leftovers,
    nursery,
    security,
)
from satform_bringup.peers import flight_domain, step_told, variables
from satform_bringup.processes import NodeProcess, processes
from satform_bringup.under_way import described

_STANDSTILL = 2.0
"""Wall-clock time for which all that are left have to have been stopped before they are given up, s."""

FAREWELL = 15.0
"""Wall-clock time that processes have to end once the flight is over, s."""

CHECKPOINT_STEPS = 100
"""Steps between two checkpoints where satellites are restarted and the scenario does not say."""

MOST_RESTARTS = 10
"""How often one process is started again at most."""

_LOOK = 0.1
"""Wall-clock time between two looks for signals, s."""


@dataclass(frozen=True)
class Loss:
    """A satellite or the recorder is no longer there.

    Attributes:
        name: of its node.
        step: first step without it.
        reason: in words.
        planned: whether the scenario says so.
    """

    name: str
    step: int
    reason: str
    planned: bool


@dataclass(frozen=True)
class Return:
    """A satellite takes part again.

    Attributes:
        name: of its node.
        step: first step with it.
        seconds: wall-clock time since its loss, s.
    """

    name: str
    step: int
    seconds: float


@dataclass(frozen=True)
class Policy:
    """What is done about losses, and how time passes.

    Attributes:
        restart: whether a satellite that is lost is started again.
        without_recorder: whether the flight goes on when the recorder is lost.
        rate: simulated seconds in each second of the wall clock; 0 for lockstep.
    """

    restart: bool = False
    without_recorder: bool = False
    rate: float = 0.0


@dataclass(frozen=True)
class Flight:
    """How a flight over DDS went.

    Attributes:
        steps: steps flown.
        seconds: wall-clock time from the first step to the last.
        start_seconds: wall-clock time from the start of the first process to the first step.
        plant_seconds: of these, the plant's own computation.
        satellite_seconds: of these, each satellite's own computation.
        memory: largest resident memory of each process with satellites, by its first satellite, bytes.
        domain: DDS domain in which it was flown.
        lost: names of the processes that ended too early or were silent for too long, though the scenario
            does not say so.
        losses: every satellite or recorder without which the flight went on, planned or not.
        returns: every satellite that came back.
        reason: why the flight ended early; empty when it did not.
        stopped: whether it was ended by Ctrl-C or SIGTERM.
        bag: folder of the bag; None when nothing was recorded.
        messages: in the bag.
        missed: sentences about messages that did not reach the bag.
        punctuality: of a flight on the wall clock: the plant's figures, and each satellite's by its name.
    """

    steps: int
    seconds: float
    start_seconds: float
    plant_seconds: float
    satellite_seconds: dict[str, float]
    memory: dict[str, int]
    domain: int
    lost: tuple[str, ...]
    losses: tuple[Loss, ...]
    returns: tuple[Return, ...]
    reason: str
    stopped: bool
    bag: Path | None
    messages: int
    missed: tuple[str, ...]
    punctuality: dict[str, Any]


def fly(
    scenario: Scenario,
    out: Path,
    *,
    record: bool,
    progress: Callable[[int, int], None],
    group: int = 1,
    policy: Policy | None = None,
    display: bool = False,
    host: HostSpec | None = None,
    keystore: Path | None = None,
    environment: Mapping[str, str] | None = None,
) -> Flight:
    """Fly a scenario as a plant, a process for each satellite and a recorder, in lockstep over DDS.

    Args:
        scenario: what to fly.
        out: existing folder; gets the scenario as every node reads it, the bag and the nodes' logs.
        record: whether to record a bag.
        progress: called now and then with the steps flown and the steps to fly.
        group: how many satellites share a process; they talk over DDS all the same.
        policy: what is done about losses; by default nothing is restarted and the recorder is needed.
        display: whether to show the flight on topics that RViz and Foxglove draw.
        host: of the scenario's hosts the one that this machine is; None when it runs everything.
        keystore: with the nodes' keys; None to fly unsecured.
        environment: more variables for the processes.

    Returns:
        How it went, also when a process was lost. No process is left behind in any case.

    Raises:
        OSError: the folder cannot be written to, or a process cannot be started.
        RuntimeError: there is no free domain, or there are too many processes for one machine.
    """
    scenario_file = out / SCENARIO_FILE
    bag = out / BAG_FOLDER if record else None
    policy = policy or Policy()
    if policy.restart and scenario.checkpoint_period is None:
        period = CHECKPOINT_STEPS * scenario.timing.step
        scenario = scenario.model_copy(update={"checkpoint_period": period})
    checkpoints = out / CHECKPOINT_FOLDER if scenario.checkpoint_period is not None else None
    nodes = processes(
        scenario,
        scenario_file,
        bag,
        group,
        checkpoints,
        not policy.without_recorder,
        policy.rate,
        display=display,
        host=host,
    )
    if keystore is not None:
        nodes = security.secured(nodes)
    with (
        _asked_to_stop() as signals,
        flight_domain(scenario, host) as domain,
        described(domain, scenario.name, out),
    ):
        if keystore is not None:
            security.require_secured(keystore, nodes, domain)
        given = _environment(scenario, out, len(nodes), host, keystore) | dict(environment or {})
        scenario_file.write_text(scenario.to_json(), encoding="utf-8")
        watch = _Watch(scenario, signals, progress, policy, out / LOG_FOLDER, domain, given)
        told = {"domain": domain, "environment": given, "nodes": [asdict(node) for node in nodes]}
        (out / PROCESSES_FILE).write_text(json.dumps(told))
        try:
            watch.start(nodes)
            watch.until_over()
        finally:
            watch.end_all()
        return watch.flight(domain, bag if host is None or "recorder" in host.runs else None)


def _environment(
    scenario: Scenario, out: Path, processes: int, host: HostSpec | None, keystore: Path | None
) -> dict[str, str]:
    """What the processes' middleware needs to be told."""
    if host is None:
        told = discovery.variables(processes, len(scenario.satellites), out)
    else:
        told = variables(scenario, host, out)
    return told if keystore is None else told | security.variables(keystore)


@dataclass
class _Signals:
    count: int = 0


@contextmanager
def _asked_to_stop() -> Iterator[_Signals]:
    """Count SIGINT, SIGTERM and SIGHUP instead of dying from them, where this thread may."""
    signals = _Signals()

    def _count(_number: int, _frame: Any) -> None:
        signals.count += 1

    try:
        before = {
            number: signal.signal(number, _count) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
        }
    except ValueError:
        # Not in the main thread: whoever runs that one handles the signals.
        before = {}
    try:
        yield signals
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


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


@dataclass
class _Watch:
    scenario: Scenario
    signals: _Signals
    progress: Callable[[int, int], None]
    policy: Policy
    logs: Path
    domain: int
    environment: dict[str, str]
    losses: list[Loss] = field(default_factory=list)
    lost_since: dict[str, float] = field(default_factory=dict)
    returns: list[Return] = field(default_factory=list)
    restarts: Counter[str] = field(default_factory=Counter)
    killed: set[str] = field(default_factory=set)
    satellites: dict[str, dict[str, Any]] = field(default_factory=dict)
    running: dict[str, _Running] = field(default_factory=dict)
    selector: selectors.BaseSelector = field(default_factory=selectors.DefaultSelector)
    sees_plant: bool = True
    begun: float = 0.0
    flying_since: float | None = None
    steps: int = 0
    finished: dict[str, Any] | None = None
    busy: dict[str, float] = field(default_factory=dict)
    memory: dict[str, int] = field(default_factory=dict)
    recorded: dict[str, Any] = field(default_factory=dict)
    lost: list[str] = field(default_factory=list)
    reason: str = ""
    stopped: bool = False
    over_since: float | None = None

    def start(self, nodes: list[NodeProcess]) -> None:
        """Start all processes, each with a pipe for its reports and a file for its words."""
        self.logs.mkdir(parents=True, exist_ok=True)
        self.begun = time.monotonic()
        self.sees_plant = any(node.name == "plant" for node in nodes)
        for node in nodes:
            self._start(node)

    def _start(self, node: NodeProcess) -> None:
        times = self.restarts[node.name]
        log = self.logs / (f"{node.name}.{times}.log" if times else f"{node.name}.log")
        process, pipe = nursery.start(node.executable, node.arguments(), self.domain, log, self.environment)
        entry = _Running(node, process, pipe, log)
        self.running[node.name] = entry
        self.selector.register(process.sentinel, selectors.EVENT_READ, (entry, self._on_exit))
        self.selector.register(pipe, selectors.EVENT_READ, (entry, self._on_report))

    def until_over(self) -> None:
        """Watch until every process has ended, or those that do not end in time are to be ended."""
        told, moved = False, time.monotonic()
        while any(not entry.node.optional for entry in self.running.values()):
            for key, _ in self.selector.select(_LOOK):
                entry, handle = key.data
                # The one before may have done away with this one's process.
                if self.running.get(entry.name) is entry:
                    handle(entry)
            if self.signals.count >= 2:
                return
            if self.signals.count == 1 and not told:
                told = self.stopped = True
                self.reason = self.reason or "stopped by a signal"
                self._end_flight()
            now = time.monotonic()
            moved = moved if self.over_since is not None and self._nobody_moves() else now
            if now - moved > _STANDSTILL or now - (self.over_since or now) > FAREWELL:
                return

    def _nobody_moves(self) -> bool:
        """Whether all that are left have been stopped by SIGSTOP or its like."""
        left = [entry for entry in self.running.values() if not entry.node.optional]
        return bool(left) and all(nursery.is_stopped(entry.process) for entry in left)

    def _end_flight(self) -> None:
        """Ask the plant to end the flight for everyone; without a plant or a first step, ask everyone."""
        if self.over_since is None:
            self.over_since = time.monotonic()
        plant = self.running.get("plant")
        asked = [plant] if plant and self.flying_since else list(self.running.values())
        for entry in asked:
            entry.process.terminate()

    def _on_report(self, entry: _Running) -> None:
        try:
            event = entry.pipe.recv()
        except (EOFError, OSError):
            self.selector.unregister(entry.pipe)
            return
        self._on_event(event)
        if not self.sees_plant:
            self.steps = max(self.steps, step_told(event, self.scenario.timing.steps))
        if event["event"] == "lost" and entry.name == "plant":
            # The flight is over because of it; others that end early may have been noted before.
            self.reason = self.reason or event["reason"]

    def _on_event(self, event: dict[str, Any]) -> None:
        match event["event"]:
            case "flying":
                self.flying_since = time.monotonic()
            case "step":
                self.steps = event["step"]
                self.progress(self.steps, self.scenario.timing.steps)
            case "finished" | "stopped":
                self._on_end(event)
            case "lost":
                self.steps = event["step"]
                if not self.lost:
                    self.lost, self.reason = event["who"], event["reason"]
            case "satellite":
                self.busy[event["node"]] = event["busy"]
                self.satellites[event["node"]] = event
            case "memory":
                self.memory[event["process"]] = event["bytes"]
            case "recorded":
                self.recorded = event
                missed = event["missed"]
                if not (missed or event["complete"]) and self.finished:
                    event["missed"] = ["the bag does not hold every message of the flight"]
            case _:
                self._on_absence(event)

    def _on_end(self, event: dict[str, Any]) -> None:
        """The plant has taken its last step, or was stopped by a signal or a service."""
        self.steps = event["step"]
        self.over_since = self.over_since or time.monotonic()
        if event["event"] == "finished":
            self.finished = event
            return
        if not self.reason:
            # By a service: a signal, or the loss that made an end of it, is known by now.
            self.stopped, self.reason = True, "stopped"
        self.progress(self.steps, self.scenario.timing.steps)

    def _on_absence(self, event: dict[str, Any]) -> None:
        """Someone is lost or back, and the flight goes on."""
        match event["event"]:
            case "killed":
                self.killed.add(event["node"])
            case "loss":
                self._note_absence(event["who"], event["step"], event["reason"])
            case "return":
                away = time.monotonic() - self.lost_since.pop(event["who"], time.monotonic())
                self.returns.append(Return(event["who"], event["step"], away))

    def _on_exit(self, entry: _Running) -> None:
        # What it reported last may still be in the pipe.
        while entry.pipe in self.selector.get_map():
            self._on_report(entry)
        entry.process.join()
        code = entry.process.exitcode or 0
        self._forget(entry)
        if entry.name == "plant":
            if code and self.over_since is None and not self.reason:
                self._note_loss(entry, code)
            if self.over_since is None:
                # It has told everyone that the flight is over, and why.
                self._end_flight()
        elif code and self.over_since is None and not entry.node.optional:
            self._go_on_without(entry, code)

    def _go_on_without(self, entry: _Running, code: int) -> None:
        """Tell the plant who is gone, and start it again where that is wanted."""
        if self.flying_since is None or "plant" not in self.running or code == EXIT_BAD_INPUT:
            self._note_loss(entry, code)
            self._end_flight()
            return
        if "plant" in self.lost:
            # Those that notice that the plant is silent end because of it.
            self._end_flight()
            return
        satellites = entry.node.parameters.get("satellites")
        names = satellites if isinstance(satellites, list) else [entry.name]
        # A satellite says so before the scenario has it killed.
        expected = self.killed.issuperset(names)
        self.killed.difference_update(names)
        if not expected:
            self.lost += [name for name in names if name not in self.lost]
        for name in names:
            self.lost_since.setdefault(name, time.monotonic())
            self._tell_plant(name, self._end_of(entry, code))
        if entry.name == "recorder" or not (expected or self.policy.restart):
            return
        wanted = self._comes_back(names) if expected else self.policy.restart
        if wanted and self.restarts[entry.name] < MOST_RESTARTS:
            self.restarts[entry.name] += 1
            # What it was doing when it was killed, it may never have let go of.
            leftovers.release(self.domain)
            self._start(entry.node)

    def _comes_back(self, names: list[str]) -> bool:
        return any(
            isinstance(fault, SatelliteLostSpec) and fault.satellite in names and fault.back is not None
            for fault in self.scenario.faults
        )

    def _tell_plant(self, name: str, reason: str) -> None:
        with suppress(OSError):
            # A plant that has gone away itself is noticed by its own end.
            self.running["plant"].pipe.send({"event": "lost", "who": name, "reason": reason})

    def _note_absence(self, name: str, step: int, reason: str) -> None:
        """Remember that the flight goes on without someone."""
        steps = planned(self.scenario).get(step, [])
        names = [satellite.name for satellite in self.scenario.satellites]
        expected = any(isinstance(event, Lost) and names[event.satellite] == name for event in steps)
        self.losses.append(Loss(name, step, reason, expected))
        self.lost_since.setdefault(name, time.monotonic())
        if not expected and name not in self.lost:
            self.lost.append(name)

    def _note_loss(self, entry: _Running, code: int) -> None:
        """Remember the process whose end ends the flight; those that end because of it are no losses."""
        if self.reason:
            return
        if entry.name not in self.lost:
            self.lost.append(entry.name)
        self.reason = self.reason or self._end_of(entry, code)

    def _end_of(self, entry: _Running, code: int) -> str:
        """How a process ended, in words."""
        how = f"was ended by signal {-code}" if code < 0 else f"ended with exit code {code}"
        last = entry.log.read_text(errors="replace").strip().splitlines()[-1:] or ["it printed nothing"]
        return f"{entry.name} {how} after step {self.steps}: {last[0]}"

    def _forget(self, entry: _Running) -> None:
        if entry.pipe in self.selector.get_map():
            self.selector.unregister(entry.pipe)
        self.selector.unregister(entry.process.sentinel)
        entry.pipe.close()
        entry.process.close()
        del self.running[entry.name]

    def end_all(self) -> None:
        """End what still runs: first asked, then forced; every process is waited for."""
        if self.signals.count < 2:
            self._end_with(BaseProcess.terminate, 3.0)
        self._end_with(BaseProcess.kill, FAREWELL)
        self.selector.close()

    def _end_with(self, end: Callable[[BaseProcess], None], patience: float) -> None:
        for entry in self.running.values():
            end(entry.process)
        until = time.monotonic() + patience
        for entry in list(self.running.values()):
            entry.process.join(max(0.0, until - time.monotonic()))
            if entry.process.exitcode is not None:
                self._forget(entry)

    def _punctuality(self, timing: dict[str, Any]) -> dict[str, Any]:
        if not timing:
            return {}
        kept = ("skipped", "age_mean", "age_largest", "processor")
        own = {name: {key: event[key] for key in kept} for name, event in self.satellites.items()}
        return {**timing, "satellites": own}

    def flight(self, domain: int, bag: Path | None) -> Flight:
        """How it went."""
        now = time.monotonic()
        since = self.flying_since or now
        done = self.finished or {}
        return Flight(
            steps=self.steps,
            seconds=done.get("seconds", now - since),
            start_seconds=since - self.begun,
            plant_seconds=done.get("busy", 0.0),
            satellite_seconds=self.busy,
            memory=self.memory,
            domain=domain,
            lost=tuple(self.lost),
            losses=tuple(self.losses),
            returns=tuple(self.returns),
            reason=self.reason,
            stopped=self.stopped,
            bag=bag,
            messages=self.recorded.get("messages", 0),
            missed=tuple(self.recorded.get("missed", ())),
            punctuality=self._punctuality(done.get("timing", {})),
        )
