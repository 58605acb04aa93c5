# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""How every test is run: examples are the same in every run, and none fails because the machine is busy."""

import gc
import sys
from collections.abc import Iterator

import pytest
from hypothesis import settings

settings.register_profile("same_everywhere", deadline=None, derandomize=True)
settings.load_profile("same_everywhere")

# Modules, tests and their parameters stay for the whole run: searching them for garbage again and again takes
# a quarter of the time of collecting the tests.
gc.disable()


def pytest_collection_finish(session: pytest.Session) -> None:
    """Leave what is there once the tests are collected out of every later search for garbage."""
    gc.collect()
    gc.freeze()
    gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Stop the coverage measurement for tests that are marked `unmeasured`: it doubles their time.

    Processes that such a test starts are measured.
    """
    coverage = sys.modules.get("coverage")
    running = coverage.Coverage.current() if coverage and item.get_closest_marker("unmeasured") else None
    if running is None:
        return (yield)
    running.stop()
    try:
        return (yield)
    finally:
        running.start()
