# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Results on the disk: what is written is read, in order, and what is damaged is found."""

import math
import random
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from satform.campaign.result_files import (
    ResultFileError,
    ResultSchema,
    all_results,
    all_series,
    result_files,
    verify,
    write_results,
)
from satform.campaign.results import CaseResult, Columns, ResultsHash, failure_text

COLUMNS = Columns(
    {"x": "number", "seed": "integer", "law": "text", "on": "boolean"}, ("effort", "error"), ("error",)
)
SCHEMA = ResultSchema(COLUMNS, "a" * 64, 20_000)


def result(number: int) -> CaseResult:
    """A result with every kind of value; one in three has no figure, as a case that could not be flown."""
    if number % 3 == 0:
        return CaseResult(number, {"x": -0.0, "seed": number}, reason=f"case {number}: é is not finite")
    return CaseResult(
        number,
        {"x": number / 7, "seed": 2**62 + number, "law": "pd", "on": number % 2 == 0},
        {"effort": 0.1 * number, "error": math.nan if number == 4 else 1.0 / number},
        {"error": number != 4},
        success=number != 4,
        reason="" if number != 4 else "not as expected: error",
        state_hash=f"{number:064x}",
        stacked=number % 2 == 0,
        series={"tracking_error": np.arange(3.0 * (number % 5 + 1)).reshape(-1, 3)},
        record_path=f"records/case-{number:08d}" if number == 4 else None,
    )


def hashed(results: list[CaseResult]) -> str:
    found = ResultsHash(COLUMNS)
    for row in results:
        found.add(COLUMNS.complete(row))
    return found.hexdigest()


def written(folder: Path, *parts: list[int]) -> None:
    for numbers in parts:
        write_results(folder, [COLUMNS.complete(result(number)) for number in sorted(numbers)], SCHEMA)


def plain(found: CaseResult) -> str:
    """A result as text, in which NaN is equal to itself."""
    return repr(replace(found, series={}))


def test_results_are_read_in_order_as_they_were_written_whatever_file_they_are_in(tmp_path: Path) -> None:
    numbers = list(range(50))
    random.Random(1).shuffle(numbers)
    written(tmp_path, numbers[:7], numbers[7:8], numbers[8:40], numbers[40:])
    found = list(all_results(tmp_path, SCHEMA))
    assert [plain(row) for row in found] == [plain(COLUMNS.complete(result(n))) for n in range(50)]
    assert hashed(found) == hashed([result(number) for number in range(50)])


def test_series_are_read_as_they_were_written(tmp_path: Path) -> None:
    written(tmp_path, [0, 3, 6], [1, 2, 4], [5, 7])
    found = dict(all_series(tmp_path))
    assert sorted(found) == [1, 2, 4, 5, 7]
    for number, series in found.items():
        assert np.array_equal(series["tracking_error"], result(number).series["tracking_error"])


@pytest.mark.parametrize(
    "other",
    [
        replace(result(5), number=6),
        replace(result(5), changes={**result(5).changes, "x": math.nextafter(5 / 7, 1.0)}),
        replace(result(5), changes={"x": 5 / 7}),
        replace(result(5), figures={"effort": 0.5, "error": math.nextafter(0.2, 1.0)}),
        replace(result(5), met={"error": False}),
        replace(result(5), success=False),
        replace(result(5), reason="another"),
    ],
    ids=["number", "change", "missing change", "figure", "met", "success", "reason"],
)
def test_the_hash_is_another_one_where_anything_of_a_result_is_another(other: CaseResult) -> None:
    assert hashed([other]) != hashed([result(5)])


@pytest.mark.parametrize(
    "other",
    [
        replace(result(5), stacked=True),
        replace(result(5), record_path="records/case-00000005"),
        replace(result(5), lost=True),
        replace(result(5), state_hash=None),
        replace(result(5), figures={"effort": 0.5, "error": 0.2}, series={}),
    ],
    ids=["stacked", "record", "lost", "state hash", "series"],
)
def test_the_hash_does_not_depend_on_how_a_case_was_flown(other: CaseResult) -> None:
    assert hashed([other]) == hashed([result(5)])


