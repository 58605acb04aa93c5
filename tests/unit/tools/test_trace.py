# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A trace says where a step's time goes."""

import json
from pathlib import Path

import pytest

from satform_tools.report import trace as flight_trace
from satform_tools.report.plots import trace as trace_plot
from satform_tools.report.trace import Span

STEP = 1_000_000


def flight(steps: int) -> list[Span]:
    """Two satellites; the plant works 100 us, states take 50, satellite b acts for 300."""
    found = []
    for step in range(steps):
        begin = step * STEP
        found += [
            Span("a", "/a/state", begin + 120_000, begin + 220_000),
            Span("b", "/b/state", begin + 150_000, begin + 450_000),
            Span("plant", "/a/command", begin + 300_000, begin + 301_000),
            Span("plant", "/b/command", begin + 520_000, begin + 620_000),
        ]
    # The step after begins when this one's last command is in.
    moved = [
        Span(span.process, span.name, span.begin - 520_000, span.end - 520_000)
        if span.process == "plant" and span.name == "/b/command"
        else span
        for span in found
    ]
    return sorted(moved, key=lambda span: span.begin)


def test_the_parts_of_a_step_are_those_of_its_slowest_satellite_and_make_up_the_step() -> None:
    spans = [
        span if span.name != "/a/command" else Span("plant", span.name, span.begin - STEP, span.end - STEP)
        for span in flight(9)
    ]
    parts = flight_trace.parts(sorted(spans, key=lambda span: span.begin))
    assert [part.seconds for part in parts] == pytest.approx([100e-6, 50e-6, 300e-6, 550e-6])
    assert sum(part.seconds for part in parts) == pytest.approx(STEP * 1e-9)


def test_too_short_a_trace_has_no_parts() -> None:
    assert flight_trace.parts([]) == []
    assert flight_trace.parts(flight(2)) == []


def without(spans: list[Span], process: str) -> list[Span]:
    return [span for span in spans if span.process != process]


def test_satellites_that_share_a_process_have_no_parts_of_a_step() -> None:
    assert flight_trace.parts(without(flight(9), "b")) == []


def test_a_step_without_every_satellites_command_has_no_parts() -> None:
    spans = flight(9)
    missing = next(span for span in spans if span.begin > 3 * STEP and span.name == "/a/command")
    assert flight_trace.parts([span for span in spans if span is not missing]) == []


def test_a_torn_file_of_one_process_does_not_hide_the_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = json.dumps({"nodes": ["sat1"], "process": 7, "names": ["a"], "what": [0, ~0], "when": [1, 2]})
    (tmp_path / "7.json").write_text(whole)
    (tmp_path / "8.json").write_text(whole[:40])
    assert flight_trace.spans(tmp_path) == [Span("sat1", "a", 1, 2)]
    assert "8.json: is not a complete trace" in capsys.readouterr().err


def test_spans_within_spans_come_back_from_the_marks_of_a_process(tmp_path: Path) -> None:
    marks = {"nodes": ["sat1"], "process": 7, "names": ["outer", "inner"]}
    (tmp_path / "7.json").write_text(
        json.dumps({**marks, "what": [0, 1, ~1, ~0, 0], "when": [1, 2, 3, 4, 5]})
    )
    assert flight_trace.spans(tmp_path) == [Span("sat1", "outer", 1, 4), Span("sat1", "inner", 2, 3)]


def test_a_viewer_gets_microseconds_from_the_first_span_on(tmp_path: Path) -> None:
    flight_trace.write(
        [Span("plant", "a", 5_000, 8_000), Span("sat1", "b", 6_500, 7_000)], tmp_path / "trace.json"
    )
    events = json.loads((tmp_path / "trace.json").read_text())["traceEvents"]
    assert [(event["ts"], event["dur"]) for event in events if event["ph"] == "X"] == [(0.0, 3.0), (1.5, 0.5)]


def test_the_picture_shows_steps_that_took_as_long_as_usual(tmp_path: Path) -> None:
    # The first three steps take twice as long as all others.
    slow = [Span(span.process, span.name, 2 * span.begin, 2 * span.end) for span in flight(3)]
    rest = [Span(span.process, span.name, span.begin + 6 * STEP, span.end + 6 * STEP) for span in flight(12)]
    limits, shown = trace_plot.window(slow + rest)
    assert limits[-1] - limits[0] == trace_plot.STEPS * STEP
    assert all(span.end > limits[0] and span.begin < limits[-1] for span in shown)
    assert {span.process for span in shown} == {"plant", "a", "b"}
    trace_plot.draw(slow + rest, tmp_path / "trace.png")
    assert (tmp_path / "trace.png").read_bytes()[:4] == b"\x89PNG"


def test_a_trace_of_too_few_steps_cannot_be_drawn(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="3 are to be shown"):
        trace_plot.draw(flight(2), tmp_path / "trace.png")
