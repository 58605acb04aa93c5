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
from satform.scenario import ScenarioError, load_scenario, parse_scenario
from satform.scenario.field_errors import nearest
from satform.scenario.renamed import RENAMED_FIELDS
from scenario_problems import TRIANGLE, broken, changed_field, line_of, problems

SIGNS = ":[]{}-#&*!|>'\"%@`,\n 0x."


def with_channel(channel: str) -> tuple[str, str]:
    """Replacement that gives all links a channel."""
    graph = "graph: {kind: complete}"
    return graph, f"links: {{default: {{channel: {channel}}}}}\n{graph}"


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
        ("orbit: {period: 6000.0", "orbit: {period: -5.0", "orbit.period", "found -5.0; it should be"),
        ("orbit: {period: 6000.0", "orbit: {period: .nan", "orbit.period", "found NaN; it should be"),
        ("orbit: {period: 6000.0", "orbit: {period: .inf", "orbit.period", "found Infinity; it should"),
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
        ("0.0, 0.0, 100.0e3]", "0.0, up, 1.0]", "satellites[0].curve.centre[1]", 'found "up"; it should be'),
        ("[50.0e3, 0.0, 0.0]", "[50.0e3, 9.0, 0.0]", "satellites[0].curve", "have to be perpendicular"),
        ("kind: arc_length_mean", "kind: mean", "expect[3]", "there is no kind 'mean'"),
        ("value: 0.461, relative: 0.005", "value: 0.461", "expect[1]", "needs exactly one of"),
        ("[sat1, sat2]", "[sat1, sat9]", "expect[5]", "there is no satellite sat9; there are sat1"),
        ("value: 0.461, relative: 0.005, ", "", "expect[1]", "give a value with its tolerance"),
        ("at: 6000.0", "at: 60000.0", "expect[0]", "later than the flight's end at 12000 s"),
        ("graph: {kind: complete}", "graph: {kind: star, centre: 3}", "graph", "numbered 0 to 2"),
        (*with_channel("{}"), "links.default.channel", "needs a `kind:`, one of optical, radio"),
        (*with_channel("2"), "links.default.channel", "of fields with `kind:` one of optical, radio"),
        (*with_channel("{kind: laser}"), "links.default.channel", "no kind 'laser'; allowed: optical, radio"),
        (
            *with_channel("{kind: radio, antenna: {}}"),
            "links.default.channel.antenna",
            "needs a `kind:`, one of array, beam, isotropic",
        ),
        (
            *with_channel("{kind: optical, wavelenth: 1e-6}"),
            "links.default.channel.wavelenth",
            "did you mean wavelength? Allowed: ",
        ),
        ("seed: 1" if "seed: 1" in TRIANGLE else "orbit:", "seed: 1.5\norbit:", "seed", "found 1.5"),
    ],
)
def test_a_mistake_is_named_with_its_line_and_what_is_allowed(
    old: str, new: str, field: str, sentence: str
) -> None:
    found, below = changed_field(TRIANGLE, old, new, field)
    assert sentence in found
    # Where a replacement adds a line before the field, the field's own line is the next one.
    assert -4 <= below <= 1


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
