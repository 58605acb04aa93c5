# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Resource limits of the process, checked before large libraries are loaded.

A library that gets no memory may abort the whole process, without an error message.
"""

import resource

LEAST_MEMORY = 512 * 2**20
"""Address space that numpy, scipy, pydantic and the Earth's models take, bytes."""

LEAST_FILES = 32
"""Files that are open at a time while modules are loaded and a run is stored."""


def complaint() -> str:
    """Which limit of this process is too low to work with; empty when none is."""
    memory, _ = resource.getrlimit(resource.RLIMIT_AS)
    files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if memory != resource.RLIM_INFINITY and memory < LEAST_MEMORY:
        return (
            f"this process may use {memory // 2**20} MiB of address space (ulimit -v); "
            f"it needs {LEAST_MEMORY // 2**20} MiB"
        )
    if files != resource.RLIM_INFINITY and files < LEAST_FILES:
        return f"this process may open {files} files (ulimit -n); it needs {LEAST_FILES}"
    return ""
