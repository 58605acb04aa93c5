# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The layouts that are shipped name topics and message fields that exist, with what RViz needs to match."""

import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from importlib import import_module
from typing import Any

import pytest
import yaml

from flights import SCENARIOS, shipped
from satform.communication import topic_table
from satform.communication.topic_table import topic_name
from satform.flight.compile import scene_plan
from satform.scenario import Scenario
from satform_nodes.display.markers import MARKER_FRAMES
from satform_nodes.runtime.start_parameters import START_PARAMETERS
from satform_nodes.transport import qos, topic_types

LAYOUTS = SCENARIOS.parent / "ros_ws" / "src" / "satform_bringup" / "layouts"
NAME = "triangle"
"""The scenario that the layouts are for."""

RVIZ_DRAWS = {
    "rviz_default_plugins/MarkerArray": "MarkerArray",
    "rviz_default_plugins/Pose": "PoseStamped",
    "rviz_default_plugins/Path": "Path",
}
"""Message that each of RViz's displays takes."""


def known_topics(scenario: Scenario) -> dict[str, Any]:
    """Every topic of a flight of the scenario that is shown, with its message type."""
    found = {
        topic_table.STATUS: topic_types.TYPES["status"],
        topic_table.MARKERS: topic_types.TYPES["markers"],
    }
    kinds = ("state", scenario.consensus.announces, "command", "tracking", "pose", "path")
    for satellite in scenario.satellites:
        for kind in kinds:
            found[topic_name(kind, satellite.name)] = topic_types.TYPES[kind]
    return found


def number_at(message_type: Any, fields: list[str]) -> bool:
    """Whether a message has a number at the end of a path of fields."""
    kinds = message_type.get_fields_and_field_types()
    first, *rest = fields
    if first not in kinds:
        return False
    kind = kinds[first]
    if not rest:
        return bool(re.fullmatch(r"double|float|u?int\d+", kind))
    if "/" not in kind:
        return False
    package, name = kind.split("/")
    return number_at(getattr(import_module(f"{package}.msg"), name), rest)


def topic_and_fields(path: str, separator: str) -> tuple[str, list[str]]:
    """Split `/sat1/state.position.x` or `/sat1/state/position/x` where the topic's name ends."""
    if separator == ".":
        topic, *fields = path.split(".")
        return topic, fields
    words = path.split("/")
    return "/".join(words[:3]), words[3:]


def foxglove() -> dict[str, Any]:
    layout: dict[str, Any] = json.loads((LAYOUTS / f"{NAME}.foxglove.json").read_text())
    return layout


def foxglove_panels(tree: Any) -> Iterator[str]:
    if isinstance(tree, str):
        yield tree
    else:
        assert set(tree) <= {"direction", "splitPercentage", "first", "second"}
        assert tree["direction"] in {"row", "column"}
        yield from foxglove_panels(tree["first"])
        yield from foxglove_panels(tree["second"])


def rviz() -> dict[str, Any]:
    layout: dict[str, Any] = yaml.safe_load((LAYOUTS / f"{NAME}.rviz").read_text())
    return layout


def rviz_topics() -> list[tuple[str, dict[str, Any]]]:
    displays = rviz()["Visualization Manager"]["Displays"]
    return [(entry["Class"], entry["Topic"]) for entry in displays if "Topic" in entry]


def plotted() -> list[tuple[str, list[str]]]:
    """Topic and fields of every curve in the layouts of Foxglove and PlotJuggler."""
    tree = ET.parse(LAYOUTS / f"{NAME}.plotjuggler.xml")  # noqa: S314
    juggled = [topic_and_fields(curve.attrib["name"], "/") for curve in tree.iter("curve")]
    panels = foxglove()["configById"].values()
    shown = [topic_and_fields(path["value"], ".") for panel in panels for path in panel.get("paths", [])]
    return juggled + shown


@pytest.mark.parametrize(("topic", "fields"), plotted(), ids=str)
def test_a_curve_is_a_number_that_a_message_of_a_topic_holds(topic: str, fields: list[str]) -> None:
    assert number_at(known_topics(shipped(NAME))[topic], fields)


