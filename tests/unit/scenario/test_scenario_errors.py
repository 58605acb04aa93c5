# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the loader says about a file that cannot fly: where, what was found, what is allowed."""

import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flights import SCENARIOS, shipped
from satform.files.named_file import FileSource
from satform.scenario import Problem, ScenarioError, load_scenario, parse_scenario
from satform.scenario.field_errors import nearest
from satform.scenario.renamed import RENAMED_FIELDS

SIGNS = ":[]{}-#&*!|>'\"%@`,\n 0x."
TRIANGLE = (SCENARIOS / "triangle.yaml").read_text()


def problems(text: str, *changes: str) -> list[Problem]:
    """What is wrong with the text of a scenario."""
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text, "f.yaml", changes)
    return caught.value.problems


def broken(old: str, new: str) -> list[Problem]:
    """What is wrong with the triangle after one replacement."""
    assert old in TRIANGLE
    return problems(TRIANGLE.replace(old, new, 1))


def line_of(start: str, text: str = TRIANGLE) -> int:
    return next(number for number, line in enumerate(text.splitlines(), 1) if line.strip().startswith(start))


@pytest.mark.parametrize(
    ("old", "new", "field", "sentence"),
    [
        ("timing: {step:", "timing: {stepp:", "timing.stepp", "there is no such field; did you mean step?"),
        ("kind: complete", "kind: complet", "graph", "there is no kind 'complet'; did you mean complete?"),
        ("graph: {kind: complete}", "graph: {}", "graph", "needs a `kind:`, one of complete, line, matrix"),
        ("graph: {kind: complete}", "graph: complete", "graph", 'found "complete"; it should be a mapping'),
        ("graph: {kind: complete}", "graph:", "graph", "found null; it should be a mapping"),
        ("duration: 12000.0", "duration: long", "timing.duration", 'found "long"; it should be a number'),
        ("duration: 12000.0", "duration: 12000.3", "timing", "for example 12000.5 s"),
        (
            "orbit: {period: 6000.0",
            "orbit: {period: -5.0",
            "orbit.period",
            "found -5.0; it should be",
        ),
        (
            "orbit: {period: 6000.0",
            "orbit: {period: .nan",
            "orbit.period",
            "found NaN; it should be",
        ),
        (
            "orbit: {period: 6000.0",
            "orbit: {period: .inf",
            "orbit.period",
            "found Infinity; it should",
        ),
        (
            "orbit: {period: 6000.0",
            "orbit: {period: true",
            "orbit.period",
            "found true; it should be a number",
        ),
        ("orbit: {period: 6000.0", 'orbit: {period: "6"', "orbit.period", 'found "6"; it should be a number'),
        ("orbit: {period: 6000.0", "orbit: {period: 1.0, mean_motion: 1.0", "orbit", "give exactly one of"),
        ("kind: harmonic", "kind: harmonics", "dynamics.perturbations[0]", "did you mean harmonic?"),
        (
            "amplitude: 0.01",
            "amplitude: true",
            "dynamics.perturbations[0].amplitude",
            "it should be a number",
        ),
        ("scale: 0.75", "path_parameter: angel", "satellites[1].path_parameter", "did you mean angle?"),
        ("name: sat2", "name: Sat 2", "satellites[1].name", "lower case letters, digits and underscores"),
        ("name: sat2", "name: plant", "satellites[1].name", "the name belongs to another node"),
        ("0.0, 0.0, 100.0e3]", "0.0, 100.0e3]", "satellites[0].curve.centre[2]", "is missing: there are 2"),
        (
            "0.0, 0.0, 100.0e3]",
            "0.0, up, 1.0]",
            "satellites[0].curve.centre[1]",
            'found "up"; it should be',
        ),
        ("[50.0e3, 0.0, 0.0]", "[50.0e3, 9.0, 0.0]", "satellites[0].curve", "have to be perpendicular"),
        ("kind: arc_length_mean", "kind: mean", "expect[3]", "there is no kind 'mean'"),
        (
            "value: 0.461, relative: 0.005",
            "value: 0.461",
            "expect[1]",
            "needs exactly one of",
        ),
        (
            "[sat1, sat2]",
            "[sat1, sat9]",
            "expect[5]",
            "there is no satellite sat9; there are sat1",
        ),
        ("at: 6000.0", "at: 60000.0", "expect[0]", "later than the flight's end at 12000 s"),
        ("graph: {kind: complete}", "graph: {kind: star, centre: 3}", "graph", "numbered 0 to 2"),
        ("seed: 1" if "seed: 1" in TRIANGLE else "orbit:", "seed: 1.5\norbit:", "seed", "found 1.5"),
    ],
)
def test_a_mistake_is_named_with_its_line_and_what_is_allowed(
    old: str, new: str, field: str, sentence: str
) -> None:
    found = [problem for problem in broken(old, new) if problem.field == field]
    assert len(found) == 1
    assert sentence in found[0].sentence
    # Where a replacement adds a line before the field, the field's own line is the next one.
    before = TRIANGLE[: TRIANGLE.index(old)].count("\n") + 1
    assert found[0].line is not None
    assert before - 4 <= found[0].line <= before + 1


