# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Which values of cases have the same bits on every processor; a worker with other arithmetic is rejected."""

import json
import math
import os
import platform
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from campaigns import SHIPPED, campaign, of
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
    "C library without FMA": {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F"},
}

VALUES = """
import json
from campaigns import CAMPAIGNS, SHIPPED, campaign, of
from satform.campaign.cases import case_values
from satform.campaign.loader import load_campaign
from satform.campaign.software import arithmetic_digest

fields = [f"satellites[{index}].arc_length" for index in range(3)]
uniform = {"kind": "uniform", "low": -3.0, "high": 10.0}
distributions = {
    "uniform": uniform,
    "choice": {"kind": "choice", "values": [1.0, 2.5, 7.0], "weights": [0.1, 0.7, 0.2]},
    "normal": {"kind": "normal", "mean": 2.0, "standard_deviation": 3.0},
    "truncated_normal": {
        "kind": "truncated_normal", "mean": 1.0, "standard_deviation": 0.1, "low": 0.8, "high": 1.2
    },
    "log_uniform": {"kind": "log_uniform", "low": 0.5, "high": 2.0},
}
spaced = {"first": 0.01, "last": 1.0, "count": 37}
logarithmic = spaced | {"spacing": "logarithmic"}
grids = [of(fields[0], grid=spaced), of(fields[1], grid=logarithmic), of(fields[2], uniform)]
made = {name: load_campaign(CAMPAIGNS / f"{name}.yaml") for name in SHIPPED}
made["grid"] = campaign(sampling={"kind": "grid"}, dispersions=grids)
made["one_at_a_time"] = campaign(sampling={"kind": "one_at_a_time"}, dispersions=grids)
for name, distribution in distributions.items():
    for kind in ("monte_carlo", "latin_hypercube", "sobol"):
        dispersions = [of("satellites[*].arc_length", distribution)]
        made[f"{name} {kind}"] = campaign(runs=20, sampling={"kind": kind}, dispersions=dispersions)
made["correlated"] = campaign(
    runs=20,
    dispersions=[of(path, uniform) for path in fields],
    correlated=[{"of": fields, "matrix": [[1.0, 0.3, 0.2], [0.3, 1.0, 0.6], [0.2, 0.6, 1.0]]}],
)
MOST = 20
values = {
    name: [case_values(own, number) for number in range(min(MOST, own.cases))] for name, own in made.items()
}
print(json.dumps([values, arithmetic_digest()]))
"""

ROUNDED_ALIKE = {
    *("gain_sweep", "lossy_links_sweep", "grid", "one_at_a_time"),
    *(
        f"{distribution} {sampling}"
        for distribution in ("uniform", "choice")
        for sampling in ("monte_carlo", "latin_hypercube", "sobol")
    ),
}
"""Campaigns without logarithms, normal distributions and correlations."""


def values_of_cases(**environment: str) -> tuple[dict[str, list[dict[str, float]]], str]:
    """Case values of campaigns by name, and the digest of the arithmetic, in a process of its own."""
    path = os.pathsep.join([str(Path(__file__).parents[2]), *filter(None, sys.path)])
    found = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", VALUES],
        env={**os.environ, "PYTHONPATH": path, **environment},
        capture_output=True,
        text=True,
        check=True,
        timeout=120.0,
    )
    values, digest = json.loads(found.stdout)
    return values, digest


@pytest.fixture(scope="module")
def here() -> tuple[dict[str, list[dict[str, float]]], str]:
    return values_of_cases()


@pytest.mark.parametrize("other", OTHER_PROCESSORS.values(), ids=OTHER_PROCESSORS)
def test_values_of_cases_have_the_same_bits_on_other_processors_or_differ_in_the_last_ones(
    other: dict[str, str], here: tuple[dict[str, list[dict[str, float]]], str]
) -> None:
    (values, digest), (others, other_digest) = here, values_of_cases(**other)
    assert others.keys() == values.keys() >= {*SHIPPED, *ROUNDED_ALIKE, "correlated", "log_uniform sobol"}
    for name, cases in values.items():
        assert [case.keys() for case in others[name]] == [case.keys() for case in cases]
        assert [case["seed"] for case in others[name]] == [case["seed"] for case in cases]
        if name in ROUNDED_ALIKE:
            assert others[name] == cases
        else:
            np.testing.assert_allclose(table(others[name]), table(cases), rtol=1e-13, err_msg=name)
    # Where the C library is another one, its tunable is without effect.
    if has_avx2() and ("GLIBC_TUNABLES" not in other or platform.libc_ver()[0] == "glibc"):
        assert other_digest != digest


def table(cases: list[dict[str, float]]) -> np.ndarray:
    """Values of cases without the seeds, shape (cases, fields)."""
    return np.array([[value for path, value in case.items() if path != "seed"] for case in cases])


def has_avx2() -> bool:
    """Whether the processor has the instructions that the environment takes away."""
    return "avx2" in Path("/proc/cpuinfo").read_text().split()


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
