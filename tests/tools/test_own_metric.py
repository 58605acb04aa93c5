# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The template of a user's own figure installs, judges a flight, and gives the same for any blocks of it."""

import math
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flights import shortened
from satform import FlightRecord, simulate
from satform.record.flight_block import FlightBlock
from satform.record.reducer import FlightShape
from satform.scenario.expectation import ComputedFrom

pytestmark = pytest.mark.unmeasured

TEMPLATE = Path(__file__).parents[2] / "docs" / "own_metric"


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder into which pip has put the template's package."""
    folder = tmp_path_factory.mktemp("own")
    shutil.copytree(TEMPLATE, folder / "source")
    options = ["--no-deps", "--no-build-isolation", "--disable-pip-version-check", "--quiet"]
    words = [*options, "--target", str(folder / "installed"), str(folder / "source")]
    subprocess.run([sys.executable, "-m", "pip", "install", *words], check=True)
    return folder / "installed"


def test_own_metric_is_known_by_its_kind_and_judges_a_flight(installed: Path, tmp_path: Path) -> None:
    search = os.pathsep.join([str(installed), os.environ.get("PYTHONPATH", "")])
    words = ["run", str(TEMPLATE / "regulated.yaml"), "--mode", "inprocess", "--out", str(tmp_path / "run")]
    done = subprocess.run(
        [sys.executable, "-m", "satform_tools", *words],
        env={**os.environ, "PYTHONPATH": search},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "longest time outside 9 m" in done.stdout


@pytest.fixture
def own_metric(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(TEMPLATE))
    import own_metric

    return own_metric


@pytest.mark.parametrize("size", [1, 3, 50])
def test_own_metric_counts_the_steps_outside_for_any_blocks(own_metric: Any, size: int) -> None:
    rng, steps = np.random.default_rng(3), 50
    position, reference = rng.standard_normal((2, steps + 1, 4, 2, 3))
    expectation = own_metric.TimeOutside(below=1.0, source="none", level=2.0, after=5.0)
    reducer = expectation.reducer(FlightShape(("a", "b"), 0.5, steps))
    for first in range(0, steps, size):
        end = min(first + size, steps)
        held = {
            "position": position[first : end + (end == steps)],
            "reference_position": reference[first:end],
            "acceleration": np.ones((end - first, 4, 2, 3)),
        }
        reducer.update(FlightBlock(("a", "b"), 0.5, first, end - first, 4, end == steps, held))
    outside = np.sqrt(((position - reference)[:steps] ** 2).sum(axis=-1)) > 2.0
    assert reducer.figures().tolist() == (0.5 * outside[10:].sum(axis=0).max(axis=-1)).tolist()


def test_the_short_way_on_the_page_gives_the_same_figure(own_metric: Any) -> None:
    page = TEMPLATE.with_suffix(".md").read_text(encoding="utf-8")
    code = re.search(r"```python\n(.*?)```", page, re.DOTALL)
    assert code
    names: dict[str, Any] = {"FlightRecord": FlightRecord, "math": math}
    exec(code[1], names)  # noqa: S102 - the page's own lines
    fields = {"below": 1.0, "source": "none", "level": 20.0, "after": 5.0, "before": 80.0}
    expectation = own_metric.TimeOutside(**fields)
    whole = type("Whole", (own_metric.TimeOutside,), {"measure": names["measure"]})(**fields)
    record = simulate(shortened("triangle", 100.0))
    assert whole.measure(record) == expectation.measure(record) > 0.0
    assert whole.computed_from is ComputedFrom.RECORD
    assert expectation.computed_from is ComputedFrom.BLOCKS