def test_all_mistakes_are_said_at_once_in_the_order_of_the_file() -> None:
    text = TRIANGLE.replace("step: 0.5", "step: -0.5").replace("kind: complete", "kind: complet")
    text = text.replace("scale: 0.75", "scale: 0.0")
    found = problems(text)
    assert [problem.field for problem in found] == ["timing.step", "graph", "satellites[1].scale"]
    lines = [problem.line for problem in found]
    assert lines == [line_of("timing:"), line_of("graph:"), line_of("scale:")]


def test_a_list_of_wrong_entries_is_not_called_empty() -> None:
    found = problems(TRIANGLE.replace("arc_length:", "arclength:"))
    assert "satellites" not in [problem.field for problem in found]
    assert found


def test_a_name_given_twice_is_said_where_it_is_given_again() -> None:
    found = broken("name: sat3", "name: sat1")
    assert ("satellites[2].name", line_of("- name: sat3")) in [(one.field, one.line) for one in found]


def bomb(levels: int, width: int, form: str = "[{}]") -> str:
    """Lines whose last one expands to width**levels lists of what is named `a`."""
    names = ["a", *(f"b{level}" for level in range(levels))]
    lists = [form.format(", ".join([f"*{inner}"] * width)) for inner in names]
    return "".join(f"{name}: &{name} {text}\n" for name, text in zip(names[1:], lists, strict=False))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "found nothing"),
        ("- a\n- b\n", "found a list"),
        ("hello", "found 'hello'"),
        pytest.param("0x" + "f" * 4000, "found 'inf'", id="a number that Python does not print"),
        ("a: [1, 2\n", "is not YAML"),
        ("a: 1\na: 2\n", "is not YAML: found duplicate key"),
        ("a: 1\n---\nb: 2\n", "expected a single document"),
        ("a: &x [1, *x]\n", "the alias *x stands within what it stands for"),
        ("a: *x\n", "is not YAML: found undefined alias"),
        ("a: &a [1, 2]\n" + bomb(9, 9), "there are more than 100000 values"),
        ("a: &a [1, 2]\n" + bomb(31, 1), "is nested more than 30 levels deep"),
        ("a: &a {k: 1}\n" + bomb(9, 9, "{{<<: [{}]}}"), "there are more than 100000 values"),
        ("a: \x00", "special characters are not allowed"),
        ("a: " + "[" * 5000, "is nested more than"),
        ("a:\n" + "-\n" * 100_000, "there are more than 100000 values"),
        ("a: " + "x" * 2_000_000, "has 2000003 bytes; a scenario has at most 2000000"),
    ],
)
def test_text_that_is_no_scenario_is_a_sentence(text: str, sentence: str) -> None:
    found = problems(text)
    assert len(found) == 1
    assert sentence in found[0].sentence
    assert "\n" not in found[0].sentence


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ("timing.step", "is not of the form key=value"),
        ("=3", "is not of the form key=value"),
        ("timing.step=[", "is not YAML"),
        ("expect=[&a [x, x], &b [*a, *b]]", "the alias *b stands within what it stands for"),
        ("expect=" + "[" * 5000, "is nested more than"),
        ("satellites.².arc_length=3", "there is no satellites.² in the scenario"),
        ("satellites." + "9" * 5000 + ".arc_length=3", "in the scenario"),
        ("seed=0x" + "f" * 5000, "found Infinity"),
        ("seed=" + "9" * 20, "it is too large for a whole number"),
        ("satellites.7.arc_length=3", "there is no satellites.7 in the scenario"),
        ("satellites.first.arc_length=3", "there is no satellites.first in the scenario"),
        ("name.first=3", "there is no name.first in the scenario"),
        ("timing.step=fast", 'found "fast"; it should be a number'),
        ("timing.stepp=1.0", "did you mean step?"),
        ("satellites.1.controller.switching=1.0", "did you mean switching_gain?"),
        ("satellites[*].scal=2.0", "did you mean scale?"),
        ("satellites.1.thruster.maximum=1.0", "there is no such field"),
        ("satellite_defaults.controller.switching=1.0", "there is no such field"),
    ],
)
def test_a_setting_that_cannot_be_laid_over_is_named_itself(change: str, sentence: str) -> None:
    found = problems(TRIANGLE, change)
    assert any(problem.file == f"--set {change}" and sentence in problem.sentence for problem in found)


