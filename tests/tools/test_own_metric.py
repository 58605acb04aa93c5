# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A user's own figure is installed, judges a flight, and gives the same for any blocks of it."""

import math
import re
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
from satform_tools.templates import package
from satform_tools.templates.kinds import PartKind

pytestmark = pytest.mark.unmeasured

ROOT = Path(__file__).parents[2]
TEMPLATE = ROOT / "tools" / "satform_tools" / "templates" / "metric"


# An editable installation is read where Python looks for packages, not on PYTHONPATH.
RUNS_WITH_PACKAGES_OF = """
import site, sys
site.addsitedir(sys.argv.pop(1))
from satform_tools.cli.main import main
sys.exit(main(sys.argv[1:]))
"""


def test_own_metric_is_installed_for_editing_and_judges_a_flight(tmp_path: Path) -> None:
    source = package.make(PartKind.METRIC, "my_figure", tmp_path / "source")
    options = ["--no-deps", "--no-build-isolation", "--disable-pip-version-check", "--quiet"]
    install = [sys.executable, "-m", "pip", "install", *options, "--prefix", tmp_path / "prefix"]
    subprocess.run([*install, "--editable", source], check=True)
    (packages,) = (tmp_path / "prefix").glob("lib/python3*/site-packages")
    words = ["run", source / "my_figure.yaml", "--mode", "inprocess", "--out", tmp_path / "run"]
    done = subprocess.run(
        [sys.executable, "-c", RUNS_WITH_PACKAGES_OF, packages, *words],
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
    import time_outside

    return time_outside


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
    page = (ROOT / "docs" / "own_metric.md").read_text(encoding="utf-8")
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