@pytest.mark.parametrize("kind", ["/", "."])
def test_a_misspelt_field_would_be_found(kind: str) -> None:
    topic, fields = topic_and_fields(kind.join(("/sat1/tracking", "position_error", "x")), kind)
    message = known_topics(shipped(NAME))[topic]
    assert number_at(message, fields)
    assert not number_at(message, ["positon_error", "x"])
    assert not number_at(message, ["position_error", "w"])
    assert not number_at(message, ["position_error"])


def test_every_satellite_is_plotted_and_drawn() -> None:
    names = {satellite.name for satellite in shipped(NAME).satellites}
    assert {topic.split("/")[1] for topic, _ in plotted()} == names
    assert {topic["Value"].split("/")[1] for _, topic in rviz_topics()} == {*names, "formation"}


def test_rviz_draws_topics_of_the_types_that_its_displays_take() -> None:
    for display, topic in rviz_topics():
        assert known_topics(shipped(NAME))[topic["Value"]].__name__ == RVIZ_DRAWS[display]


def test_rviz_asks_for_no_more_than_the_display_offers() -> None:
    offered = qos.MARKERS
    assert offered.reliability.short_key == "reliable"
    assert offered.durability.short_key == "transient_local"
    for _, topic in rviz_topics():
        assert topic["Reliability Policy"] in {"Reliable", "Best Effort"}
        assert topic["Durability Policy"] in {"Transient Local", "Volatile"}


def test_rviz_and_foxglove_look_from_the_frame_that_the_markers_are_in() -> None:
    frame = MARKER_FRAMES[START_PARAMETERS["display_scale"].default]
    assert frame == "lvlh_km"
    assert rviz()["Visualization Manager"]["Global Options"]["Fixed Frame"] == frame
    (scene,) = (panel for name, panel in foxglove()["configById"].items() if name.startswith("3D!"))
    assert scene["followTf"] == frame
    assert all(layer["frameId"] == frame for layer in scene["layers"].values())
    # What is in metres cannot be drawn there.
    assert set(scene["topics"]) == {topic_table.MARKERS}


def test_foxglove_draws_topics_that_exist_and_shows_each_panel_once() -> None:
    layout = foxglove()
    panels = list(foxglove_panels(layout["layout"]))
    assert sorted(panels) == sorted(layout["configById"])
    known = known_topics(shipped(NAME))
    for name, panel in layout["configById"].items():
        if name.startswith("3D!"):
            assert set(panel["topics"]) <= set(known)
            assert topic_table.MARKERS in panel["topics"]
        elif name.startswith("RawMessages!"):
            assert panel["topicPath"] in known


def test_rviz_shows_every_group_of_markers() -> None:
    from satform.communication.sim_time import Stamps
    from satform.display.scene import Scene
    from satform_nodes.display.markers import MarkerMessages

    scene = Scene(scene_plan(shipped(NAME)), 200, 10)
    for step in (0, 1):
        for index in range(3):
            scene.set_motion(index, step, (float(step), 0.0, 0.0), (1.0, 0.0, 0.0))
        markers = MarkerMessages(Stamps(0.5, 500_000_000), 1e-3, scene.extent).markers(scene.picture())
    displays = rviz()["Visualization Manager"]["Displays"]
    (formation,) = (entry for entry in displays if entry.get("Topic", {}).get("Value") == topic_table.MARKERS)
    assert set(formation["Namespaces"]) == {marker.ns for marker in markers.markers}


def test_the_tabs_of_plotjuggler_hold_as_many_areas_as_they_say() -> None:
    tree = ET.parse(LAYOUTS / f"{NAME}.plotjuggler.xml")  # noqa: S314
    tabs = tree.findall("tabbed_widget/Tab")
    assert tabs
    for splitter in tree.iter("DockSplitter"):
        areas = splitter.findall("DockArea") + splitter.findall("DockSplitter")
        sizes = [float(size) for size in splitter.attrib["sizes"].split(";")]
        assert int(splitter.attrib["count"]) == len(areas) == len(sizes)
        assert sum(sizes) == pytest.approx(1.0, abs=1e-3)
