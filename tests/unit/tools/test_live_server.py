# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The server of the live page: who may connect, what a viewer gets, and that no viewer holds up another."""

import asyncio
import base64
import json
import socket
from collections.abc import Callable, Coroutine
from typing import Any

import numpy as np
import pytest
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest
from tornado.websocket import WebSocketClientConnection, websocket_connect

from satform_tools.cli import names
from satform_tools.errors import CommandError
from satform_tools.live import server as live_server
from satform_tools.live.history import Column, History, Recent, rows_for
from satform_tools.live.server import MOST_VIEWERS, LiveServer, hosts
from satform_tools.live.source import Reply
from satform_tools.run.page_options import LOOPBACK, PageOptions

TIMEOUT = 30.0


class Straight:
    """A flight of one satellite that moves by 1 m in each second; a row for each update."""

    period = 0.01

    def __init__(self) -> None:
        self.history = History({"position": Column(3)}, most=200)
        self.events = Recent(10)
        self.graphs = Recent(10)
        self.step = 0

    def formation(self) -> dict[str, Any]:
        return {"names": ["sat1"]}

    def status(self) -> dict[str, Any]:
        return {"step": self.step}

    def update(self) -> None:
        self.step += 1
        self.history.append(float(self.step), {"position": [self.step, 0.0, 0.0]})


class Noted:
    """Hands that only note what they are asked for."""

    def __init__(self) -> None:
        self.asked: list[dict[str, Any]] = []

    def ask(self, request: dict[str, Any], reply: Reply) -> None:
        self.asked.append(request)
        reply(success=True, text="pauses before step 7")

    def update(self) -> None:
        pass


def times_of(message: dict[str, Any]) -> list[float]:
    return np.frombuffer(base64.b64decode(message["rows"]["columns"]["time"]), dtype="<f8").tolist()


def served(test: Callable[[LiveServer], Coroutine[Any, Any, None]], hands: Noted | None = None) -> None:
    """Run a test beside a server."""

    async def both() -> None:
        server = LiveServer(Straight(), lambda nonce: f"<p>{nonce}</p>", hands, PageOptions())
        done = asyncio.Event()
        serving = asyncio.ensure_future(server.serve(lambda _viewers: done.is_set()))
        try:
            await asyncio.wait_for(test(server), TIMEOUT)
        finally:
            done.set()
            await serving

    asyncio.run(both())


async def connected(server: LiveServer, **headers: str) -> WebSocketClientConnection:
    address = server.url.replace("http", "ws").replace("/?", "/live?")
    origin = f"http://{LOOPBACK}:{server.port}"
    request = HTTPRequest(address, headers={"Origin": origin, **headers})
    return await websocket_connect(request)


async def answer(viewer: WebSocketClientConnection, kind: str) -> dict[str, Any]:
    while True:
        text = await viewer.read_message()
        assert text is not None, f"closed: {viewer.close_code} {viewer.close_reason}"
        message: dict[str, Any] = json.loads(text)
        if message["kind"] != "reply":
            await viewer.write_message("drawn")
        if message["kind"] == kind:
            return message


def test_the_page_needs_the_token_and_this_host() -> None:
    async def test(server: LiveServer) -> None:
        client = AsyncHTTPClient()
        page = await client.fetch(server.url)
        assert b"<p>" in page.body
        assert page.headers["Referrer-Policy"] == "no-referrer"
        assert "default-src 'none'" in page.headers["Content-Security-Policy"]
        assert "Set-Cookie" not in page.headers
        assert "Server" not in page.headers
        without, wrong = server.url.partition("?")[0], server.url + "x"
        for address, headers in (
            (without, {}),
            (wrong, {}),
            (server.url, {"Host": "attacker.example"}),
            (server.url, {"Host": f"attacker.example:{server.port}"}),
        ):
            with pytest.raises(HTTPClientError, match="403"):
                await client.fetch(address, headers=headers)

    served(test)


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://attacker.example"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:1"},
        {"Host": "attacker.example"},
    ],
)
def test_a_page_of_another_site_gets_no_connection(headers: dict[str, str]) -> None:
    async def test(server: LiveServer) -> None:
        with pytest.raises(HTTPClientError, match="403"):
            await connected(server, **headers)
        assert not server.viewers

    served(test)


def test_a_viewer_gets_every_row_once_and_in_order() -> None:
    async def test(server: LiveServer) -> None:
        viewer = await connected(server)
        assert (await answer(viewer, "formation"))["formation"] == {
            "names": ["sat1"],
            "control": False,
            "most_rows": 400,
        }
        times: list[float] = []
        while len(times) < 30:
            message = await answer(viewer, "news")
            if "rows" in message:
                times += times_of(message)
        assert times == [float(step) for step in range(int(times[0]), int(times[0]) + len(times))]

    served(test)


def test_a_viewer_that_does_not_read_has_one_message_under_way_and_delays_no_other() -> None:
    async def test(server: LiveServer) -> None:
        frozen = socket.create_connection((LOOPBACK, server.port))
        path = server.url.partition(str(server.port))[2].replace("/?", "/live?")
        here = f"{LOOPBACK}:{server.port}"
        frozen.sendall(
            f"GET {path} HTTP/1.1\r\nHost: {here}\r\nOrigin: http://{here}\r\nUpgrade: websocket\r\n"
            "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode()
        )
        await _until(lambda: bool(server.viewers))
        (stuck,) = server.viewers
        reading = await connected(server)
        first = server.source.step
        while server.source.step < first + 20:
            await answer(reading, "news")
        # It has the greeting, and nothing has been added.
        assert stuck.busy
        assert stuck in server.viewers
        assert stuck.sent_until == -np.inf
        frozen.close()

    served(test)


