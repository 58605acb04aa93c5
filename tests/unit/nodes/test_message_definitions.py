# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The text of messages that a bag embeds, against what rosidl generated from the same files."""

import json
from pathlib import Path
from typing import Any

import pytest
import satform_msgs.msg
from ament_index_python.packages import get_package_share_directory
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore
from rosgraph_msgs.msg import Clock

from satform_nodes.transport.message_definitions import definition, type_name

MESSAGES = [value for name, value in vars(satform_msgs.msg).items() if name[0].isupper()]
OTHERS = [Clock, DiagnosticArray, PoseWithCovarianceStamped]


def empty_store() -> Typestore:
    """A store that knows nothing but what is registered in it."""
    return get_typestore(Stores.EMPTY)


def described_by_rosidl(name: str) -> dict[str, Any]:
    package, folder, short = name.split("/")
    path = Path(get_package_share_directory(package)) / folder / f"{short}.json"
    described: dict[str, Any] = json.loads(path.read_text())
    return described


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: message.__name__)
def test_a_message_is_named_as_bags_name_it(message: Any) -> None:
    assert type_name(message) == f"satform_msgs/msg/{message.__name__}"


@pytest.mark.parametrize("message", [*MESSAGES, *OTHERS], ids=lambda message: message.__name__)
def test_the_text_holds_exactly_the_messages_that_rosidl_found_contained(message: Any) -> None:
    name = type_name(message)
    contained = described_by_rosidl(name)["type_description_msg"]["referenced_type_descriptions"]
    expected = {name, *(entry["type_name"] for entry in contained)}
    assert set(get_types_from_msg(definition(message), name)) == expected


@pytest.mark.parametrize("message", [*MESSAGES, *OTHERS], ids=lambda message: message.__name__)
def test_the_text_alone_gives_the_type_hash_that_rosidl_computed(message: Any) -> None:
    name = type_name(message)
    store = empty_store()
    store.register(get_types_from_msg(definition(message), name))
    hashes = {entry["type_name"]: entry["hash_string"] for entry in described_by_rosidl(name)["type_hashes"]}
    assert {known: store.hash_rihs01(known) for known in hashes} == hashes


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: message.__name__)
def test_the_text_keeps_the_units_that_are_said_beside_each_field(message: Any) -> None:
    package = Path(get_package_share_directory("satform_msgs"))
    own = (package / "msg" / f"{message.__name__}.msg").read_text()
    assert definition(message).startswith(own)


@pytest.mark.parametrize("message", [*MESSAGES, *OTHERS], ids=lambda message: message.__name__)
def test_each_contained_message_stands_once_below_its_own_line(message: Any) -> None:
    first, *others = definition(message).split("=" * 80 + "\n")
    assert "MSG:" not in first
    titles = [part.partition("\n")[0] for part in others]
    assert all(title.startswith("MSG: ") and title.count("/") == 1 for title in titles)
    assert len(set(titles)) == len(titles)
    assert all(part.endswith("\n") for part in (first, *others))
