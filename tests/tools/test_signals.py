# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Being asked to stop: by which signals, whatever the parent ignores, and what comes of it."""

import os
import signal
import subprocess
import sys
import threading

import pytest

from satform_nodes.runtime.signals import StopRequest, interrupting

ASKS = """
import os, signal
from satform_nodes.runtime.signals import StopRequest
with StopRequest() as stop:
    for number in (signal.SIGINT, signal.SIGHUP, signal.SIGTERM)[:{count}]:
        os.kill(os.getpid(), number)
        stop.pause(60.0)
        print(stop.count, stop.name, flush=True)
"""
COMMAND = """
import os, signal, sys
from satform_tools.cli import main as cli
from satform_tools.describe import scenario_list
def show(**_):
    os.kill(os.getpid(), signal.{name})
    return 0
scenario_list.show = show
sys.exit(cli.main(["list"]))
"""


def python(code: str, *dispositions: str) -> subprocess.CompletedProcess[str]:
    """Run code in a process that was started with some signals ignored."""
    command = ["env", "--default-signal=INT,HUP,TERM", *dispositions, sys.executable, "-c", code]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def test_the_first_signal_is_counted_and_the_second_ends_the_process() -> None:
    done = python(ASKS.format(count=1))
    assert (done.returncode, done.stdout) == (0, "1 SIGINT\n")
    done = python(ASKS.format(count=2))
    assert (done.returncode, done.stdout, done.stderr) == (130, "1 SIGINT\n", "")


REPEATED = """
import os, signal
from satform_nodes.runtime import signals
now = 100.0
signals.time.monotonic = lambda: now
with signals.StopRequest() as stop:
    for now in (100.0, 100.1, 100.6):
        os.kill(os.getpid(), signal.SIGINT)
        print(stop.count, flush=True)
"""


def test_a_signal_to_a_process_and_its_group_counts_once_and_a_later_one_is_the_second() -> None:
    done = python(REPEATED)
    assert (done.returncode, done.stdout) == (130, "1\n1\n")


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_command_ends_in_order_with_130_by_whatever_signal(name: str) -> None:
    for dispositions in ((), ("--ignore-signal=INT",)):
        done = python(COMMAND.format(name=name), *dispositions)
        assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_nohup_keeps_a_command_running_when_the_terminal_is_closed() -> None:
    assert python(COMMAND.format(name="SIGHUP"), "--ignore-signal=HUP").returncode == 0
    # As a background job of a script, which ignores Ctrl-C, it can still be stopped.
    done = python(ASKS.format(count=3), "--ignore-signal=INT,HUP")
    assert (done.returncode, done.stdout) == (130, "1 SIGINT\n1 SIGINT\n")


def test_handlers_are_those_of_before_afterwards() -> None:
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)]
    with StopRequest() as stop, interrupting():
        assert not stop.asked
        with pytest.raises(KeyboardInterrupt, match="SIGTERM"):
            os.kill(os.getpid(), signal.SIGTERM)
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)] == before


def test_another_thread_than_the_main_one_handles_no_signals() -> None:
    counted: list[int] = []

    def ask() -> None:
        with StopRequest() as stop, interrupting():
            counted.append(stop.count)

    thread = threading.Thread(target=ask)
    thread.start()
    thread.join(60.0)
    assert counted == [0]
