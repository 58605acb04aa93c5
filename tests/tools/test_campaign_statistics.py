# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The statistics of a campaign against those computed from the files of its results."""

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.stats import binomtest, spearmanr

from campaigns import (
    ERROR,
    GAIN,
    LIMIT,
    campaign,
    of,
    result_columns,
    results_of,
    retained_series,
    some_campaign,
)
from pages import Shown
from satform.campaign.folder import CampaignFolder
from satform.campaign.result_files import write_results
from satform.campaign.results import CaseResult
from satform_tools.campaign import envelopes, gallery, junit, plots, report, tables
from satform_tools.campaign.chart_content import drawn_pairs
from satform_tools.campaign.exports import export
from satform_tools.campaign.page.charts import charts
from satform_tools.campaign.report_statistics import ReportStatistics, report_statistics
from satform_tools.campaign.summary import Summary, summarise
from satform_tools.console import to_json
from satform_tools.report.formats import Format


@pytest.fixture(scope="module")
def found(summary: Summary) -> ReportStatistics:
    return report_statistics(summary)


def test_success_and_its_interval_are_those_of_the_files(
    folder: CampaignFolder, page: Path, found: ReportStatistics
) -> None:
    success = result_columns(folder)["success"]
    interval = binomtest(int(success.sum()), len(success)).proportion_ci(method="wilson")
    shown = Shown(page).texts
    assert f"{success.sum()} of 300 cases" in shown
    rate = f"{100 * success.mean():.4g} % ({100 * interval.low:.4g} to {100 * interval.high:.4g} %)"
    assert rate in shown
    (by_gain,) = found.rates
    gains = result_columns(folder)[f"change.{GAIN}"]
    assert by_gain.values == (1.0e-3, 2.0e-3, 3.0e-3)
    for value, cases, (rate_of, low, high) in zip(
        by_gain.values, by_gain.cases, by_gain.rates.tolist(), strict=True
    ):
        own = success[gains == value]
        test = binomtest(int(own.sum()), len(own)).proportion_ci(method="wilson")
        assert (cases, rate_of, low, high) == (len(own), own.mean(), test.low, test.high)


def test_histograms_count_every_case_that_has_the_figure_and_show_its_limit(
    folder: CampaignFolder, found: ReportStatistics
) -> None:
    columns = result_columns(folder)
    residual, delta_v = found.histograms
    for histogram in (residual, delta_v):
        values = columns[f"figure.{histogram.figure.name}"]
        known = np.isfinite(values)
        assert histogram.counts.tolist() == np.histogram(values[known], histogram.edges)[0].tolist()
        failed = known & ~columns["success"]
        assert histogram.failed.tolist() == np.histogram(values[failed], histogram.edges)[0].tolist()
        assert histogram.counts.sum() == known.sum()
        assert histogram.figure.percentiles == pytest.approx(np.percentile(values[known], (5, 50, 95)))
    assert residual.counts.sum() == 270
    assert (residual.logarithmic, delta_v.logarithmic) == (True, False)
    assert [limit.value for limit in delta_v.limits] == [LIMIT]
    assert [limit.text for limit in residual.limits] == ["50 % percentile ≤ 1e+09"]


def test_a_report_of_a_campaign_under_way_counts_the_same_cases_everywhere(tmp_path: Path) -> None:
    path = tmp_path / "made"
    path.mkdir()
    about = some_campaign(300)
    folder = CampaignFolder.create(path, about, None, "2026-01-01T00:00:00+00:00")
    results = list(results_of(about, 300))
    write_results(path, results[:100], folder.manifest.schema)
    summary = summarise(folder, folder.campaign())
    # What is flown between the passes over the results.
    write_results(path, results[100:], folder.manifest.schema)
    found = report_statistics(summary)
    assert [histogram.outside for histogram in found.histograms] == [0, 0]
    assert found.histograms[1].counts.sum() == summary.flown == 100
    assert sum(found.rates[0].cases) == 100
    assert found.sample.numbers.tolist() == list(range(100))
    assert found.envelopes[0].cases == 100
    [file] = export(found, tmp_path, [Format.CSV])
    assert len(file.read_text().splitlines()) == 101


