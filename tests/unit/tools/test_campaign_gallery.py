# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of the shipped campaigns shows each of them, up to date, and nothing else."""

import pytest

from campaigns import SHIPPED
from satform_tools.campaign import gallery, library
from satform_tools.cli import main as cli


@pytest.mark.parametrize("name", SHIPPED)
def test_a_campaign_s_picture_shows_it_as_it_is_now(name: str) -> None:
    campaign, _ = library.load(name)
    assert gallery.is_current(campaign), f"make it anew: ./tools/satform campaign gallery {name}"


def test_every_picture_is_of_a_shipped_campaign_and_small_enough_to_be_kept_with_the_code() -> None:
    assert sorted(file.stem for file in gallery.FOLDER.iterdir()) == SHIPPED
    assert sum(file.stat().st_size for file in gallery.FOLDER.iterdir()) < 100_000 * len(SHIPPED)


def test_the_page_is_what_campaigns_and_pictures_say() -> None:
    page = gallery.PAGE.read_text(encoding="utf-8")
    assert page == gallery.page(), "run ./tools/satform campaign gallery --stale"
    assert [line.removeprefix("## ") for line in page.splitlines() if line.startswith("## ")] == SHIPPED


def test_a_campaign_that_is_not_shipped_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["campaign", "gallery", "gain_swep"]) == 2
    assert "'gain_swep' is not a shipped campaign" in capsys.readouterr().err
