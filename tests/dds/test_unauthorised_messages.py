# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Another program publishes on every topic of a flight, and does not change a bit of it."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from flights import shortened
from flown import assert_as_in_one_process, flown, refused

pytestmark = pytest.mark.unmeasured

STRANGER = Path(__file__).with_name("stranger.py")


@pytest.fixture
def stranger(domain: int) -> Iterator[subprocess.Popen[str]]:
    """A node that writes lies on every topic at full speed, from before the flight until after it."""
    process = subprocess.Popen(
        [sys.executable, str(STRANGER), "sat1", "sat2", "sat3"], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline().startswith("talking")
    yield process
    process.kill()
    process.communicate()


@pytest.mark.parametrize("manner", ["politely", "while a satellite is lost and comes back"])
def test_lies_and_floods_from_a_stranger_change_nothing_and_are_counted(
    manner: str, stranger: subprocess.Popen[str], tmp_path: Path
) -> None:
    changes = ["faults=[{kind: satellite_lost, satellite: sat2, at: 50.0, rejoin_at: 100.0, memory: plan}]"]
    # Long enough for every node to discover the stranger on busy cores.
    scenario = shortened("triangle", 1200.0, *(changes if "lost" in manner else []))
    flight, bag = flown(scenario, tmp_path / "run")
    assert stranger.poll() is None
    assert flight.lost == ()
    assert_as_in_one_process(bag)
    counted = refused(bag.path)
    assert {reason.partition(":")[0] for reason in counted} == {"plant", "recorder", "sat1", "sat2", "sat3"}
    for who, topic in [
        ("plant", "/sat1/command"),
        ("plant", "/formation/node_ready"),
        ("plant", "/formation/recorder_progress"),
        ("sat1", "/sat1/state"),
        ("sat2", "/sat1/arc_length"),
        ("sat3", "/formation/status"),
        ("recorder", "/clock"),
        ("recorder", "/sat3/tracking"),
        ("recorder", "/sat1/parameter_changes"),
        ("recorder", "/diagnostics"),
    ]:
        assert counted.get(f"{who}: {topic}: stranger is not authorised", 0) > 0, (who, topic, counted)


def test_a_satellite_that_says_what_is_not_a_number_is_refused_by_reason(tmp_path: Path) -> None:
    from satform_msgs.msg import Command

    from satform.communication import topic_table
    from satform.communication.message_validator import MessageValidator, RejectionCounter
    from satform.communication.sim_time import Stamps
    from satform_nodes.transport.cdr_codec import layout

    form, rejections = layout(Command, topic_table.FRAME), RejectionCounter()
    validator = MessageValidator("/sat1/command", form, rejections, Stamps(0.5, 500_000_000))
    rest = [0.0] * 5, (0, 0, *[0.0] * 8, 0, 0.0)

    def says(step: int, number: float) -> object:
        return validator.validate(
            form.pack(*divmod(step * 500_000_000, 10**9), step, number, *rest[0], *rest[1]), 5, 5
        )

    assert says(5, float("nan")) is None
    assert says(5, float("inf")) is None
    assert says(5, 1e300) is None
    assert says(6, 0.0) is None
    assert validator.validate(b"nonsense", 5, 5) is None
    assert dict(rejections.counts) == {
        ("/sat1/command", "not finite"): 2,
        ("/sat1/command", "out of range"): 1,
        ("/sat1/command", "a step that is not due yet"): 1,
        ("/sat1/command", "another form"): 1,
    }
    assert says(5, 1.0) is not None