def test_settings_reach_into_mappings_and_lists() -> None:
    scenario = shipped(
        "triangle",
        "timing.step=1.0",
        "satellites.2.arc_length=-10",
        "satellite_defaults.rate=1.0",
        "expect=[]",
    )
    assert scenario.timing.step == 1.0
    assert scenario.satellites[2].arc_length == -10.0
    assert scenario.satellite(0).rate == 1.0
    assert not scenario.expect


@pytest.mark.parametrize("place", ["missing.yaml", "", "\0"])
def test_a_file_that_cannot_be_read_is_a_sentence(place: str, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError) as caught:
        load_scenario(f"{tmp_path}/{place}")
    assert len(caught.value.problems) == 1


def test_bytes_that_are_no_text_are_a_sentence(tmp_path: Path) -> None:
    file = tmp_path / "scenario.yaml"
    file.write_bytes(b"name: \xff\xfe")
    with pytest.raises(ScenarioError, match="is not UTF-8 text: byte 0xff at offset 6"):
        load_scenario(file)


def test_two_files_that_describe_the_same_run_have_the_same_digest() -> None:
    explicit = TRIANGLE.replace("  - name: sat1", "  - scale: 1.0\n    phase_offset: 0\n    name: sat1")
    assert parse_scenario(explicit).digest() == parse_scenario(TRIANGLE).digest()
    assert shipped("triangle", "satellites.0.scale=0.5").digest() != parse_scenario(TRIANGLE).digest()


def test_a_scenario_written_out_is_read_as_the_same_scenario() -> None:
    scenario = shipped("triangle")
    assert parse_scenario(scenario.to_json()) == scenario
    assert parse_scenario(scenario.to_json()).digest() == scenario.digest()


@settings(deadline=None, max_examples=50)
@given(st.text(max_size=200))
def test_no_text_whatever_makes_the_loader_stumble(text: str) -> None:
    with pytest.raises(ScenarioError):
        parse_scenario(text)


@settings(deadline=None, max_examples=50)
@given(st.integers(0, len(TRIANGLE) - 1), st.integers(0, 40), st.text(SIGNS, max_size=6))
def test_no_slip_of_the_hand_makes_the_loader_stumble(place: int, length: int, typed: str) -> None:
    text = TRIANGLE[:place] + typed + TRIANGLE[place + length :]
    try:
        said = parse_scenario(text).name
    except ScenarioError as error:
        said = str(error)
    assert said


