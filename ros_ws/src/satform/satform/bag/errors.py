# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The error of bags that cannot be read."""


class BagError(ValueError):
    """A bag that cannot be read; the message says which, where and why."""
