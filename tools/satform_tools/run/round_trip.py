# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Round trip of an empty message between two processes, the reference of all speeds over DDS."""


def median_round_trip(count: int) -> float:
    """Median of round trips between two processes that communicate as those of a flight do.

    Args:
        count: round trips to measure.

    Returns:
        Wall-clock time, s.

    Raises:
        RuntimeError: there is no free DDS domain, or the other process does not answer.
    """
    from satform_bringup.deployment.domain_lock import on_domain, own_domain  # noqa: PLC0415 - needs ROS
    from satform_bringup.deployment.local_discovery import run_environment  # noqa: PLC0415
    from satform_nodes.runtime import round_trip  # noqa: PLC0415

    with own_domain() as domain, on_domain(domain), run_environment():
        return round_trip.measure(count).median
