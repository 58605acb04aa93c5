# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The report of a flight: the record behind it, its figures and its pictures."""

import base64
import csv
import json
import math
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from arro3.io import read_parquet

from flights import shipped, shortened
from satform.control.protocol import FlightSetting
from satform.evaluation import visibility
from satform.flight.simulate import simulate
from satform.orbits.chief import KeplerianChief
from satform.plot import prediction
from satform.plot import style as plot_style
from satform.plot.style import Unit
from satform.record.archive import load_record, save_record
from satform.record.flight_record import FlightRecord
from satform.record.quantities import QUANTITIES
from satform_tools.cli import main as cli
from satform_tools.report.page import content
from satform_tools.report.page.charts import _envelope, charts
from satform_tools.report.page.render import page_of
from satform_tools.report.page.thinning import extremes
from satform_tools.run.flight_summary import summarise
from satform_tools.run.stored_run import find

PNG = b"\x89PNG\r\n\x1a\n"


def numbers_of(page: Path) -> Any:
    """What a page's figures are drawn from."""
    found = re.search(r'id="data">(.*?)</script>', page.read_text(), re.DOTALL)
    assert found is not None
    return json.loads(found.group(1))


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a short run of the triangle."""
    out = tmp_path_factory.mktemp("runs") / "triangle"
    changes = (
        "--set",
        "timing.duration=200.0",
        "--set",
        "expect=[{kind: control, below: 100.0, source: a test}]",
    )
    assert cli.main(["run", "triangle", "--mode", "inprocess", "--out", str(out), *changes]) == 0
    return out


@pytest.fixture(scope="module")
def exported(flown: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the report of that run, with everything that can be had beside its page."""
    out = tmp_path_factory.mktemp("exported")
    wanted = [word for form in ("png", "svg", "pdf", "csv", "parquet") for word in ("--export", form)]
    assert cli.main(["report", str(flown), "--out", str(out), *wanted]) == 0
    return out


def test_a_kept_record_has_the_bits_of_the_flight(tmp_path: Path) -> None:
    record = simulate(shortened("triangle", 10.0))
    save_record(record, tmp_path / "record.npz")
    assert not record.differences(load_record(tmp_path / "record.npz"))


