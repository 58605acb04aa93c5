# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A damaged input, and how it is read."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Input:
    """A damaged input.

    Attributes:
        read: reads it, and uses what was accepted.
        source: file or folder that a sentence of a rejection has to name.
        rejections: errors by which it may be rejected.
        command: arguments of `satform` that read it; empty where no command reads it alone.
        repairs: whether the command accepts what `read` rejects, as the recovery of a bag does.
    """

    read: Callable[[], object]
    source: str
    rejections: tuple[type[Exception], ...]
    command: Sequence[str] = ()
    repairs: bool = False
