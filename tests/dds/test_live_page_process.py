# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The process that serves the page of a run ends with it, also while a browser has the page open."""

import asyncio
import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import IO

import pytest
from tornado.httpclient import HTTPRequest
from tornado.websocket import WebSocketClientConnection, websocket_connect

from process_ends import ended

TIMEOUT = 60.0
ENDLESS = ("--set", "timing.duration=100000.0", "--set", "expect=[]", "--live", "--control")


def address_of(run: subprocess.Popen[str]) -> str:
    assert run.stderr is not None
    return next(line.strip() for line in run.stderr if line.startswith("http://"))


async def opened(address: str) -> WebSocketClientConnection:
    """A page of a run, with its connection."""
    host = address.partition("/?")[0]
    socket = address.replace("http", "ws", 1).replace("/?", "/live?")
    return await websocket_connect(HTTPRequest(socket, headers={"Origin": host}))


async def until_over(page: WebSocketClientConnection) -> None:
    """Read what the page gets until it says that the flight is over."""
    while text := await page.read_message():
        message = json.loads(text)
        if message["kind"] != "reply":
            await page.write_message("drawn")
        if (message.get("status") or {}).get("over"):
            return
    raise AssertionError("the connection was closed")


def until_stored(printed: IO[str]) -> None:
    """Read what a run prints up to its last line, after which it waits for its page."""
    assert any(line.startswith("stored in ") for line in printed)


@pytest.mark.parametrize("over", [False, True])
def test_a_run_that_is_terminated_leaves_no_process_while_its_page_is_open(
    over: bool, start_run: Callable[..., subprocess.Popen[str]]
) -> None:
    async def terminated() -> list[int]:
        page = await opened(address)
        if over:
            await page.write_message(json.dumps({"kind": "stop", "id": 1}))
            await until_over(page)
            assert run.stdout is not None
            await asyncio.to_thread(until_stored, run.stdout)
        children = Path(f"/proc/{run.pid}/task/{run.pid}/children").read_text()
        run.terminate()
        await asyncio.to_thread(run.communicate, timeout=TIMEOUT)
        return [int(child) for child in children.split()]

    run = start_run("triangle", *ENDLESS)
    address = address_of(run)
    children = asyncio.run(asyncio.wait_for(terminated(), 2.0 * TIMEOUT))
    assert children
    assert ended(children, 1.0)
    assert run.returncode == 130
