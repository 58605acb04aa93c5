# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A stored flight, from a bag or a record: all that a report is made of."""

from dataclasses import dataclass
from pathlib import Path

from satform.bag.events import Events
from satform.evaluation.evaluate import evaluate
from satform.files.bounded_file import read_json
from satform.flight.scenario_record import with_chief
from satform.record.archive import RECORD, RecordError, load_record
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario, ScenarioError, load_scenario
from satform.scenario.expectation import Verdict
from satform.scenario.loader import SCENARIO_FILE
from satform_bringup import BAG_FOLDER
from satform_tools.errors import CommandError, sentence_of
from satform_tools.run import output_folders


@dataclass(frozen=True)
class StoredRun:
    """A stored flight.

    Attributes:
        path: of the bag or of the record.
        scenario: of the flight.
        record: the flight, or as much of it as there is.
        complete: whether it is the whole flight, as far as that went.
        versions: name and version of each part of the software; empty where not recorded.
        events: recorded ones; None without a bag.
        clocked: whether it was flown against the wall clock.
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
        """Name of the run's folder."""
        path = self.path.resolve()
        return path.parent.name if path.name in {BAG_FOLDER, RECORD} else path.name

    @property
    def cut_short(self) -> str:
        """Where an incomplete flight ends, as text; empty when it is complete."""
        if self.complete:
            return ""
        return f"cut short at step {self.record.steps} of {self.scenario.timing.steps}"

    @property
    def ended_early(self) -> str:
        """Step and reason of an early end, as text; empty when there is none."""
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
        """Reason for which a flight has no state hash; empty when it has one."""
        if self.clocked:
            return "none: runs against the wall clock are not bitwise reproducible"
        return "" if self.complete else f"none: {self.cut_short}"


def find(run: Path) -> StoredRun:
    """The flight at a path.

    Args:
        run: folder of a run, folder of a bag, or `.mcap` file.

    Returns:
        The flight, of at least one step.

    Raises:
        CommandError: there is none, or it cannot be read.
    """
    try:
        stored = _find(run)
    except ScenarioError as error:
        raise CommandError(f"{run}: {error.first}") from None
    except (OSError, ValueError) as error:
        reason = sentence_of(error) if isinstance(error, OSError) else str(error)
        raise CommandError(f"{run}: {reason}") from None
    if stored.record.steps == 0:
        end = stored.record.early_end
        why = "" if end is None else f": {end.sentence}"
        raise CommandError(f"{stored.path}: no complete step was recorded{why}")
    return stored


def _find(run: Path) -> StoredRun:
    if not run.exists():
        raise CommandError(f"{run}: there is no such run or bag")
    if (run / BAG_FOLDER).is_dir():
        return _from_bag(run / BAG_FOLDER)
    if (run / RECORD).is_file():
        return _from_record(run)
    if (run / output_folders.RESULT).is_file():
        raise CommandError(f"{run}: this run was not recorded, so there is nothing to report")
    return _from_bag(run)


def _from_record(folder: Path) -> StoredRun:
    scenario = load_scenario(folder / SCENARIO_FILE, recorded=True)
    record = _record(folder / RECORD)
    names = tuple(satellite.name for satellite in scenario.satellites)
    if record.satellites != names:
        raise CommandError(
            f"{folder}: the record is of {', '.join(record.satellites)}, the scenario has {', '.join(names)}"
        )
    complete = record.steps == scenario.timing.steps or record.early_end is not None
    record = with_chief(record, scenario)
    return StoredRun(folder / RECORD, scenario, record, complete, _noted_versions(folder), None)


def _record(path: Path) -> FlightRecord:
    try:
        return load_record(path)
    except OSError as error:
        raise CommandError(f"{path}: cannot be read: {sentence_of(error)}") from None
    except RecordError as error:
        raise CommandError(str(error)) from None


def _from_bag(path: Path) -> StoredRun:
    try:
        from satform.bag.errors import BagError  # noqa: PLC0415 - needs ROS
        from satform.bag.reader import read_bag  # noqa: PLC0415 - most commands do without
    except ImportError as error:
        raise CommandError(f"reading a bag needs ROS 2 ({error}); start with ./tools/satform") from None
    try:
        bag = read_bag(path)
    except BagError as error:
        raise CommandError(str(error)) from None
    # A report inside the folder of the bag would become a part of the bag.
    folder = path if path.is_dir() else path.parent
    versions = {**_noted_versions(folder.parent), **bag.versions}
    # The entries of the bag's metadata about its scenario come from the scenario itself.
    versions = {name: version for name, version in versions.items() if name not in {"scenario", "digest"}}
    return StoredRun(folder, bag.scenario, bag.record, bag.complete, versions, bag.history, bag.clocked)


def _noted_versions(folder: Path) -> dict[str, str]:
    """Versions as a run's result names them; none where it does not."""
    try:
        noted = read_json(folder / output_folders.RESULT, output_folders.MOST_BYTES)["versions"]
        return {str(name): str(version) for name, version in noted.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}
