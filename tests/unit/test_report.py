"""The report of a flight: the record behind it, its figures and its pictures."""

import json
from pathlib import Path

import numpy as np
import pytest

from flights import shipped, shortened
from satform.record import QUANTITIES, FlightRecord
from satform.simulate import simulate
from satform_tools import cli, drawing, folders, prediction
from satform_tools.summary import summarise

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a short run of the triangle."""
    out = tmp_path_factory.mktemp("runs") / "triangle"
    changes = ("--set", "timing.duration=200.0", "--set", "expect=[{kind: control, below: 100.0}]")
    assert cli.main(["run", "triangle", "--mode", "inprocess", "--out", str(out), *changes]) == 0
    return out


def test_a_kept_record_has_the_bits_of_the_flight(tmp_path: Path) -> None:
    record = simulate(shortened("triangle", 10.0))
    folders.save_record(record, tmp_path / "record.npz")
    assert not record.differences(folders.load_record(tmp_path / "record.npz"))


def test_a_report_tells_the_flight_and_draws_it(flown: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["report", str(flown)]) == 0
    printed = capsys.readouterr().out
    assert "final error [m]" in printed
    assert "pass" in printed
    drawn = sorted(path.name for path in (flown / "report").iterdir())
    assert drawn == [
        "arc_length_spread.png",
        "control.png",
        "delta_v.png",
        "flight.png",
        "orbits.png",
        "sliding_variable.png",
        "tracking_error.png",
    ]
    assert all((flown / "report" / name).read_bytes().startswith(PNG) for name in drawn)


def test_a_lone_satellite_disagrees_with_nobody(tmp_path: Path) -> None:
    changes = ("--set", "timing.duration=2.0", "--set", "expect=[]")
    out = tmp_path / "run"
    assert cli.main(["run", "trajectory_tracking", "--mode", "inprocess", "--out", str(out), *changes]) == 0
    assert cli.main(["report", str(out), "--out", str(tmp_path / "figures")]) == 0
    assert not (tmp_path / "figures" / "arc_length_spread.png").exists()
    assert (tmp_path / "figures" / "flight.png").exists()


def test_a_part_of_a_flight_is_told_but_not_judged(
    flown: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "scenario.json").write_text((flown / "scenario.json").read_text())
    folders.save_record(simulate(shortened("triangle", 10.0)), tmp_path / "record.npz")
    assert cli.main(["report", str(tmp_path), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert (data["steps"], data["steps_planned"], data["complete"]) == (20, 400, False)
    assert data["expectations"] == []


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


def test_pictures_that_cannot_be_written_are_a_sentence(
    flown: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    assert cli.main(["report", str(flown), "--out", str(tmp_path / "file")]) == 2
    assert "the pictures cannot be written" in capsys.readouterr().err


def test_the_predicted_spread_of_the_triangle_is_its_closed_form() -> None:
    time = np.linspace(0.0, 12000.0, 601)
    predicted = prediction.arc_length_spread(shipped("triangle"), time)
    decay = 1e-3 * time
    assert predicted == pytest.approx(50e3 * (3.0 * np.exp(-decay) - np.exp(-3.0 * decay)) / 2.0, rel=1e-9)


def test_where_satellites_wait_for_each_other_linear_theory_predicts_nothing() -> None:
    scenario = shipped("triangle", "consensus.arc_length_source=projected")
    assert prediction.arc_length_spread(scenario, np.array([0.0, 1.0])) is None


def test_thinning_keeps_every_peak() -> None:
    rng = np.random.default_rng(3)
    values = rng.uniform(0.0, 1.0, (100_003, 2))
    values[[7, 50_001, 100_002], [0, 1, 0]] = [5.0, 6.0, 7.0]
    time, thin = drawing.thinned(np.arange(100_003.0), values)
    assert len(time) == len(thin) <= 1500
    assert thin.max(axis=0) == pytest.approx([7.0, 6.0])
    assert 5.0 in thin[:, 0]


def test_many_satellites_are_drawn_in_colours_of_their_own() -> None:
    for count in (1, 7, 8, 40):
        assert len({str(colour) for colour in drawing.colours(count)}) == count


def test_the_figures_of_a_flight_are_those_of_its_arrays() -> None:
    flight = simulate(shortened("triangle", 20.0, "timing.step=2.0"))
    arrays = {name: np.zeros_like(getattr(flight, name)[:, :2]) for name in QUANTITIES}
    arrays["position"][:, 1] = [30.0, 40.0, 0.0]
    arrays["reference_position"] = arrays["position"][:-1] + np.array([0.0, 3.0, 4.0])
    arrays["acceleration"][:, 0, 1] = 0.1 * np.arange(10)
    arrays["given_acceleration"] = arrays["acceleration"]
    arrays["sliding_variable"] = -arrays["acceleration"]
    arrays["arc_length"][:, 1] = 7.0
    arrays["delta_v"][:] = np.nan
    summary = summarise(FlightRecord(("a", "b"), 2.0, **arrays))
    assert (summary.duration, summary.final_from) == (20.0, 16.0)
    assert summary.smallest_distance == pytest.approx(50.0)
    assert summary.spread_at_start == summary.spread_at_end == 7.0
    first = summary.satellites[0]
    assert first.final_error == pytest.approx(5.0)
    assert first.final_sliding_variable == pytest.approx(0.9)
    assert first.mean_control == pytest.approx(0.85)
    assert first.largest_control == pytest.approx(0.9)
    assert first.delta_v == pytest.approx(9.0)
