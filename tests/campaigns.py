# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Campaigns made in tests."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from arro3.io import read_parquet
from ruamel.yaml import YAML

from flights import SCENARIOS
from satform.campaign.folder import CampaignFolder
from satform.campaign.model import Campaign
from satform.campaign.result_files import result_files, write_results
from satform.campaign.results import CaseResult
from satform.campaign.scenario_file import CampaignSource

CAMPAIGNS = SCENARIOS / "campaigns"
SHIPPED = sorted(path.stem for path in CAMPAIGNS.glob("*.yaml"))


def campaign(scenario: str = "triangle", **fields: Any) -> Campaign:
    """A campaign of a shipped scenario."""
    source = CampaignSource(CAMPAIGNS)
    return Campaign.model_validate({"scenario": scenario, "seed": 1, **fields}, context=source)


def of(path: str, distribution: Any = None, **fields: Any) -> dict[str, Any]:
    """A dispersion as the file has it."""
    drawn = {} if distribution is None else {"distribution": distribution}
    return {"path": path, **drawn, **fields}


SHORT_DURATIONS = {
    "triangle_dispersed": 60.0,
    "noisy_navigation_dispersed": 60.0,
    "lossy_links_sweep": 1000.0,
    "gain_sweep": 40.0,
    "range_only_cubature": 225.0,
    "range_only_cubature_particle": 225.0,
}
"""Durations of shipped campaigns for tests that fly some of their cases, s."""

FLOWN_ALONE = {"range_only_cubature", "range_only_cubature_particle"}
"""Shipped campaigns whose cases are not stacked, because satellites with navigation are not."""


def shortened_campaign(name: str, folder: Path, series: Sequence[str] = ()) -> Path:
    """File of a shipped campaign with a short duration.

    Figures at a time or after one are those of the middle of the flight or after it.

    Args:
        name: of the campaign.
        folder: existing one, for the file.
        series: further quantities that are retained, of every step.
    """
    data = YAML(typ="safe").load((CAMPAIGNS / f"{name}.yaml").read_text())
    data["scenario"] = str(SCENARIOS / f"{data['scenario']}.yaml")
    duration = SHORT_DURATIONS[name]
    data["set"]["timing.duration"] = duration
    for measure in (*data["set"]["expect"], *(figure["measure"] for figure in data["figures"])):
        measure.update({key: 0.5 * duration for key in ("at", "after") if key in measure})
    keep = data.setdefault("keep", {})
    known = [own for own in keep.get("series", []) if own["quantity"] not in series]
    keep["series"] = [*known, *({"quantity": quantity} for quantity in series)]
    file = folder / f"{name}.yaml"
    file.write_text(json.dumps(data))
    return file


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


def made_campaign(path: Path, cases: int) -> CampaignFolder:
    """The folder of a campaign with results in two files."""
    path.mkdir()
    about = some_campaign(cases)
    folder = CampaignFolder.create(path, about, None, "2026-01-01T00:00:00+00:00")
    results = list(results_of(about, cases))
    for part in (results[: cases // 3], results[cases // 3 :]):
        write_results(path, part, folder.manifest.schema)
    return folder


def result_columns(folder: CampaignFolder) -> dict[str, Any]:
    """All columns of the files of results, without the code that makes reports."""
    columns: dict[str, list[Any]] = {}
    for file in result_files(folder.path):
        for rows in read_parquet(file.path):
            for name in rows.schema.names:
                columns.setdefault(name, []).extend(rows[name].to_pylist())
    return {name: np.array(values) for name, values in columns.items()}


def retained_series(folder: CampaignFolder, quantity: str, width: int) -> list[np.ndarray]:
    """A retained quantity of each case from the files, shape (K, width)."""
    found = []
    for file in sorted((folder.path / "series").glob("*.parquet")):
        for rows in read_parquet(file):
            found += [np.array(values).reshape(-1, width) for values in rows[quantity].to_pylist()]
    return found
