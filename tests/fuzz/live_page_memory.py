# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Memory of the live page over a long flight.

    ./tools/satform exec python tests/fuzz/live_page_memory.py --minutes 30

Flies a scenario with its page open in a headless browser, and prints the memory of the page and of its server
once a minute. It is a fault if the page's memory at the end is more than half as much again as after a third
of the time, when its history was full at the latest.
"""

import argparse
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from satform_tools.scene.browser import Browser, browsing

MEGABYTE = 1e6
_GROWTH = 1.5
_KEPT = 0.5
"""Wall-clock time between two looks at the flight, s."""


def resident(*words: str) -> float:
    """Resident memory of all processes whose command has these words, MB."""
    total = 0.0
    for process in Path("/proc").glob("[0-9]*"):
        try:
            command = (process / "cmdline").read_bytes().decode(errors="replace")
            pages = int((process / "statm").read_text().split()[1])
        except (OSError, IndexError):
            continue  # it has ended
        if all(word in command for word in words):
            total += pages * 4096 / MEGABYTE
    return total


def measured(browser: Browser, profile: Path, started: float) -> tuple[float, ...]:
    """Minutes, step, rows, memory of the page's script, of its process, and of the server, MB."""
    browser.call("HeapProfiler.collectGarbage")
    heap = browser.call("Runtime.getHeapUsage")
    used = (heap["usedSize"] + heap.get("backingStorageSize", 0.0)) / MEGABYTE
    step, rows = browser.value("[live.store.status.step, live.store.rows]")
    page = resident("--type=renderer", str(profile))
    return (time.monotonic() - started) / 60.0, step, rows, used, page, resident("satform_tools.live.watched")


def main() -> int:
    """Watch a flight as the command line asks; 1 if the page's memory grows."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--scenario", default="triangle")
    given = parser.parse_args()
    folder = Path(tempfile.mkdtemp())
    endless = ["--set", "timing.duration=1e7", "--set", "expect=[]", "--no-record"]
    words = ["run", given.scenario, *endless, "--out", str(folder / "run"), "--live"]
    command = [sys.executable, "-m", "satform_tools", *words]
    with (folder / "printed").open("w") as printed:
        run = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=printed)
    try:
        # The run ends when its flight is over and no browser has the page open.
        with browsing(folder / "profile") as browser:
            return _watched(browser, folder, run, given.minutes)
    finally:
        run.send_signal(signal.SIGINT)
        run.wait(60.0)


def _watched(browser: Browser, folder: Path, run: "subprocess.Popen[bytes]", minutes: float) -> int:
    address = ""
    while not address:
        lines = (folder / "printed").read_text().splitlines()
        address = next((line for line in lines if line.startswith("http://")), "")
        if run.poll() is not None:
            sys.stderr.write("\n".join(lines))
            return 1
        time.sleep(_KEPT)  # polls: another process prints it
    browser.open(address, 1280, "light")
    browser.call("HeapProfiler.enable")
    started, found = time.monotonic(), []
    sys.stdout.write("minutes     step   rows  script [MB]  page [MB]  server [MB]\n")
    while not found or found[-1][0] < minutes:
        time.sleep(min(60.0, 60.0 * minutes / 9))  # between two measurements
        found.append(measured(browser, folder / "profile", started))
        sys.stdout.write("{:7.1f} {:8.0f} {:6.0f} {:12.1f} {:10.0f} {:12.0f}\n".format(*found[-1]))
        sys.stdout.flush()
    early, late = found[len(found) // 3], found[-1]
    return int(late[3] > _GROWTH * early[3])


if __name__ == "__main__":
    sys.exit(main())
