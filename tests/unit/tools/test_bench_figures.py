# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Benchmarks name what has really changed, and nothing that is within the noise."""

from pathlib import Path

import pytest

from satform_tools.bench import output as bench_output
from satform_tools.bench.figures import Figure, compare, read, write
from satform_tools.errors import CommandError


def figure(name: str, *seconds: float, yardstick: float = 1.0) -> Figure:
    return Figure(name, seconds, "numpy loop", tuple(yardstick for _ in seconds))


def test_a_figure_whose_repetitions_all_got_slower_is_named() -> None:
    (change,) = compare([figure("step", 1.0, 1.1, 1.2)], [figure("step", 2.0, 2.1, 2.2)])
    assert change.slower


def test_a_slower_median_among_overlapping_repetitions_is_noise() -> None:
    (change,) = compare([figure("step", 1.0, 1.1, 2.0)], [figure("step", 1.9, 2.5, 3.0)])
    assert not change.beyond_noise


def test_a_machine_of_half_the_speed_makes_nothing_slower() -> None:
    before = figure("step", 1.0, 1.01, 1.02)
    after = figure("step", 2.0, 2.02, 2.04, yardstick=2.0)
    (change,) = compare([before], [after])
    assert not change.beyond_noise


def test_what_got_faster_is_not_called_slower() -> None:
    (change,) = compare([figure("step", 2.0, 2.1)], [figure("step", 1.0, 1.1)])
    assert change.beyond_noise
    assert not change.slower


def test_of_what_was_measured_once_nothing_is_said() -> None:
    (change,) = compare([figure("step", 1.0)], [figure("step", 5.0, 5.1)])
    assert not change.beyond_noise


def test_the_newest_history_is_never_compared_with_itself(tmp_path: Path) -> None:
    kept = write([figure("step", 1.0, 1.1)], tmp_path)
    with pytest.raises(CommandError, match="holds no history besides"):
        bench_output.compare(kept, None, tmp_path, as_json=True)


def test_figures_against_different_yardsticks_are_not_compared() -> None:
    other = Figure("step", (1.0,), "round trip", (1.0,))
    assert compare([figure("step", 1.0)], [other]) == []


def test_a_history_file_gives_back_what_was_kept(tmp_path: Path) -> None:
    kept = [figure("step", 0.1, 0.3), figure("start", 1 / 3)]
    assert read(write(kept, tmp_path / "history")) == kept


@pytest.mark.parametrize("text", ["", "[]", '{"figures": 3}', '{"figures": [{"name": "step"}]}'])
def test_a_file_that_is_no_history_is_refused_by_name(text: str, tmp_path: Path) -> None:
    path = tmp_path / "broken.json"
    path.write_text(text)
    with pytest.raises(ValueError, match=r"broken\.json"):
        read(path)
