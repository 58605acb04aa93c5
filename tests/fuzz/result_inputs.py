# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Damaged results: of a campaign, of a run, checkpoints, and descriptions of runs under way."""

import hashlib
import json
import shutil
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from random import Random
from typing import Any
from unittest.mock import patch

import numpy as np
from byte_damage import damaged
from input_kind import Input
from parquet_damage import damaged_parquet
from yaml_damage import Damage

from campaigns import made_campaign
from flights import satellite_of, shortened
from satform.campaign import folder_repair
from satform.campaign.folder import CampaignFolder
from satform.campaign.manifest import MANIFEST, FolderError
from satform.campaign.result_files import ResultFileError, all_series, result_files
from satform.flight.simulate import simulate
from satform.record.archive import RECORD, save_record
from satform.scenario import ScenarioError, save_scenario
from satform.scenario.loader import SCENARIO_FILE
from satform_bringup import PROCESSES_FILE
from satform_bringup.deployment import runtime_folder
from satform_bringup.deployment.node_processes import NodeProcess
from satform_bringup.supervisor.rejoin import RejoinError, process_of
from satform_bringup.supervisor.run_registry import RegisteredRun, registered_runs
from satform_nodes.satellite.checkpoint_file import CheckpointFile
from satform_nodes.transport.node_error import NodeError
from satform_tools.bench import figures as bench_figures
from satform_tools.campaign import library
from satform_tools.campaign.summary import summarise
from satform_tools.errors import CommandError
from satform_tools.run import output_folders, stored_run

Maker = Callable[[Random, Path], Input]

_TEXTS = (
    b"[" * 100_000,
    b'{"a":' * 50_000,
    b"9" * 5000,
    b"\xff\xfe\x00",
    b"",
    b"null",
    b"[]",
    b'{"a": 1e999}',
)
"""JSON that is none, or is more than it looks like."""


def result_inputs(folder: Path) -> Maker:
    """What makes damaged files of results.

    Args:
        folder: for whole ones.
    """
    kinds = (
        *(_campaigns(folder / "campaign"),) * 5,
        *(_runs(folder / "run"),) * 3,
        _checkpoints(folder / "checkpoints"),
        _registry(),
        _processes(),
        _benchmarks(),
    )

    def make(draw: Random, place: Path) -> Input:
        return draw.choice(kinds)(draw, place)

    return make


def _json_damaged(draw: Random, content: bytes) -> bytes:
    """JSON with changed data or changed bytes, or none."""
    match draw.randrange(10):
        case 0:
            return draw.choice(_TEXTS)
        case 1 | 2:
            return damaged(draw, content)
        case _:
            tree = Damage.of([json.loads(content)])
            return json.dumps(tree.changed(draw, tree.data[0]), skipkeys=True, default=str).encode()


def _campaigns(whole: Path) -> Maker:
    made_campaign(whole, 20)
    files = [MANIFEST, "campaign.json", SCENARIO_FILE]
    tables = [str(path.relative_to(whole)) for path in sorted(whole.glob("*/*.parquet"))]

    def make(draw: Random, place: Path) -> Input:
        campaign = place / "campaign"
        shutil.copytree(whole, campaign)
        if draw.random() < 0.3:
            file = campaign / draw.choice(files)
            file.write_bytes(_json_damaged(draw, file.read_bytes()))
        else:
            _damage_table(draw, campaign / draw.choice(tables))
        rejections = (CommandError, FolderError, ResultFileError, ScenarioError)
        command = ["campaign", "report", str(campaign), "--json"]
        return Input(lambda: _read_campaign(campaign), str(campaign), rejections, command)

    return make


def _damage_table(draw: Random, file: Path) -> None:
    """Damage a file of results, whose name has the digest of its content; mostly it fits again."""
    content = file.read_bytes()
    file.unlink()
    if draw.random() < 0.02:
        return
    other = damaged_parquet(draw, content)
    first, last, digest = file.stem.removeprefix("cases-").split("-")
    if draw.random() < 0.9:
        digest = hashlib.sha256(other).hexdigest()[:16]
    if draw.random() < 0.1:
        last = draw.choice(("00000000", "99999999999999999999", "00000019", last))
    name = f"cases-{first}-{last}-{digest}.parquet" if draw.random() < 0.95 else "x.parquet"
    named = file.with_name(name)
    named.write_bytes(other)
    if file.parent.name == "series":
        # A file of results names it.
        for results in sorted((file.parent.parent / "results").glob("*.parquet")):
            changed = results.read_bytes().replace(file.name.encode(), name.encode())
            own = hashlib.sha256(changed).hexdigest()[:16]
            results.unlink()
            results.with_name(f"{results.stem[:-16]}{own}.parquet").write_bytes(changed)


