# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The command `recover`: writes a complete bag from one whose recorder was killed."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from satform_bringup import BAG_FOLDER
from satform_tools import console
from satform_tools.errors import CommandError, sentence_of
from satform_tools.run import ros_packages

if TYPE_CHECKING:
    from satform.bag.reader import Bag
    from satform_nodes.bag.recovery import Recovered

_SUFFIX = "_recovered"
"""End of the new folder's name by default."""


@dataclass(frozen=True)
class _Recovery:
    """A recovered bag, to be printed.

    Attributes:
        recovered: what was written.
        bag: the new bag; None where it holds no flight.
        why_none: reason where it holds none.
    """

    recovered: "Recovered"
    bag: "Bag | None"
    why_none: str

    def data(self) -> dict[str, Any]:
        """As data for JSON."""
        found: dict[str, Any] = {
            "source": str(self.recovered.source),
            "bag": str(self.recovered.folder),
            "messages": self.recovered.messages,
            "topics": self.recovered.topics,
            "damage": self.recovered.damage,
        }
        if self.bag is None:
            return found
        timing = self.bag.scenario.timing
        return found | {
            "steps": self.bag.record.steps,
            "steps_planned": timing.steps,
            "complete": self.bag.complete,
            "missing_from_step": None if self.bag.complete else self.bag.record.steps,
        }

    def lines(self) -> list[str]:
        """As lines of text."""
        recovered = self.recovered
        lines = [f"{recovered.messages} messages on {recovered.topics} topics are in {recovered.folder}"]
        if recovered.damage:
            lines.append(f"{recovered.source} could not be read further: {recovered.damage}")
        if self.bag is None:
            return [*lines, f"no flight can be read from it: {self.why_none}"]
        steps, timing = self.bag.record.steps, self.bag.scenario.timing
        if self.bag.complete:
            return [*lines, f"the flight is complete: {steps} of {timing.steps} steps"]
        missing = (
            f"the steps from {steps} on ({steps * timing.step:g} s) are missing"
            if steps < timing.steps
            else "its last messages may be missing"
        )
        return [*lines, f"{steps} of {timing.steps} steps are complete; {missing}"]


def recover(run: Path, out: Path | None, *, as_json: bool) -> None:
    """Write a complete bag from what can be read of a run's bag, into a folder of its own.

    Args:
        run: folder of a run, folder of a bag, or `.mcap` file; nothing in it is changed.
        out: folder of the new bag; None for one beside the old.
        as_json: whether to print JSON.

    Raises:
        CommandError: there is no such bag, nothing of it can be read, or the new one cannot be written.
    """
    ros_packages.require()
    from satform.bag.errors import BagError  # noqa: PLC0415 - most commands do without
    from satform_nodes.bag.recovery import is_whole  # noqa: PLC0415
    from satform_nodes.bag.recovery import recover as written  # noqa: PLC0415

    source = run / BAG_FOLDER if (run / BAG_FOLDER).is_dir() else run
    folder = source.with_name(f"{source.stem}{_SUFFIX}") if out is None else out
    try:
        if out is None and is_whole(source):
            _print_complete(source, as_json=as_json)
            return
        recovery = _reread(written(source, folder))
    except BagError as error:
        raise CommandError(str(error)) from None
    except FileExistsError:
        raise CommandError(f"{folder} already exists; name another folder with --out") from None
    except OSError as error:
        raise CommandError(f"the bag cannot be recovered: {sentence_of(error)}") from None
    if as_json:
        console.as_json(recovery.data())
        return
    for line in recovery.lines():
        console.line(line)


def _reread(recovered: "Recovered") -> _Recovery:
    from satform.bag.errors import BagError  # noqa: PLC0415 - needs ROS
    from satform.bag.reader import read_bag  # noqa: PLC0415 - most commands do without

    try:
        return _Recovery(recovered, read_bag(recovered.folder), "")
    except BagError as error:
        return _Recovery(recovered, None, str(error))


def _print_complete(source: Path, *, as_json: bool) -> None:
    if as_json:
        console.as_json({"source": str(source), "whole": True})
    else:
        console.line(f"{source} is complete and has a valid metadata.yaml; there is nothing to recover")
