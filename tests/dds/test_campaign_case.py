# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A case of a campaign flown as processes over DDS has the bits that it has within the campaign."""

import json
import math
import struct
from pathlib import Path

import pytest

from campaigns import FLOWN_ALONE, SHIPPED, shortened_campaign
from flights import SCENARIOS
from flown import repetitions
from satform.campaign.cases import case_scenario
from satform.campaign.chunk import fly_case, fly_chunk, result_of
from satform.campaign.folder import CampaignFolder
from satform.campaign.loader import load_campaign
from satform.campaign.results import CaseResult
from satform.flight.simulate import simulate
from satform_tools.cli import main as cli
from satform_tools.run import stored_run

TRIANGLE = """
scenario: {scenarios}/triangle.yaml
runs: 8
seed: 5
set: {{timing.duration: 50.0, expect: [{{kind: arc_length_spread, at: 50.0, below: 1.0e6, source: a test}}]}}
dispersions:
  - path: satellites[*].position_error[*]
    distribution: {{kind: normal, standard_deviation: 1000.0}}
    applied: add
  - path: satellites[*].controller.reaching_gain[*]
    distribution: {{kind: uniform, low: 0.8, high: 1.2}}
    applied: scale
figures: [{{name: effort, measure: {{kind: delta_v}}}}]
"""

CASES = [(name, number) for name in SHIPPED for number in range(repetitions(2))]


@pytest.mark.slow
@pytest.mark.unmeasured
@pytest.mark.parametrize(("name", "number"), CASES)
def test_a_case_over_dds_has_the_bits_and_the_figures_of_the_campaign(
    name: str, number: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = shortened_campaign(name, tmp_path, ("position", "velocity"))
    campaign = load_campaign(file)
    words = ["run", "--campaign", str(file), "--case", str(number), "--out", str(tmp_path / "run"), "--json"]
    # 1 where the short flight does not meet what is expected of the whole one.
    assert cli.main(words) in {0, 1}
    run = json.loads(capsys.readouterr().out)
    assert run["mode"] == "lockstep"
    bag = stored_run.find(tmp_path / "run")
    assert bag.complete
    scenario = case_scenario(campaign, number)
    assert simulate(scenario).differences(bag.record) == []
    alone, stacked = fly_case(campaign, number), fly_chunk(campaign, range(10))[number]
    assert run["state_hash"] == alone.state_hash
    assert stacked.stacked is (name not in FLOWN_ALONE)
    assert stacked.state_hash == (None if stacked.stacked else alone.state_hash)
    over_dds = result_of(campaign, number, scenario, bag.record)
    assert bits(over_dds) == bits(alone) == bits(stacked)
    assert [(own["label"], own["figure"]) for own in run["expectations"]] == [
        (own.describe(), finite_or_none(alone.figures[own.describe()])) for own in scenario.expect
    ]


def bits(result: CaseResult) -> tuple[object, ...]:
    """What a result says of its flight, bit for bit."""
    figures = {name: struct.pack("<d", figure) for name, figure in result.figures.items()}
    series = {name: (values.shape, values.tobytes()) for name, values in result.series.items()}
    return result.changes, figures, result.met, result.success, result.reason, series


def finite_or_none(figure: float) -> float | None:
    """A figure as JSON has it."""
    return figure if math.isfinite(figure) else None


def test_bags_of_failed_cases_are_recorded_at_the_end_of_a_campaign(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "campaign.yaml"
    text = TRIANGLE.format(scenarios=SCENARIOS).replace("50.0", "4.0").replace("runs: 8", "runs: 2")
    # Nothing can be met.
    file.write_text(text.replace("below: 1.0e6", "below: 1.0") + "keep: {bag: on_failure}\n")
    out = tmp_path / "out"
    words = ["campaign", "run", str(file), "--out", str(out), "--workers", "1", "--json"]
    assert cli.main(words) == 0
    assert json.loads(capsys.readouterr().out)["failed"] == 2
    folder = CampaignFolder.open(out)
    for result in folder.results():
        bag = stored_run.find(out / "bags" / f"case-{result.number:08d}")
        assert bag.events is not None
        alone = simulate(case_scenario(folder.campaign(), result.number))
        assert alone.differences(bag.record) == []
    before = sorted(out.rglob("*"))
    assert cli.main(["campaign", "resume", str(out)]) == 0
    assert sorted(out.rglob("*")) == before
