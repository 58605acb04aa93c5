# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What continuous integration reads: JUnit XML, annotations, SARIF, and logs without times of the clock."""

import json
import os
import re
from pathlib import Path
from typing import Any
from urllib.parse import unquote
from xml.etree import ElementTree

import jsonschema
import pytest

from flights import SCENARIOS
from satform_tools.cli import main as cli
from satform_tools.report import junit

SHORT = ("--mode", "inprocess", "--set", "timing.duration=20.0")

# What the schemas of Apache Ant and of Jenkins' xUnit plug-in have in common: attributes by element.
ATTRIBUTES = {
    "testsuite": "name timestamp hostname tests failures errors skipped time",
    "property": "name value",
    "testcase": "classname name time",
    "failure": "message type",
    "error": "message type",
    "skipped": "message",
}
SUITE = re.compile(r"properties( testcase)* system-out system-err")


def suite_of(file: Path) -> ElementTree.Element:
    """The suite of a JUnit file, which keeps to the schemas and counts its cases right."""
    root = ElementTree.parse(file).getroot()  # noqa: S314 - our own
    assert SUITE.fullmatch(" ".join(child.tag for child in root))
    for element in root.iter():
        assert set(element.keys()) == set(ATTRIBUTES.get(element.tag, "").split()), element.tag
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d", root.attrib["timestamp"])
    cases = root.findall("testcase")
    assert all(len(case) <= 1 for case in cases)
    assert len({case.attrib["name"] for case in cases}) == int(root.attrib["tests"]) == len(cases)
    for plural, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
        assert len(root.findall(f"testcase/{tag}")) == int(root.attrib[plural])
    return root


def test_junit_has_a_case_for_the_flight_and_one_for_each_expectation(tmp_path: Path) -> None:
    expect = (
        "expect=[{kind: tracking_error, below: 1.0, source: none}, "
        "{kind: tracking_error, below: 1e9, source: none}, "
        '{kind: delta_v, above: 0.0, source: none, label: "a < b\\n & ä"}]'
    )
    file = tmp_path / "new" / "junit.xml"
    words = ["run", "triangle", *SHORT, "--set", expect, "--out", str(tmp_path / "run"), "--junit", str(file)]
    assert cli.main(words) == 1
    flight, missed, met, odd = suite_of(file).findall("testcase")
    assert (flight.get("classname"), flight.get("name"), len(flight)) == ("triangle", "flight", 0)
    assert met.get("name") == f"{missed.get('name')} (2)"
    assert (len(met), len(odd), odd.get("name")) == (0, 0, "a < b & ä")
    figure = json.loads((tmp_path / "run" / "result.json").read_text())["expectations"][0]["figure"]
    (failure,) = missed
    assert failure.get("message") == f"expected ≤ 1, found {figure:.7g} m"


@pytest.mark.parametrize(
    ("change", "outcome", "said"),
    [
        ("seed=1", "skipped", "the flight ends before it"),
        ("satellites[0].position_error=[1e12, 0, 0]", "failure", "ENDED EARLY"),
        ("timing.step=-1", "error", "timing.step"),
    ],
)
def test_junit_says_why_there_are_no_verdicts(change: str, outcome: str, said: str, tmp_path: Path) -> None:
    file = tmp_path / "junit.xml"
    options = [*SHORT, "--set", change, "--out", str(tmp_path / "run"), "--junit", str(file)]
    code = cli.main(["run", "triangle", *options])
    (message, *_) = [found.get("message") for found in suite_of(file).findall(f"testcase/{outcome}")]
    assert said in str(message)
    assert code == {"skipped": 0, "failure": 4, "error": 2}[outcome]


def test_a_junit_file_is_an_error_until_the_command_ends_and_one_that_cannot_be_written_starts_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "junit.xml"
    with junit.begun(file, junit.FLIGHT_SUITE, "some/triangle.yaml", junit.FLIGHT):
        (error,) = suite_of(file).findall("testcase/error")
    assert "has not ended" in str(error.get("message"))
    out = tmp_path / "run"
    assert cli.main(["run", "triangle", *SHORT, "--out", str(out), "--junit", str(file / "below")]) == 2
    assert "the JUnit file cannot be written" in capsys.readouterr().err
    assert not out.exists()


