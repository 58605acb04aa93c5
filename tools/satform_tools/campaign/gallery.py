# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes the page of the shipped campaigns in `docs/`: picture and results of each.

Each PNG file contains the digest of its campaign and the results as text. The page is written from these
texts; a digest that differs from the campaign's shows that a picture is out of date.
"""

import json
import math
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from satform.campaign.model import Campaign
from satform.common.exit_codes import EXIT_DONE, EXIT_MISSED
from satform.plot.style import STYLE
from satform_tools import console
from satform_tools.campaign import command, library
from satform_tools.campaign.plots import overview
from satform_tools.campaign.report_statistics import report_statistics
from satform_tools.campaign.summary import Summary
from satform_tools.campaign.theory_plots import FIGURES
from satform_tools.errors import CommandError
from satform_tools.report import gallery_picture
from satform_tools.run.scenario_library import ROOT

FOLDER = ROOT / "docs" / "campaign_gallery"
"""Folder of the pictures."""

PAGE = ROOT / "docs" / "campaign_gallery.md"
"""The page with the pictures."""

_DIGEST = "Campaign digest"
_RESULTS = "Results"
_DOTS_PER_INCH = 75
_INTRODUCTION = """# Shipped campaigns

Picture and results of every shipped campaign, made by `./tools/satform campaign gallery`. How campaigns are
written, flown and reported is on the page [campaigns](campaigns.md).
"""


def make(names: Sequence[str], workers: int | None, *, stale: bool, folders: Path | None = None) -> int:
    """Fly campaigns, draw them, and write the page with all pictures.

    Args:
        names: of the campaigns to fly; all when empty.
        workers: processes; None for as many as there are processors.
        stale: whether to skip campaigns whose picture is up to date.
        folders: folder in which campaigns by their names are flown or resumed; None for one that is removed.

    Returns:
        Exit code: 1 when a campaign missed an expectation.

    Raises:
        CommandError: a name is not that of a shipped campaign, or it cannot be flown to its end.
    """
    known = library.names()
    gallery_picture.prepare(FOLDER, names, known, "campaign")
    missed = 0
    with tempfile.TemporaryDirectory() as removed:
        for name in names or known:
            campaign, _ = library.load(name)
            if not (stale and is_current(campaign)):
                missed += not _fly_and_draw(campaign, (folders or Path(removed)) / name, workers)
    PAGE.write_text(page(), encoding="utf-8")
    console.line(f"{PAGE.relative_to(ROOT)} is written")
    return EXIT_MISSED if missed else EXIT_DONE


def page() -> str:
    """The text of the page: title, text, picture and results of each campaign, sorted by name."""
    entries = (_entry(library.load(name)[0]) for name in library.names())
    return "\n".join([_INTRODUCTION, *entries])


def picture(name: str) -> Path:
    """Path of the picture of a campaign."""
    return FOLDER / f"{name}.png"


def is_current(campaign: Campaign) -> bool:
    """Whether the picture of a campaign was made from its present content."""
    return _text(campaign.name).get(_DIGEST) == campaign.digest


def save(drawn: Figure, summary: Summary, file: Path) -> None:
    """Write a picture in reduced size, with digest and results as text inside.

    Args:
        drawn: the picture.
        summary: of the campaign.
        file: PNG; replaced if it is there.

    Raises:
        OSError: the file cannot be written.
    """
    results = {
        "cases": summary.flown,
        "succeeded": summary.succeeded,
        "rate": [None if math.isnan(value) else value for value in summary.rate],
        "hash": summary.results_hash,
        "verdicts": [
            {
                "label": verdict.label,
                "found": f"{verdict.statistic:.4g} {verdict.unit}".rstrip(),
                "allowed": verdict.allowed,
                "met": verdict.met,
            }
            for verdict in summary.verdicts
        ],
    }
    digest = (_DIGEST, summary.folder.manifest.digest)
    text = (_RESULTS, json.dumps(results, ensure_ascii=False))
    gallery_picture.save(drawn, file, _DOTS_PER_INCH, digest, text)


def _fly_and_draw(campaign: Campaign, folder: Path, workers: int | None) -> bool:
    options = command.Options(workers=workers)
    if library.is_folder(folder):
        summary = command.resume(folder, options, command.Resumption())
    else:
        summary = command.run(campaign.name, folder, options)
    if not summary.complete:
        raise CommandError(f"{campaign.name} was not flown to its end: {summary.reason or 'it was stopped'}")
    if summary.lost:
        raise CommandError(f"{campaign.name} has {summary.lost} lost cases, so that its results have no hash")
    with mpl.rc_context(STYLE):
        save(
            FIGURES.get(campaign.name, overview)(report_statistics(summary)), summary, picture(campaign.name)
        )
    met = all(verdict.met for verdict in summary.verdicts)
    console.line(f"{campaign.name}: {'as expected' if met else 'MISSED'}", "" if met else "bold red")
    return met


def _entry(campaign: Campaign) -> str:
    name, title = campaign.name, " ".join(campaign.title.split())
    lines = [f"## {name}", "", f"{title} ([campaign](../scenarios/campaigns/{name}.yaml))."]
    for part in campaign.text.strip().split("\n\n"):
        lines += ["", " ".join(part.split())]
    text = _text(name)
    if text:
        results = _results(json.loads(text[_RESULTS]), is_random=campaign.sampling.is_random)
        lines += ["", f"![{title}](campaign_gallery/{name}.png)", "", results]
    lines += ["", f"    ./tools/satform campaign run {name}"]
    return "\n".join([*lines, ""])


def _results(found: dict[str, Any], *, is_random: bool) -> str:
    """Success rate and verdicts in a sentence; the hash over all results."""
    rate, *limits = found["rate"]
    interval = ""
    if is_random:
        low, high = (100.0 * value for value in limits)
        interval = f", with a 95 % interval of {low:.4g} to {high:.4g} %"
    parts = [
        f"{verdict['label']} {verdict['found']} ({verdict['allowed']})"
        + ("" if verdict["met"] else " (**missed**)")
        for verdict in found["verdicts"]
    ]
    met = sum(verdict["met"] for verdict in found["verdicts"])
    return (
        f"{found['succeeded']} of {found['cases']} cases succeed: {100.0 * rate:.4g} %{interval}. "
        f"{met} of {len(parts)} expectations met: {'; '.join(parts)}. "
        f"Hash over all results: `{found['hash'][:16]}`."
    )


def _text(name: str) -> dict[str, str]:
    """The text inside the picture of a campaign; empty when there is no readable picture."""
    return gallery_picture.texts(picture(name), {_DIGEST, _RESULTS})
