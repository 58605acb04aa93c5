# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a bag holds of a message type: its name, the text of its definition and its hash."""

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from ament_index_python.packages import get_package_share_directory
from rosbags.interfaces import Nodetype
from rosbags.typesys import get_types_from_msg

SEPARATOR = "=" * 80
"""Line between the texts of the messages of one definition."""


@dataclass(frozen=True)
class MessageType:
    """A message type as a bag describes it.

    Attributes:
        name: for example `satform_msgs/msg/Command`.
        definition: text of the message with all that it contains, in ros2msg form.
        type_hash: RIHS01 hash of its type description (REP 2016), as DDS discovery carries it; empty where
            it is not known.
    """

    name: str
    definition: str
    type_hash: str


@cache
def described(message_type: Any) -> MessageType:
    """A message type, described once.

    Raises:
        OSError: its package's `.msg` or `.json` file is not installed.
    """
    return MessageType(type_name(message_type), definition(message_type), type_hash(message_type))


def type_hash(message_type: Any) -> str:
    """RIHS01 hash of a message type, as rosidl generated it beside the definition.

    Raises:
        OSError: the package's `.json` file is not installed.
    """
    own = type_name(message_type)
    generated = json.loads(_read(own, ".json"))
    return str(next(entry["hash_string"] for entry in generated["type_hashes"] if entry["type_name"] == own))


def type_name(message_type: Any) -> str:
    """Full name of a message, for example `satform_msgs/msg/Command`."""
    return f"{message_type.__module__.split('.')[0]}/msg/{message_type.__name__}"


def definition(message_type: Any) -> str:
    """Text of a message and of all messages that it contains, in ros2msg form.

    Raises:
        OSError: a package's `.msg` file is not installed.
    """
    own = type_name(message_type)
    text = _read(own)
    parts, seen, waiting = [text], {own}, _contained(own, text)
    while waiting:
        name = waiting.pop(0)
        if name in seen:
            continue
        seen.add(name)
        text = _read(name)
        package, _, short = name.split("/")
        parts.append(f"{SEPARATOR}\nMSG: {package}/{short}\n{text}")
        waiting += _contained(name, text)
    return "".join(part if part.endswith("\n") else part + "\n" for part in parts)


def _read(name: str, suffix: str = ".msg") -> str:
    package, folder, short = name.split("/")
    share = Path(get_package_share_directory(package))
    return (share / folder / f"{short}{suffix}").read_text(encoding="utf-8")


def _contained(name: str, text: str) -> list[str]:
    """Full names of the messages that a message's fields are made of."""
    _, fields = get_types_from_msg(text, name)[name]
    found = []
    for _, field in fields:
        kind, described = field[1][0] if field[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE) else field
        if kind == Nodetype.NAME:
            found.append(str(described))
    return found
