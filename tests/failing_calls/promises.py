# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What writes files, what it says that it has kept, and what has to be there then, whatever failed."""

import json
import os
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from bag_writing import PROFILES, messages_of, write
from campaigns import results_of, some_campaign
from flights import satellite_of, shortened
from satform.bag.records import records
from satform.campaign import folder_repair
from satform.campaign.folder import CampaignFolder, locked
from satform.campaign.manifest import FolderError
from satform.campaign.result_files import all_series
from satform.campaign.result_store import ResultStore
from satform.files.durable_file import write_durably
from satform.flight.simulate import simulate
from satform.record.archive import RECORD, load_record, save_record
from satform_bringup.supervisor import run_registry
from satform_nodes.bag import recovery
from satform_nodes.bag.writer import BagWriter
from satform_nodes.satellite.checkpoint_file import CheckpointFile
from satform_nodes.transport import topic_types
from satform_nodes.transport.message_definitions import described

Say = Callable[[str], None]
"""Says that something is kept."""


class Writer(ABC):
    """Something that writes files.

    Attributes:
        all_said: how much is said to be kept if no call fails; None where a failure is not the end.
    """

    all_said: int | None = None

    def prepare(self, folder: Path) -> None:  # noqa: B027 - most writers begin in an empty folder
        """Make what is there before."""

    @abstractmethod
    def act(self, folder: Path, say: Say) -> None:
        """Write, and say what is kept once it is.

        Raises:
            OSError: a call failed.
        """

    @abstractmethod
    def broken(self, folder: Path, said: list[str], killed: bool) -> str:
        """Which promise is broken, in words; empty for none.

        Args:
            folder: in which was written.
            said: to be kept, in order.
            killed: whether the process was ended, so that drafts may be left.
        """


def _drafts(folder: Path) -> list[str]:
    return [path.name for path in folder.rglob(".*") if path.is_file() and path.name != ".lock"]


class OneFile(Writer):
    """A file that is written again and again: it has the content of which that was said, or a later one."""

    all_said = 3

    def act(self, folder: Path, say: Say) -> None:
        for number in range(3):
            write_durably(folder / "file", f"{number}".encode() * 10_000)
            say(str(number))

    def broken(self, folder: Path, said: list[str], killed: bool) -> str:
        content = (folder / "file").read_text() if (folder / "file").exists() else ""
        if not killed and _drafts(folder):
            return f"drafts are left: {_drafts(folder)}"
        if not content:
            return "the file is missing" if said else ""
        whole = len(content) == 10_000 and len(set(content)) == 1
        return "" if whole and int(content[0]) >= int((said or ["0"])[-1]) else "older, or a part only"


class Checkpoints(Writer):
    """Checkpoints: the last one that was written can be restored, and none is taken for a later one."""

    def __init__(self) -> None:
        self._scenario = shortened("ring_six", 60.0)

    def act(self, folder: Path, say: Say) -> None:
        satellite = satellite_of(self._scenario, 0)
        file = CheckpointFile(str(folder / "checkpoints"), "sat1", 1)
        for step in (1, 2, 3):
            satellite.join(step)
            file.keep(satellite, [1, 5])
            if file.written == step:
                say(str(step))
            elif not file.problem:
                raise AssertionError("a checkpoint was neither written nor said to have failed")

    def broken(self, folder: Path, said: list[str], killed: bool) -> str:
        found = CheckpointFile(str(folder / "checkpoints"), "sat1", 1)
        if found.step < int((said or ["-1"])[-1]):
            return f"the checkpoint is of step {found.step}"
        if found.step >= 0:
            satellite = satellite_of(self._scenario, 0)
            found.restore(satellite, [1, 5])
            if satellite.state.step != found.step:
                return "the checkpoint is of another step than it says"
        return "" if killed or not _drafts(folder) else f"drafts are left: {_drafts(folder)}"


class Bag(Writer):
    """A bag: it has all messages of the steps of which the recorder said so, and is whole once closed."""

    STEPS = 40

    all_said = 1 + STEPS // 8

    def __init__(self) -> None:
        self._scenario = shortened("triangle", 2.0)

    def act(self, folder: Path, say: Say) -> None:
        bag = BagWriter(folder / "bag", self._scenario, {})
        channel = bag.add_topic("/sat1/state", described(topic_types.TYPES["state"]), PROFILES)
        try:
            for step in range(self.STEPS):
                bag.write(channel, step, bytes(3000), step)
                if step % 8 == 7:
                    bag.flush()
                    say(str(step))
        finally:
            bag.close()
        say("closed")

    def broken(self, folder: Path, said: list[str], killed: bool) -> str:
        files = list((folder / "bag").glob("*.mcap"))
        if not said:
            return ""
        if "closed" in said and not recovery.is_whole(folder / "bag"):
            return "it is not whole"
        found = []
        with suppress(*recovery.READ_FAILURES):
            for record in records(files[0]):
                if type(record).__name__ == "Message":
                    found.append(record.sequence)
        last = max(int(step) for step in said if step != "closed")
        return "" if found[: last + 1] == list(range(last + 1)) else f"{found} of {last + 1} are there"