def test_a_report_tells_the_flight_and_says_where_its_page_is(
    flown: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["report", str(flown), "--out", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert "final error [m]" in printed
    assert "pass" in printed
    assert f"report: {tmp_path / 'report.html'}\n" in printed
    assert sorted(path.name for path in tmp_path.iterdir()) == ["flight.png", "report.html"]
    assert (tmp_path / "flight.png").read_bytes().startswith(PNG)


def test_without_a_folder_named_a_report_lies_beside_the_flight(flown: Path) -> None:
    assert cli.main(["report", str(flown)]) == 0
    assert (flown / "report" / "report.html").is_file()


def test_pictures_of_every_quantity_are_drawn_when_they_are_wanted(exported: Path) -> None:
    names = [
        "arc_length_spread",
        "control",
        "delta_v",
        "flight",
        "orbits",
        "sliding_variable",
        "tracking_error",
    ]
    assert sorted(path.stem for path in exported.glob("*.png")) == names
    assert sorted(path.stem for path in exported.glob("*.svg")) == names
    assert all(path.read_bytes().startswith(PNG) for path in exported.glob("*.png"))
    for path in exported.glob("*.svg"):
        root = ElementTree.parse(path).getroot()  # noqa: S314 - just written by ourselves
        assert root.tag == "{http://www.w3.org/2000/svg}svg"
        texts = [element.text or "" for element in root.iter("{http://www.w3.org/2000/svg}text")]
        assert "time [s]" in texts or any("radial" in text for text in texts), path
    assert sorted(path.stem for path in exported.glob("*.pdf")) == names
    for path in exported.glob("*.pdf"):
        content = path.read_bytes()
        assert content.startswith(b"%PDF")
        # Fonts as outlines in the file are type 3; as type 42 their text can be searched and copied.
        assert b"/Type3" not in content
        assert b"/FontFile2" in content


def test_a_lone_satellite_disagrees_with_nobody(tmp_path: Path) -> None:
    changes = ("--set", "timing.duration=2.0", "--set", "expect=[]")
    out = tmp_path / "run"
    assert cli.main(["run", "trajectory_tracking", "--mode", "inprocess", "--out", str(out), *changes]) == 0
    figures = tmp_path / "figures"
    assert cli.main(["report", str(out), "--out", str(figures), "--export", "png"]) == 0
    assert not (figures / "arc_length_spread.png").exists()
    assert (figures / "flight.png").exists()
    keys = [chart["key"] for chart in numbers_of(figures / "report.html")["charts"]]
    assert "tracking_error" in keys
    assert "arc_length_spread" not in keys


def test_a_flight_as_csv_has_every_number_with_all_its_digits(flown: Path, exported: Path) -> None:
    record = load_record(flown / "record.npz")
    with (exported / "flight.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 401 * 3
    for row in (rows[0], rows[500], rows[-1]):
        step, column = int(row["step"]), record.satellites.index(row["satellite"])
        assert float(row["time"]) == 0.5 * step
        assert float(row["position_y"]) == record.position[step, column, 1]
        assert float(row["arc_length"]) == record.arc_length[step, column]
    assert float(rows[500]["acceleration_z"]) == record.acceleration[166, 2, 2]
    assert rows[-1]["acceleration_z"] == ""


def test_a_flight_as_parquet_has_the_bits_of_the_flight_and_its_units(flown: Path, exported: Path) -> None:
    record = load_record(flown / "record.npz")
    table = read_parquet(exported / "flight.parquet").read_all()
    assert table.num_rows == 401 * 3
    assert table["satellite"].to_pylist()[:3] == ["sat1", "sat2", "sat3"]
    velocity = np.array(table["velocity_x"].to_pylist()).reshape(401, 3)
    assert np.array_equal(velocity, record.velocity[..., 0])
    # Where polars, pandas and pyarrow look.
    about = {key.decode(): value.decode() for key, value in table.schema.metadata.items()}
    assert about["unit.velocity_x"] == "m/s"
    units = json.loads(about["PANDAS_ATTRS"])["units"]
    assert units["acceleration_x"] == "m/s²"
    assert set(units) == set(table.column_names) - {"step", "satellite"}
    assert table.schema.field("position_x").metadata == {b"unit": b"m"}


def test_a_page_needs_nothing_but_itself(exported: Path) -> None:
    page = (exported / "report.html").read_text()
    without_data = re.sub(r'<script type="[^"]*" id="[^"]*">.*?</script>', "", page, flags=re.DOTALL)
    assert not re.findall(r"""(?:src|href|url\()\s*=?\s*["'(]?(?:https?:)?//""", without_data)
    assert 'src="' not in without_data
    assert len(page) < 4_000_000


def test_a_page_tells_what_flew_and_by_which_hash_it_is_known_again(flown: Path, exported: Path) -> None:
    page = (exported / "report.html").read_text()
    kept = find(flown)
    for text in (kept.scenario.digest(), kept.state_hash, f"numpy {np.__version__}"):
        assert text in page
    assert "<td>passed</td>" in page


def test_the_hash_of_the_numbers_changes_with_the_last_bit_of_any_of_them(flown: Path) -> None:
    kept = find(flown)
    position = kept.record.position.copy()
    position[77, 1, 2] = np.nextafter(position[77, 1, 2], np.inf)
    other = replace(kept, record=replace(kept.record, position=position))
    assert find(flown).state_hash == kept.state_hash
    assert other.state_hash != kept.state_hash


def test_words_of_a_scenario_cannot_break_out_of_the_page(flown: Path) -> None:
    kept = find(flown)
    evil = "</script><script>alert(1)</script>"
    scenario = kept.scenario.model_copy(update={"title": evil, "text": evil})
    page = page_of(replace(kept, scenario=scenario))
    assert "<script>alert" not in page
    assert "&lt;script&gt;alert(1)" in page


def test_a_part_of_a_flight_is_told_but_not_judged(
    flown: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "scenario.json").write_text((flown / "scenario.json").read_text())
    save_record(simulate(shortened("triangle", 10.0)), tmp_path / "record.npz")
    assert cli.main(["report", str(tmp_path), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert (data["steps"], data["steps_planned"], data["complete"]) == (20, 400, False)
    assert data["expectations"] == []
    assert cli.main(["report", str(tmp_path)]) == 0
    assert "cut short at step 20 of 400" in capsys.readouterr().out
    assert "cut short at step 20 of 400" in (tmp_path / "report" / "report.html").read_text()


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("record.npz", b"nothing of the kind", "is not the record of a run"),
        ("flight.mcap", b"nothing of the kind", "is not an MCAP file that can be read"),
        ("flight.mcap", b"", "flight.mcap"),
        ("result.json", b"{}", "this run was not recorded"),
    ],
)
def test_what_cannot_be_read_is_a_sentence(
    name: str, content: bytes, said: str, flown: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_bytes(content)
    (tmp_path / "scenario.json").write_text((flown / "scenario.json").read_text())
    place = tmp_path / name if name.endswith(".mcap") else tmp_path
    assert cli.main(["report", str(place)]) == 2
    captured = capsys.readouterr()
    assert said in captured.err
    assert not captured.out


def test_a_report_that_cannot_be_written_are_a_sentence(
    flown: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    assert cli.main(["report", str(flown), "--out", str(tmp_path / "file")]) == 2
    assert "the report cannot be written" in capsys.readouterr().err


def test_the_predicted_spread_of_the_triangle_is_its_closed_form() -> None:
    time = np.linspace(0.0, 12000.0, 601)
    predicted = prediction.arc_length_spread(shipped("triangle"), time)
    decay = 1e-3 * time
    assert predicted == pytest.approx(50e3 * (3.0 * np.exp(-decay) - np.exp(-3.0 * decay)) / 2.0, rel=1e-9)


def test_where_satellites_wait_for_each_other_linear_theory_predicts_nothing() -> None:
    scenario = shipped("triangle", "consensus.arc_length_source=projected")
    assert prediction.arc_length_spread(scenario, np.array([0.0, 1.0])) is None


def test_two_flights_of_one_scenario_are_the_same_to_the_last_bit(
    flown: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["report", str(flown), str(flown), "--out", str(tmp_path)]) == 0
    assert "Bitwise equal." in capsys.readouterr().out
    assert "Bitwise equal." in (tmp_path / "report.html").read_text()


def test_two_flights_that_differ_are_told_apart_number_by_number(
    flown: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "other"
    other.mkdir()
    (other / "scenario.json").write_text((flown / "scenario.json").read_text())
    record = load_record(flown / "record.npz")
    record.velocity[123, 2, 0] += 0.25
    save_record(record, other / "record.npz")
    assert cli.main(["report", str(flown), str(other), "--out", str(tmp_path), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["same"] is False
    unlike = [entry for entry in data["differences"] if entry["first"] is not None]
    assert [entry["quantity"] for entry in unlike] == ["velocity"]
    assert (unlike[0]["step"], unlike[0]["satellite"], unlike[0]["first"]) == (123, "sat3", 123)
    assert unlike[0]["largest"] == pytest.approx(0.25, rel=1e-12)
    assert [entry["difference"] for entry in data["expectations"]] == [0.0]
    assert "the first at step 123" in (tmp_path / "report.html").read_text()


@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan, 1e200])
def test_a_flight_that_diverged_is_told_as_far_as_it_can_be_drawn(
    value: float, flown: Path, tmp_path: Path
) -> None:
    away = tmp_path / "away"
    away.mkdir()
    (away / "scenario.json").write_text((flown / "scenario.json").read_text())
    record = load_record(flown / "record.npz")
    record.position[150:, 1] = value
    record.measured_position[150:, 1] = value
    save_record(record, away / "record.npz")
    assert cli.main(["report", str(away), "--out", str(tmp_path)]) in (0, 1)
    page = tmp_path / "report.html"
    assert "From step 150 on there are positions that are not finite" in page.read_text()
    drawn = np.frombuffer(base64.b64decode(numbers_of(page)["space"][0]["position"]), dtype="<f4")
    missing = np.isnan(drawn.reshape(-1, 3, 3)).all(axis=-1)
    # The lines of the scene have a gap where there is no number.
    assert missing[:, 1].any()
    assert not missing[:, [0, 2]].any()
    assert not np.isinf(drawn).any()


def test_a_gap_of_all_satellites_stays_a_gap_in_their_envelope() -> None:
    values = np.array([[1.0, 2.0, 6.0], [np.nan, np.nan, np.nan], [3.0, np.nan, 5.0]])
    found = _envelope(values)
    assert np.array_equal(found[[0, 2]], [[1.0, 2.0, 6.0], [3.0, 4.0, 5.0]])
    assert np.isnan(found[1]).all()


def test_flights_of_other_satellites_are_compared_by_their_figures_alone(flown: Path, tmp_path: Path) -> None:
    changes = ("--set", "timing.duration=20.0")
    other = tmp_path / "ring"
    assert cli.main(["run", "ring_six", "--mode", "inprocess", "--out", str(other), *changes]) == 0
    assert cli.main(["report", str(flown), str(other), "--out", str(tmp_path)]) == 0
    page = (tmp_path / "report.html").read_text()
    assert "Different flights: one has sat1, sat2, sat3, the other" in page


@pytest.mark.parametrize("words", [("a", "b", "c"), ("flown", "flown", "--export", "csv")])
def test_more_than_is_understood_is_a_sentence(
    words: tuple[str, ...], flown: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["report", *(str(flown) if word == "flown" else word for word in words)]) == 2
    assert re.search(r"satform: .*(report takes one run|--export is for one run)", capsys.readouterr().err)


def test_the_extremes_of_a_series_are_its_own_samples_with_every_peak_and_trough() -> None:
    rng = np.random.default_rng(4)
    values = rng.uniform(0.0, 1.0, 100_003)
    values[[7, 50_001, 100_002]] = [5.0, -6.0, np.nan]
    places = extremes(values, 500)
    assert len(places) <= 1002
    assert np.all(np.diff(places) > 0)
    assert {0, 7, 50_001, 100_002} <= set(places.tolist())


def test_a_line_on_the_page_is_the_flight_at_its_own_times(flown: Path) -> None:
    kept = find(flown)
    chart = next(chart for chart in charts(kept, Unit("s", 1.0)) if chart.key == "tracking_error")
    line = chart.lines[2]
    rows = np.rint(line.time / 0.5).astype(int)
    away = kept.record.position[rows, 2] - kept.record.reference_position[rows, 2]
    assert line.values == pytest.approx(np.sqrt((away**2).sum(axis=-1)), rel=1e-12)


def test_thinning_keeps_every_peak() -> None:
    rng = np.random.default_rng(3)
    values = rng.uniform(0.0, 1.0, (100_003, 2))
    values[[7, 50_001, 100_002], [0, 1, 0]] = [5.0, 6.0, 7.0]
    time, thin = plot_style.thinned(np.arange(100_003.0), values)
    assert len(time) == len(thin) <= 1500
    assert thin.max(axis=0) == pytest.approx([7.0, 6.0])
    assert 5.0 in thin[:, 0]


def test_many_satellites_are_drawn_in_colours_of_their_own() -> None:
    for count in (1, 7, 8, 40):
        assert len({str(colour) for colour in plot_style.colours(count)}) == count


def test_the_figures_of_a_flight_are_those_of_its_arrays() -> None:
    flight = simulate(shortened("triangle", 20.0, "timing.step=2.0"))
    arrays = {name: np.zeros_like(getattr(flight, name)[:, :2]) for name in QUANTITIES}
    arrays["position"][:, 1] = [30.0, 40.0, 0.0]
    arrays["reference_position"] = arrays["position"][:-1] + np.array([0.0, 3.0, 4.0])
    arrays["acceleration"][:, 0, 1] = 0.1 * np.arange(10)
    arrays["applied_acceleration"] = arrays["acceleration"]
    arrays["sliding_variable"] = -arrays["acceleration"]
    arrays["arc_length"][:, 1] = 7.0
    arrays["delta_v"][:] = np.nan
    record = FlightRecord(("a", "b"), 2.0, **arrays)
    summary = summarise(record, FlightSetting(math.tau / 8.0, 2.0))
    assert (summary.duration, summary.final_from) == (20.0, 16.0)
    assert summary.smallest_distance == pytest.approx(50.0)
    assert summary.spread_at_start == summary.spread_at_end == 7.0
    first = summary.satellites[0]
    assert first.final_error == pytest.approx(5.0)
    assert first.final_sliding_variable == pytest.approx(0.9)
    assert first.mean_control == pytest.approx(0.85)
    assert first.largest_control == pytest.approx(0.9)
    assert first.delta_v == pytest.approx(9.0)
    # Two and a half revolutions of 8 s.
    assert first.delta_v_per_orbit == pytest.approx(3.6)
    (pair,) = summary.pairs
    assert (pair.first, pair.second, pair.closest_at) == ("a", "b", 0.0)
    assert pair.smallest_distance == pytest.approx(50.0)
    # At rest 30 m higher, on an ellipse about 120 m with a half axis of 90 m across the flight direction.
    assert pair.radial_normal_distance == pytest.approx(30.0)
    assert math.isnan(summary.tetrahedron_quality)


def test_the_figures_of_four_satellites_about_an_eccentric_chief_and_of_many() -> None:
    flight = simulate(shortened("tetrahedron", 100.0, "expect=[]"))
    chief = KeplerianChief(2.0e7, 0.5, 0.1, 0.0, 0.0, 0.0)
    summary = summarise(flight, FlightSetting(chief.mean_motion, 10.0, chief=chief))
    assert summary.tetrahedron_quality == pytest.approx(3.0)
    (table,) = content.pairs(summary)
    assert table.title == "Pairs of satellites; least tetrahedron quality 3 (3 is regular)"
    assert len(summary.pairs) == 6
    assert all(math.isnan(pair.radial_normal_distance) for pair in summary.pairs)
    assert math.isnan(summary.satellites[0].delta_v_per_orbit)
    arrays = {name: np.repeat(getattr(flight, name), 3, axis=1) for name in QUANTITIES}
    many = summarise(FlightRecord(tuple("abcdefghijkl"), 10.0, **arrays))
    assert (many.pairs, math.isnan(many.tetrahedron_quality)) == ((), True)


def test_a_flight_with_a_date_is_exported_as_orbit_messages_with_its_contacts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # The station sees the chief at the start.
    station = "stations=[{name: quito, latitude: 0.1 deg, longitude: -78.5 deg}]"
    words = [word for change in ("timing.duration=20.0", "expect=[]", station) for word in ("--set", change)]
    out = tmp_path / "run"
    assert cli.main(["run", "triangle_inertial", "--mode", "inprocess", "--out", str(out), *words]) == 0
    capsys.readouterr()
    assert cli.main(["report", str(out), "--export", "oem", "--export", "omm", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [own["other"] for own in told["timeline"] if own["kind"] == "contact"] == ["quito"] * 3
    assert told["lines_of_sight_left_out"] is False
    objects = ["chief", "sat1", "sat2", "sat3"]
    names = [Path(file).name for file in told["files"]]
    assert names[-8:] == [f"{name}.{kind}" for kind in ("oem", "omm") for name in objects]
    assert (out / "report" / "sat2.oem").read_text().startswith("CCSDS_OEM_VERS = 3.0\n")
    page = numbers_of(out / "report" / "report.html")
    bars = next(chart for chart in page["graphs"] if chart["key"] == "timeline")
    assert [line["name"] for line in bars["lines"]] == [f"sat{number}: quito" for number in (1, 2, 3)]
    monkeypatch.setattr(visibility, "MOST_PAIRS", 2)
    assert cli.main(["report", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["lines_of_sight_left_out"] is True


def test_without_sgp4_the_export_of_mean_elements_is_refused_in_a_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "run"
    words = [word for change in ("timing.duration=4.0", "expect=[]") for word in ("--set", change)]
    assert cli.main(["run", "triangle_inertial", "--mode", "inprocess", "--out", str(out), *words]) == 0
    capsys.readouterr()
    # With None in its place Python raises ImportError.
    monkeypatch.setitem(sys.modules, "sgp4.api", None)
    assert cli.main(["report", str(out), "--export", "omm"]) == 2
    assert "no OMM: mean elements need sgp4: pip install 'satform[omm]'" in capsys.readouterr().err


def test_a_flight_without_a_date_has_no_orbit_messages(
    flown: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["report", str(flown), "--out", str(tmp_path), "--export", "oem"]) == 2
    assert "no OEM: this flight has no inertial quantities" in capsys.readouterr().err
    assert cli.main(["report", str(flown), "--out", str(tmp_path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["timeline"] is None
