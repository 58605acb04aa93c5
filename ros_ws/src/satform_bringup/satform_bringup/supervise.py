"""The life of a formation's processes: started together, watched, and ended by their own handles."""

import selectors
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from satform.scenario import Scenario
from satform_bringup import BAG_FOLDER, LOG_FOLDER, SCENARIO_FILE, discovery, nursery
from satform_bringup.domain import own_domain
from satform_bringup.processes import NodeProcess, processes

FAREWELL = 15.0
"""Wall-clock time that processes have to end once the flight is over, s."""

_LOOK = 0.1
"""Wall-clock time between two looks for signals, s."""


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
        lost: names of the processes that ended too early or were silent for too long.
        reason: why the flight ended early; empty when it did not.
        stopped: whether it was ended by Ctrl-C or SIGTERM.
        bag: folder of the bag; None when nothing was recorded.
        messages: in the bag.
        missed: sentences about messages that did not reach the bag.
    """

    steps: int
    seconds: float
    start_seconds: float
    plant_seconds: float
    satellite_seconds: dict[str, float]
    memory: dict[str, int]
    domain: int
    lost: tuple[str, ...]
    reason: str
    stopped: bool
    bag: Path | None
    messages: int
    missed: tuple[str, ...]


def fly(
    scenario: Scenario,
    out: Path,
    *,
    record: bool,
    progress: Callable[[int, int], None],
    group: int = 1,
    variables: Mapping[str, str] | None = None,
) -> Flight:
    """Fly a scenario as a plant, a process for each satellite and a recorder, in lockstep over DDS.

    Args:
        scenario: what to fly.
        out: existing folder; gets the scenario as every node reads it, the bag and the nodes' logs.
        record: whether to record a bag.
        progress: called now and then with the steps flown and the steps to fly.
        group: how many satellites share a process; they talk over DDS all the same.
        variables: more of the processes' environment.

    Returns:
        How it went, also when a process was lost. No process is left behind in any case.

    Raises:
        OSError: the folder cannot be written to, or a process cannot be started.
        RuntimeError: there is no free domain, or there are too many processes for one machine.
    """
    scenario_file = out / SCENARIO_FILE
    bag = out / BAG_FOLDER if record else None
    with _asked_to_stop() as signals, own_domain() as domain:
        scenario_file.write_text(scenario.to_json(), encoding="utf-8")
        watch = _Watch(scenario, signals, progress)
        try:
            nodes = processes(scenario, scenario_file, bag, group)
            given = {**discovery.variables(len(nodes), out), **(variables or {})}
            watch.start(nodes, out / LOG_FOLDER, domain, given)
            watch.until_over()
        finally:
            watch.end_all()
        return watch.flight(domain, bag)


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
        name: of its node.
        process: its handle.
        pipe: on which it reports.
        log: what it prints.
    """

    name: str
    process: BaseProcess
    pipe: Connection
    log: Path


@dataclass
class _Watch:
    scenario: Scenario
    signals: _Signals
    progress: Callable[[int, int], None]
    running: dict[str, _Running] = field(default_factory=dict)
    selector: selectors.BaseSelector = field(default_factory=selectors.DefaultSelector)
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

    def start(self, nodes: list[NodeProcess], logs: Path, domain: int, variables: Mapping[str, str]) -> None:
        """Start all processes, each with a pipe for its reports and a file for its words."""
        logs.mkdir(parents=True, exist_ok=True)
        self.begun = time.monotonic()
        for node in nodes:
            log = logs / f"{node.name}.log"
            process, pipe = nursery.start(node.executable, node.arguments(), domain, log, variables)
            entry = _Running(node.name, process, pipe, log)
            self.running[node.name] = entry
            self.selector.register(process.sentinel, selectors.EVENT_READ, (entry, self._on_exit))
            self.selector.register(pipe, selectors.EVENT_READ, (entry, self._on_report))

    def until_over(self) -> None:
        """Watch until every process has ended, or those that do not end in time are to be ended."""
        told = False
        while self.running:
            for key, _ in self.selector.select(_LOOK):
                entry, handle = key.data
                # The one before may have done away with this one's process.
                if entry.name in self.running:
                    handle(entry)
            if self.signals.count >= 2:
                return
            if self.signals.count == 1 and not told:
                told = self.stopped = True
                self.reason = self.reason or "stopped by a signal"
                self._end_flight()
            if self.over_since is not None and time.monotonic() - self.over_since > FAREWELL:
                return

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

    def _on_event(self, event: dict[str, Any]) -> None:
        match event["event"]:
            case "flying":
                self.flying_since = time.monotonic()
            case "step" | "stopped":
                self.steps = event["step"]
                self.progress(self.steps, self.scenario.timing.steps)
            case "finished":
                self.finished = event
                self.steps = event["step"]
                self.over_since = time.monotonic()
            case "lost":
                self.steps = event["step"]
                if not self.lost:
                    self.lost, self.reason = event["who"], event["reason"]
            case "satellite":
                self.busy[event["node"]] = event["busy"]
            case "memory":
                self.memory[event["process"]] = event["bytes"]
            case "recorded":
                self.recorded = event
                missed = event["missed"]
                if not (missed or event["complete"]) and self.finished:
                    event["missed"] = ["the bag does not hold every message of the flight"]

    def _on_exit(self, entry: _Running) -> None:
        # What it reported last may still be in the pipe.
        while entry.pipe in self.selector.get_map():
            self._on_report(entry)
        entry.process.join()
        code = entry.process.exitcode or 0
        self._forget(entry)
        if code and self.over_since is None:
            self._note_loss(entry, code)
            self._end_flight()
        if entry.name == "plant" and self.over_since is None:
            # It has told everyone that the flight is over, and why.
            self.over_since = time.monotonic()

    def _note_loss(self, entry: _Running, code: int) -> None:
        """Remember the process whose end came first; those that end because of it are no losses."""
        if self.lost:
            return
        self.lost.append(entry.name)
        how = f"was ended by signal {-code}" if code < 0 else f"ended with exit code {code}"
        last = entry.log.read_text(errors="replace").strip().splitlines()[-1:] or ["it printed nothing"]
        self.reason = self.reason or f"{entry.name} {how} after step {self.steps}: {last[0]}"

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
            reason=self.reason,
            stopped=self.stopped,
            bag=bag,
            messages=self.recorded.get("messages", 0),
            missed=tuple(self.recorded.get("missed", ())),
        )