def test_what_a_file_expects_beyond_the_end_of_a_shortened_flight_is_left_out_and_said() -> None:
    said: list[str] = []
    scenario = load_scenario(SCENARIOS / "triangle.yaml", ["timing.duration=6000.0"], said.append)
    every = shipped("triangle").expect
    # Those that name no end are about the whole flight as it was written.
    kept = ["arc-length spread at 6000 s", "arc-length spread settles to 1 %"]
    assert [expectation.describe() for expectation in scenario.expect] == kept
    labels = [expectation.describe() for expectation in every]
    assert list(scenario.omitted_expectations) == [label for label in labels if label not in kept]
    assert said == [f"{len(every) - 2} expectations lie beyond the shorter flight and are not judged"]


def test_what_is_left_out_stays_known_to_who_reads_the_shorter_flight_again() -> None:
    scenario = load_scenario(SCENARIOS / "triangle.yaml", ["timing.duration=6000.0"])
    again = parse_scenario(scenario.to_json())
    assert again == scenario
    # Shortened once more, it lacks those of both.
    shorter = parse_scenario(scenario.to_json(), changes=["timing.duration=3000.0"])
    assert len(shorter.omitted_expectations) == len(scenario.omitted_expectations) + 2
    # What is not judged does not make it another flight.
    assert again.model_copy(update={"omitted_expectations": ()}).digest() == scenario.digest()


@pytest.mark.parametrize("change", ["timing.duration=12000.0", "timing.duration=12000.5", "timing.step=1.0"])
def test_nothing_is_left_out_of_a_flight_that_is_no_shorter(change: str) -> None:
    said: list[str] = []
    scenario = load_scenario(SCENARIOS / "triangle.yaml", [change], said.append)
    assert scenario.expect == shipped("triangle").expect
    assert not said


def test_a_file_that_expects_something_beyond_its_own_end_stays_wrong() -> None:
    short = TRIANGLE.replace("duration: 12000.0", "duration: 9600.0")
    for changes in ((), ("timing.duration=9000.0",)):
        (first, *_) = problems(short, *changes)
        assert first.line == line_of("- {kind: arc_length_spread, at: 12000.0", short)
        assert "at 12000 s is later than the flight's end" in first.sentence


def test_what_is_expected_on_the_command_line_is_meant_for_the_flight_that_is_set_there() -> None:
    late = "expect=[{kind: arc_length_spread, at: 5000.0, below: 1.0, source: a test}]"
    (problem,) = problems(TRIANGLE, "timing.duration=3000.0", late)
    assert problem.file == f"--set {late}"
    (problem,) = problems(TRIANGLE, "timing.duration=3000.0", "expect.0.at=5000.0")
    assert problem.field == "expect[0]"


def test_an_expectation_says_where_its_figure_comes_from() -> None:
    named = "value: 0.461, relative: 0.005, source: "
    where = TRIANGLE.index(named)
    said = TRIANGLE[where : TRIANGLE.index("}", where)]
    (problem,) = broken(said, "value: 0.461, relative: 0.005")
    assert problem.field == "expect[1]"
    assert problem.line == line_of("- {kind: arc_length_spread, at: 12000.0")
    assert "give a source (paper, theory, another program), or say regression: true" in problem.sentence
    parse_scenario(TRIANGLE.replace(said, "value: 0.461, relative: 0.005, regression: true"))
    for both in (
        "value: 0.461, relative: 0.005, source: a, regression: true",
        "below: 1.0, regression: true",
    ):
        (problem,) = broken(said, both)
        assert "regression figure" in problem.sentence