async def _until(condition: Callable[[], bool]) -> None:
    while not condition():
        await asyncio.sleep(0.005)  # polls: the server runs in the same loop


def test_without_control_a_request_is_refused_and_with_control_it_is_passed_on() -> None:
    async def refused(server: LiveServer) -> None:
        viewer = await connected(server)
        await viewer.write_message(json.dumps({"kind": "pause", "id": 3}))
        reply = await answer(viewer, "reply")
        assert (reply["id"], reply["success"]) == (3, False)
        assert "--control" in reply["text"]

    served(refused)
    hands = Noted()

    async def passed_on(server: LiveServer) -> None:
        viewer = await connected(server)
        wrong_ids = (
            '{"kind": "stop"}',
            *(f'{{"kind": "stop", "id": {one}}}' for one in ("true", "1.5", "[[]]")),
        )
        for text in ("[", "[]", "{}", '{"kind": 1}', "[" * 4000, *wrong_ids):
            await viewer.write_message(text)
            assert not (await answer(viewer, "reply"))["success"]
        await viewer.write_message(json.dumps({"kind": "pause", "id": 4}))
        assert (await answer(viewer, "reply"))["text"] == "pauses before step 7"

    served(passed_on, hands)
    assert hands.asked == [{"kind": "pause", "id": 4}]


@pytest.mark.parametrize(("messages", "code"), [(["x" * 5000], 1009), (["{}"] * 100, 1008)])
def test_size_and_rate_of_requests_are_bounded(messages: list[str], code: int) -> None:
    async def test(server: LiveServer) -> None:
        viewer = await connected(server)
        for text in messages:
            await viewer.write_message(text)
        while await viewer.read_message() is not None:
            pass
        assert viewer.close_code == code

    served(test, Noted())


def test_the_number_of_viewers_is_bounded() -> None:
    async def test(server: LiveServer) -> None:
        sockets = [await connected(server) for _ in range(MOST_VIEWERS)]
        with pytest.raises(HTTPClientError, match="503"):
            await connected(server)
        sockets[0].close()
        await _until(lambda: len(server.viewers) < MOST_VIEWERS)
        await connected(server)

    served(test)


def test_a_taken_port_is_one_sentence() -> None:
    async def test(server: LiveServer) -> None:
        with pytest.raises(CommandError, match=f"cannot be served on 127.0.0.1:{server.port}"):
            LiveServer(Straight(), str, None, PageOptions(port=server.port))

    served(test)


def test_on_port_80_browsers_leave_the_port_out() -> None:
    assert hosts(("127.0.0.1", "localhost"), 80) == {"127.0.0.1", "localhost", "127.0.0.1:80", "localhost:80"}
    assert hosts(("127.0.0.1", "localhost"), 8080) == {"127.0.0.1:8080", "localhost:8080"}


def test_a_server_whose_viewers_do_not_close_their_connections_ends_in_order(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def never(_server: Any) -> None:
        await asyncio.Event().wait()

    monkeypatch.setattr(live_server, "_CLOSING", 0.05)
    monkeypatch.setattr(live_server.HTTPServer, "close_all_connections", never)

    async def nothing(_server: LiveServer) -> None:
        pass

    served(nothing)


def test_a_history_of_any_length_has_a_bounded_number_of_rows_from_the_first_to_the_newest() -> None:
    history = History({"position": Column(1)}, most=100)
    for step in range(20_000):
        history.append(step * 0.5, {"position": [step]})
    assert 25 < len(history) <= 100
    rows = history.packed(-np.inf)
    assert rows is not None
    times = np.frombuffer(base64.b64decode(rows["columns"]["time"]), dtype="<f8")
    places = np.frombuffer(base64.b64decode(rows["columns"]["position"]), dtype="<f4")
    assert np.array_equal(places, times / 0.5)
    assert times[0] == 0.0
    assert times[-1] > 0.95 * 9999.5
    assert np.diff(times).max() < 4.0 * np.diff(times).mean()
    assert history.packed(times[-1]) is None


def test_of_a_list_of_any_length_the_newest_are_kept_and_each_is_given_once() -> None:
    recent = Recent(3, [{"text": "0"}])
    assert recent.after(0) == [{"text": "0"}]
    for number in range(1, 10):
        recent.append({"text": str(number)})
    assert recent.count == 10
    assert [entry["text"] for entry in recent.after(8)] == ["8", "9"]
    assert [entry["text"] for entry in recent.after(1)] == ["7", "8", "9"]
    assert recent.after(10) == []


def test_the_history_of_a_thousand_satellites_has_as_many_positions_as_that_of_fifty() -> None:
    assert rows_for(1) == rows_for(3) == 3000
    assert 1000 * rows_for(1000) <= 50 * rows_for(50)
    assert rows_for(100_000) >= 2


def test_a_row_of_another_width_is_an_error() -> None:
    with pytest.raises(ValueError, match="position: found 2 numbers; a row has 3"):
        History({"position": Column(3)}).append(0.0, {"position": [1.0, 2.0]})


def test_an_address_to_serve_on_is_one_of_this_machine() -> None:
    assert names.address("[::1]") == "::1"
    for text, reason in (("::", "stands for every address"), ("localhost", "is not an IP address")):
        with pytest.raises(CommandError, match=reason):
            names.address(text)
