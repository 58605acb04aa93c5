"""The text of message definitions, as a bag embeds it."""

from pathlib import Path
from typing import Any

from ament_index_python.packages import get_package_share_directory
from rosbags.interfaces import Nodetype
from rosbags.typesys import get_types_from_msg

_SEPARATOR = "=" * 80


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
        parts.append(f"{_SEPARATOR}\nMSG: {package}/{short}\n{text}")
        waiting += _contained(name, text)
    return "".join(part if part.endswith("\n") else part + "\n" for part in parts)


def _read(name: str) -> str:
    package, folder, short = name.split("/")
    return (Path(get_package_share_directory(package)) / folder / f"{short}.msg").read_text(encoding="utf-8")


def _contained(name: str, text: str) -> list[str]:
    """Full names of the messages that a message's fields are made of."""
    _, fields = get_types_from_msg(text, name)[name]
    found = []
    for _, field in fields:
        kind, described = field[1][0] if field[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE) else field
        if kind == Nodetype.NAME:
            found.append(str(described))
    return found
