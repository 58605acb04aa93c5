# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs a flight over DDS, from its scenario to its result; all processes have ended afterwards."""

import json
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path

from satform.communication.satellite_groups import divide
from satform.files.durable_file import write_durably
from satform.flight.compile import compile_scenario
from satform.scenario import Scenario, save_scenario
from satform.scenario.deployment import HostSpec
from satform.scenario.loader import SCENARIO_FILE
from satform_bringup import BAG_FOLDER, CHECKPOINT_FOLDER, GROUPS_FILE, LOG_FOLDER, PROCESSES_FILE
from satform_bringup.deployment import external_nodes, local_discovery, participant_ports, preflight, security
from satform_bringup.deployment.multi_host_discovery import flight_domain, variables
from satform_bringup.deployment.node_processes import processes
from satform_bringup.supervisor import process_server
from satform_bringup.supervisor.flight import Flight, Policy
from satform_bringup.supervisor.run_registry import described
from satform_bringup.supervisor.supervisor import Supervisor
from satform_nodes.runtime import shared_plan
from satform_nodes.runtime.signals import StopRequest

CHECKPOINT_STEPS = 100
"""Steps between two checkpoints where satellites are restarted and the scenario does not say."""


def fly(
    scenario: Scenario,
    out: Path,
    *,
    record: bool,
    progress: Callable[[int, int], None],
    group: int = 1,
    arrays: bool = False,
    policy: Policy | None = None,
    display: bool = False,
    host: HostSpec | None = None,
    keystore: Path | None = None,
    environment: Mapping[str, str] | None = None,
    namespace: str = "",
    notice: Callable[[str], None] = lambda _sentence: None,
) -> Flight:
    """Fly a scenario as a plant, a process for each satellite and a recorder, in lockstep over DDS.

    Args:
        scenario: what to fly.
        out: existing folder; gets the scenario as every node reads it, the bag and the nodes' logs.
        record: whether to record a bag.
        progress: called now and then with the steps flown and the steps to fly.
        group: how many satellites share a process.
        arrays: whether these exchange arrays; else each has its own node and topics.
        policy: what is done about losses; by default nothing is restarted and the recorder is needed.
        display: whether to show the flight on topics that RViz and Foxglove draw.
        host: of the scenario's hosts the one that this machine is; None when it runs everything.
        keystore: with the nodes' keys; None to fly unsecured.
        environment: more variables for the processes.
        namespace: of all nodes and topics, such as `/f1`; empty for the root.
        notice: called with a sentence about the external satellites that the run waits for.

    Returns:
        How it went, also when a process was lost. No process is left behind in any case.

    Raises:
        OSError: the folder cannot be written to, or a process cannot be started.
        RuntimeError: there is no free domain, or there are too many processes for one machine.
    """
    scenario_file = out / SCENARIO_FILE
    bag = out / BAG_FOLDER if record else None
    policy = policy or Policy()
    if policy.restart and scenario.checkpoint_period is None:
        period = CHECKPOINT_STEPS * scenario.timing.step
        scenario = scenario.model_copy(update={"checkpoint_period": period})
    checkpoints = out / CHECKPOINT_FOLDER if scenario.checkpoint_period is not None else None
    groups = divide(scenario.possible_graph(), group) if arrays else None
    groups_file = out / GROUPS_FILE if arrays else None
    plan = compile_scenario(scenario, groups)
    nodes = processes(
        plan,
        scenario_file,
        bag,
        group,
        checkpoints,
        not policy.without_recorder,
        policy.rate,
        groups_file=groups_file,
        display=display,
        host=host,
        namespace=namespace,
    )
    if keystore is not None:
        nodes = security.secured(nodes)
    preflight.require(len(nodes), secured=keystore is not None)
    with (
        # At the second signal, processes that still run are killed, and the run is reported all the same.
        StopRequest(exit_at_second=False) as signals,
        flight_domain(scenario, host, namespace) as domain,
        described(domain, scenario.name, out),
        ExitStack() as ports,
    ):
        if keystore is not None:
            security.require_secured(keystore, nodes, domain)
        count = len(nodes) + len(plan.external)
        writers = len(scenario.satellites) if groups is None else len(groups.members)
        flight_variables = _environment(scenario, out, (count, writers), host, keystore) | dict(
            environment or {}
        )
        save_scenario(scenario, scenario_file)
        shared_plan.announce(process_server.shared_scenario(), scenario_file)
        if groups is not None and groups_file is not None:
            write_durably(groups_file, groups.to_text().encode())
        if plan.external:
            external_nodes.write_environment(out, domain, flight_variables)
            notice(external_nodes.awaited(plan, out, namespace))
        if host is None and local_discovery.on_loopback_alone():
            nodes = ports.enter_context(participant_ports.assigned(nodes, plan, domain, out))
        watch = Supervisor(plan, signals, progress, policy, out / LOG_FOLDER, domain, flight_variables)
        settings = {
            "domain": domain,
            "environment": flight_variables,
            "nodes": [asdict(node) for node in nodes],
            "external": list(plan.external),
        }
        write_durably(out / PROCESSES_FILE, json.dumps(settings).encode())
        try:
            watch.start(nodes)
            watch.until_over()
        finally:
            watch.end_all()
        return watch.reports.flight(domain, bag if host is None or "recorder" in host.runs else None)


def _environment(
    scenario: Scenario, out: Path, counts: tuple[int, int], host: HostSpec | None, keystore: Path | None
) -> dict[str, str]:
    """Environment variables of the processes, for their middleware.

    Args:
        scenario: that is flown.
        out: folder of the run.
        counts: of the processes, and of the satellites or groups that have topics.
        host: that this machine is; None when it runs everything.
        keystore: with the nodes' keys; None to fly unsecured.
    """
    settings = local_discovery.variables(*counts, out) if host is None else variables(scenario, host, out)
    settings |= preflight.log_variables(out)
    return settings if keystore is None else settings | security.variables(keystore)