def test_a_flight_that_was_flown_without_sources_is_still_read() -> None:
    bare = re.sub(', source: ".*?"}', "}", TRIANGLE)
    assert len(problems(bare)) > 10
    scenario = parse_scenario(bare, files=FileSource(recorded=True))
    assert scenario.expect[0].origin == ""


def test_problems_of_a_shortened_flight_keep_their_lines() -> None:
    last = TRIANGLE.rstrip().rpartition("\n")[2]
    unknown = TRIANGLE.replace(
        last, "  - {kind: arc_length_spread, at: 1.0, below: 1.0, source: a, labell: a}"
    )
    (problem,) = problems(unknown, "timing.duration=3000.0")
    line = line_of("- {kind: arc_length_spread, at: 1.0,", unknown)
    assert (problem.line, problem.field) == (line, "expect[16].labell")


DISTURBED = (
    TRIANGLE.replace("expect:", "checkpoint_period: 60.0\nexpect:", 1)
    + """links:
  default: {loss: 0.1, delay: 2.0}
  edges:
    - {sender: sat1, receiver: sat2, outages: [{begin: 10.0, end: 20.0}]}
graph_schedule:
  - {at: 100.0, graph: {kind: line}}
  - {at: 200.0, add: [[sat1, sat3]], remove: [[sat1, sat2]]}
faults:
  - {kind: satellite_lost, satellite: sat2, at: 500.0, rejoin_at: 600.0}
  - {kind: byzantine, satellite: sat1, at: 50.0, drift: 1.0}
"""
)


def test_a_scenario_in_which_much_goes_wrong_is_a_scenario_all_the_same() -> None:
    scenario = parse_scenario(DISTURBED)
    assert scenario.links is not None
    assert len(scenario.graph_schedule) == len(scenario.faults) == 2
    assert parse_scenario(scenario.to_json()) == scenario


