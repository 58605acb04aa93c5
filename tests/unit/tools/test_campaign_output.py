# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the commands of campaigns print and write: progress, tables, JUnit of one that is not complete."""

import io
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from campaigns import campaign, of
from satform.campaign.folder import CampaignFolder
from satform.campaign.result_store import ResultStore
from satform.campaign.results import CaseResult
from satform.common.exit_codes import EXIT_LOST, EXIT_STOPPED
from satform_tools.campaign import junit, progress, tables
from satform_tools.campaign.summary import kind_of, summarise

EXPECTED = {"kind": "arc_length_spread", "at": 4.0, "below": 1.0, "source": "a test"}


@pytest.fixture
def folder(tmp_path: Path) -> CampaignFolder:
    """A campaign of 200 cases of which 150 have failed and the others have no result."""
    path = tmp_path / "campaign"
    path.mkdir()
    studied = campaign(
        "triangle",
        runs=200,
        set={"timing.duration": 4.0, "expect": [EXPECTED]},
        dispersions=[of("satellites[0].arc_length", {"kind": "uniform", "low": 0.0, "high": 1.0})],
        keep={"record": "always"},
    )
    made = CampaignFolder.create(path, studied, None, "2026-01-01T00:00:00+00:00")
    store = ResultStore(made)
    reason = "speed of sat1 is {} m/s at step {} ({} s), beyond the limit of 5 m/s; likely cause: gains"
    store.store(
        [
            CaseResult(
                number,
                {"seed": number},
                reason=reason.format(10.5 + number, number, 2 * number),
                state_hash="0" * 64 if number < 3 else None,
            )
            for number in range(150)
        ]
    )
    store.flush()
    return made


def test_a_campaign_that_is_not_complete_says_so_with_its_reasons_and_how_to_go_on(
    folder: CampaignFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    found = summarise(folder, folder.campaign(), reason="the disk is full")
    tables.print_summary(found)
    printed = capsys.readouterr().out
    assert found.exit_code == EXIT_LOST
    assert "NOT COMPLETE: 50 of 200 cases are not flown: the disk is full; go on with: " in printed
    assert f"satform campaign resume {folder.path}" in printed
    assert "  150  speed of sat1 is ... m/s at step ... (... s), beyond the limit of ... m/s" in printed
    assert "and 140 more failed cases" in printed
    assert "Records that could not be stored, as on a full disk: 3" in printed
    assert "Hash over all results" not in printed
    assert summarise(folder, folder.campaign(), stopped=True).exit_code == EXIT_STOPPED


def test_a_campaign_of_which_no_case_is_flown_says_so_and_prints_no_figures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    studied = campaign(
        "triangle",
        runs=6,
        set={"timing.duration": 4.0, "expect": [EXPECTED]},
        expect=[{"kind": "success_rate", "above": 0.5, "source": "a test"}],
    )
    made = CampaignFolder.create(tmp_path, studied, None, "2026-01-01T00:00:00+00:00")
    found = summarise(made, made.campaign())
    assert found.figures
    tables.print_summary(found)
    printed = capsys.readouterr().out
    assert "0 of 6 cases flown: there is no success rate and no figure yet\n" in printed
    assert "NOT COMPLETE: 6 of 6 cases are not flown; go on with: " in printed
    assert "nan" not in printed.replace(str(tmp_path), "").split()


def test_junit_lists_failed_cases_up_to_a_bound_and_cases_without_a_result_as_an_error(
    folder: CampaignFolder, tmp_path: Path
) -> None:
    junit.write(summarise(folder, folder.campaign(), reason="a \x07 bell"), tmp_path / "junit.xml")
    suite = ElementTree.parse(tmp_path / "junit.xml").getroot()  # noqa: S314 - our own
    names = [case.get("name") for case in suite.findall("testcase")]
    assert names == [
        "all cases are flown",
        *(f"case {number}" for number in range(100)),
        "50 more failed cases",
    ]
    assert {name: suite.get(name) for name in ("tests", "failures", "errors", "skipped")} == {
        "tests": "102",
        "failures": "0",
        "errors": "1",
        "skipped": "101",
    }
    error = suite.find("testcase/error")
    assert error is not None
    assert error.get("message") == "50 of 200 cases have no result; a bell"


@pytest.mark.parametrize(
    ("reason", "kind"),
    [
        ("timeout: not flown within 0.5 s", "timeout: not flown within ... s"),
        ("position of sat12 is not finite at step 3", "position of sat12 is not finite at step ..."),
        ("mass is -1.5e-3 kg", "mass is ... kg"),
        ("its worker process ended by SIGKILL", "its worker process ended by SIGKILL"),
    ],
)
def test_a_kind_of_reason_is_the_reason_without_its_numbers(reason: str, kind: str) -> None:
    assert kind_of(reason) == kind


@pytest.mark.parametrize(
    ("done", "speed", "text"),
    [
        (0, 0.0, "0 of 7200 cases (0 %), 0 cases/min"),
        (3600, 0.5, "3600 of 7200 cases (50 %), 30 cases/min, 2 h 00 min left"),
        (7000, 2.0, "7000 of 7200 cases (97 %), 2 cases/s, 1 min 40 s left"),
        (7190, 1234.5, "7190 of 7200 cases (99 %), 1.23e+03 cases/s, 0 s left"),
    ],
)
def test_progress_has_the_cases_the_rate_and_the_remaining_time(done: int, speed: float, text: str) -> None:
    assert progress.progress_text(done, 7200, speed) == text


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_terminal_has_a_bar_that_leaves_nothing_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr("satform_tools.run.progress.BAR_PERIOD", 0.0)
    with progress.displayed("study") as report:
        for done in range(0, 101, 10):
            report(done, 100)
    assert "study" in terminal.getvalue()
    assert "100/100" in terminal.getvalue()
