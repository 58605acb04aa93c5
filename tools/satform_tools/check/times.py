# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about times: rounded to steps, after the end, or longer than the flight."""

from collections.abc import Iterator, Sequence
from typing import TypeAlias

from satform.communication.channel_model import LinkSpec
from satform.control.protocol import ControllerSpec
from satform.membership.faults import step_at
from satform.membership.formation import GraphChangeSpec
from satform.membership.reconfiguration import ReconfigurationSpec
from satform.planning.impulsive_guidance import ImpulsiveGuidanceSpec, TimedBurnsSpec
from satform.scenario import Scenario
from satform.scenario.windowed_expectation import AtTime

_SLACK = 1e-6
"""Fraction of a step by which a time may differ from it and still counts as on it."""

_MOST_SENTENCES = 8
"""Largest number of sentences of one kind; more are counted."""

Laws: TypeAlias = list[tuple[str, ControllerSpec]]


def time_warnings(scenario: Scenario) -> list[str]:
    """Sentences about times that are not flown as they are written."""
    laws = _laws(scenario)
    return [
        *_few([*_rounded_plans(laws, scenario.timing.step), *_rounded_events(scenario)]),
        *_few([*_late_plans(laws, scenario), *_late_events(scenario), *_too_long(scenario)]),
    ]


def _few(found: list[str]) -> list[str]:
    more = len(found) - _MOST_SENTENCES
    return found if more <= 0 else [*found[:_MOST_SENTENCES], f"timing: and {more} more like the last one"]


def _laws(scenario: Scenario) -> Laws:
    """Each control law once, with the path of its field."""
    own = [
        (f"satellites[{index}].controller", satellite.controller)
        for index, satellite in enumerate(scenario.satellites)
    ]
    every = ("satellite_defaults.controller", scenario.satellite_defaults.controller)
    return [(path, law) for path, law in [every, *own] if law is not None]


def _off(time: float, step: float) -> bool:
    """Whether a time is not on a step."""
    return abs(time / step - round(time / step)) > _SLACK


def _rounded_plans(laws: Laws, step: float) -> Iterator[str]:
    """Times of impulses, which are flown at the nearest step."""
    for path, law in laws:
        if isinstance(law, ImpulsiveGuidanceSpec):
            if _off(law.start_time, step):
                yield _rounded(f"{path}.start_time", law.start_time, round(law.start_time / step) * step)
            for index, waypoint in enumerate(law.waypoints):
                if _off(waypoint.duration, step):
                    flown = round(waypoint.duration / step) * step
                    yield _rounded(f"{path}.waypoints[{index}].duration", waypoint.duration, flown)
        if isinstance(law, TimedBurnsSpec):
            for index, burn in enumerate(law.burns):
                begin = max(0, round(burn.time / step - 0.5)) * step
                if abs(burn.time - begin - 0.5 * step) > _SLACK * step:
                    yield (
                        f"{path}.burns[{index}].time: {burn.time:.10g} s is flown from {begin:.10g} s to "
                        f"{begin + step:.10g} s, its middle at {begin + 0.5 * step:.10g} s"
                    )


def _rounded(field: str, written: float, flown: float) -> str:
    return f"{field}: {written:.10g} s is rounded to {flown:.10g} s, a whole number of steps"


def _rounded_events(scenario: Scenario) -> Iterator[str]:
    step = scenario.timing.step
    for index, fault in enumerate(scenario.faults):
        for name in ("at", "until", "rejoin_at"):
            time = getattr(fault, name, None)
            if time is not None and _off(time, step):
                yield _next(f"faults[{index}].{name}", time, step)
    yield from _rounded_changes("graph_schedule", scenario.graph_schedule, step)
    yield from _rounded_changes("reconfigurations", scenario.reconfigurations, step)
    period = scenario.checkpoint_period
    if period is not None and _off(period, step):
        flown = max(1, round(period / step)) * step
        yield f"checkpoint_period: {period:.10g} s is rounded to {flown:.10g} s, a whole number of steps"
    for path, link in _links(scenario):
        yield from _rounded_links(path, link, step)
    for index, expectation in enumerate(scenario.expect):
        if isinstance(expectation, AtTime) and expectation.at is not None and _off(expectation.at, step):
            judged = round(expectation.at / step) * step
            yield f"expect[{index}].at: {expectation.at:.10g} s is evaluated at the step at {judged:.10g} s"


