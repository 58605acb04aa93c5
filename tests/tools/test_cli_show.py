# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the command line says of scenarios without flying them: list, show, check, schema, version, help."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

from flights import SCENARIOS, shortened
from satform_tools import console
from satform_tools.cli import main as cli

NOT_PLAIN = re.compile("[\x1b─-╿]")
"""Escape codes and box drawing."""


def test_numbers_that_are_not_finite_become_null_in_json() -> None:
    assert json.loads(console.to_json({"figure": float("nan"), "list": [float("inf"), 1.0]})) == {
        "figure": None,
        "list": [None, 1.0],
    }


@pytest.mark.parametrize("words", [["list"], ["show", "triangle"], ["--help"], ["check", "triangle"]])
def test_away_from_a_terminal_everything_is_plain_text(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(words) == 0
    printed = capsys.readouterr().out
    assert printed
    assert not NOT_PLAIN.search(printed)


def test_help_says_what_the_exit_codes_mean(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["run", "--help"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    for meaning in ("0 done", "1 an expectation was missed", "2 bad input", "3 a process was lost"):
        assert meaning in printed


def test_list_names_every_shipped_scenario(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["list", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert [entry["name"] for entry in listed] == sorted(path.stem for path in SCENARIOS.glob("*.yaml"))
    triangle = next(entry for entry in listed if entry["name"] == "triangle")
    assert (triangle["satellites"], triangle["duration"], triangle["graph"]) == (3, 12000.0, "complete")


def test_check_lays_changes_over_scenarios_and_not_over_campaigns(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert cli.main(["check", "triangle", "--set", "timing.step=20.0"]) == 0
    # reaching_gain is 0.1 1/s, and 1 - 0.1 * 20 = -1.
    assert "reaching_gain 0.1 1/s times the step 20 s is 2" in capsys.readouterr().out
    assert cli.main(["check", "triangle", "--set", "timing.step=-1", "--json"]) == 2
    (entry,) = json.loads(capsys.readouterr().out)
    (problem,) = entry["problems"]
    assert (problem["file"], problem["field"]) == ("--set timing.step=-1", "timing.step")
    assert cli.main(["check", "triangle", "gain_sweep", "--set", "timing.step=1.0"]) == 2
    assert "gain_sweep is a campaign: --set changes fields of scenarios" in capsys.readouterr().err


def test_check_says_everything_about_every_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (SCENARIOS / "triangle.yaml").read_text()
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text(text.replace("kind: complete", "kind: complet").replace("period: 6000.0", "period: -1"))
    assert cli.main(["check", str(wrong), "triangle", "unheard_of"]) == 2
    captured = capsys.readouterr()
    lines = text.splitlines()
    graph = next(number for number, line in enumerate(lines, 1) if line.startswith("graph:"))
    assert f"{wrong}:{graph}: graph: there is no kind 'complet'; did you mean complete?" in captured.err
    assert captured.err.count("it should be greater than") == 2
    assert "there is no scenario 'unheard_of'" in captured.err
    number = next(number for number, line in enumerate(lines, 1) if line.startswith("dynamics:"))
    assert captured.out.startswith(
        f"triangle:{number}: warning: dynamics: cw is of first order in the distance"
    )
    assert captured.out.endswith("triangle: OK\n")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("switching_gain: 0.1", "switching_gain: 0.005", "switching_gain on axis x is 0.005 m/s^2"),
        (
            "kind: complete",
            "kind: matrix, rows: [[0, 1, 0], [1, 0, 0], [0, 0, 0]]",
            "graph: it is not connected",
        ),
        ("scale: 0.75", "scale: 0.76", "have equal periods only if"),
        ("step: 0.5,", "step: 600.0,", "consensus: with a control period of 600 s, arc_length"),
        ("reaching_gain: 0.1", "reaching_gain: 5.0", "the sampled law diverges"),
    ],
)
def test_check_warns_of_what_is_unwise(
    old: str, new: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (SCENARIOS / "triangle.yaml").read_text()
    assert old in text
    unwise = tmp_path / "unwise.yaml"
    unwise.write_text(text.replace(old, new))
    assert cli.main(["check", str(unwise)]) == 0
    printed = capsys.readouterr().out
    assert "warning: " in printed
    assert said in printed


def test_show_describes_the_graph_its_roots_and_in_neighbours(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["show", "line_six", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["graph"]["in_neighbours"]["sat3"] == ["sat2", "sat4"]
    assert data["consensus"]["modal_roots"][1][0] == pytest.approx(-2.67949e-4, rel=1e-5)
    # With hold and coupling_gain = tracking_gain * rate_gain no delay makes a mode unstable.
    assert data["consensus"]["delay_margin"] is None
    assert data["consensus"]["stable_for_any_delay"]
    # The slowest mode over a step of 1 s.
    agreement = next(loop for loop in data["sampled_loops"] if loop["kind"] == "consensus")
    assert -math.log(agreement["radius"]) == pytest.approx(2.67949e-4, rel=1e-4)
    assert data["orbit"]["altitude"] == pytest.approx(758.5e3, abs=50.0)
    assert {"topic": "/sat3/arc_length", "from": "sat3", "to": ["sat2", "sat4"]} in data["topics"]
    assert data["processes"][0]["node"] == "plant"
    assert len(data["processes"]) == 8


def shown(name: str, capsys: pytest.CaptureFixture[str]) -> dict[str, dict[str, object]]:
    """Satellites of a scenario as `show --json` gives them, by name; its text has to be printed as well."""
    assert cli.main(["show", name]) == 0
    assert capsys.readouterr().out
    assert cli.main(["show", name, "--json"]) == 0
    return {entry["name"]: entry for entry in json.loads(capsys.readouterr().out)["satellites"]}


def test_show_prints_gain_closed_loop_and_observer_poles(capsys: pytest.CaptureFixture[str]) -> None:
    satellites = shown("geo_sphere_lqr", capsys)
    leader, observed = (satellites[name]["feedback"] for name in ("leader", "observed"))
    assert observed["gain"] == leader["gain"]
    # Across the orbit: z'' = -n^2 z + u, solved by hand.
    motion = 2.0 * math.pi / 86164.0905
    stiffness = motion**2 * (-1.0 + math.sqrt(1.0 + 0.5 / (0.5 * motion**2)))
    assert leader["gain"][2][2] == pytest.approx(stiffness, rel=1e-4)
    assert leader["observer_poles"] == []
    assert observed["observer_poles"] == pytest.approx([-0.050, -0.052, -0.054, -0.056, -0.058, -0.060])
    assert len(leader["closed_loop_poles"]) == 6
    assert all(pole[0] < 0.0 for pole in leader["closed_loop_poles"])
    assert cli.main(["show", "geo_sphere_lqr"]) == 0
    printed = capsys.readouterr().out
    assert "gain of observed, u = -K e:" in printed
    assert "observer poles of observed: -0.05, -0.052, -0.054, -0.056, -0.058, -0.06 1/s" in printed


def test_show_prints_reaching_times_and_the_lyapunov_function_at_the_start(
    capsys: pytest.CaptureFixture[str],
) -> None:
    start = shown("triangle", capsys)["sat1"]["sliding"]
    # Velocity errors of 50, -50 and 20 m/s; switching and reaching gain 0.1; disturbances of 0.01 m/s^2.
    assert start["sliding_variable"] == pytest.approx([50.0, -50.0, 20.0], rel=1e-9)
    assert start["lyapunov"] == pytest.approx(2700.0, rel=1e-9)
    for key, authority in (("reaching_time", 0.1), ("longest_reaching_time", 0.09)):
        wanted = [math.log1p(0.1 * error / authority) / 0.1 for error in (50.0, 50.0, 20.0)]
        assert start[key] == pytest.approx(wanted, rel=1e-9)


def hill(motion):
    """State and input matrix of the Clohessy-Wiltshire equations."""
    state = np.zeros((6, 6))
    state[:3, 3:] = np.eye(3)
    state[3, 0], state[3, 4], state[4, 3], state[5, 2] = (
        3.0 * motion**2,
        2.0 * motion,
        -2.0 * motion,
        -(motion**2),
    )
    return state, np.vstack((np.zeros((3, 3)), np.eye(3)))


def cost_of_flight(state, command, gain, weights, start):
    """Integral of x'Qx + u'Ru of a closed loop from a start, by Lyapunov's equation."""
    q, r = weights
    rate = -(q + gain.T @ r @ gain)
    return float(start @ solve_continuous_lyapunov((state - command @ gain).T, rate) @ start)


def test_show_prints_the_cost_to_go_of_linear_quadratic_regulators(
    capsys: pytest.CaptureFixture[str],
) -> None:
    weights = "position_weight: 0.01, velocity_weight: 0.05, command_weight: 1.0"
    changes = "satellite_defaults.position_error=[100.0, -80.0, 60.0]"
    for law, form in (
        (f"{{kind: lqr, {weights}}}", 6),
        (f"{{kind: lqi, {weights}, integral_weight: 1.0e-7, command_path: error, feedforward: true}}", 9),
    ):
        command = ["show", "compare_controllers", "--set", changes, "--set", f"satellites.1.controller={law}"]
        assert cli.main([*command, "--json"]) == 0
        found = next(
            entry for entry in json.loads(capsys.readouterr().out)["satellites"] if entry["name"] == "lqr"
        )
        motion = 2.0 * math.pi / 6000.0
        state, thrust = hill(motion)
        costs = [0.01] * 3 + [0.05] * 3 + [1e-7] * (form - 6)
        if form == 9:
            state = np.block([[state, np.zeros((6, 3))], [np.eye(3), np.zeros((3, 6))]])
            thrust = np.vstack((thrust, np.zeros((3, 3))))
        start = np.array([100.0, -80.0, 60.0] + [0.0] * (form - 3))
        gain, effort = np.array(found["feedback"]["gain"]), np.eye(3) / motion**2
        wanted = cost_of_flight(state, thrust, gain, (np.diag(costs), effort), start)
        assert found["lyapunov"]["value"] == pytest.approx(wanted, rel=1e-6)
        assert (found["lyapunov"]["unit"], found["lyapunov"]["form"]) == ("s", "x'Px")
    assert cli.main(command) == 0
    printed = capsys.readouterr().out
    assert re.search(rf"lqr +{re.escape(f'{wanted:.6g}')} +s +x'Px", printed)


def test_show_prints_what_is_known_of_other_lyapunov_functions(capsys: pytest.CaptureFixture[str]) -> None:
    # s = 2 l e + e' with the velocity of the reference: (0.4 s^-1 times 5, -4, 3 m)^2 / 2.
    adaptive = shown("adaptive_tracking", capsys)["patches"]["lyapunov"]
    assert adaptive["value"] == pytest.approx(0.5 * 0.4**2 * 50.0, rel=1e-9)
    assert "without the part of the estimates" in adaptive["form"]
    # From rest at (0, 0, 0), the neighbour at (45, 5, 4) m: s = -common velocity + g / m, (2) to (4).
    potential = shown("directed_triangle", capsys)["sat1"]["lyapunov"]
    apart = np.array([-45.0, -5.0, -4.0])
    margin, wanted = apart @ apart - 100.0, 100.0**2 - 100.0
    pull = 0.01 * 2.0 * apart * (1.0 - (wanted / margin) ** 2)
    speed = -np.array([0.5, 0.2, 0.0]) + pull / math.sqrt(1.0 + pull @ pull / 9.0)
    assert potential["value"] == pytest.approx(0.5 * speed @ speed, rel=1e-9)
    # 10 m above a free motion that has the wanted elements: 40 m of semi-major axis, 30 m of the e-vector.
    changes = ("dynamics={kind: cw}", "nominal_motion.period=6000", "satellites.0.position_error=[10, 0, 0]")
    words = [word for change in changes for word in ("--set", change)]
    assert cli.main(["show", "mean_elements", *words, "--json"]) == 0
    mean, osculating, _ = json.loads(capsys.readouterr().out)["satellites"]
    assert mean["lyapunov"]["value"] == pytest.approx(0.5 * (40.0**2 + 30.0**2), rel=1e-6)
    assert osculating["lyapunov"] is None


def tschauner_hempel(times, axis, eccentricity):
    """State matrix of relative motion about an eccentric chief at times since perigee, shape (n, 6, 6)."""
    motion = math.sqrt(398600.4418e9 / axis**3)
    eccentric = motion * times
    for _ in range(60):
        miss = eccentric - eccentricity * np.sin(eccentric) - motion * times
        eccentric = eccentric - miss / (1.0 - eccentricity * np.cos(eccentric))
    radius = axis * (1.0 - eccentricity * np.cos(eccentric))
    turning = motion * axis**2 * math.sqrt(1.0 - eccentricity**2) / radius**2
    rising = motion * axis**2 * eccentricity * np.sin(eccentric) / radius
    pull, swerve = 398600.4418e9 / radius**3, -2.0 * turning * rising / radius
    matrix = np.zeros((len(times), 6, 6))
    matrix[:, :3, 3:] = np.eye(3)
    matrix[:, 3, 0], matrix[:, 3, 1], matrix[:, 3, 4] = turning**2 + 2.0 * pull, swerve, 2.0 * turning
    matrix[:, 4, 0], matrix[:, 4, 1], matrix[:, 4, 3] = -swerve, turning**2 - pull, -2.0 * turning
    matrix[:, 5, 2] = -pull
    return matrix


def test_show_prints_the_gain_of_a_periodic_regulator_over_the_orbit(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Against a backward Riccati recursion on numerically integrated Tschauner-Hempel equations."""
    command = ["show", "eccentric_rigid", "--set", "timing.step=60.0"]
    assert cli.main([*command, "--json"]) == 0
    feedback = json.loads(capsys.readouterr().out)["satellites"][0]["feedback"]
    assert feedback["gain"] is None
    angles = [math.degrees(entry["true_anomaly"]) for entry in feedback["gains_over_orbit"]]
    assert angles == pytest.approx([0.0, 90.0, 180.0, 270.0])

    axis, eccentricity = 20.0e6, 0.6
    motion = math.sqrt(398600.4418e9 / axis**3)
    count = round(2.0 * math.pi / motion / 60.0)
    step, parts = 2.0 * math.pi / motion / count, 8
    # Transition and effect of a held command of all steps at once, by the classical Runge-Kutta method.
    state = np.broadcast_to(np.hstack((np.eye(6), np.zeros((6, 3)))), (count, 6, 9)).copy()
    push, part = np.vstack((np.zeros((3, 9)), np.hstack((np.zeros((3, 6)), np.eye(3))))), step / parts
    for number in range(parts):
        begin = step * np.arange(count) + number * part
        first, middle, last = (
            tschauner_hempel(begin + offset, axis, eccentricity) for offset in (0.0, part / 2, part)
        )
        k1 = first @ state + push
        k2 = middle @ (state + part / 2 * k1) + push
        k3 = middle @ (state + part / 2 * k2) + push
        k4 = last @ (state + part * k3) + push
        state = state + part / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    cost, effort, weight = np.zeros((6, 6)), np.eye(3) / motion**2, np.diag([1e-4] * 3 + [0.0] * 3)
    gains = np.zeros((count, 3, 6))
    for number in range(4 * count - 1, -1, -1):
        ahead, held = state[number % count, :, :6], state[number % count, :, 6:]
        gains[number % count] = np.linalg.solve(effort + held.T @ cost @ held, held.T @ cost @ ahead)
        cost = weight + ahead.T @ cost @ (ahead - held @ gains[number % count])
    found = [np.array(entry["gain"]) for entry in feedback["gains_over_orbit"]]
    scale = np.repeat([1.0, motion], 3) / np.abs(gains[0][:, :3]).max()
    assert np.abs((found[0] - gains[0]) * scale).max() < 1e-5
    apogee = 0.5 * (gains[count // 2] + gains[(count + 1) // 2])
    assert np.abs((found[2] - apogee) * scale).max() < 1e-5
    assert np.abs((found[0] - apogee) * scale).max() > 0.3

    assert cli.main(command) == 0
    printed = capsys.readouterr().out
    assert "gain of periodic, u = -K e, at a true anomaly of the chief of 270 deg:" in printed


def test_show_prints_pointing_gains_inertia_and_the_lyapunov_function_of_attitudes(
    capsys: pytest.CaptureFixture[str],
) -> None:
    attitude = shown("attitude_cape_canaveral", capsys)["sat1"]["attitude"]
    assert (attitude["attitude_gain"], attitude["rate_gain"]) == (14.0, 40.0)
    assert [row[axis] for axis, row in enumerate(attitude["inertia"])] == [86.0, 85.0, 113.0]
    assert attitude["wheel_inertia"] == [0.5, 0.5, 0.5]
    # V = rate' J rate / 2 + 2 k1 ln(1 + tan^2(angle / 4)), with J between 84.5 and 112.5 kg m^2.
    turned = 28.0 * math.log1p(math.tan(0.25 * attitude["angle"]) ** 2)
    moved = 0.5 * attitude["rate_error"] ** 2
    assert turned + 84.5 * moved <= attitude["lyapunov"] <= turned + 112.5 * moved
    # Close to the reference: J s^2 + k2 s + k1 / 4 = 0 on each axis.
    slowest = max(root.real for inertia in (85.5, 84.5, 112.5) for root in np.roots([inertia, 40.0, 3.5]))
    assert attitude["closed_loop_poles"][0] == pytest.approx(slowest, rel=0.05)
    aimed = shown("formation_pointing", capsys)["sat1"]["attitude"]
    assert aimed["pointing"]["target"] == "sat2"
    assert aimed["lyapunov"] == pytest.approx(0.0, abs=1e-12)


def test_schema_prints_what_stands_beside_the_scenarios(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["schema"]) == 0
    assert capsys.readouterr().out == (SCENARIOS / "scenario.schema.json").read_text()


def test_version_names_what_has_a_part_in_the_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["version", "--json"]) == 0
    assert {"python", "satform", "numpy", "scipy"} <= json.loads(capsys.readouterr().out).keys()


def test_show_says_how_many_liars_a_graph_bears(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["show", "complete_six"]) == 0
    printed = capsys.readouterr().out
    assert "robustness: 3-robust; (r, s)-robust for (1, 6), (2, 6), (3, 6)" in printed
    assert cli.main(["show", "ring_six", "--json"]) == 0
    graph = json.loads(capsys.readouterr().out)["graph"]
    assert graph["robustness"] == {"r": 1, "s": [4], "exact": True}
    assert graph["promise"]["largest_local"] == 0


def test_check_warns_of_more_liars_than_the_graph_bears(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (SCENARIOS / "ring_six.yaml").read_text()
    law = "kind: resilient_arc_length\n  tolerated_byzantine: "
    for liars, warned in ((0, 0), (1, 1)):
        file = tmp_path / "ring.yaml"
        file.write_text(text.replace("kind: arc_length\n", f"{law}{liars}\n", 1))
        assert cli.main(["check", str(file)]) == 0
        assert capsys.readouterr().out.count("consensus.tolerated_byzantine: nothing is promised") == warned


def test_check_warns_of_a_later_graph_that_bears_fewer_liars(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (SCENARIOS / "complete_six.yaml").read_text()
    text = text.replace("kind: arc_length\n", "kind: resilient_arc_length\n  tolerated_byzantine: 1\n", 1)
    for later, warned in (("complete", 0), ("ring", 1)):
        file = tmp_path / "complete.yaml"
        file.write_text(f"{text}\ngraph_schedule:\n  - {{at: 60.0, graph: {{kind: {later}}}}}\n")
        assert cli.main(["check", str(file)]) == 0
        printed = capsys.readouterr().out
        assert printed.count("consensus.tolerated_byzantine: from 60 s on: nothing is promised") == warned
        assert printed.count("consensus.tolerated_byzantine") == warned


def test_show_tells_what_is_planned_to_go_wrong(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["show", "satellite_lost_and_rejoined"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "fault: satellite_lost of sat2, at 3100, rejoin_at 4900, memory checkpoint" in printed
    assert "checkpoints: every 500 s" in printed
    # Of two satellites that hear each other the Laplacian has the eigenvalues 0 and 2, of three 0, 3 and 3.
    assert "3100 sat2 is killed by the scenario 2 2 2" in printed
    assert "4900 sat2 is back 3 6 3" in printed


def test_show_tells_links_with_what_they_take_from_the_default(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["show", "lossy_links", "--json"]) == 0
    links = json.loads(capsys.readouterr().out)["links"]
    (own,) = links["edges"]
    assert (own["sender"], own["receiver"], own["loss"], own["delay"]) == ("sat3", "sat1", 0.5, 20.0)
    assert cli.main(["show", "lossy_links"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "links: loss 0.3, delay 20, jitter 10" in printed
    assert "from sat3 to sat1: loss 0.5, delay 20, jitter 10, outages" in printed


def test_show_says_nothing_of_faults_where_there_are_none(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["show", "triangle"]) == 0
    printed = capsys.readouterr().out
    assert "links:" not in printed
    assert "fault" not in printed


def test_a_large_formation_is_shown_on_a_page(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    data = json.loads(shortened("triangle", 10.0).to_json())
    curve = data["satellites"][0]["curve"]
    data["satellites"] = [{"name": f"s{number}", "curve": curve} for number in range(120)]
    file = tmp_path / "many.json"
    file.write_text(json.dumps(data))
    assert cli.main(["show", str(file)]) == 0
    printed = capsys.readouterr().out
    assert len(printed) < 20_000
    assert len(printed.splitlines()) < 150
    assert max(map(len, printed.splitlines())) < 500
    assert "... and 110 more; --json prints all" in printed
    assert "(119 in all)" in printed
    # Of a few satellites everything is shown.
    assert cli.main(["show", "triangle"]) == 0
    assert "--json prints all" not in capsys.readouterr().out
