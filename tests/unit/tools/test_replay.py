# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A recorded flight flown once more has the same bits, or it is said where they differ."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from formations import formation
from satform.bag import reader as bag_reader
from satform.flight.simulate import simulate
from satform.membership.formation import Plan, SatelliteLost
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario
from satform_tools.cli import main as cli
from satform_tools.run.replay import compare

LOST: Plan = {10: [SatelliteLost(1, "killed")]}


def three() -> Scenario:
    satellites = [{"arc_length": 100.0 * i, "position_error": [2.0 * i, 1.0, -1.0]} for i in range(3)]
    return formation(satellites, 20.0)


def recorded() -> FlightRecord:
    """A flight whose second satellite was lost before it showed how it followed its last step."""
    record = simulate(three(), events={step: list(events) for step, events in LOST.items()})
    record.sliding_variable[9, 1] = np.nan
    record.reference_position[9, 1] = np.nan
    return record


def test_a_flight_with_an_unplanned_loss_is_flown_again_to_the_last_bit() -> None:
    found = compare(three(), recorded(), LOST)
    assert (found.steps, found.events, found.differences) == (40, 1, ())


def test_one_changed_bit_is_found_with_its_quantity_and_step() -> None:
    record = recorded()
    record.arc_length[17, 2] = np.nextafter(record.arc_length[17, 2], np.inf)
    differences = compare(three(), record, LOST).differences
    assert differences == ("arc_length: 1 numbers differ, the first at step 17",)


def test_what_a_satellite_that_flies_did_not_show_is_not_forgiven() -> None:
    record = recorded()
    record.sliding_variable[9, 2] = np.nan
    (difference,) = compare(three(), record, LOST).differences
    assert difference == "sliding_variable: 3 numbers differ, the first at step 9"


@pytest.mark.parametrize(
    ("bag", "sentence"),
    [
        ({"clocked": True}, "was flown against the wall clock"),
        ({"clocked": False, "record": SimpleNamespace(steps=0, early_end=None)}, "has no complete step"),
    ],
)
def test_a_flight_that_cannot_be_flown_again_is_a_sentence(
    bag: dict[str, Any],
    sentence: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(bag_reader, "read_bag", lambda _: SimpleNamespace(**bag))
    assert cli.main(["replay", str(tmp_path)]) == 2
    assert sentence in capsys.readouterr().err
