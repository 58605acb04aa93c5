# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Files that once ended their reader by an exception, a hang or too much memory, as small as can be."""

import hashlib
import io
import json
import math
import os
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arro3.core import Array, DataType, Table
from arro3.io import read_parquet, write_parquet

from bag_writing import messages_of, write
from campaigns import made_campaign
from flights import shipped, shortened
from satform.bag.errors import BagError
from satform.bag.message_types import TopicMessages
from satform.bag.reader import read_bag
from satform.campaign import parquet_file
from satform.campaign.folder import CampaignFolder
from satform.campaign.manifest import MANIFEST, FolderError
from satform.campaign.parquet_file import ParquetError, ParquetFile
from satform.campaign.result_files import ResultFileError
from satform.flight.compile import compile_scenario
from satform.flight.simulate import simulate
from satform.record.archive import RECORD, RecordError, load_record, save_record
from satform.scenario import Problem, ScenarioError, parse_scenario
from satform_bringup import PROCESSES_FILE
from satform_bringup.deployment.security import variables
from satform_bringup.supervisor.rejoin import RejoinError, process_of
from satform_nodes.bag.metadata import FILE_NAME, fits
from satform_nodes.plant.permitted_edges import POLICIES, permitted_graph
from satform_tools.errors import CommandError
from satform_tools.run import stored_run


def test_text_of_a_file_neither_breaks_a_sentence_nor_steers_the_terminal() -> None:
    problem = Problem("a.yaml", 3, "timing.x\ny", "found '\x1b[2J\u2028'")
    assert str(problem) == r"a.yaml:3: timing.x\ny: found '\x1b[2J\u2028'"


def test_an_unknown_kind_is_rejected_where_kinds_share_a_base_class() -> None:
    data = shipped("trajectory_tracking").model_dump(mode="json", exclude_unset=True)
    data["dynamics"] = {"kind": "inertial", "integrator": {"kind": "lqi"}}
    with pytest.raises(ScenarioError, match=r"integrator.*no kind 'lqi'.*rk4"):
        parse_scenario(json.dumps(data))


def test_a_long_text_in_the_place_of_a_name_is_shortened_in_the_sentence() -> None:
    data = shipped("trajectory_tracking").model_dump(mode="json", exclude_unset=True)
    for changed in ({"dynamics": {"kind": "#" * 50_000}}, {"graph": {"kind": "#" * 50_000}}):
        with pytest.raises(ScenarioError) as error:
            parse_scenario(json.dumps({**data, **changed}))
        assert max(len(problem.sentence) for problem in error.value.problems) < 2000


@pytest.mark.parametrize(
    ("scenario", "sentence"),
    [(b'{"name": 3, "x": 1}', r"name.*and \d+ more$"), (b"\xff", "not UTF-8 text")],
    ids=["several problems", "no text"],
)
def test_a_bag_whose_scenario_cannot_be_read_is_rejected_in_one_line(
    scenario: bytes, sentence: str, tmp_path: Path
) -> None:
    flown = shortened("triangle", 2.0)
    writer = write(tmp_path / "bag", flown, messages_of(simulate(flown)), close=False)
    writer.add_attachment("scenario.json", "application/json", scenario)
    writer.close()
    with pytest.raises(BagError, match=sentence) as error:
        read_bag(tmp_path / "bag")
    assert "\n" not in str(error.value)


def test_an_error_about_a_message_definition_quotes_little_of_it() -> None:
    from satform.bag.events import STATUS_TYPE, EventError, read_events

    topic = TopicMessages("/formation/status", STATUS_TYPE, "uint8 x\n" * 5000 + "(", (b"",))
    with pytest.raises(EventError) as error:
        read_events([topic])
    assert len(str(error.value)) < 500


@pytest.mark.parametrize(
    "text",
    [
        b"[" * 100_000,
        b"- " * 50_000,
        b"a: &a {x: 1}\nb: &b {<<: [" + b"*a, " * 30 + b"]}\nc: {<<: [" + b"*b, " * 30 + b"]}\n",
    ],
    ids=["nested", "nested lists of YAML", "aliases"],
)
def test_a_bag_with_any_text_for_its_description_is_not_whole(text: bytes, tmp_path: Path) -> None:
    (tmp_path / FILE_NAME).write_bytes(text)
    assert not fits(tmp_path, 1)