@pytest.mark.parametrize(
    ("old", "new", "field", "sentence"),
    [
        ("loss: 0.1", "loss: 1.1", "links.default.loss", "found 1.1; it should be"),
        ("loss: 0.1", "lost: 0.1", "links.default.lost", "there is no such field; did you mean loss?"),
        ("delay: 2.0", "delay: 9000.0", "links.default", "which is more than 10000 steps of 0.5 s"),
        ("sender: sat1", "sender: sat9", "links.edges[0]", "no satellite sat9; there are sat1, sat2, sat3"),
        ("receiver: sat2", "receiver: sat1", "links.edges[0]", "sat1 has no link to itself"),
        ("end: 20.0", "end: 10.0", "links.edges[0].outages[0]", "end 10 s is not later than begin 10 s"),
        (
            "graph_schedule:",
            "    - {sender: sat1, receiver: sat2}\ngraph_schedule:",
            "links.edges[1]",
            "the link from sat1 to sat2 is described twice",
        ),
        ("at: 100.0", "at: 12000.0", "graph_schedule[0].at", "not earlier than the flight's end at 12000 s"),
        ("graph: {kind: line}", "graph: {kind: lime}", "graph_schedule[0].graph", "did you mean line?"),
        ("graph: {kind: line}", "", "graph_schedule[0]", "nothing changes: give a graph, or edges"),
        (
            "graph: {kind: line}",
            "graph: {kind: star, centre: 3}",
            "graph_schedule[0]",
            "numbered 0 to 2",
        ),
        ("[[sat1, sat3]]", "[[sat1, sat4]]", "graph_schedule[1]", "there is no satellite sat4; there are"),
        ("[[sat1, sat3]]", "[[sat1, sat1]]", "graph_schedule[1]", "sat1 cannot receive from itself"),
        ("[[sat1, sat3]]", "[[sat1, sat2]]", "graph_schedule[1]", "cannot both come and go"),
        ("[[sat1, sat3]]", "[[sat1]]", "graph_schedule[1].add[0][1]", "is missing"),
        ("kind: satellite_lost", "kind: lost", "faults[0]", "there is no kind 'lost'"),
        ("satellite: sat2", "satellite: sat7", "faults[0].satellite", "no satellite sat7; there are sat1"),
        ("at: 500.0", "at: 0.0", "faults[0]", "a satellite that never flies is left out instead"),
        ("at: 500.0", "at: 12000.0, memory: plan", "faults[0]", "rejoin_at 600 s is earlier than at 12000 s"),
        ("rejoin_at: 600.0", "rejoin_at: 400.0", "faults[0]", "rejoin_at 400 s is earlier than at 500 s"),
        ("at: 50.0", "at: 12000.0", "faults[1].at", "at 12000 s is not earlier than the flight's end"),
        (
            "  - {kind: byzantine",
            "  - {kind: satellite_lost, satellite: sat2, at: 600.0}\n  - {kind: byzantine",
            "faults[1]",
            "sat2 does not fly at 600 s, so that it cannot be lost then",
        ),
        (
            "kind: byzantine, satellite: sat1, at: 50.0, drift: 1.0",
            "kind: weak_thruster, satellite: sat1, at: 50.0, factor: 0.5",
            "faults[1]",
            "sat1 has no thruster that could fail in this way",
        ),
        (
            "kind: byzantine, satellite: sat1, at: 50.0, drift: 1.0",
            "kind: frozen_sensor, satellite: sat1, at: 50.0",
            "faults[1]",
            "sat1 has no sensor that could fail in this way",
        ),
        (
            "kind: byzantine, satellite: sat1, at: 50.0, drift: 1.0",
            "kind: clock_offset, satellite: sat1, at: 50.0, until: 40.0, offset: 1.0",
            "faults[1]",
            "until 40 s is not later than at 50 s",
        ),
        ("checkpoint_period: 60.0", "checkpoint_period: 0.0", "checkpoint_period", "found 0.0; it should be"),
        (
            "checkpoint_period",
            "tolerated_losses: -1\ncheckpoint_period",
            "tolerated_losses",
            "found -1; it should",
        ),
    ],
)
def test_what_cannot_go_wrong_in_this_way_is_named_with_its_line(
    old: str, new: str, field: str, sentence: str
) -> None:
    assert old in DISTURBED
    text = DISTURBED.replace(old, new, 1)
    found = [problem for problem in problems(text) if problem.field == field]
    assert len(found) == 1
    assert sentence in found[0].sentence
    changed = DISTURBED[: DISTURBED.index(old)].count("\n") + 1
    assert found[0].line is not None
    assert changed - 1 <= found[0].line <= changed + 1


def test_who_comes_back_from_a_checkpoint_needs_one() -> None:
    text = DISTURBED.replace("checkpoint_period: 60.0\n", "")
    (problem,) = problems(text)
    assert (problem.field, problem.line) == ("faults[0]", line_of("- {kind: satellite_lost", text))
    assert (
        "none are stored: give the scenario a checkpoint_period, or the fault memory: plan"
        in problem.sentence
    )


def test_who_follows_a_neighbour_keeps_its_graph_and_tells_no_phase_to_lie_about() -> None:
    text = (SCENARIOS / "directed_triangle.yaml").read_text()
    (change,) = problems(text + "graph_schedule: [{at: 1.0, graph: {kind: none}}]\n")
    assert "needs it as an in-neighbour all the time" in change.sentence
    assert change.line == len(text.splitlines()) + 1
    (lie,) = problems(text + "faults: [{kind: byzantine, satellite: sat1, at: 1.0}]\n")
    assert "send no phase to falsify" in lie.sentence


