# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A flight as it was kept, in a bag or in a record: all that a report is made of."""

from dataclasses import dataclass
from pathlib import Path

from satform.bag.events import Events
from satform.evaluation.evaluate import evaluate
from satform.files.bounded_file import read_json
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario, load_scenario
from satform.scenario.expectation import Verdict
from satform_bringup import BAG_FOLDER, SCENARIO_FILE
from satform_tools.errors import CommandError, sentence_of
from satform_tools.run import folders


@dataclass(frozen=True)
class Kept:
    """A flight as it was kept.

    Attributes:
        path: of the bag or of the record.
        scenario: what was flown.
        record: the flight, or as much of it as there is.
        complete: whether it is the whole flight, as far as that went.
        versions: what flew it, name and version of each part; empty where nothing was noted down.
        events: what happened besides the numbers; None where nobody noted it down.
        clocked: whether it was flown on the wall clock.
    """

    path: Path
    scenario: Scenario
    record: FlightRecord
    complete: bool
    versions: dict[str, str]
    events: Events | None
    clocked: bool = False

    @property
    def name(self) -> str:
        """Of the run's folder, by which people tell runs apart."""
        place = self.path.resolve()
        return place.parent.name if place.name in {BAG_FOLDER, folders.RECORD} else place.name

    @property
    def cut_short(self) -> str:
        """Where a flight ends that is not complete, in words; empty when it is."""
        if self.complete:
            return ""
        return f"cut short at step {self.record.steps} of {self.scenario.timing.steps}"

    @property
    def ended_early(self) -> str:
        """After which step a flight ended early, and why, in words; empty when it did not."""
        end = self.record.early_end
        flown = f"step {self.record.steps} of {self.scenario.timing.steps}"
        return "" if end is None else f"{flown}: {end.sentence}"

    def verdicts(self) -> list[Verdict]:
        """The expectations against the flight; none where it is only a part of one."""
        return evaluate(self.scenario, self.record) if self.complete else []

    @property
    def state_hash(self) -> str:
        """Of the record, as the run that made it printed it; empty where no other run has these bits."""
        return "" if self.why_no_hash else self.record.digest()

    @property
    def why_no_hash(self) -> str:
        """Why a flight has no state hash, in words; empty when it has one."""
        if self.clocked:
            return "none: on the wall clock every run has bits of its own"
        return "" if self.complete else f"none: {self.cut_short}"


def find(run: Path) -> Kept:
    """The flight that a path means.

    Args:
        run: folder of a run, folder of a bag, or `.mcap` file.

    Returns:
        The flight, of at least one step.

    Raises:
        CommandError: there is none, or it cannot be read.
    """
    try:
        kept = _find(run)
    except (OSError, ValueError) as error:
        reason = sentence_of(error) if isinstance(error, OSError) else str(error)
        raise CommandError(f"{run}: {reason}") from None
    if kept.record.steps == 0:
        end = kept.record.early_end
        why = "" if end is None else f": {end.sentence}"
        raise CommandError(f"{kept.path}: not one whole step was recorded{why}")
    return kept


def _find(run: Path) -> Kept:
    if not run.exists():
        raise CommandError(f"{run}: there is no such run or bag")
    if (run / BAG_FOLDER).is_dir():
        return _from_bag(run / BAG_FOLDER)
    if (run / folders.RECORD).is_file():
        return _from_record(run)
    if (run / folders.RESULT).is_file():
        raise CommandError(f"{run}: this run was not recorded, so there is nothing to tell of it")
    return _from_bag(run)


def _from_record(folder: Path) -> Kept:
    scenario = load_scenario(folder / SCENARIO_FILE, recorded=True)
    record = folders.load_record(folder / folders.RECORD)
    names = tuple(satellite.name for satellite in scenario.satellites)
    if record.satellites != names:
        raise CommandError(
            f"{folder}: the record is of {', '.join(record.satellites)}, the scenario has {', '.join(names)}"
        )
    complete = record.steps == scenario.timing.steps or record.early_end is not None
    return Kept(folder / folders.RECORD, scenario, record, complete, _noted_versions(folder), None)


def _from_bag(path: Path) -> Kept:
    try:
        from satform.bag.errors import BagError  # noqa: PLC0415 - needs ROS
        from satform.bag.reader import read_bag  # noqa: PLC0415 - most commands do without
    except ImportError as error:
        raise CommandError(f"reading a bag needs ROS 2 ({error}); start with ./tools/satform") from None
    try:
        bag = read_bag(path)
    except BagError as error:
        raise CommandError(str(error)) from None
    # A bag's own folder is the bag, a report in it would be in the way.
    place = path if path.is_dir() else path.parent
    versions = {**_noted_versions(place.parent), **bag.versions}
    # What a bag's note repeats of its scenario is told from the scenario itself.
    versions = {name: version for name, version in versions.items() if name not in {"scenario", "digest"}}
    return Kept(place, bag.scenario, bag.record, bag.complete, versions, bag.history, bag.clocked)


def _noted_versions(folder: Path) -> dict[str, str]:
    """Versions as a run's result names them; none where it does not."""
    try:
        noted = read_json(folder / folders.RESULT, folders.MOST_BYTES)["versions"]
        return {str(name): str(version) for name, version in noted.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}
