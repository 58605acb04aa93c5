# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A satellite's checkpoint on disk belongs to the neighbours that it had."""

from pathlib import Path

import numpy as np
import pytest

from flights import shortened
from satform.communication.neighbour_buffer import Received
from satform.control.protocol import Motion
from satform.flight.compile_satellite import flight_plan
from satform.flight.satellite import Satellite
from satform_nodes.satellite.checkpoint_file import CheckpointFile
from satform_nodes.transport.node_error import NodeError

SCENARIO = shortened("ring_six", 60.0)
MOTION = Motion(np.array([5.0e4, 10.0, -3.0]), np.array([1.0, -20.0, 0.5]))


def satellite(neighbours: int) -> Satellite:
    return Satellite(flight_plan(SCENARIO, 0), neighbours)


def kept(folder: Path) -> Satellite:
    """The satellite in place 0, which has heard 1 and 5, and whose checkpoint is on disk."""
    flown = satellite(2)
    said = np.array([[1.0e4, 50.0], [2.0e4, 60.0]])
    flown.act(MOTION, Received.whole(said, np.zeros(2)))
    CheckpointFile(str(folder), "sat1", 1).keep(flown, [1, 5])
    return flown


def test_what_neighbours_said_is_found_under_their_places_in_another_list(tmp_path: Path) -> None:
    before = kept(tmp_path)
    found = CheckpointFile(str(tmp_path), "sat1", 1)
    assert found.step == 1
    after = satellite(3)
    found.restore(after, [1, 3, 5])
    inbox = after.state.inbox
    assert inbox.known.tolist() == [1.0, 0.0, 1.0]
    assert inbox.values[[0, 2]].tolist() == before.state.inbox.values.tolist()
    found.restore(after, [5])
    assert after.state.inbox.values.tolist() == [[2.0e4, 60.0]]
    assert after.state.step == 1


@pytest.mark.parametrize("length", [0, 7, 11, 15])
def test_a_file_that_is_cut_short_is_refused_in_a_sentence(tmp_path: Path, length: int) -> None:
    kept(tmp_path)
    (file,) = tmp_path.iterdir()
    file.write_bytes(file.read_bytes()[:length])
    with pytest.raises(NodeError, match=f"{file.name}: is no checkpoint, or cut short"):
        CheckpointFile(str(tmp_path), "sat1", 1)


def test_a_damaged_state_is_refused_in_a_sentence(tmp_path: Path) -> None:
    kept(tmp_path)
    (file,) = tmp_path.iterdir()
    file.write_bytes(file.read_bytes()[:100])
    with pytest.raises(NodeError, match=f"{file.name}: this is no checkpoint"):
        CheckpointFile(str(tmp_path), "sat1", 1).restore(satellite(2), [1, 5])
