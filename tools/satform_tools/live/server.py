# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Serves the live page on this machine: one page, and a WebSocket for each viewer.

Tornado does it: it runs on asyncio, has types, serves HTTP and WebSockets with limits of its own, and is
installed already, since campaigns on several machines (`distributed`) communicate by it. Starlette with
uvicorn and a WebSocket library, or aiohttp, would add several packages for the same two addresses.

A viewer gets what is newest and never delays anything: until its page has drawn the last message and
acknowledged it, none is added, and it then gets the rows that it has not got, of a history of bounded length.
"""

import asyncio
import hmac
import json
import secrets
import time
from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPServerRequest
from tornado.ioloop import PeriodicCallback
from tornado.iostream import StreamClosedError
from tornado.netutil import bind_sockets
from tornado.web import Application, HTTPError, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from satform_tools.errors import CommandError, sentence_of
from satform_tools.live.source import Hands, Source
from satform_tools.run.page_options import LOOPBACK, PageOptions

MOST_VIEWERS = 16
_LARGEST_REQUEST = 4096
"""Bytes of a message from a page."""

_ACKNOWLEDGED = "drawn"
"""What a page sends when it has drawn a message."""

_REQUESTS_PER_SECOND = 10.0
_BURST = 20.0
_PING_PERIOD = 20.0
"""Wall-clock time after which a viewer that gives no sign is asked for one, and given up after another, s."""

_CLOSING = 2.0
"""Wall-clock time for viewers to close their connections at the end, s."""

_HTTP_PORT = 80
"""Port that browsers leave out of Host and Origin."""

_POLICY = (
    "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; img-src data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


@dataclass(eq=False)
class _Viewer:
    """A page that is connected.

    Attributes:
        socket: to it.
        sent_until: time of the newest row that it has, s.
        events: that it has.
        graphs: that it has.
        status: that it has.
        busy: whether its last message is under way, or not acknowledged.
        credit: requests that it may make now.
        since: when the credit was last counted, s of the monotonic clock.
    """

    socket: "LiveSocket"
    sent_until: float = -float("inf")
    events: int = 0
    graphs: int = 0
    status: dict[str, Any] | None = None
    busy: bool = False
    credit: float = _BURST
    since: float = field(default_factory=time.monotonic)

    def may_ask(self) -> bool:
        """Whether one more request is within the rate."""
        now = time.monotonic()
        self.credit = min(_BURST, self.credit + (now - self.since) * _REQUESTS_PER_SECOND)
        self.since = now
        if self.credit < 1.0:
            return False
        self.credit -= 1.0
        return True


class LiveServer:
    """The server of one live page.

    Attributes:
        token: that an address has to have.
        viewers: that are connected.
    """

    def __init__(
        self, source: Source, page: Callable[[str], str], hands: Hands | None, options: PageOptions
    ) -> None:
        """Bind a port.

        Args:
            source: what is shown.
            page: the page's text for a nonce of its scripts and styles.
            hands: what viewers may do; None for viewers who look only.
            options: address and port to bind.

        Raises:
            CommandError: the port cannot be bound.
        """
        self.source, self.page, self.hands = source, page, hands
        self.token = secrets.token_urlsafe(24)
        self.viewers: set[_Viewer] = set()
        address = options.address
        try:
            self._sockets = bind_sockets(options.port, address, reuse_port=False)
        except OSError as error:
            raise CommandError(
                f"the page cannot be served on {address}:{options.port}: {sentence_of(error)}"
            ) from None
        self._host = f"[{address}]" if ":" in address else address
        self.port = int(self._sockets[0].getsockname()[1])
        self.hosts = hosts((self._host, "localhost", LOOPBACK), self.port)

    @property
    def url(self) -> str:
        """Address of the page, with its token."""
        return f"http://{self._host}:{self.port}/?token={self.token}"

    async def serve(self, finished: Callable[[int], bool]) -> None:
        """Serve until something is over.

        Args:
            finished: asked with the number of viewers, as often as the source is updated.
        """
        application = Application(
            [("/", _Page, {"server": self}), ("/live", LiveSocket, {"server": self})],
            websocket_ping_interval=_PING_PERIOD,
            websocket_ping_timeout=_PING_PERIOD,
            websocket_max_message_size=_LARGEST_REQUEST,
            compress_response=True,
            log_function=lambda _handler: None,
        )
        http = HTTPServer(
            application,
            max_header_size=16_384,
            max_body_size=_LARGEST_REQUEST,
            idle_connection_timeout=_PING_PERIOD,
        )
        http.add_sockets(self._sockets)
        over = asyncio.Event()
        failed: list[BaseException] = []

        def update() -> None:
            try:
                self.source.update()
                if self.hands is not None:
                    self.hands.update()
                self._send()
                if finished(len(self.viewers)):
                    over.set()
            except Exception as error:
                failed.append(error)
                over.set()

        ticking = PeriodicCallback(update, 1e3 * self.source.period)
        ticking.start()
        try:
            await over.wait()
        finally:
            ticking.stop()
            http.stop()
            for viewer in list(self.viewers):
                viewer.socket.close(1001, "the server ends")
            with suppress(TimeoutError):
                await asyncio.wait_for(asyncio.shield(http.close_all_connections()), _CLOSING)
        if failed:
            raise failed[0]

    def _send(self) -> None:
        """Send each viewer what it has not got, unless its last message is under way."""
        status = self.source.status()
        known: dict[Any, str] = {}
        for viewer in self.viewers:
            if viewer.busy:
                continue
            key = (viewer.sent_until, viewer.events, viewer.graphs, viewer.status == status)
            if key not in known:
                known[key] = self._news(viewer, status)
            if known[key]:
                self.send(viewer, known[key])
            viewer.sent_until = max(viewer.sent_until, self.source.history.last_time)
            viewer.events, viewer.graphs = self.source.events.count, self.source.graphs.count
            viewer.status = status

    def _news(self, viewer: _Viewer, status: dict[str, Any]) -> str:
        """What a viewer has not got, as a message; empty for nothing."""
        source = self.source
        found: dict[str, Any] = {
            "rows": source.history.packed(viewer.sent_until),
            "events": source.events.after(viewer.events),
            "graphs": source.graphs.after(viewer.graphs),
            "status": None if viewer.status == status else status,
        }
        news = {name: value for name, value in found.items() if value}
        return json.dumps({"kind": "news", **news}, separators=(",", ":")) if news else ""

    def send(self, viewer: _Viewer, text: str) -> None:
        """Send a message to a viewer, in its own time; the next one when it is acknowledged."""
        viewer.busy = True

        async def write() -> None:
            try:
                await viewer.socket.write_message(text)
            except (WebSocketClosedError, StreamClosedError):
                self.viewers.discard(viewer)

        viewer.socket.writing = asyncio.ensure_future(write())


def hosts(names: Collection[str], port: int) -> set[str]:
    """What browsers may send as Host to a server.

    Args:
        names: of the server's machine.
        port: that it serves on.
    """
    found = {f"{name}:{port}" for name in names}
    return found | set(names) if port == _HTTP_PORT else found


class _Guarded(RequestHandler):
    """Refuses requests without the token, or for another host."""

    def initialize(self, server: LiveServer) -> None:
        self.server = server

    def prepare(self) -> None:
        require_token(self.request, self.server)

    def set_default_headers(self) -> None:
        self.clear_header("Server")

    def write_error(self, status_code: int, **_details: Any) -> None:
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"{status_code}: {self._reason}\n")


def require_token(request: HTTPServerRequest, server: LiveServer) -> None:
    """Raise unless a request is for this host and has the token.

    Another name of the host would be that of a site that lets its name point here (DNS rebinding).

    Raises:
        HTTPError: 403.
    """
    given = request.query_arguments.get("token", [b""])[-1]
    if request.host not in server.hosts:
        raise HTTPError(403, reason="This host is not served")
    if not hmac.compare_digest(given, server.token.encode()):
        raise HTTPError(403, reason="The address needs the token that the command printed")


class _Page(_Guarded):
    """The page itself, all in one file."""

    def get(self) -> None:
        nonce = secrets.token_urlsafe(16)
        self.set_header("Content-Security-Policy", _POLICY.format(nonce=nonce))
        self.set_header("Referrer-Policy", "no-referrer")
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("Cross-Origin-Opener-Policy", "same-origin")
        self.set_header("Cache-Control", "no-store")
        self.finish(self.server.page(nonce))


class LiveSocket(WebSocketHandler):
    """The connection of one viewer."""

    writing: Any = None

    def initialize(self, server: LiveServer) -> None:
        """Take the server."""
        self.server = server
        self._viewer: _Viewer | None = None

    def prepare(self) -> None:
        """Refuse strangers, and more viewers than there is room for."""
        require_token(self.request, self.server)
        if len(self.server.viewers) >= MOST_VIEWERS:
            raise HTTPError(503, reason=f"{MOST_VIEWERS} pages are connected already")

    def check_origin(self, origin: str) -> bool:
        """Whether a page of this server asks, and not one of another site."""
        return origin in {f"http://{host}" for host in self.server.hosts}

    def open(self, *_arguments: str, **_keywords: str) -> None:
        """Greet a viewer with what does not change; its rows follow."""
        self._viewer = _Viewer(self)
        source = self.server.source
        formation = {
            **source.formation(),
            "control": self.server.hands is not None,
            "most_rows": 2 * source.history.most,
        }
        self.server.send(self._viewer, json.dumps({"kind": "formation", "formation": formation}))
        self.server.viewers.add(self._viewer)

    def on_close(self) -> None:
        """Forget a viewer."""
        if self._viewer is not None:
            self.server.viewers.discard(self._viewer)

    def on_message(self, message: str | bytes) -> None:
        """Take a request, if this page has control and keeps to the rate."""
        viewer, hands = self._viewer, self.server.hands
        if viewer is None:
            return
        if message == _ACKNOWLEDGED and viewer.busy:
            viewer.busy = False
            return
        if not viewer.may_ask():
            self.close(1008, "too many requests")
            return
        try:
            request = json.loads(message)
            if not isinstance(request, dict) or not isinstance(request.get("kind"), str):
                raise ValueError("a request is an object with a kind")
            number = request.get("id")
            if type(number) is not int:
                raise ValueError("the id of a request is a whole number")
        except (ValueError, RecursionError) as error:
            self._reply(None, success=False, text=f"the request was not understood: {error}")
            return
        if hands is None:
            self._reply(number, success=False, text="this page only shows; start it with --control")
            return
        hands.ask(request, lambda **outcome: self._reply(number, **outcome))

    def _reply(
        self, number: int | None, *, success: bool, text: str, data: dict[str, Any] | None = None
    ) -> None:
        outcome = {"kind": "reply", "id": number, "success": success, "text": text, "data": data}

        async def write() -> None:
            try:
                await self.write_message(json.dumps(outcome))
            except (WebSocketClosedError, StreamClosedError):
                return  # the page has gone, and its reply with it

        self.replying = asyncio.ensure_future(write())