class Recovery(Writer):
    """A recovered bag: the damaged one stays as it is, and what is not whole does not pass for whole."""

    all_said = 1

    def __init__(self) -> None:
        self._scenario = shortened("triangle", 2.0)
        self._content = b""

    def prepare(self, folder: Path) -> None:
        write(folder / "bag", self._scenario, messages_of(simulate(self._scenario)))
        (file,) = (folder / "bag").glob("*.mcap")
        self._content = file.read_bytes()[:-100]
        file.write_bytes(self._content)
        (folder / "bag" / "metadata.yaml").unlink()

    def act(self, folder: Path, say: Say) -> None:
        recovery.recover(folder / "bag", folder / "new")
        say("recovered")

    def broken(self, folder: Path, said: list[str], killed: bool) -> str:
        if (folder / "bag" / "bag_0.mcap").read_bytes() != self._content:
            return "the damaged bag was changed"
        there = (folder / "new").exists()
        if said:
            return "" if there and recovery.is_whole(folder / "new") else "the new bag is not whole"
        return "" if killed or not there else "a part of a bag is left"


class Record(Writer):
    """The record of a run: whole, or not there."""

    all_said = 1

    def __init__(self) -> None:
        self._record = simulate(shortened("triangle", 2.0))

    def act(self, folder: Path, say: Say) -> None:
        save_record(self._record, folder / RECORD)
        say("record")

    def broken(self, folder: Path, said: list[str], killed: bool) -> str:
        if not (folder / RECORD).exists():
            return "the record is missing" if said else ""
        differences = load_record(folder / RECORD).differences(self._record)
        return f"another record: {differences}" if differences else ""


class Registry(Writer):
    """Descriptions of runs under way: whole or not there; a failure does not end the run."""

    def act(self, folder: Path, say: Say) -> None:
        os.environ["XDG_RUNTIME_DIR"] = str(folder)
        folder.chmod(0o700)
        for domain in (1, 2):
            run_registry.describe(domain, "triangle", folder)
            if domain in [run.domain for run in run_registry.registered_runs()]:
                say(str(domain))

    def broken(self, folder: Path, said: list[str], killed: bool) -> str:
        files = sorted((folder / "satform").glob("run-*.json"))
        domains = [str(json.loads(path.read_text())["domain"]) for path in files]
        if not set(said) <= set(domains):
            return f"only {domains} are described"
        return "" if killed or not _drafts(folder) else f"drafts are left: {_drafts(folder)}"


class Campaign(Writer):
    """Results of a campaign: every case that was stored has its result, and the folder can be used on."""

    CASES = 9

    all_said = 1 + CASES

    def __init__(self) -> None:
        self._campaign = some_campaign(self.CASES)
        self._results = list(results_of(self._campaign, self.CASES))

    def act(self, folder: Path, say: Say) -> None:
        path = folder / "campaign"
        path.mkdir()
        with locked(path):
            campaign = CampaignFolder.create(path, self._campaign, None, "2026-01-01T00:00:00+00:00")
            say("created")
            store = ResultStore(campaign)
            for first in (0, 3, 6):
                store.store(self._results[first : first + 3])
                store.flush()
                for number in range(first, first + 3):
                    say(str(number))

    def broken(self, folder: Path, said: list[str], killed: bool) -> str:
        try:
            campaign = CampaignFolder.open(folder / "campaign")
        except FolderError as error:
            return str(error) if said else ""
        campaign.campaign()
        return _missing(campaign, self._results, [int(number) for number in said if number != "created"])


class Retry(Writer):
    """Lost cases are forgotten: all others keep their results and series, and none has two."""

    CASES = 9
    LOST = (1, 4)

    all_said = 1

    def __init__(self) -> None:
        found = results_of(some_campaign(self.CASES), self.CASES)
        self._results = [replace(own, lost=own.number in self.LOST) for own in found]

    def prepare(self, folder: Path) -> None:
        path = folder / "campaign"
        path.mkdir()
        about = some_campaign(self.CASES)
        store = ResultStore(CampaignFolder.create(path, about, None, "2026-01-01T00:00:00+00:00"))
        for first in (0, 3, 6):
            store.store(self._results[first : first + 3])
            store.flush()

    def act(self, folder: Path, say: Say) -> None:
        folder_repair.forget_lost(CampaignFolder.open(folder / "campaign"))
        say("forgotten")

    def broken(self, folder: Path, said: list[str], killed: bool) -> str:
        campaign = CampaignFolder.open(folder / "campaign")
        # As the next one that goes on with it.
        folder_repair.clean(campaign)
        kept = [number for number in range(self.CASES) if number not in self.LOST]
        if said and campaign.done()[list(self.LOST)].any():
            return "a lost case still has a result"
        return _missing(campaign, self._results, kept)


def _missing(campaign: CampaignFolder, results: list, numbers: list[int]) -> str:
    """Which results or series of cases are missing or others, in words; empty for none."""
    damaged = folder_repair.damaged_files(campaign)
    if damaged:
        return str(damaged[0])
    complete = campaign.manifest.columns.complete
    found = {result.number: result for result in campaign.results()}
    series = dict(all_series(campaign.path))
    for number in numbers:
        wanted = complete(results[number])
        if number not in found:
            return f"case {number} has no result"
        if found[number].reason != wanted.reason or found[number].changes != dict(wanted.changes):
            return f"case {number} has another result"
        if not all(np.array_equal(series[number][name], own) for name, own in wanted.series.items()):
            return f"case {number} has other series"
    return ""


WRITERS: dict[str, Callable[[], Writer]] = {
    "file": OneFile,
    "checkpoint": Checkpoints,
    "bag": Bag,
    "recovery": Recovery,
    "record": Record,
    "registry": Registry,
    "campaign": Campaign,
    "retry": Retry,
}
"""By name."""
