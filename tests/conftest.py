# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""How every test is run: examples are the same in every run, and none fails because the machine is busy."""

import gc

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
