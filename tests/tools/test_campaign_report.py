# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The report of a campaign: its statistics against the files of results, its page, its exports."""

import csv
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from arro3.io import read_parquet
from scipy.stats import binomtest, spearmanr

from browser import browsing, chromium
from campaigns import campaign, of
from flights import SCENARIOS
from satform.campaign.folder import CampaignFolder
from satform.campaign.model import Campaign
from satform.campaign.result_files import result_files, write_results
from satform.campaign.results import CaseResult
from satform_tools.campaign import envelopes, gallery, junit, plots, report, tables
from satform_tools.campaign.exports import export
from satform_tools.campaign.page.charts import MOST_POINTS, charts, drawn_pairs
from satform_tools.campaign.report_statistics import ReportStatistics, report_statistics
from satform_tools.campaign.summary import MOST_FAILURES, Summary, summarise
from satform_tools.cli import main as cli
from satform_tools.console import to_json
from satform_tools.report.formats import Format

HOSTILE = "</script><script>alert(1)</script><b>&amp; \"bold\" 'it'</b>"
GAIN = "consensus.tracking_gain"
ERROR = "satellites[1].position_error[0]"
LIMIT = 36.0


def some_campaign(cases: int, figure: str = "residual") -> Campaign:
    """A campaign whose results are made here, without any flight."""
    return campaign(
        name="made",
        title=HOSTILE,
        text=f"First. {HOSTILE}\n\nSecond.",
        runs=cases,
        set={
            "timing.duration": 60.0,
            "expect": [{"kind": "delta_v", "label": HOSTILE, "below": LIMIT, "source": "a test"}],
        },
        dispersions=[
            of(ERROR, {"kind": "normal", "standard_deviation": 1000.0}, applied="add"),
            of(GAIN, {"kind": "choice", "values": [1.0e-3, 2.0e-3, 3.0e-3]}),
        ],
        figures=[{"name": figure, "measure": {"kind": "tracking_error"}}],
        keep={
            "series": [{"quantity": "tracking_error", "every": 5.0}, {"quantity": "position", "every": 30.0}]
        },
        expect=[
            {"kind": "success_rate", "above": 0.9, "source": HOSTILE},
            {"kind": "percentile", "figure": figure, "percentile": 50, "below": 1e9, "regression": True},
        ],
    )


def results_of(about: Campaign, cases: int) -> Iterator[CaseResult]:
    """Results in which one figure follows an input and the other has very different values."""
    label = about.figure_names[1]
    random = np.random.default_rng(7)
    error, noise = random.normal(size=(2, cases))
    gain = random.choice([1.0e-3, 2.0e-3, 3.0e-3], cases)
    for number in range(cases):
        delta_v = 30.0 + 5.0 * error[number] + 2.0 * noise[number]
        reason = "" if delta_v <= LIMIT else f"not as expected: {HOSTILE} {number}"
        residual = float(np.exp(4.0 * noise[number])) if number % 10 else float("nan")
        # Every seventh flight ends early.
        rows = 7 if number % 7 == 0 else 13
        series = {
            "tracking_error": 100.0 + error[number] + np.arange(rows * 3.0).reshape(rows, 3),
            "position": noise[number] * np.arange(27.0).reshape(3, 3, 3),
        }
        yield CaseResult(
            number,
            changes={ERROR: 1000.0 * error[number], GAIN: float(gain[number]), "seed": number},
            figures={"residual": residual, label: delta_v},
            met={label: not reason},
            success=not reason,
            reason=reason,
            stacked=number % 2 == 0,
            series=series if cases < 1000 else {},
        )


