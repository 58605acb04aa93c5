# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The folder of a campaign: what is refused, what a repair puts aside, and what a chunk leaves there."""

import json
import shutil
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partialmethod
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from campaigns import campaign, of
from satform.campaign.cases import case_scenario, case_values
from satform.campaign.chunk import columns_of, fly_case, fly_chunk
from satform.campaign.folder import CampaignFolder, locked
from satform.campaign.folder_repair import clean, damaged_files, forget_lost, repair
from satform.campaign.loader import load_campaign, save_campaign
from satform.campaign.manifest import FolderError
from satform.campaign.model import Campaign
from satform.campaign.result_files import all_series, result_files, series_file
from satform.campaign.result_store import ResultStore
from satform.campaign.results import CaseResult
from satform.evaluation.evaluate import evaluate
from satform.flight.simulate import simulate

EXPECTED = {"kind": "arc_length_spread", "at": 4.0, "below": 50_000.0, "source": "a test"}
SHORT = {"timing.duration": 4.0, "expect": [EXPECTED]}


def small(**fields: object) -> Campaign:
    """A campaign of flights of a few steps, some of which meet what is expected."""
    given = {
        "runs": 6,
        "set": SHORT,
        "dispersions": [
            of("satellites[*].arc_length", {"kind": "uniform", "low": -15e3, "high": 15e3}, applied="add")
        ],
        "figures": [{"name": "effort", "measure": {"kind": "delta_v"}}],
    }
    return campaign("triangle", **{**given, **fields})


@pytest.fixture
def folder(tmp_path: Path) -> CampaignFolder:
    path = tmp_path / "campaign"
    path.mkdir()
    return CampaignFolder.create(path, small(), None, "2026-01-01T00:00:00+00:00")


def test_a_case_of_a_chunk_has_the_figures_of_its_scenario_flown_alone() -> None:
    flown = fly_chunk(small(), range(6))
    assert {result.success for result in flown} == {True, False}
    for result in flown:
        scenario = case_scenario(small(), result.number)
        record = simulate(scenario)
        (verdict,) = evaluate(scenario, record)
        assert result.changes == case_values(small(), result.number)
        assert result.figures[verdict.label] == verdict.figure
        # Delta-v is that of the satellite that needs most.
        assert result.figures["effort"] == pytest.approx(record.effort.sum(axis=0).max(), rel=1e-12)
        assert result.success == result.met[verdict.label] == verdict.met
        assert result.reason == ("" if verdict.met else f"not as expected: {verdict.label}")
        assert (result.stacked, result.state_hash) == (True, None)
        assert fly_case(small(), result.number).state_hash == record.digest()


def test_a_flight_that_ends_early_and_one_that_cannot_be_flown_are_results_with_reasons() -> None:
    diverging = small(set={**SHORT, "limits.distance": 1.0})
    result = fly_case(diverging, 0)
    assert "beyond the limit of 1 m" in result.reason
    assert not result.success
    orbits = of("orbit.period", {"kind": "choice", "values": [6000.0, -1.0]})
    impossible = small(dispersions=[orbits], runs=12)
    results = fly_chunk(impossible, range(12))
    assert {result.changes["orbit.period"] for result in results} == {6000.0, -1.0}
    for result in results:
        cannot_be_flown = result.changes["orbit.period"] < 0.0
        names_it = f"the scenario cannot be flown: case {result.number}, orbit.period = -1: found -1.0"
        assert result.reason.startswith(names_it) == cannot_be_flown


def test_a_chunk_reports_what_begins_how_far_it_is_and_every_result_once() -> None:
    reported: list[tuple[str, object]] = []

    class Observer:
        def begin(self, numbers: Sequence[int]) -> None:
            reported.append(("begin", tuple(numbers)))

        def advanced(self, part: float) -> None:
            reported.append(("advanced", part))

        def finished(self, results: Sequence[CaseResult]) -> None:
            reported.append(("finished", tuple(result.number for result in results)))

    results = fly_chunk(small(), range(6), Observer())
    assert all(result.stacked for result in results)
    assert reported == [("begin", tuple(range(6))), ("advanced", 1.0), ("finished", tuple(range(6)))]
    reported.clear()
    fly_chunk(small(), [3], Observer())
    assert reported == [("begin", (3,)), ("finished", (3,))]