def _rounded_changes(
    field: str, changes: Sequence[GraphChangeSpec | ReconfigurationSpec], step: float
) -> Iterator[str]:
    for index, change in enumerate(changes):
        if _off(change.at, step):
            yield _next(f"{field}[{index}].at", change.at, step)


def _next(field: str, time: float, step: float) -> str:
    flown = step_at(time, step) * step
    return f"{field}: {time:.10g} s is between two steps; it takes effect at the next one, at {flown:.10g} s"


def _links(scenario: Scenario) -> list[tuple[str, LinkSpec]]:
    if scenario.links is None:
        return []
    edges = [(f"links.edges[{index}]", edge) for index, edge in enumerate(scenario.links.edges)]
    return [("links.default", scenario.links.default), *edges]


def _rounded_links(path: str, link: LinkSpec, step: float) -> Iterator[str]:
    if _off(link.delay, step) and link.jitter == 0.0:
        arrival = step_at(link.delay, step) * step
        yield f"{path}.delay: a delay of {link.delay:.10g} s ends at the next step, after {arrival:.10g} s"
    if _off(link.period, step):
        flown = max(1, round(link.period / step)) * step
        yield f"{path}.period: {link.period:.10g} s is rounded to {flown:.10g} s, a whole number of steps"
    for index, window in enumerate(link.outages):
        for name in ("begin", "end"):
            if _off(getattr(window, name), step):
                yield _next(f"{path}.outages[{index}].{name}", getattr(window, name), step)


def _late_plans(laws: Laws, scenario: Scenario) -> Iterator[str]:
    """Impulses of a plan after the end of the flight."""
    step, steps = scenario.timing.step, scenario.timing.steps
    end = f"after the flight's end at {scenario.timing.duration:.10g} s"
    for path, law in laws:
        if isinstance(law, TimedBurnsSpec):
            for index, burn in enumerate(law.burns):
                if max(0, round(burn.time / step - 0.5)) >= steps:
                    yield f"{path}.burns[{index}].time: {burn.time:.10g} s is {end}; it is never flown"
        if isinstance(law, ImpulsiveGuidanceSpec):
            at = round(law.start_time / step)
            if at >= steps:
                yield f"{path}.start_time: {law.start_time:.10g} s is {end}; the tour is not flown"
                continue
            for index, waypoint in enumerate(law.waypoints):
                at += round(waypoint.duration / step)
                stops = waypoint.arrival == "stop" or index == len(law.waypoints) - 1
                # The burn that stops there is held over a step of its own.
                if at + stops > steps:
                    yield f"{path}.waypoints[{index}]: is reached at {at * step:.10g} s, {end}"
                    break
                at += stops


def _late_events(scenario: Scenario) -> Iterator[str]:
    duration = scenario.timing.duration
    for index, fault in enumerate(scenario.faults):
        until = getattr(fault, "until", None)
        if until is not None and until > duration:
            yield (
                f"faults[{index}].until: {until:g} s is after the flight's end at {duration:g} s; the fault "
                "lasts to the end"
            )
    for path, link in _links(scenario):
        for index, window in enumerate(link.outages):
            if window.begin >= duration:
                yield (
                    f"{path}.outages[{index}]: begins at {window.begin:g} s, after the flight's end at "
                    f"{duration:g} s"
                )


def _too_long(scenario: Scenario) -> Iterator[str]:
    """Delays and periods that the flight is too short for."""
    duration = scenario.timing.duration
    end = f"but the flight lasts {duration:g} s"
    if scenario.checkpoint_period is not None and scenario.checkpoint_period > duration:
        yield f"checkpoint_period: {scenario.checkpoint_period:g} s, {end}: no checkpoint is written"
    for path, link in _links(scenario):
        if link.delay >= duration:
            yield f"{path}.delay: {link.delay:g} s, {end}: no message arrives"
        elif link.period >= duration:
            yield f"{path}.period: {link.period:g} s, {end}: only the first message is sent"
    seen: set[str] = set()
    for index in range(len(scenario.satellites)):
        sensor = scenario.satellite(index).sensor
        if sensor is None or repr(sensor) in seen:
            continue
        seen.add(repr(sensor))
        name = scenario.satellites[index].name
        for field in ("latency", "update_period"):
            if getattr(sensor, field) >= duration:
                yield (
                    f"satellites[{index}].sensor.{field}: {getattr(sensor, field):g} s, {end}: {name} has "
                    "its first measurement only"
                )
