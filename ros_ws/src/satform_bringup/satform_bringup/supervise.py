"""The life of a formation's processes: started together, watched, and ended by their own handles."""

import json
import os
import selectors
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from ament_index_python.packages import get_package_prefix

from satform.scenario import Scenario
from satform_bringup.domain import own_domain
from satform_bringup.processes import PACKAGE, NodeProcess, processes

REPORT_VARIABLE = "SATFORM_REPORT_FD"

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
    domain: int
    lost: tuple[str, ...]
    reason: str
    stopped: bool
    bag: Path | None
    messages: int
    missed: tuple[str, ...]


def fly(scenario: Scenario, out: Path, *, record: bool, progress: Callable[[int, int], None]) -> Flight:
    """Fly a scenario as a plant, a process for each satellite and a recorder, in lockstep over DDS.

    Args:
        scenario: what to fly.
        out: existing folder; gets the scenario as every node reads it, the bag and the nodes' logs.
        record: whether to record a bag.
        progress: called now and then with the steps flown and the steps to fly.

    Returns:
        How it went, also when a process was lost. No process is left behind in any case.

    Raises:
        OSError: the folder cannot be written to, or a process cannot be started.
    """
    scenario_file = out / "scenario.json"
    scenario_file.write_text(scenario.to_json())
    bag = out / "bag" if record else None
    with own_domain() as domain, _asked_to_stop() as signals:
        watch = _Watch(scenario, signals, progress)
        try:
            watch.start(processes(scenario, scenario_file, bag), out / "log", domain)
            watch.until_over()
        finally:
            watch.end_all()
        return watch.flight(domain, bag)


@dataclass
class _Signals:
    count: int = 0


@contextmanager
def _asked_to_stop() -> Iterator[_Signals]:
    """Count SIGINT and SIGTERM instead of dying from them, where this thread may."""
    signals = _Signals()

    def _count(_number: int, _frame: Any) -> None:
        signals.count += 1

    try:
        before = {number: signal.signal(number, _count) for number in (signal.SIGINT, signal.SIGTERM)}
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
        pidfd: becomes readable when the process ends.
        log: what it prints.
        rest: bytes of a report line that is not complete yet.
    """

    name: str
    process: subprocess.Popen[bytes]
    pidfd: int
    pipe: int
    log: Path
    rest: bytes = b""


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
    recorded: dict[str, Any] = field(default_factory=dict)
    lost: list[str] = field(default_factory=list)
    reason: str = ""
    stopped: bool = False
    over_since: float | None = None

    def start(self, nodes: list[NodeProcess], logs: Path, domain: int) -> None:
        """Start all processes, each with a pipe for its reports and a file for its words."""
        logs.mkdir(parents=True, exist_ok=True)
        self.begun = time.monotonic()
        folder = Path(get_package_prefix(PACKAGE)) / "lib" / PACKAGE
        environment = node_environment(domain)
        for node in nodes:
            self._start(node, folder, logs, environment)

    def _start(self, node: NodeProcess, folder: Path, logs: Path, environment: Mapping[str, str]) -> None:
        reader, writer = os.pipe()
        log = logs / f"{node.name}.log"
        try:
            with log.open("wb") as output:
                process = _popen(
                    [str(folder / node.executable), *node.arguments()], environment, writer, output
                )
        except OSError:
            os.close(reader)
            raise
        finally:
            os.close(writer)
        entry = _Running(node.name, process, os.pidfd_open(process.pid), reader, log)
        self.running[node.name] = entry
        self.selector.register(entry.pidfd, selectors.EVENT_READ, (entry, self._on_exit))
        self.selector.register(entry.pipe, selectors.EVENT_READ, (entry, self._on_report))

    def until_over(self) -> None:
        """Watch until every process has ended, or those that do not end in time are to be ended."""
        told = False
        while self.running:
            for key, _ in self.selector.select(_LOOK):
                entry, handle = key.data
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
        """Ask the plant to end the flight for everyone; without a plant, ask everyone."""
        if self.over_since is None:
            self.over_since = time.monotonic()
        plant = self.running.get("plant")
        for entry in [plant] if plant else list(self.running.values()):
            entry.process.send_signal(signal.SIGTERM)

    def _on_report(self, entry: _Running) -> None:
        data = os.read(entry.pipe, 65536)
        if not data:
            self.selector.unregister(entry.pipe)
            return
        *lines, entry.rest = (entry.rest + data).split(b"\n")
        for line in lines:
            self._on_event(json.loads(line))

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
                self.lost += event["who"]
                self.steps = event["step"]
                self.reason = self.reason or event["reason"]
            case "satellite":
                self.busy[event["node"]] = event["busy"]
            case "recorded":
                self.recorded = event

    def _on_exit(self, entry: _Running) -> None:
        # What it reported last may still be in the pipe.
        while entry.pipe in self.selector.get_map():
            self._on_report(entry)
        code = entry.process.wait()
        self._forget(entry)
        early = self.finished is None and self.over_since is None
        if (code or early) and not self.stopped:
            self._note_loss(entry, code)
        if entry.name == "plant" or early:
            self._end_flight()

    def _note_loss(self, entry: _Running, code: int) -> None:
        """Remember the process whose end came first; those that end because of it are no losses."""
        if self.lost:
            return
        self.lost.append(entry.name)
        how = f"was ended by signal {-code}" if code < 0 else f"ended with exit code {code}"
        last = entry.log.read_text(errors="replace").strip().splitlines()[-1:] or ["it printed nothing"]
        self.reason = self.reason or f"{entry.name} {how} after step {self.steps}: {last[0]}"

    def _forget(self, entry: _Running) -> None:
        self.selector.unregister(entry.pidfd)
        os.close(entry.pidfd)
        os.close(entry.pipe)
        del self.running[entry.name]

    def end_all(self) -> None:
        """End what still runs: first asked, then forced; every process is waited for."""
        for number, patience in ((signal.SIGTERM, 3.0), (signal.SIGKILL, FAREWELL)):
            if number == signal.SIGTERM and self.signals.count >= 2:
                continue
            for entry in self.running.values():
                entry.process.send_signal(number)
            end = time.monotonic() + patience
            for entry in list(self.running.values()):
                try:
                    entry.process.wait(max(0.0, end - time.monotonic()))
                except subprocess.TimeoutExpired:
                    continue
                if entry.pipe in self.selector.get_map():
                    self.selector.unregister(entry.pipe)
                self._forget(entry)
        self.selector.close()

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
            domain=domain,
            lost=tuple(self.lost),
            reason=self.reason,
            stopped=self.stopped,
            bag=bag,
            messages=self.recorded.get("messages", 0),
            missed=tuple(self.recorded.get("missed", ())),
        )


def node_environment(domain: int) -> dict[str, str]:
    """Environment of the nodes: this process's own, on the given domain and on this machine only."""
    return {
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        **os.environ,
        "ROS_DOMAIN_ID": str(domain),
    }


def _popen(
    command: list[str], environment: Mapping[str, str], report: int, output: IO[bytes]
) -> "subprocess.Popen[bytes]":
    return subprocess.Popen(
        command,
        env={**environment, REPORT_VARIABLE: str(report)},
        pass_fds=(report,),
        stdin=subprocess.DEVNULL,
        stdout=output,
        stderr=subprocess.STDOUT,
        # A terminal's Ctrl-C is for the one who started the flight, who ends it in order.
        start_new_session=True,
    )
