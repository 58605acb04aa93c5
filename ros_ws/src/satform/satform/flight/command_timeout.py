# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""How long a command is held on the wall clock while no newer one arrives, in simulated time."""

import math


def held_steps(timeout: float, step: float) -> int:
    """Steps after its own for which a command is still held.

    Args:
        timeout: simulated time for which a command is held, s.
        step: control period, s.

    Returns:
        At least one: a command that arrives a step late is flown.
    """
    return max(1, math.floor(timeout / step * (1.0 + 1e-12)))
