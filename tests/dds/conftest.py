# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the tests that fly real nodes share: a domain of their own, and flights that are always ended."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import rclpy
from ament_index_python.packages import get_package_prefix
from rclpy.node import Node

from satform_bringup import PACKAGE
from satform_bringup.deployment import local_discovery
from satform_bringup.deployment.domain_lock import on_domain, own_domain
from satform_bringup.deployment.node_processes import NodeProcess
from satform_bringup.supervisor import process_server


@pytest.fixture(autouse=True)
def domain() -> Iterator[int]:
    """A DDS domain that no other test and no other run on this machine uses."""
    with own_domain() as number, on_domain(number):
        yield number


@pytest.fixture(scope="session")
def in_c(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Command of the satellite in C, a package that colcon builds as the page of the examples says."""
    workspace = tmp_path_factory.mktemp("workspace")
    examples = Path(__file__).parents[2] / "docs" / "external_satellites"
    settings = [
        "-G",
        "Ninja",
        f"-DCMAKE_PROJECT_INCLUDE={examples / 'wheels.cmake'}",
        "-DCMAKE_C_FLAGS=-Werror",
    ]
    done = subprocess.run(
        ["colcon", "build", "--base-paths", str(examples / "c"), "--cmake-args", *settings],
        cwd=workspace,
        # The user's own defaults for colcon are for their own workspaces.
        env=os.environ | {"COLCON_HOME": str(workspace)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        # Against a hang only.
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    package = "foreign_satellite_c"
    return [str(workspace / "install" / package / "lib" / package / "foreign_satellite")]


@pytest.fixture
def start_program() -> Iterator[Callable[..., "subprocess.Popen[str]"]]:
    """Starts a program with the environment that a run has written; ends it when the test is over."""
    started: list[subprocess.Popen[str]] = []

    def start(run: Path, command: list[str]) -> "subprocess.Popen[str]":
        script = run / "environment.sh"
        end = time.monotonic() + 60.0
        while not script.exists():
            assert time.monotonic() < end, f"{script} is not written"
            time.sleep(0.02)  # polls: another process writes it
        process = subprocess.Popen(
            ["sh", "-c", f'. "{script}"; exec "$@"', "sh", *command],
            env=dict(os.environ),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        started.append(process)
        return process

    yield start
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()


@pytest.fixture
def start_faulty(
    start_program: Callable[[Path, list[str]], "subprocess.Popen[str]"],
) -> Callable[[Path, str], "subprocess.Popen[str]"]:
    """Starts a satellite with a fault, of `faulty_satellite.py`, for a run in a folder."""
    program = [sys.executable, str(Path(__file__).with_name("faulty_satellite.py"))]

    def start(run: Path, fault: str) -> "subprocess.Popen[str]":
        return start_program(run, [*program, fault, str(run / "scenario.json")])

    return start


@pytest.fixture
def observer() -> Iterator[Node]:
    """A node that looks on."""
    rclpy.init()
    node = Node("observer")
    yield node
    node.destroy_node()
    rclpy.shutdown()


@pytest.fixture
def busy_cores() -> Iterator[None]:
    """Keep every core busy with other work while the test runs."""
    count = os.cpu_count() or 1
    spinning = "while True: pass"
    processes = [subprocess.Popen([sys.executable, "-c", spinning]) for _ in range(count)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
        for process in processes:
            process.wait()


@pytest.fixture
def start_run(tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Starts `satform run` as a user would, in the background; ends it when the test is over."""
    started: list[subprocess.Popen[str]] = []

    def start(scenario: str, *options: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [
                # A parent that ignores SIGHUP, as nohup does, hands that on.
                "env",
                "--default-signal=INT,HUP,TERM",
                sys.executable,
                "-m",
                "satform_tools",
                "run",
                scenario,
                "--out",
                str(tmp_path / "run"),
                *options,
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            # As from a terminal: in a process group of its own, to which Ctrl-C goes as a whole.
            start_new_session=True,
        )
        started.append(process)
        return process

    yield start
    for process in started:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            try:
                process.communicate(timeout=30)
            except subprocess.TimeoutExpired:
                process.kill()
        process.wait()


class Born:
    """A node's process from the nursery, to be handled as one of `subprocess`."""

    def __init__(self, node: NodeProcess, domain: int, folder: Path, told: dict[str, str]) -> None:
        self._process, self._pipe = process_server.start(
            node.executable, node.arguments(), domain, folder / f"{node.name}.log", told
        )

    def send_signal(self, number: int) -> None:
        if self._process.is_alive():
            os.kill(self._process.pid, number)

    def terminate(self) -> None:
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)

    def wait(self, timeout: float | None = None) -> int:
        self._process.join(timeout)
        if self._process.exitcode is None:
            raise subprocess.TimeoutExpired(self._process.name, timeout)
        return self._process.exitcode

    def close(self) -> None:
        self._pipe.close()
        self._process.close()


Fleet = list[Born] | list[subprocess.Popen[bytes]]


def end(fleet: Fleet) -> None:
    for process in fleet:
        process.terminate()
    for process in fleet:
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@pytest.fixture
def fleet(tmp_path: Path, domain: int) -> Iterator[Callable[[list[NodeProcess]], Fleet]]:
    """Starts node processes without anyone to watch them; ends them after the test."""
    started: list[Born] = []

    def start(nodes: list[NodeProcess]) -> Fleet:
        told = local_discovery.variables(len(nodes), len(nodes), tmp_path)
        started.extend(Born(node, domain, tmp_path, told) for node in nodes)
        return started

    yield start
    end(started)
    for process in started:
        process.close()


@pytest.fixture
def installed_fleet(tmp_path: Path) -> Iterator[Callable[[list[NodeProcess]], Fleet]]:
    """As `fleet`, from the installed executables, as `ros2 run` and a launch file start them."""
    started: list[subprocess.Popen[bytes]] = []

    def start(nodes: list[NodeProcess]) -> Fleet:
        folder = Path(get_package_prefix(PACKAGE)) / "lib" / PACKAGE
        for node in nodes:
            with (tmp_path / f"{node.name}.log").open("wb") as log:
                command = [str(folder / node.executable), *node.arguments()]
                started.append(subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT))
        return started

    yield start
    end(started)