def test_retained_series_have_every_so_many_steps_of_the_record() -> None:
    keep = {"series": [{"quantity": "position", "every": 1.0}, {"quantity": "tracking_error"}]}
    keep["series"].append({"quantity": "effort", "every": 2.0})
    result = fly_case(small(keep=keep), 0)
    record = simulate(case_scenario(small(), 0))
    stride = round(1.0 / record.step)
    assert np.array_equal(result.series["position"], record.position[::stride])
    assert np.array_equal(result.series["tracking_error"], record.tracking_error)
    assert np.array_equal(result.series["effort"], record.effort[:: round(2.0 / record.step)])


def test_the_copy_in_the_folder_is_the_same_campaign(folder: CampaignFolder) -> None:
    assert folder.campaign().digest == small().digest
    assert [case_values(folder.campaign(), n) for n in range(6)] == [
        case_values(small(), n) for n in range(6)
    ]
    assert folder.manifest.columns == columns_of(small())


def test_a_changed_copy_and_a_changed_source_are_refused_by_digest(
    folder: CampaignFolder, tmp_path: Path
) -> None:
    source = save_campaign(small(), tmp_path)
    started = replace(folder, manifest=replace(folder.manifest, file=str(source)))
    started.require_source()
    scenario = tmp_path / "scenario.json"
    changed = json.loads(scenario.read_text())
    changed["orbit"]["period"] += 1.0
    scenario.write_text(json.dumps(changed))
    with pytest.raises(FolderError, match="the campaign or its scenario is not the one that was started"):
        started.require_source()
    (folder.path / "scenario.json").write_text(json.dumps(changed))
    with pytest.raises(FolderError, match="the campaign or its scenario is not the one that was started"):
        folder.campaign()
    source.unlink()
    started.require_source()


def test_results_of_other_software_are_refused(folder: CampaignFolder) -> None:
    folder.require_software()
    other = replace(folder.manifest, versions={**folder.manifest.versions, "numpy": "1.0"})
    with pytest.raises(FolderError, match=r"numpy 1\.0 then, 2.* now"):
        replace(folder, manifest=other).require_software()