def _read_campaign(path: Path) -> None:
    folder: CampaignFolder = library.opened(path)
    campaign = folder.campaign()
    damaged_ones = folder_repair.damaged_files(folder)
    summarise(folder, campaign)
    for _ in all_series(folder.path):
        pass
    if damaged_ones:
        raise damaged_ones[0]
    folder.done()
    result_files(folder.path)


def _runs(whole: Path) -> Maker:
    whole.mkdir()
    scenario = shortened("triangle", 5.0)
    save_scenario(scenario, whole / SCENARIO_FILE)
    save_record(simulate(scenario), whole / RECORD)
    (whole / output_folders.RESULT).write_text(json.dumps({"versions": {"satform": "1"}, "steps": 10}))
    arrays = dict(np.load(whole / RECORD))

    def make(draw: Random, place: Path) -> Input:
        run = place / "run"
        shutil.copytree(whole, run)
        file = run / draw.choice((RECORD, RECORD, RECORD, SCENARIO_FILE, output_folders.RESULT))
        if file.name != RECORD:
            file.write_bytes(_json_damaged(draw, file.read_bytes()))
        elif draw.random() < 0.5:
            file.write_bytes(damaged(draw, file.read_bytes()))
        else:
            np.savez(file, **_arrays(draw, arrays))
        command = ["report", str(run), "--json"] if draw.random() < 0.2 else []
        return Input(lambda: stored_run.find(run), str(run), (CommandError,), command)

    return make


def _arrays(draw: Random, arrays: dict[str, Any]) -> dict[str, Any]:
    """Arrays of which one is missing, of another shape or type, or has other numbers."""
    changed, name = dict(arrays), draw.choice(list(arrays))
    match draw.randrange(6):
        case 0:
            del changed[name]
        case 1:
            changed[name] = changed[name][:-1] if changed[name].ndim else np.zeros(3)
        case 2:
            changed[name] = np.zeros(draw.choice(((0,), (3, 0), (1, 1, 1, 1), (10, 3, 3), ())))
        case 3:
            changed[name] = np.full(arrays[name].shape, draw.choice((np.nan, np.inf, 1e308, 0.0)))
        case 4:
            changed[name] = np.array(draw.choice(("x", "é", "1e999", 1j, True, b"x")))
        case _:
            head = json.loads(str(arrays["head"]))
            tree = Damage.of([head])
            changed["head"] = np.array(json.dumps(tree.changed(draw, head), skipkeys=True, default=str))
    return changed


def _checkpoints(whole: Path) -> Maker:
    scenario = shortened("ring_six", 60.0)
    satellite = satellite_of(scenario, 0)
    CheckpointFile(str(whole), "sat1", 1).keep(satellite, [1, 5])
    content = (whole / "sat1.checkpoint").read_bytes()

    def make(draw: Random, place: Path) -> Input:
        (place / "sat1.checkpoint").write_bytes(damaged(draw, content, changes=3))

        def read() -> None:
            CheckpointFile(str(place), "sat1", 1).restore(satellite, [1, 3])

        return Input(read, "sat1.checkpoint", (NodeError,))

    return make


def _registry() -> Maker:
    whole = json.dumps(asdict(RegisteredRun(1, "triangle", "/x", 1, 1))).encode()

    def make(draw: Random, place: Path) -> Input:
        place.chmod(0o700)
        name = draw.choice(("run-1-1.json", "run-99999999999999999999-1.json", "run-1-1.json.x"))
        (place / name).write_bytes(_json_damaged(draw, whole))

        def read() -> None:
            with patch.object(runtime_folder, "folder_path", lambda: place):
                registered_runs()

        return Input(read, "", ())

    return make


def _processes() -> Maker:
    node = NodeProcess("sat1", "satellite_node", {"satellite": "sat1"})
    whole = json.dumps(
        {"nodes": [asdict(node)], "domain": 3, "environment": {"A": "b"}, "external": []}
    ).encode()

    def make(draw: Random, place: Path) -> Input:
        (place / PROCESSES_FILE).write_bytes(_json_damaged(draw, whole))

        def read() -> None:
            found, domain, environment = process_of(place, "sat1")
            found.arguments()
            if not all(isinstance(text, str) for text in (*environment, *environment.values())):
                raise AssertionError("an environment has texts only")
            if not 0 <= domain <= 232:
                raise AssertionError(f"{domain} is no domain")

        return Input(read, str(place), (RejoinError,))

    return make


def _benchmarks() -> Maker:
    figure = {
        "name": "a",
        "seconds": [1.0],
        "yardstick": "y",
        "yardstick_seconds": [1.0],
        "details": {"x": 1.0},
    }
    whole = json.dumps({"machine": {}, "figures": [figure]}).encode()

    def make(draw: Random, place: Path) -> Input:
        (place / "history.json").write_bytes(_json_damaged(draw, whole))
        return Input(lambda: bench_figures.read(place / "history.json"), "history.json", (ValueError,))

    return make