def test_of_an_exception_the_class_is_hashed_and_the_text_is_not() -> None:
    first, second, other = (
        hashed([replace(result(5), success=False, reason=failure_text(error))])
        for error in (
            ValueError("<law at 0x7f01>"),
            ValueError("<law at 0x7f02>"),
            KeyError("<law at 0x7f01>"),
        )
    )
    assert first == second != other
    early, later = (
        hashed([replace(result(5), success=False, reason=f"it ended at {time} s: sat1 diverged")])
        for time in (1, 2)
    )
    assert early != later


def test_all_that_is_not_a_number_is_hashed_alike() -> None:
    negative = float(np.copysign(np.nan, -1.0))
    first, second = (replace(result(5), figures={"effort": value}) for value in (math.nan, negative))
    assert hashed([first]) == hashed([second])


def test_results_out_of_order_have_no_hash() -> None:
    with pytest.raises(ValueError, match="case 5 comes after case 5"):
        hashed([result(5), result(5)])


def test_a_result_with_what_its_campaign_has_not_is_refused() -> None:
    with pytest.raises(ValueError, match="case 1 has y, which the campaign does not have"):
        COLUMNS.complete(CaseResult(1, {"y": 1.0}))


@pytest.mark.parametrize("where", ["results", "series"])
def test_each_changed_byte_of_a_file_is_found_and_the_file_is_named(where: str, tmp_path: Path) -> None:
    written(tmp_path, [1, 2, 3])
    (file,) = (tmp_path / where).iterdir()
    content = file.read_bytes()
    for index in range(0, len(content), 97):
        changed = bytearray(content)
        changed[index] ^= 0x40
        file.write_bytes(changed)
        with pytest.raises(ResultFileError, match=f"{file.name}: is damaged"):
            verify(result_files(tmp_path)[0], SCHEMA)
    file.write_bytes(content[:-1])
    with pytest.raises(ResultFileError, match=f"{file.name}: is damaged"):
        verify(result_files(tmp_path)[0], SCHEMA)
    file.write_bytes(content)
    verify(result_files(tmp_path)[0], SCHEMA)


def test_a_missing_file_of_series_is_found(tmp_path: Path) -> None:
    written(tmp_path, [1, 2, 3])
    (series,) = (tmp_path / "series").iterdir()
    series.unlink()
    with pytest.raises(ResultFileError, match="the series of its cases are missing"):
        verify(result_files(tmp_path)[0], SCHEMA)


def test_a_case_in_two_files_is_refused_naming_both(tmp_path: Path) -> None:
    written(tmp_path, [1, 2, 4], [2, 3])
    with pytest.raises(ResultFileError, match=r"cases-0000000.*has case 2, which is in .*cases-0000000"):
        list(all_results(tmp_path, SCHEMA))


def test_a_file_of_another_campaign_or_of_another_name_is_refused(tmp_path: Path) -> None:
    written(tmp_path, [1, 2])
    with pytest.raises(ResultFileError, match=r"does not have the column 'change\.z' of this campaign"):
        list(all_results(tmp_path, replace(SCHEMA, columns=Columns({"z": "number"}, ()))))
    with pytest.raises(
        ResultFileError, match="is of another campaign: it has the digest aaaaaaaaaaaaaaaa, this"
    ):
        list(all_results(tmp_path, replace(SCHEMA, digest="b" * 64)))
    with pytest.raises(ResultFileError, match="has case 2, and the campaign has 2 cases"):
        list(all_results(tmp_path, replace(SCHEMA, cases=2)))
    (tmp_path / "results" / "cases.parquet").touch()
    with pytest.raises(ResultFileError, match="is not the name of a file of results"):
        result_files(tmp_path)


def test_reading_needs_memory_for_some_rows_and_not_for_all(tmp_path: Path) -> None:
    def peak(cases: int) -> int:
        folder = tmp_path / str(cases)
        folder.mkdir()
        for first in range(0, cases, 2000):
            rows = [COLUMNS.complete(CaseResult(n, {"x": 1.0 * n})) for n in range(first, first + 2000)]
            write_results(folder, rows, SCHEMA)
        tracemalloc.start()
        assert sum(1 for _ in all_results(folder, SCHEMA)) == cases
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found

    assert peak(16_000) < 1.5 * peak(4000)
