# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A case of a campaign flown as processes over DDS has the bits that it has within the campaign."""

import json
from pathlib import Path

import pytest

from flights import SCENARIOS
from satform.campaign.cases import case_scenario
from satform.campaign.chunk import fly_chunk
from satform.campaign.folder import CampaignFolder
from satform.campaign.loader import load_campaign
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

NOISY = """
scenario: {scenarios}/noisy_navigation.yaml
runs: 8
seed: 5
sampling: {{kind: sobol}}
set: {{timing.duration: 100.0, expect: []}}
dispersions:
  - path: satellites[*].sensor.position_noise[*]
    distribution: {{kind: uniform, low: 0.5, high: 5.0}}
    shared: true
figures: [{{name: navigation, measure: {{kind: navigation_error, statistic: rms}}}}]
"""


@pytest.mark.parametrize(
    ("text", "number"), [(TRIANGLE, 3), (NOISY, 6)], ids=["dispersed gains", "dispersed noise"]
)
def test_a_case_over_dds_has_the_bits_and_the_figures_of_the_campaign(
    text: str, number: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "campaign.yaml"
    file.write_text(text.format(scenarios=SCENARIOS))
    campaign = load_campaign(file)
    words = ["run", "--campaign", str(file), "--case", str(number), "--out", str(tmp_path / "run"), "--json"]
    assert cli.main(words) == 0
    run = json.loads(capsys.readouterr().out)
    assert run["mode"] == "lockstep"
    bag = stored_run.find(tmp_path / "run")
    assert bag.complete
    alone = simulate(case_scenario(campaign, number))
    assert alone.differences(bag.record) == []
    results = fly_chunk(campaign, range(campaign.cases))
    assert results[number].state_hash in {None, run["state_hash"]}
    for verdict in run["expectations"]:
        assert results[number].figures[verdict["label"]] == verdict["figure"]
    # Each case is another flight.
    assert len({tuple(result.figures.values()) for result in results}) == campaign.cases


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