def test_two_processes_do_not_fly_one_campaign(folder: CampaignFolder) -> None:
    taken = "is flying a campaign in this folder"
    with locked(folder.path), pytest.raises(FolderError, match=taken), locked(folder.path):
        pass
    with locked(folder.path):
        pass


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (None, "is not the folder of a campaign"),
        ("{", "is not JSON"),
        ("{}", "is not the manifest of a campaign"),
        ('{"format": 99}', "is of format 99"),
    ],
)
def test_a_folder_without_a_manifest_is_refused(text: str | None, sentence: str, tmp_path: Path) -> None:
    if text is not None:
        (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(FolderError, match=sentence):
        CampaignFolder.open(tmp_path)


def test_a_repair_puts_a_damaged_file_aside_and_its_cases_are_missing(folder: CampaignFolder) -> None:
    store = ResultStore(folder)
    store.store([CaseResult(0, {"seed": 1}), CaseResult(3, {"seed": 1})])
    store.flush()
    store.store([CaseResult(1, {"seed": 1})])
    store.flush()
    first = min((folder.path / "results").iterdir())
    first.write_bytes(first.read_bytes()[:-10])
    (damage,) = damaged_files(folder)
    assert damage.path == first
    assert repair(folder) == 1
    assert damaged_files(folder) == []
    assert np.flatnonzero(folder.done()).tolist() == [1]
    assert (folder.path / "damaged" / first.name).exists()


def test_lost_cases_are_forgotten_and_the_series_of_the_others_stay(folder: CampaignFolder) -> None:
    series = {"position": np.ones((2, 3))}
    store = ResultStore(folder)
    store.store([CaseResult(0, {"seed": 1}, lost=True), CaseResult(2, {"seed": 1}, series=series)])
    store.store([CaseResult(1, {"seed": 1}, lost=True)])
    store.flush()
    assert forget_lost(folder) == 2
    assert np.flatnonzero(folder.done()).tolist() == [2]
    assert [number for number, _ in all_series(folder.path)] == [2]
    # A reader of the whole folder of series finds each case once, too.
    (file,) = result_files(folder.path)
    assert list((folder.path / "series").iterdir()) == [series_file(file)]


def test_a_process_killed_while_it_forgets_lost_cases_leaves_a_folder_that_is_resumed(
    folder: CampaignFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    series = {"position": np.ones((2, 3))}

    def kept() -> list[int]:
        return [result.number for result in folder.results() if not result.lost]

    for operation in ("replace", "unlink"):
        shutil.rmtree(folder.path / "results", ignore_errors=True)
        store = ResultStore(folder)
        store.store([CaseResult(0, {"seed": 1}, lost=True), CaseResult(2, {"seed": 1}, series=series)])
        store.flush()
        # A kill after each of the operations by which a file is replaced.
        for last in range(4):
            count = 0

            def killed(path: Path, *target: Path, call: Any, last: int = last) -> Any:
                nonlocal count
                if path.suffix == ".parquet" or target:
                    if count == last:
                        raise KeyboardInterrupt
                    count += 1
                return call(path, *target)

            with monkeypatch.context() as patch, suppress(KeyboardInterrupt):
                patch.setattr(Path, operation, partialmethod(killed, call=getattr(Path, operation)))
                forget_lost(folder)
            assert damaged_files(folder) == []
            clean(folder)
            assert damaged_files(folder) == []
            assert kept() == [2]
            assert [number for number, _ in all_series(folder.path)] == [2]
            assert len(list((folder.path / "series").iterdir())) == 1
            assert not list((folder.path / "replaced").glob("*"))


def test_a_repair_puts_aside_every_file_that_cannot_be_used(folder: CampaignFolder, tmp_path: Path) -> None:
    store = ResultStore(folder)
    for numbers in ([0, 1], [3], [1, 2]):
        store.store([CaseResult(number, {"seed": 1}) for number in numbers])
        store.flush()
    other = tmp_path / "other"
    other.mkdir()
    foreign = ResultStore(CampaignFolder.create(other, small(seed=9), None, ""))
    foreign.store([CaseResult(4, {"seed": 1})])
    foreign.flush()
    large = tmp_path / "large"
    large.mkdir()
    beyond = ResultStore(CampaignFolder.create(large, small(runs=99), None, ""))
    beyond.store([CaseResult(50, {"seed": 1})])
    beyond.flush()
    results = folder.path / "results"
    for path in (*(other / "results").iterdir(), *(large / "results").iterdir()):
        shutil.copy(path, results)
    (results / "cases.parquet").touch()
    sentences = sorted(str(error).split(": ")[1] for error in damaged_files(folder))
    assert len(sentences) == 4
    assert sentences[0].startswith("has case 1, which is in ")
    assert sentences[1:] == ["is not the name of a file of results", *["is of another campaign"] * 2]
    assert repair(folder) == 4
    assert damaged_files(folder) == []
    assert np.flatnonzero(folder.done()).tolist() == [0, 1, 3]
    assert len(list((folder.path / "damaged").iterdir())) == 4


def test_files_of_series_that_no_file_of_results_names_are_removed(folder: CampaignFolder) -> None:
    series = {"position": np.ones((2, 3))}
    store = ResultStore(folder)
    for number in (0, 1):
        store.store([CaseResult(number, {"seed": 1}, series=series)])
        store.flush()
    # As after a kill between the file of series and that of the results.
    result_files(folder.path)[0].path.unlink()
    clean(folder)
    (file,) = result_files(folder.path)
    assert list((folder.path / "series").iterdir()) == [series_file(file)]


def test_series_are_stored_in_files_that_are_not_larger_than_those_of_a_chunk(
    folder: CampaignFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("satform.campaign.result_store.MOST_SERIES_BYTES", 250)
    store = ResultStore(folder)
    sizes = {5: 10, 1: 10, 2: 10, 0: 40, 3: 10}
    results = [
        CaseResult(number, {"seed": 1}, series={"effort": np.full((rows, 1), number)})
        for number, rows in sizes.items()
    ]
    store.store([*results, CaseResult(4, {"seed": 1})])
    store.flush()
    found = [(file.first, file.last) for file in result_files(folder.path)]
    assert found == [(0, 0), (1, 4), (5, 5)]
    assert damaged_files(folder) == []
    series = dict(all_series(folder.path))
    assert {number: len(own["effort"]) for number, own in series.items()} == sizes


def test_the_size_of_the_series_of_a_case_is_known_before_it_is_flown() -> None:
    record = simulate(case_scenario(small(), 0))
    for every in (None, 1.0):
        keep = {"series": [{"quantity": name, "every": every} for name in ("position", "effort", "rate")]}
        result = fly_case(small(keep=keep), 0)
        size = sum(array.nbytes for array in result.series.values())
        # A quantity that is decided in a step has one row less.
        row = 8 * len(record.satellites)
        assert size <= small(keep=keep).series_bytes <= size + row


def test_the_same_campaign_loads_from_its_file_and_from_the_folder(folder: CampaignFolder) -> None:
    assert load_campaign(folder.path / "campaign.json").figure_names == small().figure_names
