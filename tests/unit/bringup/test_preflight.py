# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A start that cannot work is named before any process starts; what a flight does without is taken away."""

import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from satform_bringup.deployment import preflight
from satform_bringup.deployment.preflight import PreflightError
from satform_bringup.supervisor import process_server

OF_A_SHELL = (
    *preflight.UNUSED_VARIABLES,
    "ROS_DOMAIN_ID",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_STATIC_PEERS",
    "ROS_SECURITY_ENABLE",
    "FASTRTPS_DEFAULT_PROFILES_FILE",
    "FASTDDS_DEFAULT_PROFILES_FILE",
)


@pytest.fixture(autouse=True)
def plain_shell(monkeypatch: pytest.MonkeyPatch) -> None:
    """A shell in which nothing of all this is set."""
    for name in OF_A_SHELL:
        monkeypatch.delenv(name, raising=False)


def test_a_plain_shell_is_fine() -> None:
    preflight.require(5)


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF", "OFF prevents nodes from discovering each other"),
        (
            "ROS_AUTOMATIC_DISCOVERY_RANGE",
            "WORLD",
            "'WORLD' is not a discovery range; the allowed values are LOCALHOST",
        ),
        ("ROS_STATIC_PEERS", "10.0.0.1;300.1.2.3", "names '300.1.2.3', which is no IP address"),
        ("ROS_STATIC_PEERS", "nobody.invalid", "names 'nobody.invalid', which is not known as a host"),
        ("ROS_DOMAIN_ID", "abc", "ROS_DOMAIN_ID='abc' is not a DDS domain"),
        ("ROS_DOMAIN_ID", "300", "ROS_DOMAIN_ID='300' is not a DDS domain"),
        ("RMW_IMPLEMENTATION", "rmw_nobody_cpp", "RMW_IMPLEMENTATION=rmw_nobody_cpp is not installed"),
        ("ROS_SECURITY_ENABLE", "true", "asks for a secured flight, which needs --secure KEYSTORE"),
        ("FASTRTPS_DEFAULT_PROFILES_FILE", "/no/such.xml", "/no/such.xml: cannot be read: no such file"),
        ("FASTDDS_DEFAULT_PROFILES_FILE", __file__, "is not XML"),
    ],
)
def test_a_variable_that_cannot_work_is_named(
    name: str, value: str, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(name, value)
    with pytest.raises(PreflightError) as refused:
        preflight.require()
    assert sentence in str(refused.value)


def test_all_that_is_wrong_is_named_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "abc")
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")
    with pytest.raises(PreflightError, match=r"ROS_DOMAIN_ID.*; ROS_AUTOMATIC_DISCOVERY_RANGE=OFF"):
        preflight.require()


def test_a_secured_flight_may_have_the_variable_of_security_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    preflight.require(secured=True)


def test_a_low_limit_of_open_files_is_raised_or_named() -> None:
    script = """
import resource, sys
from satform_bringup.deployment import preflight
soft, hard = map(int, sys.argv[1:])
resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
try:
    preflight.require(50)
    print(resource.getrlimit(resource.RLIMIT_NOFILE)[0])
except preflight.PreflightError as error:
    print(error)
"""

    def says(soft: int, hard: int) -> str:
        command = [sys.executable, "-c", script, str(soft), str(hard)]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    assert int(says(100, 1024)) == 64 + 6 * 50
    assert "200 open files are allowed and 364 are needed for 50 processes; raise the limit" in says(100, 200)
    assert resource.getrlimit(resource.RLIMIT_NOFILE)[0] > 100


def test_a_loopback_interface_that_is_down_is_named() -> None:
    unshare = shutil.which("unshare")
    if unshare is None or os.geteuid() != 0:
        pytest.skip("NOT TESTED: a network of one's own needs root and the program unshare")
    script = "from satform_bringup.deployment import preflight; preflight.require()"
    done = subprocess.run(
        [unshare, "-n", sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    if "unshare" in done.stderr:
        pytest.skip("NOT TESTED: this machine lets nobody make a network")
    assert "no datagram passes on the loopback interface (127.0.0.1)" in done.stderr


def test_a_command_says_it_before_a_process_is_started(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    from satform_tools.cli import main as cli

    def start() -> None:
        pytest.fail("a process was started")

    monkeypatch.setattr(process_server, "prepare", start)
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")
    assert cli.main(["run", "triangle", "--out", str(tmp_path / "run")]) == 2
    assert "ROS_AUTOMATIC_DISCOVERY_RANGE=OFF" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_what_a_flight_does_not_need_is_taken_away(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DISCOVERY_SERVER", "127.0.0.1:11811")
    assert preflight.unused_variables() == ["ROS_DISCOVERY_SERVER"]
    preflight.remove_unused_variables()
    assert "ROS_DISCOVERY_SERVER" not in os.environ
