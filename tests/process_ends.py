# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Waits for the end of processes that are not children of the test."""

import os
import select
from collections.abc import Iterable


def ended(processes: Iterable[int], limit: float = 60.0) -> bool:
    """Whether each process ends within some time of the one before it.

    Args:
        processes: their numbers.
        limit: longest time, s.
    """
    return all(_ends(process, limit) for process in processes)


def _ends(process: int, limit: float) -> bool:
    try:
        descriptor = os.pidfd_open(process)
    except ProcessLookupError:
        return True
    try:
        return bool(select.select([descriptor], [], [], limit)[0])
    finally:
        os.close(descriptor)
