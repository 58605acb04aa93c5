# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Values of cases have the same bits on every processor, and unlike arithmetic is noticed."""

import math
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from campaigns import campaign, of
from satform.campaign import software
from satform.campaign.chunk import columns_of
from satform.campaign.exact_arithmetic import (
    cholesky_factor,
    factor_times,
    linear_points,
    logarithmic_points,
)
from satform.campaign.results import CaseResult, ResultsHash

OTHER_PROCESSORS = {
    "without AVX": {"NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR"},
    "LAPACK for SSE3": {"OPENBLAS_CORETYPE": "Prescott"},
}

VALUES = """
import sys
from campaigns import CAMPAIGNS, campaign, of
from satform.campaign.cases import case_values
from satform.campaign.loader import load_campaign
from satform.campaign.software import arithmetic_digest

normal = {"kind": "normal", "standard_deviation": 1.0}
matrix = [[1.0, 0.3, 0.2], [0.3, 1.0, 0.6], [0.2, 0.6, 1.0]]
paths = [f"satellites[{index}].arc_length" for index in range(3)]
correlated = campaign(
    runs=50, dispersions=[of(path, normal) for path in paths], correlated=[{"of": paths, "matrix": matrix}]
)
for made in (load_campaign(CAMPAIGNS / "gain_sweep.yaml"), correlated):
    print([case_values(made, number) for number in range(made.cases)])
print(arithmetic_digest())
"""


def printed(**environment: str) -> list[str]:
    """Case values of two campaigns, and the digest of the arithmetic, in a process of its own."""
    path = os.pathsep.join([str(Path(__file__).parents[2]), *filter(None, sys.path)])
    found = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", VALUES],
        env={**os.environ, "PYTHONPATH": path, **environment},
        capture_output=True,
        text=True,
        check=True,
        timeout=60.0,
    )
    return found.stdout.splitlines()


@pytest.mark.parametrize("other", OTHER_PROCESSORS.values(), ids=OTHER_PROCESSORS)
def test_values_of_cases_have_the_same_bits_on_other_processors(other: dict[str, str]) -> None:
    here, there = printed(), printed(**other)
    assert there[:2] == here[:2]
    assert len(here) == 3
    if "avx2" in Path("/proc/cpuinfo").read_text().split():
        assert there[2] != here[2]


def test_unlike_arithmetic_has_another_digest(monkeypatch: pytest.MonkeyPatch) -> None:
    here = software.arithmetic_digest()
    assert software.arithmetic_digest() == here == software.software()["arithmetic"]
    plain = software.ndtri
    monkeypatch.setattr(software, "ndtri", lambda values: np.nextafter(plain(values), np.inf))
    assert software.arithmetic_digest() != here


@pytest.mark.parametrize(("first", "last"), [(0.08, 1.0), (-3.0, -1e-5), (7, 700)])
def test_points_of_a_grid_are_evenly_spaced_between_both_ends(first: float, last: float) -> None:
    for count in (2, 3, 17):
        found = linear_points(first, last, count)
        assert found == pytest.approx(np.linspace(first, last, count).tolist(), rel=1e-14)
        ratios = logarithmic_points(first, last, count)
        assert ratios == pytest.approx(np.geomspace(first, last, count).tolist(), rel=1e-14)
        for points in (found, ratios):
            assert (points[0], points[-1]) == (first, last)
            assert {type(point) for point in points} == {float}


def test_the_factor_of_a_matrix_is_that_of_lapack() -> None:
    rng = np.random.default_rng(1)
    for size in (2, 3, 7):
        root = rng.normal(size=(size, size))
        matrix = root @ root.T
        factor = cholesky_factor(matrix.tolist())
        assert np.allclose(factor, np.linalg.cholesky(matrix), rtol=1e-9, atol=1e-12)
        values = rng.normal(size=size)
        assert np.allclose(factor_times(factor, values.tolist()), np.array(factor) @ values, atol=1e-13)
    with pytest.raises(ValueError, match=r"math domain error|nonnegative input"):
        cholesky_factor([[1.0, 2.0], [2.0, 1.0]])


def test_a_figure_of_loops_is_in_the_table_and_not_in_the_hash() -> None:
    radius = {"name": "radius", "measure": {"kind": "spectral_radius"}}
    effort = {"name": "effort", "measure": {"kind": "delta_v"}}
    normal = {"kind": "normal", "standard_deviation": 1.0}
    made = campaign(
        runs=1, dispersions=[of("satellites[0].arc_length", normal)], figures=[radius, effort],
        set={"expect": []},
    )  # fmt: skip
    columns = columns_of(made)
    assert (columns.figures, columns.of_loops) == (("radius", "effort"), ("radius",))
    assert type(columns).of_data(columns.data()) == columns

    def hashed(**figures: float) -> str:
        found = ResultsHash(columns)
        found.add(columns.complete(replace(CaseResult(0, {}), figures=figures)))
        return found.hexdigest()

    assert hashed(radius=0.9, effort=1.0) == hashed(radius=math.nextafter(0.9, 1.0), effort=1.0)
    assert hashed(radius=0.9, effort=1.0) != hashed(radius=0.9, effort=math.nextafter(1.0, 2.0))