@pytest.mark.parametrize(
    "document",
    [
        b'<?xml version="1.0" encoding="ebcdic-x"?><a/>',
        b'<?xml version="1.0" encoding="idna"?><a/>',
        b'<?xml version="1.0" encoding="utf-7"?><a/>',
        None,
    ],
    ids=["unknown encoding", "no encoding of text", "encoding of several bytes", "pipe"],
)
def test_a_list_of_permissions_that_cannot_be_read_leaves_the_edges_of_the_scenario(
    document: bytes | None, tmp_path: Path
) -> None:
    plan = compile_scenario(shortened("triangle", 2.0))
    if document is None:
        os.mkfifo(tmp_path / POLICIES)
    else:
        (tmp_path / POLICIES).write_bytes(document)
    found = permitted_graph(plan, variables(tmp_path))
    assert found is not None
    assert np.array_equal(found.adjacency, plan.membership.possible_graph.adjacency)


def table_without_version() -> bytes:
    """A Parquet file whose description at the end is empty: its parser in Rust panics."""
    return b"PAR1" + b"\x00" + struct.pack("<I", 1) + b"PAR1"


def expanding_table() -> bytes:
    """A Parquet file of a few kilobytes with a text of 3 megabytes in each of 50 rows."""
    file = io.BytesIO()
    write_parquet(Table({"x": Array(["x" * 3_000_000] * 50, DataType.string())}), file, compression="zstd(1)")
    return file.getvalue()


