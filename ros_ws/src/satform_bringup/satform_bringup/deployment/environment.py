# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""This process's environment variables, changed for a while."""

import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager


@contextmanager
def restored(names: Collection[str]) -> Iterator[None]:
    """Put environment variables back in the end as they are now, those that are not set included."""
    before = {name: os.environ.get(name) for name in names}
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