def test_quiet_flights_print_the_same_text_each_time_and_no_progress(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    printed = []
    for folder in ("first", "second"):
        (tmp_path / folder).mkdir()
        monkeypatch.chdir(tmp_path / folder)
        assert cli.main(["run", "triangle", *SHORT, "--set", "expect=[]", "--quiet", "--out", "run"]) == 0
        printed.append(capsys.readouterr())
    assert printed[0] == printed[1]
    assert "state hash" in printed[0].out
    assert printed[0].err == ""


# The parts of the SARIF 2.1.0 schema that a log of `check` uses, with what code scanning asks for beyond it.
SARIF: dict[str, Any] = {
    "type": "object",
    "required": ["version", "runs"],
    "properties": {
        "version": {"const": "2.1.0"},
        "runs": {
            "type": "array",
            "items": {
                "required": ["tool", "results"],
                "properties": {
                    "tool": {
                        "required": ["driver"],
                        "properties": {"driver": {"required": ["name", "rules", "version"]}},
                    },
                    "columnKind": {"enum": ["utf16CodeUnits", "unicodeCodePoints"]},
                    "results": {
                        "items": {
                            "required": ["message", "ruleId", "level", "locations"],
                            "properties": {
                                "level": {"enum": ["none", "note", "warning", "error"]},
                                "message": {"required": ["text"]},
                                "locations": {
                                    "minItems": 1,
                                    "items": {
                                        "properties": {
                                            "physicalLocation": {
                                                "required": ["artifactLocation", "region"],
                                                "properties": {
                                                    "region": {
                                                        "properties": {
                                                            "startLine": {"type": "integer", "minimum": 1}
                                                        }
                                                    },
                                                },
                                            }
                                        }
                                    },
                                },
                            },
                        }
                    },
                },
            },
        },
    },
}


@pytest.fixture
def odd_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A repository with a wrong and an unwise scenario, in a folder whose name has to be escaped."""
    folder = tmp_path / "ä b, 100 %"
    folder.mkdir()
    text = (SCENARIOS / "triangle.yaml").read_text()
    wrong = text.replace("kind: complete", "kind: complet").replace(
        "orbit: {period: 6000.0}", "orbit: {period: -1}"
    )
    (folder / "wrong.yaml").write_text(wrong)
    (folder / "unwise.yaml").write_text(text.replace("switching_gain: 0.1", "switching_gain: 0.005"))
    monkeypatch.setenv("GITHUB_WORKSPACE", str(tmp_path))
    monkeypatch.chdir(folder)
    return folder


def line_with(file: Path, text: str) -> int:
    return next(number for number, line in enumerate(file.read_text().splitlines(), 1) if text in line)


def test_github_annotations_have_the_path_in_the_repository_and_the_line(
    odd_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["check", "wrong.yaml", "unwise.yaml", "--format", "github"]) == 2
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("::")]
    found = [
        re.fullmatch(r"::(error|warning) file=([^:,]*),line=(\d+),title=[^:,]*::(.+)", line) for line in lines
    ]
    assert all(found)
    places = {(match[1], match[2], int(match[3])) for match in found if match}
    escaped = "ä b%2C 100 %25"
    wrong, unwise = odd_folder / "wrong.yaml", odd_folder / "unwise.yaml"
    assert {place for place in places if place[0] == "error"} == {
        ("error", f"{escaped}/wrong.yaml", line_with(wrong, text)) for text in ("period: -1", "graph:")
    }
    # The law of all satellites stands in their defaults.
    assert ("warning", f"{escaped}/unwise.yaml", line_with(unwise, "  controller:")) in places


def test_sarif_has_the_same_findings_with_their_lines(
    odd_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["check", "wrong.yaml", "unwise.yaml", "--format", "sarif"]) == 2
    log = json.loads(capsys.readouterr().out)
    jsonschema.validate(log, SARIF)
    (run,) = log["runs"]
    rules = [rule["id"] for rule in run["tool"]["driver"]["rules"]]
    found = set()
    for result in run["results"]:
        assert rules[result["ruleIndex"]] == result["ruleId"]
        place = result["locations"][0]["physicalLocation"]
        assert place["artifactLocation"]["uriBaseId"] == "%SRCROOT%"
        file = Path(os.environ["GITHUB_WORKSPACE"]) / unquote(place["artifactLocation"]["uri"])
        found.add((result["level"], file, place["region"]["startLine"]))
    wrong, unwise = odd_folder / "wrong.yaml", odd_folder / "unwise.yaml"
    assert ("error", wrong, line_with(wrong, "graph:")) in found
    assert ("warning", unwise, line_with(unwise, "  controller:")) in found


def test_two_forms_of_output_at_once_are_rejected(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["check", "triangle", "--json", "--format", "sarif"]) == 2
    assert "--json and --format sarif exclude each other" in capsys.readouterr().err