@pytest.fixture
def small_reader(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A process that reads Parquet files in less memory than the expanding one needs."""
    monkeypatch.setattr(parquet_file, "MOST_MEMORY", 300 * 2**20)
    monkeypatch.setattr(parquet_file, "_READERS", [])
    yield
    for reader in parquet_file._READERS:
        reader.end()


@pytest.mark.usefixtures("small_reader")
def test_a_parquet_file_that_ends_or_fills_its_parser_is_rejected_and_the_next_one_is_read() -> None:
    file = io.BytesIO()
    write_parquet(Table({"x": Array([1, 2, 3], DataType.int64())}), file)
    with pytest.raises(ParquetError, match="Required field version is missing"):
        ParquetFile(table_without_version())
    content = expanding_table()
    assert len(content) < 100_000
    with pytest.raises(ParquetError, match="needs more memory"):
        list(ParquetFile(content).batches())
    assert list(ParquetFile(file.getvalue()).batches()) == [{"x": [1, 2, 3]}]


def test_several_parquet_files_are_read_in_turn() -> None:
    contents = []
    for first in (0, 5000):
        file = io.BytesIO()
        write_parquet(Table({"x": Array(range(first, first + 2000), DataType.int64())}), file)
        contents.append(file.getvalue())
    pairs = list(zip(*(ParquetFile(content).batches() for content in contents), strict=True))
    assert [len(low["x"]) for low, _ in pairs] == [1024, 976]
    assert [high["x"][0] - low["x"][0] for low, high in pairs] == [5000, 5000]


def test_a_parquet_reader_that_does_not_answer_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parquet_file, "_LIMIT", 0.0)
    with pytest.raises(ParquetError, match="was not read within 0 s"):
        ParquetFile(table_without_version())


@pytest.mark.parametrize(
    ("column", "values", "sentence"),
    [
        ("reason", [1] * 6, "the column reason has a value of type int"),
        ("success", None, "does not have the column 'success'"),
        ("number", [None] * 6, "the column number has a value of type NoneType"),
    ],
)
def test_results_with_columns_of_other_types_are_rejected(
    column: str, values: list[object] | None, sentence: str, tmp_path: Path
) -> None:
    folder = made_campaign(tmp_path / "campaign", 20)
    (path, *_) = sorted((folder.path / "results").glob("*.parquet"))
    table = read_parquet(path).read_all()
    columns = {name: table[name].combine_chunks() for name in table.schema.names if name != column}
    if values is not None:
        columns[column] = Array(values, DataType.int64())
    file = io.BytesIO()
    metadata = {name.decode(): value.decode() for name, value in table.schema.metadata.items()}
    write_parquet(Table(columns), file, key_value_metadata=metadata)
    path.unlink()
    digest = hashlib.sha256(file.getvalue()).hexdigest()[:16]
    path.with_name(f"{path.stem[:-16]}{digest}.parquet").write_bytes(file.getvalue())
    with pytest.raises(ResultFileError, match=sentence):
        list(folder.results())


@pytest.mark.parametrize(
    ("field", "value", "sentence"),
    [
        ("cases", 10**15, "has 1000000000000000 cases"),
        ("columns", {"changes": {}, "figures": ["x"], "judged": []}, "with the figures x"),
        ("columns", {"changes": {"a": "complex"}, "figures": [], "judged": []}, "is not the manifest"),
    ],
)
def test_a_manifest_that_does_not_fit_its_campaign_is_rejected(
    field: str, value: object, sentence: str, tmp_path: Path
) -> None:
    path = made_campaign(tmp_path / "campaign", 20).path / MANIFEST
    path.write_text(json.dumps({**json.loads(path.read_text()), field: value}))
    with pytest.raises(FolderError, match=sentence):
        CampaignFolder.open(tmp_path / "campaign").campaign()


def test_a_record_whose_satellites_have_no_names_is_rejected(tmp_path: Path) -> None:
    save_record(simulate(shortened("triangle", 2.0)), tmp_path / RECORD)
    arrays = dict(np.load(tmp_path / RECORD))
    head = json.loads(str(arrays["head"]))
    head["satellites"][1] = 2.5
    np.savez(tmp_path / RECORD, **{**arrays, "head": np.array(json.dumps(head))})
    with pytest.raises(RecordError, match=r"found 2\.5; the name of a satellite is text"):
        load_record(tmp_path / RECORD)


@pytest.mark.parametrize(
    ("name", "values", "sentence"),
    [
        ("velocity", np.zeros((11, 3)), r"velocity has shape \(11, 3\), not \(5, 3, 3\)"),
        ("position", np.zeros(()), r"position has shape \(\), not \(1, 3, 3\)"),
        ("acceleration", np.zeros((5, 3, 3)), r"acceleration has shape \(5, 3, 3\), not \(4, 3, 3\)"),
        ("delta_v", np.zeros((0, 3)), r"delta_v has shape \(0, 3\), not \(5, 3\)"),
        ("mrp", np.zeros((3, 3, 3)), r"mrp has shape \(3, 3, 3\), not \(5, 3, 3\)"),
        ("rate", np.full((5, 3), 1j), "rate holds complex128, not numbers"),
        ("rate", np.full((5, 3), "1"), "rate holds str32, not numbers"),
        ("step", 0.0, r"found 0\.0; a control period is a positive number of seconds"),
        ("step", math.inf, "found inf; a control period"),
        ("step", "1", "found '1'; a control period"),
    ],
)
def test_a_record_with_arrays_of_another_form_is_rejected(
    name: str, values: Any, sentence: str, tmp_path: Path
) -> None:
    save_record(simulate(shortened("triangle", 2.0)), tmp_path / RECORD)
    arrays = dict(np.load(tmp_path / RECORD))
    if name == "step":
        values, name = np.array(json.dumps({**json.loads(str(arrays["head"])), "step": values})), "head"
    np.savez(tmp_path / RECORD, **{**arrays, name: values})
    with pytest.raises(RecordError, match=sentence):
        load_record(tmp_path / RECORD)


def test_a_run_whose_scenario_has_several_errors_is_rejected_in_one_line(tmp_path: Path) -> None:
    save_record(simulate(shortened("triangle", 2.0)), tmp_path / RECORD)
    (tmp_path / "scenario.json").write_text('{"name": 3, "x": 1}')
    with pytest.raises(CommandError, match=r"scenario.json:1: .*, and \d+ more") as error:
        stored_run.find(tmp_path)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "changed",
    [
        {"domain": 10**20},
        {"domain": -1},
        {"environment": {"A": 1}},
        {"nodes": [{"name": 1, "executable": "x"}]},
        {"nodes": [{"name": "sat1", "executable": "satellite_node", "parameters": ["satellite"]}]},
    ],
)
def test_processes_that_cannot_be_started_as_their_file_says_are_rejected(
    changed: dict[str, object], tmp_path: Path
) -> None:
    whole: dict[str, object] = {"nodes": [], "domain": 3, "environment": {}, "external": []}
    (tmp_path / PROCESSES_FILE).write_text(json.dumps({**whole, **changed}))
    with pytest.raises(RejoinError, match="does not describe the processes of a run"):
        process_of(tmp_path, "sat1")