def test_a_figure_with_the_name_success_is_correlated_beside_success(tmp_path: Path) -> None:
    path = tmp_path / "made"
    path.mkdir()
    about = some_campaign(100, figure="success")
    folder = CampaignFolder.create(path, about, None, "2026-01-01T00:00:00+00:00")
    results = [
        replace(result, figures={"success": -(number**2.0), label: result.figures[label]})
        for label in [about.figure_names[1]]
        for number, result in enumerate(results_of(about, 100))
    ]
    write_results(path, results, folder.manifest.schema)
    found = report_statistics(summarise(folder, folder.campaign()))
    numbers, inputs = found.sample.numbers, found.sample.inputs[ERROR]
    expected = {
        ("success", False): spearmanr(inputs, -(numbers**2.0)).statistic,
        ("success of the case", True): spearmanr(inputs, found.sample.success).statistic,
    }
    pairs = {(pair.figure, pair.of_success): pair for pair in found.correlations if pair.input == ERROR}
    for key, coefficient in expected.items():
        assert pairs[key].coefficient == pytest.approx(coefficient, abs=1e-12)
    assert "success" in {pair.figure for pair in drawn_pairs(found)}
    assert not any(pair.of_success for pair in drawn_pairs(found))


def test_a_grid_has_no_intervals_and_no_p_values(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "made"
    path.mkdir()
    about = campaign(
        name="made",
        sampling={"kind": "grid", "repeats": 2},
        set={"timing.duration": 60.0, "expect": []},
        dispersions=[of(GAIN, grid={"values": [1.0e-3, 2.0e-3, 3.0e-3, 4.0e-3]})],
        figures=[{"name": "residual", "measure": {"kind": "tracking_error"}}],
        # Wilson's interval of 6 of 8 cases begins at 0.41.
        expect=[
            {"kind": "success_rate", "above": 0.7, "source": "a test"},
            {"kind": "mean", "figure": "residual", "above": 100.0, "source": "a test"},
        ],
    )
    folder = CampaignFolder.create(path, about, None, "2026-01-01T00:00:00+00:00")
    results = [
        CaseResult(
            number,
            changes={GAIN: 1.0e-3 * (1 + number % 4), "seed": number},
            figures={"residual": float(number % 4)},
            success=number % 4 > 0,
        )
        for number in range(about.cases)
    ]
    write_results(path, results, folder.manifest.schema)
    summary = summarise(folder, folder.campaign())
    assert [verdict.met for verdict in summary.verdicts] == [True, False]
    found = report_statistics(summary)
    assert found.rates[0].rates[:, 0].tolist() == [0.0, 1.0, 1.0, 1.0]
    assert np.isnan(found.rates[0].rates[:, 1:]).all()
    assert found.correlations[0].coefficient == pytest.approx(1.0)
    assert all(np.isnan(pair.p_value) and not pair.significant for pair in found.correlations)
    [chart] = charts(found)["rates"]
    assert (chart["parts"][0]["low"], chart["parts"][0]["high"], chart["note"]) == (None, None, "")
    tables.print_summary(summary)
    printed = capsys.readouterr().out
    assert "Success: 6 of 8, 75 %\n" in printed
    assert "95 % interval" not in printed
    assert "nan" not in printed
    data = json.loads(to_json(summary.data()))
    assert (data["success_rate"]["estimate"], data["success_rate"]["low"]) == (0.75, None)
    shown = Shown(report.write(summary, tmp_path / "page", [Format.SVG])[0]).texts
    assert "75 %" in shown
    assert "There are no p-values: the cases are not drawn at random." in shown
    assert "a test" in shown
    assert not any("nan" in text.split() or "(95 %)" in text for text in shown)
    junit.write(summary, tmp_path / "junit.xml")
    failure = ElementTree.parse(tmp_path / "junit.xml").getroot().find("testcase/failure")  # noqa: S314 - our own
    assert failure is not None
    assert failure.get("message") == "expected ≥ 100, found 1.5 m"
    monkeypatch.setattr(gallery, "FOLDER", tmp_path)
    gallery.save(plots.overview(found), summary, gallery.picture("made"))
    assert "6 of 8 cases succeed: 75 %. 1 of 2 expectations met" in gallery._entry(about)


def test_a_few_cases_far_from_all_others_leave_the_histogram_its_shape(tmp_path: Path) -> None:
    path = tmp_path / "made"
    path.mkdir()
    about = some_campaign(200)
    folder = CampaignFolder.create(path, about, None, "2026-01-01T00:00:00+00:00")
    grown = {7: -1e6, 11: 1e30}
    results = [
        replace(result, figures={"residual": max(0.0, number - 9.0) ** 8, about.figure_names[1]: figure})
        for number, result in enumerate(results_of(about, 200))
        for figure in [grown.get(number, 100.0 + number)]
    ]
    write_results(path, results, folder.manifest.schema)
    nearly_zero, linear = report_statistics(summarise(folder, folder.campaign())).histograms
    assert (linear.outside, linear.counts.sum(), linear.logarithmic) == (2, 198, False)
    assert 0.0 < linear.edges[0] < 100.0
    assert 299.0 < linear.edges[-1] < 400.0
    assert (nearly_zero.outside, nearly_zero.logarithmic) == (10, True)
    notes = [
        chart["note"] for chart in charts(report_statistics(summarise(folder, folder.campaign())))["figures"]
    ]
    assert "2 more cases are outside of this range." in notes[1]


def test_rank_correlations_are_those_of_scipy_over_the_files_strongest_first(
    folder: CampaignFolder, found: ReportStatistics
) -> None:
    columns = {**result_columns(folder)}
    columns["figure.success"] = columns["success"].astype(float)
    names = [*found.summary.campaign.figure_names, "success"]
    pairs = {(pair.input, pair.figure): pair for pair in found.correlations}
    assert set(pairs) == {(path, name) for path in (ERROR, GAIN) for name in names}
    for (path, name), pair in pairs.items():
        first, second = columns[f"change.{path}"], columns[f"figure.{name}"]
        known = np.isfinite(second)
        expected = spearmanr(first[known], second[known])
        assert pair.coefficient == pytest.approx(expected.statistic, abs=1e-12)
        assert pair.p_value == pytest.approx(expected.pvalue, rel=1e-9)
        assert pair.cases == known.sum()
        assert pair.significant == (expected.pvalue < 0.05 / 6)
    strengths = [abs(pair.coefficient) for pair in found.correlations]
    assert strengths == sorted(strengths, reverse=True)
    assert (found.correlations[0].input, found.correlations[0].figure) == (ERROR, names[1])
    assert not pairs[GAIN, names[1]].significant


def test_envelopes_are_the_percentiles_of_all_satellites_of_all_cases(
    folder: CampaignFolder, found: ReportStatistics
) -> None:
    error, *position = found.envelopes
    assert [entry.quantity for entry in position] == ["position x", "position y", "position z"]
    members = retained_series(folder, "tracking_error", 3)
    assert error.time.tolist() == [5.0 * row for row in range(13)]
    for row in range(13):
        values = np.concatenate([own[row] for own in members if len(own) > row])
        assert error.percentiles[row] == pytest.approx(np.percentile(values, (5, 50, 95)))
        assert error.members[row] == len(values)
    assert (error.members[0], error.members[-1]) == (900, 900 - 3 * 43)
    values = np.array([own[2].reshape(3, 3)[:, 1] for own in retained_series(folder, "position", 9)])
    assert position[1].percentiles[2] == pytest.approx(np.percentile(values, (5, 50, 95)))
    assert position[1].time[2] == 60.0


def test_an_envelope_of_many_satellites_is_computed_from_the_cases_that_fit_into_memory(
    summary: Summary, monkeypatch: pytest.MonkeyPatch
) -> None:
    numbers = 3 * envelopes.MOST_TIMES * len(summary.campaign.base.satellites)
    for most, cases in ((2 * numbers, 2), (numbers // 2, 1)):
        monkeypatch.setattr(envelopes, "_MOST_VALUES", most)
        assert {found.cases for found in envelopes.envelopes(summary)} == {cases}
