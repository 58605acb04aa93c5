# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of shipped campaigns: flights as their results say, theory as the library says, text inside."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from campaigns import CAMPAIGNS
from flights import SCENARIOS
from satform.campaign.cases import case_values
from satform.campaign.folder import CampaignFolder
from satform.campaign.loader import load_campaign
from satform.campaign.model import Campaign
from satform.campaign.result_files import write_results
from satform.campaign.results import CaseResult
from satform.evaluation.stability_borders import loop_radius, lossy_consensus
from satform_tools.campaign import gallery
from satform_tools.campaign.report_statistics import ReportStatistics, report_statistics
from satform_tools.campaign.summary import summarise
from satform_tools.campaign.theory_plots import agreement_over_loss, stability_over_gains


def studied(campaign: Campaign, results: list[CaseResult], path: Path) -> ReportStatistics:
    path.mkdir()
    folder = CampaignFolder.create(path, campaign, None, "2026-01-01T00:00:00+00:00")
    write_results(
        path, [folder.manifest.columns.complete(result) for result in results], folder.manifest.schema
    )
    return report_statistics(summarise(folder, campaign))


def lines(figure: Any) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Coordinates of what is drawn by the beginning of its label."""
    (axes,) = figure.axes
    return {str(line.get_label()).partition(":")[0]: line.get_data() for line in axes.get_lines()}


def test_agreement_is_drawn_when_one_percent_of_the_first_disagreement_is_left(tmp_path: Path) -> None:
    campaign = load_campaign(CAMPAIGNS / "lossy_links_sweep.yaml", SCENARIOS)
    time = 100.0 * np.arange(241)
    decay = [500.0, 2000.0, 4000.0, 9000.0]
    phases = [np.exp(-time / own)[:, None] * [0.0, 3000.0, -2000.0] + 80.0 * time[:, None] for own in decay]
    results = [
        CaseResult(number, case_values(campaign, number), success=True, series={"arc_length": phases[number]})
        for number in range(len(decay))
    ]
    drawn = lines(agreement_over_loss(studied(campaign, results, tmp_path / "sweep")))
    _, agreed = drawn["flights"]
    expected = [100.0 * math.ceil(own * math.log(100.0) / 100.0) / 3600.0 for own in decay[:3]]
    assert agreed.tolist() == pytest.approx(expected)
    assert len(drawn["flights that do not agree in time"][0]) == 1
    losses, times = drawn["theory"]
    known = np.isfinite(times)
    assert np.all(np.diff(times[known]) >= 0.0)
    assert 60.0 < losses[known].max() < 100.0 * lossy_consensus(campaign.base).largest_loss()


def test_phases_that_agree_from_the_start_agree_at_once(tmp_path: Path) -> None:
    campaign = load_campaign(CAMPAIGNS / "lossy_links_sweep.yaml", SCENARIOS)
    phases = 80.0 * np.arange(241.0)[:, None] * [1.0, 1.0, 1.0]
    results = [CaseResult(0, case_values(campaign, 0), success=True, series={"arc_length": phases})]
    drawn = lines(agreement_over_loss(studied(campaign, results, tmp_path / "sweep")))
    assert drawn["flights"][1].tolist() == [0.0]


@pytest.fixture(scope="module")
def gains(tmp_path_factory: pytest.TempPathFactory) -> tuple[ReportStatistics, Figure]:
    """Statistics of the sweep of gains, every other case of which succeeds, and its picture."""
    campaign = load_campaign(CAMPAIGNS / "gain_sweep.yaml", SCENARIOS)
    results = [
        CaseResult(number, case_values(campaign, number), success=number % 2 == 0)
        for number in range(campaign.cases)
    ]
    found = studied(campaign, results, tmp_path_factory.mktemp("gains") / "sweep")
    return found, stability_over_gains(found)


def test_the_border_of_gains_has_a_spectral_radius_of_one(gains: tuple[ReportStatistics, Figure]) -> None:
    campaign, drawn = load_campaign(CAMPAIGNS / "gain_sweep.yaml", SCENARIOS), lines(gains[1])
    assert len(drawn["flights that converge"][0]) == len(drawn["flights that do not"][0]) == 192
    reaching, layers = drawn["theory"]
    known = np.flatnonzero(np.isfinite(layers))
    assert len(known) > 15
    for index in known[::6]:
        changes = {
            "satellites[*].controller.reaching_gain": float(reaching[index]),
            "satellites[*].controller.boundary_layer": float(layers[index]),
        }
        assert loop_radius(campaign.base.with_(changes), "tracking") == pytest.approx(1.0, abs=1e-6)


def test_a_picture_holds_digest_and_results_as_text(
    gains: tuple[ReportStatistics, Figure], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    campaign, (found, figure) = load_campaign(CAMPAIGNS / "gain_sweep.yaml", SCENARIOS), gains
    monkeypatch.setattr(gallery, "FOLDER", tmp_path)
    assert not gallery.is_current(campaign)
    gallery.save(figure, found.summary, gallery.picture(campaign.name))
    assert gallery.is_current(campaign)
    entry = gallery._entry(campaign)
    assert "192 of 384 cases succeed: 50 %" in entry
    assert "(**missed**)" in entry
    assert str(found.summary.results_hash)[:16] in entry
