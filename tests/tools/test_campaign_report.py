# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The report of a campaign: its page and its exports."""

import csv
import json
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from arro3.io import read_parquet

from campaigns import ERROR, HOSTILE, made_campaign, result_columns, some_campaign
from pages import Shown
from satform.campaign.folder import CampaignFolder
from satform_tools.campaign import envelopes, report
from satform_tools.campaign.chart_content import MOST_POINTS
from satform_tools.campaign.page.charts import charts
from satform_tools.campaign.report_statistics import report_statistics
from satform_tools.campaign.summary import MOST_FAILURES, Summary, summarise
from satform_tools.cli import main as cli
from satform_tools.scene.browser import browsing, chromium


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Summary:
    folder = made_campaign(tmp_path_factory.mktemp("large") / "made", envelopes.MOST_SAMPLED + 1500)
    return summarise(folder, folder.campaign())


def test_failed_cases_are_listed_with_the_command_that_flies_each(
    folder: CampaignFolder, summary: Summary, page: Path
) -> None:
    columns = result_columns(folder)
    numbers = columns["number"][~columns["success"]]
    shown = Shown(page).texts
    assert len(numbers) > 3
    for number in numbers[:MOST_FAILURES]:
        reason = " ".join(str(columns["reason"][columns["number"] == number][0]).split())
        assert reason in shown
        assert f"satform run --campaign {folder.path} --case {number}" in shown


def test_a_command_for_a_folder_with_a_space_in_its_name_can_be_copied(tmp_path: Path) -> None:
    folder = made_campaign(tmp_path / "of one's own", 4)
    command = summarise(folder, folder.campaign()).command(3)
    path = str(folder.path).replace("'", "'\"'\"'")
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
    columns = result_columns(folder)
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
