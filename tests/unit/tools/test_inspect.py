# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Looks into a flight, as far as they need none: which domain, values and their names, frames, sentences."""

import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NoReturn, cast

import numpy as np
import pytest
from rcl_interfaces.msg import Log, ParameterType
from rcl_interfaces.srv import SetParameters
from satform_msgs.msg import Command, FormationStatus, ParameterChange, RelativeState, Tracking

from satform_bringup.deployment import domain_lock as domains
from satform_bringup.deployment import runtime_folder
from satform_bringup.deployment.domain_lock import DomainError, hold
from satform_bringup.supervisor.run_registry import described, file_name, hold_shell_domain, registered_runs
from satform_tools.cli import main as cli
from satform_tools.errors import CommandError
from satform_tools.inspect import message_values, observer_node, target_domain
from satform_tools.inspect import monitor as monitor_module
from satform_tools.inspect import parameters as node_parameters
from satform_tools.inspect import watch as watch_command
from satform_tools.inspect.echo import intervals
from satform_tools.inspect.monitor import FormationMonitor, sentences
from satform_tools.inspect.observer_node import Observer
from satform_tools.inspect.parameters import as_parameter
from satform_tools.inspect.snapshot import Frame, LinkStatus, SatelliteStatus, as_text


@pytest.fixture(autouse=True)
def machine_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Descriptions and holds of the test's own, and no domain set."""
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    monkeypatch.setattr(domains, "ABSTRACT", f"\0test observe {os.getpid()}/")
    for name in ("ROS_DOMAIN_ID", "SATFORM_HOLDS_DOMAIN", "XDG_RUNTIME_DIR"):
        monkeypatch.delenv(name, raising=False)


def test_the_only_run_on_this_machine_is_found_and_an_ended_one_is_not(tmp_path: Path) -> None:
    with described(41, "triangle", tmp_path):
        (run,) = registered_runs()
        assert (run.domain, run.scenario, run.folder) == (41, "triangle", str(tmp_path))
        assert target_domain.domain(None) == 41
    assert registered_runs() == []


def test_what_a_killed_run_left_behind_is_passed_over(tmp_path: Path) -> None:
    script = (
        f"import tempfile; tempfile.tempdir = {tempfile.gettempdir()!r}\n"
        "from pathlib import Path\n"
        "from satform_bringup.supervisor.run_registry import describe, registered_runs\n"
        "describe(7, 'ring_six', Path('run')); print(len(registered_runs()), flush=True)"
    )
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert ended.stdout.strip() == "1"
    (left,) = runtime_folder.names()
    assert json.loads(runtime_folder.read(left) or "")["scenario"] == "ring_six"
    assert registered_runs() == []
    with described(3, "triangle", tmp_path):
        assert left not in runtime_folder.names()


def test_a_process_with_the_number_of_a_killed_run_is_no_run(tmp_path: Path) -> None:
    with described(7, "triangle", tmp_path):
        note = json.loads(runtime_folder.read(file_name(7)) or "")
        assert note["process"] == os.getpid()
        runtime_folder.write(file_name(7), json.dumps({**note, "started": note["started"] - 1}))
        assert registered_runs() == []


@pytest.mark.parametrize("text", ["", "{", "[]", '{"domain": 7}', '{"domain": 8, "x": 1}', "\0"])
def test_a_description_that_says_nothing_sensible_is_passed_over(text: str) -> None:
    runtime_folder.write(file_name(7), text)
    assert registered_runs() == []


def test_of_several_runs_one_has_to_be_named(tmp_path: Path) -> None:
    with described(3, "triangle", tmp_path), described(7, "ring_six", tmp_path):
        sentence = r"2 runs under way on this machine: 3 \(triangle\), 7 \(ring_six\); name one with --domain"
        with pytest.raises(CommandError, match=sentence):
            target_domain.domain(None)
        assert target_domain.domain(5) == 5
        assert "no formation is flying on domain 5; runs under way" in target_domain.no_formation_sentence(5)


def test_without_a_run_the_sentence_says_how_to_have_one() -> None:
    with pytest.raises(CommandError, match="no run is under way on this machine; start one"):
        target_domain.domain(None)
    assert cli.main(["topics"]) == 2