def test_what_would_happen_beyond_the_end_of_a_shortened_flight_is_left_out_and_said() -> None:
    said: list[str] = []
    scenario = parse_scenario(DISTURBED, changes=["timing.duration=150.0", "expect=[]"], remark=said.append)
    assert [fault.satellite for fault in scenario.faults] == ["sat1"]
    assert len(scenario.graph_schedule) == 1
    assert said == [
        "1 fault lies beyond the shorter flight and does not happen",
        "1 change of the graph lies beyond the shorter flight and does not happen",
    ]
    shortest: list[str] = []
    parse_scenario(DISTURBED, changes=["timing.duration=50.0", "expect=[]"], remark=shortest.append)
    assert shortest == [
        "2 faults lie beyond the shorter flight and do not happen",
        "2 changes of the graph lie beyond the shorter flight and do not happen",
    ]


def test_a_fault_of_the_command_line_is_meant_for_the_flight_that_is_set_there() -> None:
    late = "faults=[{kind: byzantine, satellite: sat1, at: 200.0}]"
    (problem,) = problems(DISTURBED, "timing.duration=150.0", "expect=[]", late)
    assert problem.file == f"--set {late}"
    assert "not earlier than the flight's end at 150 s" in problem.sentence


def test_a_whole_number_of_thousands_of_digits_is_a_sentence() -> None:
    found = problems(TRIANGLE.replace("orbit:", f"seed: 0x{'f' * 5000}\norbit:"))
    assert [(problem.field, problem.sentence[:14]) for problem in found] == [("seed", "found Infinity")]


def test_half_a_character_is_no_text_and_a_whole_one_written_as_two_halves_is() -> None:
    (name,) = [found for found in problems(TRIANGLE.replace("name: sat1", r'name: "\ud800"')) if found.line]
    assert "\N{REPLACEMENT CHARACTER}" in name.sentence
    whole = TRIANGLE.replace("title: ", r'title: "\ud83d\ude80"  # ', 1)
    assert parse_scenario(whole).title == "\N{ROCKET}"


def test_no_more_problems_are_said_than_anybody_reads() -> None:
    found = problems("".join(f"field{number}: 1\n" for number in range(1000)))
    assert len(found) == 201
    assert "more; mend these first" in found[-1].sentence


def test_a_controller_that_cannot_fly_in_its_setting_is_refused_where_it_stands() -> None:
    text = (SCENARIOS / "geo_parallel_lqr.yaml").read_text()
    found = problems(text, "timing.step=3600.0", "timing.duration=36000.0", "expect=[]")
    assert "does not decay" in " ".join(problem.sentence for problem in found)
    assert all("controller" in problem.field for problem in found)


@pytest.mark.parametrize("old", sorted(RENAMED_FIELDS))
def test_a_renamed_field_is_answered_with_its_new_name_where_that_is_allowed(old: str) -> None:
    assert nearest(old, [RENAMED_FIELDS[old], "other"], RENAMED_FIELDS) == (
        f"; since version 0.2.0 it is called {RENAMED_FIELDS[old]}"
    )
    assert "since version" not in nearest(old, ["other"], RENAMED_FIELDS)


def test_old_names_of_a_whole_file_are_answered_with_the_new_ones() -> None:
    text = (SCENARIOS / "satellite_lost_and_rejoined.yaml").read_text(encoding="utf-8")
    for new, old in (
        ("nominal_motion:", "circulation:"),
        ("satellite_defaults:", "every_satellite:"),
        ("rejoin_at:", "back:"),
    ):
        assert new in text
        text = text.replace(new, old)
    sentences = {problem.sentence.partition("since ")[2] for problem in problems(text)}
    assert {
        f"version 0.2.0 it is called {new}" for new in ("nominal_motion", "satellite_defaults", "rejoin_at")
    } <= sentences


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("hill_pd", "feedback_linearisation"),
        ("impulse", "impulsive_guidance"),
        ("adaptive_distance", "artificial_potential"),
    ],
)
def test_an_old_kind_is_answered_with_the_new_one(old: str, new: str) -> None:
    text = (SCENARIOS / "triangle.yaml").read_text(encoding="utf-8")
    changed = re.sub(r"kind: sliding_mode", f"kind: {old}", text)
    assert changed != text
    assert any(f"it is called {new}" in problem.sentence for problem in problems(changed))
