"""A satellite's checkpoints on disk: the last one, written whole or not at all."""

from pathlib import Path

from satform.checkpoint import restore, save
from satform.exit_codes import EXIT_BAD_INPUT, EXIT_LOST
from satform.satellite import Satellite
from satform_nodes.lifetime import NodeError

_STEP_BYTES = 8
"""At the beginning of the file, the step; then the state."""


class CheckpointFile:
    """The last checkpoint of one satellite.

    Attributes:
        step: of the checkpoint that was found at the start; -1 when there was none.
    """

    def __init__(self, folder: str, name: str, every: int | None) -> None:
        """Find the checkpoint of an earlier process of the same satellite.

        Args:
            folder: where checkpoints are kept; empty to keep none.
            name: of the satellite.
            every: steps between two checkpoints; None to keep none.

        Raises:
            NodeError: there is a file that is no checkpoint.
        """
        self._file = Path(folder) / f"{name}.checkpoint" if folder and every else None
        self._every = every or 0
        self.step = -1
        self._data = b""
        self.load()

    def load(self) -> None:
        """Take up the last checkpoint."""
        if self._file is None or not self._file.exists():
            return
        try:
            data = self._file.read_bytes()
        except OSError as error:
            raise NodeError(f"{self._file}: cannot be read: {error.strerror}", EXIT_BAD_INPUT) from None
        self.step, self._data = int.from_bytes(data[:_STEP_BYTES], "little"), data[_STEP_BYTES:]

    def restore(self, satellite: Satellite) -> None:
        """Put a satellite into the state of the checkpoint.

        Raises:
            NodeError: the checkpoint is damaged, or another satellite's.
        """
        try:
            restore(satellite, self._data)
        except ValueError as error:
            raise NodeError(f"{self._file}: {error}", EXIT_LOST) from None

    def due(self, step: int) -> bool:
        """Whether a checkpoint is to be written before a step."""
        return self._file is not None and step % self._every == 0

    def keep(self, satellite: Satellite) -> None:
        """Write a checkpoint if one is due at the satellite's step."""
        if self._file is None or not self.due(satellite.state.step):
            return
        new = self._file.with_suffix(".new")
        try:
            self._file.parent.mkdir(exist_ok=True)
            new.write_bytes(satellite.state.step.to_bytes(_STEP_BYTES, "little") + save(satellite))
            new.replace(self._file)
        except OSError as error:
            sentence = f"{self._file}: the checkpoint cannot be written: {error.strerror}"
            raise NodeError(sentence, EXIT_LOST) from None