def test_the_shells_domain_comes_before_what_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with described(3, "triangle", tmp_path):
        monkeypatch.setenv("ROS_DOMAIN_ID", "12")
        assert target_domain.domain(None) == 12
        monkeypatch.setenv("ROS_DOMAIN_ID", "here")
        with pytest.raises(CommandError, match="ROS_DOMAIN_ID='here' is not a DDS domain"):
            target_domain.domain(None)


def test_a_launch_in_a_domain_that_is_taken_is_refused_by_the_name_of_who_has_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "9")
    lock = hold(9)
    assert lock is not None
    with described(9, "triangle", tmp_path), pytest.raises(DomainError, match=r"domain 9 .* \(triangle in "):
        hold_shell_domain("ring_six", tmp_path)
    os.close(lock)
    assert hold_shell_domain("ring_six", tmp_path) == 9
    assert [run.scenario for run in registered_runs()] == ["ring_six"]
    assert hold(9) is None


def test_a_message_becomes_plain_data_and_comes_back_the_same() -> None:
    status = FormationStatus(
        step=3, satellites=["a", "b"], alive=[True, False], edge_receivers=[0, 1], edge_senders=[1, 0]
    )
    status.header.stamp.sec = 7
    data = json.loads(json.dumps(message_values.plain(status)))
    assert data["header"]["stamp"] == {"sec": 7, "nanosec": 0}
    assert data["alive"] == [True, False]
    assert message_values.fill(FormationStatus(), data) == status


def test_a_request_may_hold_messages_in_lists_and_whole_numbers_for_doubles() -> None:
    data = {"parameters": [{"name": "gain", "value": {"type": 3, "double_value": 2}}]}
    request = message_values.fill(SetParameters.Request(), data)
    assert request.parameters[0].value.double_value == 2.0


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        ({"positon": {"x": 1.0}}, "RelativeState: there is no field 'positon'; did you mean position?"),
        ({"position": {"w": 1.0}}, "position: there is no field 'w'; there are x, y, z"),
        ({"position": {"x": "far"}}, "position.x: found 'far'; it has to be of the type double"),
        ({"step": -1}, "step: found -1; it has to be of the type uint64"),
        ([1.0], r"RelativeState: found \[1.0\]; it has to be of the form {header: ..., step"),
    ],
)
def test_what_does_not_fit_a_message_is_named(data: object, sentence: str) -> None:
    with pytest.raises(CommandError, match=sentence):
        message_values.fill(RelativeState(), data)


def test_a_field_is_picked_by_its_dotted_name() -> None:
    data = {"a": {"b": [1.0, {"c": 2.0}]}}
    assert message_values.pick(data, "a.b[1].c") == 2.0
    assert dict(message_values.flat(data)) == {"a.b[0]": 1.0, "a.b[1].c": 2.0}


@pytest.mark.parametrize(
    ("field", "sentence"),
    [
        ("a.d", "there is no 'd'; there are b"),
        ("a.b[7]", "there is no entry 7: b has 2 entries"),
        ("a.b[0].c", "there is no 'c'; it has no fields"),
        ("a[0]", "a is no list"),
        ("", "there is no ''"),
    ],
)
def test_a_field_that_is_not_there_is_named(field: str, sentence: str) -> None:
    with pytest.raises(CommandError, match=sentence):
        message_values.pick({"a": {"b": [1.0, {"c": 2.0}]}}, field)


@pytest.mark.parametrize("name", ["nowhere/msg/Thing", "std_msgs/msg/Nothing", "std_msgs", ""])
def test_a_type_that_is_not_here_is_a_sentence(name: str) -> None:
    with pytest.raises(CommandError, match="is not among the packages"):
        message_values.interface(name)


def test_a_parameter_is_read_as_the_type_that_it_is_declared_with() -> None:
    for text, value in (("1", 1.0), ("1e3", 1000.0), ("1.0e3", 1000.0), ("-2E-3", -0.002)):
        assert as_parameter(ParameterType.PARAMETER_DOUBLE, "gain", text).double_value == value
    single = as_parameter(ParameterType.PARAMETER_DOUBLE_ARRAY, "gain", "1e-1")
    assert (single.type, single.double_value) == (ParameterType.PARAMETER_DOUBLE, 0.1)
    triple = as_parameter(ParameterType.PARAMETER_DOUBLE_ARRAY, "gain", "[1, 2.5, 3]")
    assert list(triple.double_array_value) == [1.0, 2.5, 3.0]
    # The node makes a number of it, if the parameter is an angle.
    assert as_parameter(ParameterType.PARAMETER_DOUBLE, "angle", "45 deg").string_value == "45 deg"
    assert as_parameter(ParameterType.PARAMETER_STRING, "name", "on").string_value == "on"


