# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A flight served to Foxglove, read by a client that speaks the protocol: topics, schemas, messages."""

import asyncio
import importlib.util
import json
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rclpy.serialization import deserialize_message
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from satform_msgs.msg import Command
from tornado.websocket import WebSocketClientConnection, websocket_connect

from satform.bag.reader import read_bag

PROTOCOL = "foxglove.sdk.v1"
TIMEOUT = 60.0
MESSAGE = 1
"""Code of a binary frame with a message: subscription, 4 bytes; time, 8 bytes; the message."""

needs_sdk = pytest.mark.skipif(
    importlib.util.find_spec("foxglove") is None,
    reason="NOT TESTED: foxglove-sdk is not installed; requirements-foxglove.txt says how",
)
pytestmark = pytest.mark.unmeasured


async def advertised(viewer: WebSocketClientConnection, topic: str, known: dict[str, Any]) -> dict[str, Any]:
    while topic not in known:
        frame = await viewer.read_message()
        assert frame is not None, "closed"
        message = json.loads(frame) if isinstance(frame, str) else {}
        known.update({channel["topic"]: channel for channel in message.get("channels", [])})
    return dict(known[topic])


async def watched(address: str) -> tuple[dict[str, Any], list[Command]]:
    """Subscribe to the commands of a satellite: the channel, and some messages."""
    viewer = await websocket_connect(address, subprotocols=[PROTOCOL])
    assert viewer.selected_subprotocol == PROTOCOL
    info = json.loads(await viewer.read_message() or "")
    assert info["op"] == "serverInfo"
    assert "clientPublish" not in info["capabilities"]
    channel = await advertised(viewer, "/sat1/command", {})
    wanted = {"op": "subscribe", "subscriptions": [{"id": 7, "channelId": channel["id"]}]}
    await viewer.write_message(json.dumps(wanted))
    found: list[Command] = []
    while len(found) < 5:
        frame = await viewer.read_message()
        assert frame is not None, "closed"
        if isinstance(frame, bytes) and frame[0] == MESSAGE:
            assert struct.unpack_from("<I", frame, 1) == (7,)
            found.append(deserialize_message(frame[13:], Command))
    viewer.close()
    return channel, found


@needs_sdk
def test_foxglove_gets_the_topics_with_schemas_and_the_messages_that_the_bag_has(
    start_run: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    run = start_run("triangle", "--set", "timing.duration=3000.0", "--set", "expect=[]", "--foxglove")
    assert run.stderr is not None
    address = next(line.strip() for line in run.stderr if line.startswith("ws://"))
    channel, commands = asyncio.run(asyncio.wait_for(watched(address), TIMEOUT))
    run.communicate(timeout=180)

    assert channel["encoding"] == "cdr"
    assert channel["schemaName"] == "satform_msgs/msg/Command"
    assert channel["schemaEncoding"] == "ros2msg"
    # Another parser of message definitions reads the schema, with all that it contains.
    store = get_typestore(Stores.ROS2_JAZZY)
    types = get_types_from_msg(channel["schema"], "satform_msgs/msg/Command")
    store.register({name: kind for name, kind in types.items() if name.startswith("satform_msgs")})
    assert {"step", "acceleration"} <= {name for name, _ in types["satform_msgs/msg/Command"][1]}

    record = read_bag(tmp_path / "run" / "bag").record
    for command in commands:
        given = [command.acceleration.x, command.acceleration.y, command.acceleration.z]
        assert np.array_equal(given, record.acceleration[command.step, 0])


def test_without_the_extra_one_sentence_says_how_to_install_it(tmp_path: Path) -> None:
    blocked = tmp_path / "sitecustomize.py"
    # A finder that finds no such package, in front of all others.
    blocked.write_text(
        "import importlib.util\n"
        "found = importlib.util.find_spec\n"
        "importlib.util.find_spec = lambda name, *more: None if name == 'foxglove' else found(name, *more)\n"
    )
    program = (
        f"exec(open({str(blocked)!r}).read()); from satform_tools.cli.main import main; "
        "import sys; sys.exit(main(['run', 'triangle', '--foxglove']))"
    )
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert "requirements-foxglove.txt" in ended.stderr
    assert "Traceback" not in ended.stderr
