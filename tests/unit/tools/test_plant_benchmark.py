# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The propagators whose speed is compared fly the same orbit."""

from satform_tools.bench.plant import measure


def test_every_propagator_of_the_benchmark_ends_where_an_adaptive_one_with_tight_tolerances_does():
    rows = measure(counts=(2,), repetitions=1)
    assert {row.propagator for row in rows} == {"satform", "brahe", "SciPy"}
    assert all(row.satellite_seconds_per_second > 0.0 for row in rows)
    errors = {(row.propagator, row.setting): row.error for row in rows}
    assert errors["satform", "rk8, 60 s"] < 5e-6
    assert errors["satform", "rk4, 1 s"] < 5e-6
    assert errors["brahe", "RK4, 1 s"] < 5e-6
    assert max(errors.values()) < 0.05
