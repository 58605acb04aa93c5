# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Checkpoint file of a satellite: the last checkpoint, written atomically.

The bytes of a checkpoint are made and read by `satform.flight.checkpoint`.
"""

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_LOST
from satform.common.printable_text import reason
from satform.files.bounded_file import read_bounded
from satform.files.durable_file import reason_text, write_durably
from satform.flight.checkpoint import restore, save
from satform.flight.satellite import Satellite
from satform_nodes.transport.node_error import NodeError

MOST_BYTES = 100_000_000
"""Size of the largest file that is taken for a checkpoint; those of shipped scenarios have some kilobytes."""

_HEAD = struct.Struct("<qI")
"""At the beginning of the file: the step, and how many neighbours follow; then the state."""

_INDEX = "<u4"
"""Data type of a neighbour's index in the file."""


class CheckpointFile:
    """The last checkpoint of one satellite.

    Attributes:
        step: of the checkpoint that was found at the start; -1 when there was none.
        written: step of the last checkpoint on the disk; -1 when there is none.
        failures: how many could not be written.
        problem: why the last one could not be written; empty when it is there.
    """

    def __init__(self, folder: str, name: str, every: int | None) -> None:
        """Find the checkpoint of an earlier process of the same satellite.

        Args:
            folder: of the checkpoint files; empty to write none.
            name: of the satellite.
            every: steps between two checkpoints; None to write none.

        Raises:
            NodeError: there is a file that is no checkpoint.
        """
        self._file = Path(folder) / f"{name}.checkpoint" if folder and every else None
        self._every = every or 0
        self.step = self.written = -1
        self.failures = 0
        self.problem = ""
        self._data = b""
        self._neighbours: list[int] = []
        self.load()

    def load(self) -> None:
        """Read the last checkpoint."""
        if self._file is None or not self._file.exists():
            return
        try:
            data = read_bounded(self._file, MOST_BYTES, "a checkpoint")
        except OSError as error:
            raise NodeError(f"{self._file}: cannot be read: {error.strerror}", EXIT_BAD_INPUT) from None
        try:
            step, count = _HEAD.unpack_from(data)
            indices = np.frombuffer(data, _INDEX, count, _HEAD.size)
        except (struct.error, ValueError):
            raise NodeError(f"{self._file}: is no checkpoint, or cut short", EXIT_BAD_INPUT) from None
        self.step = self.written = step
        self._neighbours = indices.tolist()
        self._data = data[_HEAD.size + indices.nbytes :]

    def restore(self, satellite: Satellite, neighbours: Sequence[int]) -> None:
        """Put a satellite into the state of the checkpoint.

        Args:
            satellite: whose state it becomes.
            neighbours: indices of its in-neighbours; the graph may have changed since the checkpoint.

        Raises:
            NodeError: the checkpoint is damaged, or another satellite's.
        """
        before = self._neighbours
        try:
            satellite.rearrange([None] * len(before))
            restore(satellite, self._data)
        except ValueError as error:
            raise NodeError(f"{self._file}: {reason(error)}", EXIT_LOST) from None
        satellite.rearrange([before.index(index) if index in before else None for index in neighbours])

    def due(self, step: int) -> bool:
        """Whether a checkpoint is to be written before a step."""
        return self._file is not None and step % self._every == 0

    def keep(self, satellite: Satellite, neighbours: Sequence[int]) -> None:
        """Write a checkpoint if one is due at the satellite's step; a failure does not stop the satellite.

        Args:
            satellite: whose state is written.
            neighbours: indices of its in-neighbours.
        """
        if self._file is None or not self.due(satellite.step):
            return
        step = satellite.step
        head = _HEAD.pack(step, len(neighbours))
        try:
            self._file.parent.mkdir(exist_ok=True)
            write_durably(self._file, head + np.array(neighbours, dtype=_INDEX).tobytes() + save(satellite))
        except OSError as error:
            self.failures += 1
            last = f"the last one is of step {self.written}" if self.written >= 0 else "there is none"
            self.problem = (
                f"{self._file}: the checkpoint of step {step} cannot be written, {last}: "
                f"{reason_text(error, self._file)}"
            )
        else:
            self.written, self.problem = step, ""
