"""Telling of a flight that was kept: its figures, and pictures of it."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from satform.metrics import Verdict, judge
from satform.record import FlightRecord
from satform.scenario import Scenario, load_scenario
from satform_bringup import BAG_FOLDER, SCENARIO_FILE
from satform_tools import folders, say, tables
from satform_tools.faults import CommandError, sentence_of
from satform_tools.summary import summarise


@dataclass(frozen=True)
class Kept:
    """A flight as it was kept.

    Attributes:
        path: of the bag or of the record.
        scenario: what was flown.
        record: the flight, or as much of it as there is.
        complete: whether it is the whole flight.
    """

    path: Path
    scenario: Scenario
    record: FlightRecord
    complete: bool


def report(run: Path, out: Path | None, *, as_json: bool) -> None:
    """Print a kept flight's figures and draw its pictures.

    Args:
        run: folder of a run, folder of a bag, or `.mcap` file.
        out: folder of the pictures; None for `report` beside the bag or record.
        as_json: whether to print for a machine.

    Raises:
        CommandError: there is no flight, or the pictures cannot be written.
    """
    kept = find(run)
    if kept.record.steps == 0:
        raise CommandError(f"{kept.path}: not one whole step was recorded")
    # Figures of a part of a flight are no verdict on the whole.
    verdicts = judge(kept.scenario.expect, kept.record) if kept.complete else []
    folder = out or kept.path.parent / "report"
    pictures = _draw(kept, folder)
    if as_json:
        say.as_json(_data(kept, verdicts, pictures))
        return
    say.heading(f"{kept.scenario.name}: {kept.scenario.title}")
    if not kept.complete:
        say.line(
            f"NOT COMPLETE: {kept.record.steps} of {kept.scenario.timing.steps} steps; nothing is judged",
            "bold red",
        )
    tables.print_summary(summarise(kept.record))
    if verdicts:
        say.line()
        tables.print_verdicts(verdicts)
    say.line(f"pictures: {', '.join(str(picture) for picture in pictures)}")


def find(run: Path) -> Kept:
    """The flight that a path means.

    Args:
        run: folder of a run, folder of a bag, or `.mcap` file.

    Returns:
        The flight.

    Raises:
        CommandError: there is none, or it cannot be read.
    """
    try:
        if not run.exists():
            raise CommandError(f"{run}: there is no such run or bag")
        if (run / BAG_FOLDER).is_dir():
            return _from_bag(run / BAG_FOLDER)
        if (run / folders.RECORD).is_file():
            return _from_record(run)
    except (OSError, ValueError) as error:
        reason = sentence_of(error) if isinstance(error, OSError) else str(error)
        raise CommandError(f"{run}: {reason}") from None
    if (run / folders.RESULT).is_file():
        raise CommandError(f"{run}: this run was not recorded, so there is nothing to tell of it")
    return _from_bag(run)


def _from_record(folder: Path) -> Kept:
    scenario = load_scenario(folder / SCENARIO_FILE)
    record = folders.load_record(folder / folders.RECORD)
    names = tuple(satellite.name for satellite in scenario.satellites)
    if record.satellites != names:
        raise CommandError(
            f"{folder}: the record is of {', '.join(record.satellites)}, the scenario has {', '.join(names)}"
        )
    return Kept(folder / folders.RECORD, scenario, record, record.steps == scenario.timing.steps)


def _from_bag(path: Path) -> Kept:
    try:
        from satform_nodes.bag_reader import BagError, read_bag  # noqa: PLC0415 - needs ROS
    except ImportError as error:
        raise CommandError(f"reading a bag needs ROS 2 ({error}); start with ./tools/satform") from None
    try:
        bag = read_bag(path)
    except BagError as error:
        raise CommandError(str(error)) from None
    # A bag's own folder is the bag, a report in it would be in the way.
    place = path if path.is_dir() else path.parent
    return Kept(place, bag.scenario, bag.record, bag.complete)


def _draw(kept: Kept, folder: Path) -> list[Path]:
    from satform_tools import pictures  # noqa: PLC0415 - matplotlib takes long to load

    try:
        folder.mkdir(parents=True, exist_ok=True)
        return pictures.draw(kept.scenario, kept.record, folder)
    except OSError as error:
        raise CommandError(f"the pictures cannot be written: {sentence_of(error)}") from None


def _data(kept: Kept, verdicts: list[Verdict], pictures: list[Path]) -> dict[str, Any]:
    return {
        "scenario": kept.scenario.name,
        "digest": kept.scenario.digest(),
        "source": str(kept.path),
        "steps": kept.record.steps,
        "steps_planned": kept.scenario.timing.steps,
        "complete": kept.complete,
        "summary": summarise(kept.record).data(),
        "expectations": [asdict(verdict) for verdict in verdicts],
        "pictures": [str(picture) for picture in pictures],
    }
