# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A headless Chromium, driven through its DevTools pipe: nothing but the browser itself is needed.

It draws the pictures of pages in `docs/`, and the tests use pages with it.
"""

import base64
import contextlib
import itertools
import json
import os
import select
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from satform_tools.errors import CommandError

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
TIMEOUT = 120.0
"""How long anything in the browser may take on a busy machine, s."""

# The pipe's ends are to be file descriptors 3 and 4 of the browser.
_WITH_PIPE = 'exec "$@" 3<&"$FROM_TEST" 4>&"$TO_TEST"'


def chromium() -> str | None:
    """The browser's program; None when there is none on this machine."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


class BrowserError(CommandError):
    """The browser is not there, does not answer in time, or a script in its page fails."""


class Browser:
    """One page in a browser.

    Attributes:
        complaints: everything that the page wrote to the console as an error, and what it threw.
        requests: every address that it asked for.
        process: id of the browser's process.
    """

    def __init__(self, reading: int, writing: int, process: int) -> None:
        self.process = process
        self._reading, self._writing = reading, writing
        self._numbers = itertools.count(1)
        self._buffer = b""
        self._session: str | None = None
        self.complaints: list[str] = []
        self.requests: list[str] = []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> Any:
        """Ask the browser for something and wait for its answer."""
        number = next(self._numbers)
        request = {"id": number, "method": method, "params": parameters}
        if self._session:
            request["sessionId"] = self._session
        os.write(self._writing, json.dumps(request).encode() + b"\0")
        end = time.monotonic() + TIMEOUT
        while True:
            message = self._next(end, method)
            if message.get("id") == number:
                if "error" in message:
                    raise BrowserError(f"{method}: {message['error']}")
                return message["result"]
            self._note(message)

    def look(self, page: Path, width: int, scheme: str) -> None:
        """Open a file in a window of a width and in a colour scheme, and wait until its figures are drawn."""
        self.open(page.as_uri(), width, scheme)

    def open(self, address: str, width: int, scheme: str) -> None:
        """Open an address, as `look` opens a file."""
        self.resize(width)
        self.scheme(scheme)
        self.call("Page.navigate", url=address)
        drawn = """new Promise((done) => {
          const look = () => document.documentElement?.dataset.drawn === "yes"
            || (document.getElementById("trouble") && !document.getElementById("trouble").hidden);
          const timer = setInterval(() => { if (look()) { clearInterval(timer); done(true); } }, 50);
        })"""
        self.value(drawn)

    def resize(self, width: int, height: int = 900) -> None:
        """Give the window another size."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 600,
        )

    def scheme(self, name: str) -> None:
        """Prefer light or dark."""
        features = [{"name": "prefers-color-scheme", "value": name}]
        self.call("Emulation.setEmulatedMedia", features=features)

    def value(self, expression: str) -> Any:
        """The value of a JavaScript expression, awaited if it is a promise."""
        answer = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            raise BrowserError(f"{expression}: {answer['exceptionDetails']}")
        return answer["result"].get("value")

    def until(self, condition: str) -> Any:
        """Wait until a JavaScript expression is true, and return its value."""
        return self.value(f"""new Promise((done, fail) => {{
          const end = performance.now() + {1e3 * TIMEOUT / 2};
          const timer = setInterval(() => {{
            const found = {condition};
            if (!found && performance.now() < end) return;
            clearInterval(timer);
            if (found) done(found);
            else fail(new Error({json.dumps("never: " + condition)}));
          }}, 30);
        }})""")

    def picture(self, file: Path | IO[bytes], area: dict[str, float] | None = None) -> None:
        """Keep an area of the page as a PNG; all of it when none is named."""
        size = area or self.call("Page.getLayoutMetrics")["cssContentSize"]
        clip = {**size, "scale": 1}
        found = self.call("Page.captureScreenshot", captureBeyondViewport=True, clip=clip)
        data = base64.b64decode(found["data"])
        if isinstance(file, Path):
            file.write_bytes(data)
        else:
            file.write(data)

    def _next(self, end: float, waiting_for: str) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            left = end - time.monotonic()
            ready = left > 0 and select.select([self._reading], [], [], left)[0]
            if not ready:
                raise BrowserError(f"the browser does not answer {waiting_for}")
            data = os.read(self._reading, 1 << 16)
            if not data:
                raise BrowserError(f"the browser ended before it answered {waiting_for}")
            self._buffer += data
        text, _, self._buffer = self._buffer.partition(b"\0")
        found: dict[str, Any] = json.loads(text)
        return found

    def _note(self, message: dict[str, Any]) -> None:
        told = message.get("params", {})
        match message.get("method"):
            case "Runtime.consoleAPICalled" if told["type"] in {"error", "assert"}:
                self.complaints.append(
                    " ".join(str(part.get("value", part.get("description"))) for part in told["args"])
                )
            case "Runtime.exceptionThrown":
                self.complaints.append(json.dumps(told["exceptionDetails"]))
            case "Log.entryAdded" if told["entry"]["level"] == "error":
                self.complaints.append(told["entry"]["text"])
            case "Network.requestWillBeSent":
                self.requests.append(told["request"]["url"])


@contextlib.contextmanager
def browsing(profile: Path) -> Iterator[Browser]:
    """A browser of one's own, ended afterwards.

    Args:
        profile: folder for what it keeps.

    Yields:
        Its page.

    Raises:
        BrowserError: it is not installed.
    """
    program = chromium()
    if program is None:
        raise BrowserError("there is no Chromium here; install it (apt install chromium)")
    to_browser, from_browser = os.pipe(), os.pipe()
    options = [
        "--headless=new",
        "--remote-debugging-pipe",
        f"--user-data-dir={profile}",
        "--no-first-run",
        "--no-sandbox",  # the page is our own, and CI runs as root
        "--disable-dev-shm-usage",
        "--disable-background-networking",
        "--use-angle=swiftshader",  # three dimensions without a graphics card
        "--enable-unsafe-swiftshader",
        "--hide-scrollbars",
    ]
    process = subprocess.Popen(
        ["bash", "-c", _WITH_PIPE, "bash", program, *options],
        env={**os.environ, "FROM_TEST": str(to_browser[0]), "TO_TEST": str(from_browser[1])},
        pass_fds=(to_browser[0], from_browser[1]),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(to_browser[0])
    os.close(from_browser[1])
    try:
        yield Browser(from_browser[0], to_browser[1], process.pid)
    finally:
        # The browser ends with its pipe, and its helpers with it.
        os.close(to_browser[1])
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        os.close(from_browser[0])
