# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The part of a flight that runs on one of several hosts: its options and its result."""

from dataclasses import replace

from satform.scenario import Scenario
from satform.scenario.deployment import HostSpec
from satform_tools import console
from satform_tools.errors import CommandError
from satform_tools.run import ros_packages
from satform_tools.run.run_result import Mode, RunResult

_ONE_MACHINE: dict[Mode, str] = {
    "inprocess": "a run in one process is on one machine",
    "realtime": "against the wall clock a flight is on one machine, since the clocks of several differ",
}
"""Why a flight of a mode cannot be on several hosts."""


def part(scenario: Scenario, name: str, mode: Mode, *, record: bool) -> HostSpec:
    """The host of the scenario that this machine is.

    Args:
        scenario: what is flown.
        name: of the host.
        mode: how it is flown.
        record: whether the flight is recorded.

    Returns:
        The host.

    Raises:
        CommandError: there is no such host, this machine is another one, or it has nothing to do.
    """
    if mode != "lockstep":
        raise CommandError(f"--host {name} is for lockstep: {_ONE_MACHINE[mode]}")
    ros_packages.require()
    from satform_bringup.deployment import multi_host_discovery  # noqa: PLC0415 - in-process runs do without
    from satform_bringup.deployment.domain_lock import DomainError  # noqa: PLC0415

    try:
        host = multi_host_discovery.find_host(scenario, name)
        multi_host_discovery.require_own_address(host)
        with multi_host_discovery.flight_domain(scenario, host) as domain:
            console.note(multi_host_discovery.in_words(scenario, host, domain))
    except (multi_host_discovery.PeerError, DomainError) as error:
        raise CommandError(str(error)) from None
    if host.runs == ("recorder",) and not record:
        raise CommandError(f"host {name} runs the recorder alone, so with --no-record it has nothing to do")
    return host


def on_host(result: RunResult, host: HostSpec) -> RunResult:
    """The result of a flight as it is reported on one of its hosts.

    Args:
        result: on this machine.
        host: that this machine was.

    Returns:
        The result, with the host that judges and, where the flight ended early, the host that has the reason.
    """
    from satform_bringup.deployment import multi_host_discovery  # noqa: PLC0415 - in-process runs do without

    judge = multi_host_discovery.judge(result.scenario).name
    result = replace(result, host=host.name, judged_on="" if judge == host.name else judge)
    flown = result.speed.steps == result.scenario.timing.steps
    if flown or result.lost or result.stopped or result.early_end or "plant" in host.runs:
        return result
    # Nothing failed here, and a bag that ends with the flight is not the reason.
    plant = next(other.name for other in result.scenario.hosts if "plant" in other.runs)
    steps = f"step {result.speed.steps} of {result.scenario.timing.steps}"
    return replace(result, reason=f"it ended at {steps}; host {plant}, which runs the plant, has the reason")
