# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags of cases that a campaign retains are refused unless they have the bits of the campaign."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import campaigns
from satform.campaign.cases import case_scenario
from satform.campaign.chunk import fly_chunk
from satform.flight.simulate import simulate
from satform_tools.campaign import bags
from satform_tools.run import command as run_command

STUDY = campaigns.campaign(
    runs=2,
    set={"timing.duration": 4.0, "expect": []},
    dispersions=[
        campaigns.of("satellites[*].arc_length", {"kind": "normal", "standard_deviation": 9.0}, applied="add")
    ],
    figures=[{"name": "effort", "measure": {"kind": "delta_v"}}],
    keep={"bag": "always"},
)
BITS = simulate(case_scenario(STUDY, 1)).digest()


@pytest.mark.parametrize(
    ("state_hash", "changed", "sentence"),
    [
        (BITS, {}, ""),
        (
            "0123456789abcdef",
            {},
            f"case 1 has the state hash 0123456789abcdef over DDS, and {BITS} in one process",
        ),
        (BITS, {"effort": 1.0}, "case 1 has other figures alone than flown together with others"),
    ],
)
def test_the_bag_of_a_case_flown_together_with_others_is_compared_with_the_case_flown_alone(
    state_hash: str,
    changed: Mapping[str, float],
    sentence: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def flown(_scenario: Any, _mode: str, *, out: Path, **_options: Any) -> SimpleNamespace:
        out.mkdir(parents=True)
        return SimpleNamespace(stopped=False, lost=(), complete=True, early_end=None, state_hash=state_hash)

    monkeypatch.setattr(run_command, "run", flown)
    _, result = fly_chunk(STUDY, range(2))
    assert result.stacked
    result = replace(result, figures={**result.figures, **changed})
    folder: Any = SimpleNamespace(path=tmp_path, results=lambda: iter([result]))
    assert bags.record(folder, STUDY) == (sentence, False)
    assert (tmp_path / "bags" / "case-00000001").is_dir() == (not sentence)
