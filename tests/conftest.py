# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""How every test is run: examples are the same in every run, and none fails because the machine is busy."""

from hypothesis import settings

settings.register_profile("same_everywhere", deadline=None, derandomize=True)
settings.load_profile("same_everywhere")