@pytest.mark.parametrize("text", ["[1, x]", "fast", "[", "[true]", "{a: 1}", "[.nan]"])
def test_a_parameter_of_another_type_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(CommandError, match=r"has to be of the type double array, such as '\[0.1"):
        as_parameter(ParameterType.PARAMETER_DOUBLE_ARRAY, "gain", text)


@pytest.mark.parametrize(
    ("module", "function", "words"),
    [
        (watch_command, "watch", ["watch"]),
        (node_parameters, "change", ["params", "set", "sat1", "gain", "1.0"]),
    ],
)
def test_a_reader_who_has_seen_enough_ends_a_look_in_peace(
    module: Any,
    function: str,
    words: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    @contextmanager
    def observe(_domain: int, _patience: float, _namespace: str | None) -> Iterator[None]:
        yield None

    def closed(*_: Any, **__: Any) -> NoReturn:
        raise BrokenPipeError

    monkeypatch.setattr(observer_node, "observe", observe)
    monkeypatch.setattr(module, function, closed)
    # The command takes the stream away; the test gives it back.
    monkeypatch.setattr(sys, "stdout", sys.stdout)
    assert cli.main([*words, "--domain", "7"]) == 0
    assert capsys.readouterr().err == ""


def test_the_rate_is_messages_less_one_over_the_time_between_the_first_and_the_last() -> None:
    moments = np.cumsum([5.0, 0.1, 0.3, 0.1, 0.3]).tolist()
    found = intervals(moments)
    assert found is not None
    assert found["rate"] == pytest.approx(4.0 / 0.8)
    assert (found["shortest"], found["longest"]) == pytest.approx((0.1, 0.3))
    assert found["deviation"] == pytest.approx(np.std([0.1, 0.3, 0.1, 0.3]))
    assert intervals([1.0]) is None


def look(name: str, alive: bool = True) -> SatelliteStatus:
    return SatelliteStatus(name, alive, False, (1.0, -2.0, math.nan), 0.5, 1e-3, 12.5)


def frame(links: tuple[LinkStatus, ...], events: tuple[str, ...] = ()) -> Frame:
    return Frame(
        title="triangle on domain 3",
        phase="flying",
        step=50,
        last_step=200,
        time=25.0,
        steps_per_second=400.0,
        satellites=(look("one"), look("two", alive=False)),
        spread=3.25,
        connectivity=2.0,
        links=links,
        events=events,
    )


def test_a_frame_says_where_the_flight_is_and_how_fast() -> None:
    head, _, one, two, *_ = as_text(frame(())).splitlines()
    assert head == ("triangle on domain 3: flying, step 50 of 200 (25 %), 25 s, 400 steps/s, 200 x real time")
    assert one.split() == ["one", "alive", "1.0", "-2.0", "-", "0.5", "0.001", "12.5"]
    assert two.split()[:2] == ["two", "lost"]


def test_of_many_links_the_oldest_are_named_and_those_never_heard_before_all() -> None:
    links = tuple(LinkStatus(f"s{index}", "s0", float(index)) for index in range(30))
    text = as_text(frame((*links, LinkStatus("one", "two", math.nan))))
    assert "on 31 links [s]: one<-two -, s29<-s0 29, s28<-s0 28" in text
    assert text.endswith("and 19 with newer messages")


def test_the_newest_events_are_shown() -> None:
    text = as_text(frame((), tuple(f"event {index}" for index in range(20))))
    assert text.splitlines()[-6:] == [f"event {index}" for index in range(14, 20)]


def test_a_changed_gain_and_a_warning_are_worth_a_line_and_small_talk_is_not() -> None:
    change = ParameterChange(step=9, name="controller.gain", value=[0.2, 0.5])
    assert sentences(change, "sat1") == ["step 9: sat1 controller.gain = 0.2, 0.5"]
    assert sentences(Log(level=30, name="sat1", msg="late")) == ["sat1: late"]
    assert sentences(Log(level=20, name="sat1", msg="hello")) == []


@pytest.mark.parametrize(
    "words",
    [
        ["topics"],
        ["topics", "info", "/x"],
        ["topics", "hz", "/x"],
        ["echo", "/x"],
        ["nodes"],
        ["nodes", "info", "x"],
        ["params", "list", "x"],
        ["params", "get", "x", "y"],
        ["params", "describe", "x", "y"],
        ["params", "set", "x", "y", "-1.0"],
        ["call", "/x"],
        ["watch", "--once"],
    ],
)
def test_every_look_at_an_empty_domain_ends_with_2_and_a_sentence(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main([*words, "--domain", "231", "--timeout", "0.2"]) == 2
    captured = capsys.readouterr()
    assert captured.err == (
        "satform: no formation is flying on domain 231; no run is under way on this machine\n"
    )
    assert not captured.out


class Queue:
    """A subscription whose messages are put in by hand."""

    def __init__(self, kind: Any, callback: Callable[[Any], None]) -> None:
        self.msg_type, self.callback, self.handle = kind, callback, self
        self.messages: list[Any] = []

    def take_message(self, _kind: Any, _raw: bool) -> tuple[Any, None] | None:
        return (self.messages.pop(0), None) if self.messages else None


class Formation:
    """The part of an observer that a monitor needs: one satellite, whose messages are put in by hand."""

    domain, timeout = 231, 0.0

    def __init__(self) -> None:
        self.node = self
        self.queues: dict[str, Queue] = {}

    def create_subscription(self, kind: Any, topic: str, callback: Callable[[Any], None], _qos: Any) -> Queue:
        self.queues[topic] = Queue(kind, callback)
        return self.queues[topic]

    def latest_status(self) -> FormationStatus:
        return FormationStatus(phase=FormationStatus.FLYING, last_step=200, satellites=["one"], alive=[True])

    def full_name(self, topic: str) -> str:
        return topic

    def require_formation(self) -> None:
        pass

    def wait(self, condition: Callable[[], bool], _seconds: float) -> bool:
        return condition()

    def count_publishers(self, _topic: str) -> int:
        return 1

    def plant_exists(self) -> bool:
        return True

    def put(self, topic: str, message: Any, time: float) -> None:
        message.header.stamp.sec, message.header.stamp.nanosec = int(time), round(1e9 * (time % 1.0))
        self.queues[topic].messages.append(message)


def test_step_and_time_of_a_frame_are_those_of_one_message() -> None:
    formation = Formation()
    monitor = FormationMonitor(cast(Observer, formation))
    # A control period of 0.5 s, in which a command has come and the tracking of the same step has not.
    formation.put("/one/tracking", Tracking(step=15), 7.5)
    formation.put("/one/command", Command(step=16), 8.0)
    monitor.update()
    assert (monitor.frame().step, monitor.frame().time) == (16, 8.0)
    formation.put("/one/tracking", Tracking(step=17), 8.5)
    monitor.update()
    assert (monitor.frame().step, monitor.frame().time) == (17, 8.5)
    # 40 steps of 0.5 s in a second of wall-clock time.
    shown = as_text(replace(monitor.frame(), steps_per_second=40.0))
    assert "step 17 of 200 (8 %), 8.5 s, 40 steps/s, 20 x real time" in shown
    end = FormationStatus(
        phase=FormationStatus.FINISHED, step=200, last_step=200, satellites=["one"], alive=[True]
    )
    formation.put("/formation/status", end, 100.0)
    monitor.update()
    assert (monitor.frame().step, monitor.frame().time) == (200, 100.0)


def test_the_step_rate_is_between_messages_and_not_from_the_status_of_the_start(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = [0.0]
    monkeypatch.setattr(monitor_module, "time", SimpleNamespace(monotonic=lambda: now[0]))
    formation = Formation()
    monitor = FormationMonitor(cast(Observer, formation))
    # The status that is received first is that of step 0, and the flight has been going on since.
    monitor.update()
    for now[0], step in ((0.3, 2400), (0.5, 2408)):
        formation.put("/one/command", Command(step=step), 0.5 * step)
        monitor.update()
    # 8 steps in 0.2 s of wall-clock time.
    assert monitor.frame().steps_per_second == pytest.approx(40.0)
