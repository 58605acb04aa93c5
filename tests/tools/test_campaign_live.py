# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of a campaign under way, in a real browser."""

import json
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

from satform.campaign.chunk import fly_chunk
from satform.campaign.loader import load_campaign
from satform_tools.scene.browser import browsing, chromium
from small_campaign import write_campaign

NO_BROWSER = (
    "THE PAGE OF A CAMPAIGN IS NOT TESTED: there is no Chromium here; install it (apt install chromium)"
)

if chromium() is None:
    warnings.warn(NO_BROWSER, stacklevel=1)

STATUS = "campaignProgress.state.status"


@pytest.mark.skipif(chromium() is None, reason=NO_BROWSER)
def test_the_page_shows_success_rate_and_distributions_until_the_browser_leaves_it(tmp_path: Path) -> None:
    file = write_campaign(tmp_path, above=0.9)
    results = list(fly_chunk(load_campaign(file), range(12)))
    words = ["campaign", "run", str(file), "--out", str(tmp_path / "out"), "--json", "--live"]
    run = subprocess.Popen(
        [sys.executable, "-m", "satform_tools", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert run.stderr is not None
    address = next(line.strip() for line in run.stderr if line.startswith("http://"))
    with browsing(tmp_path / "profile") as browser:
        browser.open(address, 1280, "light")
        status = browser.until(f"{STATUS}.over && {STATUS}")
        assert status["flown"] == 12
        assert status["succeeded"] == sum(result.success for result in results)
        efforts = [result.figures["effort"] for result in results]
        (found,) = [one for one in status["histograms"] if one["name"] == "effort"]
        assert sum(found["counts"]) == 12
        assert found["median"] == pytest.approx(np.median(efforts))
        assert found["edges"][0] <= min(efforts)
        assert found["edges"][-1] >= max(efforts)
        assert browser.value("document.querySelectorAll('#charts .figure').length") >= 2
        wanted = "missed" if status["succeeded"] / 12 <= 0.9 else "passed"
        assert browser.value("document.getElementById('expectations').rows[1].cells[3].textContent") == wanted
        for width, scheme in ((400, "dark"), (2560, "light")):
            browser.resize(width)
            browser.scheme(scheme)
            assert browser.value("document.documentElement.scrollWidth - innerWidth") <= 0
        assert browser.complaints == []
        assert browser.requests == [address]
    out, _ = run.communicate(timeout=120)
    assert json.loads(out)["succeeded"] == status["succeeded"]


def test_options_of_the_page_need_the_page(tmp_path: Path) -> None:
    words = [
        "campaign",
        "run",
        str(write_campaign(tmp_path)),
        "--out",
        str(tmp_path / "out"),
        "--port",
        "8080",
    ]
    ended = subprocess.run(
        [sys.executable, "-m", "satform_tools", *words], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 2
    assert "need --live" in ended.stderr