def made(path: Path, cases: int) -> CampaignFolder:
    """The folder of a campaign with results in two files."""
    path.mkdir()
    about = some_campaign(cases)
    folder = CampaignFolder.create(path, about, None, "2026-01-01T00:00:00+00:00")
    results = list(results_of(about, cases))
    for part in (results[: cases // 3], results[cases // 3 :]):
        write_results(path, part, folder.manifest.schema)
    return folder


def table(folder: CampaignFolder) -> dict[str, Any]:
    """All columns of the files of results, without the code that makes reports."""
    columns: dict[str, list[Any]] = {}
    for file in result_files(folder.path):
        for rows in read_parquet(file.path):
            for name in rows.schema.names:
                columns.setdefault(name, []).extend(rows[name].to_pylist())
    return {name: np.array(values) for name, values in columns.items()}


def retained(folder: CampaignFolder, quantity: str, width: int) -> list[np.ndarray]:
    """A retained quantity of each case from the files, shape (K, width)."""
    found = []
    for file in sorted((folder.path / "series").glob("*.parquet")):
        for rows in read_parquet(file):
            found += [np.array(values).reshape(-1, width) for values in rows[quantity].to_pylist()]
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> CampaignFolder:
    return made(tmp_path_factory.mktemp("campaigns") / "made", 300)


@pytest.fixture(scope="module")
def summary(folder: CampaignFolder) -> Summary:
    return summarise(folder, folder.campaign())


@pytest.fixture(scope="module")
def found(summary: Summary) -> ReportStatistics:
    return report_statistics(summary)


@pytest.fixture(scope="module")
def page(summary: Summary, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return report.write(summary, tmp_path_factory.mktemp("page"))[0]


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Summary:
    folder = made(tmp_path_factory.mktemp("large") / "made", envelopes.MOST_SAMPLED + 1500)
    return summarise(folder, folder.campaign())


class Shown(HTMLParser):
    """Text, tags and addresses of a page, without its scripts."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.texts: list[str] = []
        self.tags: list[str] = []
        self.addresses: list[str] = []
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.addresses += [value or "" for name, value in attrs if name in {"src", "href", "data", "action"}]

    def handle_data(self, data: str) -> None:
        if data.strip() and self.tags[-1] not in {"script", "style"}:
            self.texts.append(" ".join(data.split()))


def test_success_and_its_interval_are_those_of_the_files(
    folder: CampaignFolder, page: Path, found: ReportStatistics
) -> None:
    success = table(folder)["success"]
    interval = binomtest(int(success.sum()), len(success)).proportion_ci(method="wilson")
    shown = Shown(page).texts
    assert f"{success.sum()} of 300 cases" in shown
    rate = f"{100 * success.mean():.4g} % ({100 * interval.low:.4g} to {100 * interval.high:.4g} %)"
    assert rate in shown
    (by_gain,) = found.rates
    gains = table(folder)[f"change.{GAIN}"]
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
    columns = table(folder)
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
    columns = {**table(folder)}
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
    members = retained(folder, "tracking_error", 3)
    assert error.time.tolist() == [5.0 * row for row in range(13)]
    for row in range(13):
        values = np.concatenate([own[row] for own in members if len(own) > row])
        assert error.percentiles[row] == pytest.approx(np.percentile(values, (5, 50, 95)))
        assert error.members[row] == len(values)
    assert (error.members[0], error.members[-1]) == (900, 900 - 3 * 43)
    values = np.array([own[2].reshape(3, 3)[:, 1] for own in retained(folder, "position", 9)])
    assert position[1].percentiles[2] == pytest.approx(np.percentile(values, (5, 50, 95)))
    assert position[1].time[2] == 60.0


def test_failed_cases_are_listed_with_the_command_that_flies_each(
    folder: CampaignFolder, summary: Summary, page: Path
) -> None:
    columns = table(folder)
    numbers = columns["number"][~columns["success"]]
    shown = Shown(page).texts
    assert len(numbers) > 3
    for number in numbers[:MOST_FAILURES]:
        reason = " ".join(str(columns["reason"][columns["number"] == number][0]).split())
        assert reason in shown
        assert f"satform run --campaign {folder.path}/campaign.json --case {number}" in shown


def test_a_command_for_a_file_with_a_space_in_its_name_can_be_copied(tmp_path: Path) -> None:
    folder = made(tmp_path / "of one's own", 4)
    command = summarise(folder, folder.campaign()).command(3)
    path = str(folder.path / "campaign.json").replace("'", "'\"'\"'")
    assert command == f"satform run --campaign '{path}' --case 3"


def test_the_page_says_where_its_numbers_come_from(
    folder: CampaignFolder, summary: Summary, page: Path
) -> None:
    shown = Shown(page).texts
    about = folder.campaign()
    for value in (folder.manifest.digest, about.base.digest(), summary.results_hash, str(about.seed)):
        assert value in shown
    assert shown[shown.index("flown in stacks") + 1] == "150"
    assert shown[shown.index("flown one by one") + 1] == "150"
    assert any(f"satform {folder.manifest.versions['satform']}" in text for text in shown)


def test_names_and_reasons_with_markup_are_text_on_the_page(page: Path) -> None:
    shown = Shown(page)
    assert " ".join(HOSTILE.split()) in shown.texts
    assert "b" not in shown.tags
    assert "alert(1)" not in re.sub(
        r"&lt;script&gt;alert\(1\)|\\u003cscript>alert\(1\)", "", page.read_text()
    )


def test_the_page_asks_for_nothing_else(page: Path) -> None:
    assert [address for address in Shown(page).addresses if address != "data:,"] == []
    assert not re.search(r"@import|url\(", page.read_text().partition("</style>")[0])


def test_a_large_campaign_has_a_small_page_with_all_cases_counted(large: Summary, tmp_path: Path) -> None:
    cases = large.cases
    found = report_statistics(large)
    assert found.histograms[1].counts.sum() == cases
    assert len(found.sample.numbers) == envelopes.MOST_SAMPLED
    assert len(np.unique(found.sample.numbers)) == envelopes.MOST_SAMPLED
    assert report_statistics(large).sample.numbers.tolist() == found.sample.numbers.tolist()
    for scatter in charts(found)["scatters"]:
        assert sum(len(part["cases"]) for part in scatter["parts"]) == MOST_POINTS
    file = report.write(large, tmp_path)[0]
    numbers = re.search(r'id="data">(.*?)</script>', file.read_text(), re.DOTALL)
    assert numbers is not None
    assert len(numbers.group(1)) < 200_000
    assert large.failed > MOST_FAILURES
    shown = Shown(file).texts
    assert sum(text.startswith("satform run --campaign") for text in shown) == MOST_FAILURES
    assert any(f"{large.failed - MOST_FAILURES} more failed cases" in text for text in shown)


def test_the_command_writes_page_and_exports_with_the_bits_of_the_results(
    folder: CampaignFolder, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wanted = [word for form in ("svg", "csv", "parquet") for word in ("--export", form)]
    code = cli.main(["campaign", "report", str(folder.path), "--out", str(tmp_path), "--json", *wanted])
    answer = json.loads(capsys.readouterr().out)
    assert code == answer["exit_code"]
    assert answer["report"] == str(tmp_path / "report.html")
    assert sorted(answer["files"]) == sorted(str(path) for path in tmp_path.iterdir())
    names = {"success", "envelopes", "figures", "dependences"}
    assert {path.stem for path in tmp_path.glob("*.svg")} == names
    for path in tmp_path.glob("*.svg"):
        assert ElementTree.parse(path).getroot().tag == "{http://www.w3.org/2000/svg}svg"  # noqa: S314 - our own
    columns = table(folder)
    for rows in read_parquet(tmp_path / "cases.parquet"):
        assert set(rows.schema.names) == set(columns)
        for name in ("number", "figure.residual", f"change.{ERROR}"):
            assert rows[name].to_numpy().tobytes() == columns[name].tobytes()
    with (tmp_path / "cases.csv").open(encoding="utf-8", newline="") as stream:
        lines = list(csv.DictReader(stream))
    assert [float(line[f"change.{ERROR}"]) for line in lines] == columns[f"change.{ERROR}"].tolist()
    assert [line["figure.residual"] == "" for line in lines] == np.isnan(columns["figure.residual"]).tolist()
    assert [line["reason"] for line in lines] == columns["reason"].tolist()


def test_a_campaign_without_a_result_has_a_page_that_says_so(tmp_path: Path) -> None:
    path = tmp_path / "made"
    path.mkdir()
    folder = CampaignFolder.create(path, some_campaign(5), None, "2026-01-01T00:00:00+00:00")
    shown = Shown(report.write(summarise(folder, folder.campaign()), tmp_path / "page")[0]).texts
    assert "Not complete: 5 of 5 cases are not flown" in shown
    assert "No case is flown: there is no success rate and no figure yet." in shown
    assert "No case is flown." in shown
    assert not [text for text in shown if "nan" in text.split() or "0 of 0" in text]


@pytest.mark.unmeasured
@pytest.mark.skipif(chromium() is None, reason="there is no Chromium here, in which a page is opened")
def test_every_chart_is_drawn_in_a_browser_wide_and_narrow_light_and_dark(page: Path, tmp_path: Path) -> None:
    with browsing(tmp_path) as browser:
        for width, scheme in ((2560, "light"), (400, "dark")):
            browser.complaints.clear()
            browser.requests.clear()
            browser.look(page, width, scheme)
            assert browser.complaints == []
            assert [address for address in browser.requests if not address.startswith("data:")] == [
                page.as_uri()
            ]
            assert browser.value("document.getElementById('trouble').hidden") is True
            assert browser.value("document.documentElement.scrollWidth") == width
            drawn = browser.value(
                """[...document.querySelectorAll(".plot")].map((plot) => [
                  plot.id, plot.querySelectorAll(".scatterlayer .trace, .heatmaplayer image").length])"""
            )
            assert len(drawn) == 1 + 2 + 4 + 1 + 4
            assert all(count > 0 for _, count in drawn), drawn
        title = "document.getElementById('chart-figure-1').previousElementSibling.textContent"
        assert browser.value(title) == HOSTILE


def test_an_envelope_of_many_satellites_is_computed_from_the_cases_that_fit_into_memory(
    summary: Summary, monkeypatch: pytest.MonkeyPatch
) -> None:
    numbers = 3 * envelopes.MOST_TIMES * len(summary.campaign.base.satellites)
    for most, cases in ((2 * numbers, 2), (numbers // 2, 1)):
        monkeypatch.setattr(envelopes, "_MOST_VALUES", most)
        assert {found.cases for found in envelopes.envelopes(summary)} == {cases}


def test_the_lines_of_pandas_in_the_documentation_read_the_results(folder: CampaignFolder) -> None:
    pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    text = (SCENARIOS.parent / "docs" / "campaigns.md").read_text(encoding="utf-8")
    (lines,) = (block for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "pandas" in block)
    *first, reasons, percentiles, error = lines.replace("DIR/", f"{folder.path}/").strip().splitlines()
    names: dict[str, Any] = {}
    exec("\n".join(first), names)  # noqa: S102 - our own documentation
    columns = table(folder)
    found = eval(reasons, names)  # noqa: S307 - likewise
    assert found.index.tolist() == columns["number"][~columns["success"]].tolist()
    values = columns["figure.residual"]
    expected = np.percentile(values[np.isfinite(values)], (5, 50, 95))
    found = eval(percentiles, names)["figure.residual"]  # noqa: S307 - likewise
    assert found.tolist() == pytest.approx(expected.tolist())
    assert np.array_equal(eval(error, names), retained(folder, "tracking_error", 3)[17])  # noqa: S307 - likewise
