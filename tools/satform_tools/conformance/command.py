# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The command `conformance`: plays a formation to one node, and prints which rules it breaks."""

import os
import shlex
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import rclpy

from satform.common.exit_codes import EXIT_DONE, EXIT_MISSED
from satform.common.name_list import listed
from satform.flight.compile import compile_scenario
from satform.scenario import Scenario, save_scenario
from satform.scenario.loader import SCENARIO_FILE
from satform_bringup.deployment import external_nodes, local_discovery
from satform_bringup.deployment.domain_lock import DomainError, own_domain
from satform_tools import console
from satform_tools.conformance.formation import TestedFormation
from satform_tools.conformance.procedure import STEPS, Procedure
from satform_tools.conformance.rules import RULES, Findings
from satform_tools.errors import CommandError

_PROCESSES = 8
"""Processes for whose discovery the environment is made."""

_SHOWN = 5
"""Last lines of a program's output that are shown when a rule is broken."""

_UNCHANGED: dict[str, Any] = {
    "faults": [],
    "graph_schedule": [],
    "reconfigurations": [],
    "expect": [],
    "hosts": [],
}
"""Fields of a scenario that the procedure replaces by its own changes."""


@dataclass(frozen=True)
class Test:
    """What is tested, and how.

    Attributes:
        node: name of the node, with its namespace.
        scenario: in which it flies.
        command: that starts it, with `{scenario}` for the path of the scenario; empty when somebody does.
        timeout: wall-clock time within which it has to be there and ready, s.
    """

    node: str
    scenario: Scenario
    command: str
    timeout: float


class _Program:
    """The process of the node."""

    def __init__(self, command: list[str], environment: dict[str, str], log: Path, hint: str) -> None:
        self._command, self._environment, self._log, self._hint = command, environment, log, hint
        self._process: subprocess.Popen[bytes] | None = None
        self._note("start the program")

    @property
    def is_ours(self) -> bool:
        """Whether exit codes can be seen."""
        return bool(self._command)

    def start_again(self) -> None:
        """Start it again, or ask for that."""
        self.end()
        self._note("start the program again")

    def _note(self, request: str) -> None:
        if not self._command:
            console.note(f"{request}; in the shell that does: . {self._hint}")
            return
        with self._log.open("ab") as log:
            try:
                self._process = subprocess.Popen(
                    self._command, env=self._environment, stdout=log, stderr=subprocess.STDOUT
                )
            except OSError as error:
                raise CommandError(f"--command: cannot be started: {error.strerror}") from None

    def exit_code(self, timeout: float) -> int | None:
        """Exit code, waited for; None when the process goes on or is not ours."""
        if self._process is None:
            return None
        try:
            return self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            return None

    def end(self) -> None:
        """End the process if it goes on."""
        if self._process is not None and self._process.poll() is None:
            self._process.kill()
            self._process.wait()

    def output(self) -> list[str]:
        """Its last lines of output."""
        if not self._log.exists():
            return []
        return self._log.read_text(errors="replace").strip().splitlines()[-_SHOWN:]


def conformance(test: Test, *, as_json: bool) -> int:
    """Test a node, print what was found, and return the exit code.

    Raises:
        CommandError: there is no such satellite, the program cannot be started, or no domain is free.
    """
    namespace, _, name = test.node.rpartition("/")
    names = [satellite.name for satellite in test.scenario.satellites]
    if name not in names:
        raise CommandError(f"there is no satellite {name} in {test.scenario.name}; there are {listed(names)}")
    duration = STEPS * test.scenario.timing.step
    changes = {**_UNCHANGED, "timing.duration": duration, f"satellites[{name}].external": True}
    findings, output = _try_rules(test, test.scenario.with_(changes), name, namespace)
    if as_json:
        console.as_json(findings.data())
    else:
        _print(findings, output)
    return EXIT_MISSED if findings.broken else EXIT_DONE


def _try_rules(test: Test, scenario: Scenario, name: str, namespace: str) -> tuple[Findings, list[str]]:
    findings = Findings()
    plan = compile_scenario(scenario)
    context = rclpy.Context()
    with tempfile.TemporaryDirectory() as made, local_discovery.run_environment():
        folder = Path(made)
        save_scenario(scenario, folder / SCENARIO_FILE)
        try:
            with own_domain(namespace=namespace) as domain:
                rclpy.init(context=context, domain_id=domain)
                variables = local_discovery.variables(_PROCESSES, len(plan.names), folder)
                external_nodes.write_environment(folder, domain, variables)
                environment = {**os.environ, **variables, "ROS_DOMAIN_ID": str(domain)}
                command = [
                    part.replace("{scenario}", str(folder / SCENARIO_FILE))
                    for part in shlex.split(test.command)
                ]
                formation = TestedFormation(plan, name, context, namespace)
                hint = str(folder / external_nodes.ENVIRONMENT_FILE)
                program = _Program(command, environment, folder / "output.log", hint)
                try:
                    Procedure(formation, findings, program, test.timeout).run()
                finally:
                    program.end()
                    formation.close()
                return findings, program.output()
        except DomainError as error:
            raise CommandError(str(error)) from None
        finally:
            rclpy.try_shutdown(context=context)


def _print(findings: Findings, output: list[str]) -> None:
    for rule, about in RULES.items():
        outcome = findings.outcome(rule)
        console.line(f"{rule}  {outcome:<9}  {about}")
        for sentence in findings.remarks(rule):
            console.line(f"      {sentence}")
    if findings.broken and output:
        console.line("output of the program:")
        for line in output:
            console.line(f"  {line}")
    broken = sorted(findings.broken)
    console.line(f"result: {'breaks ' + listed(broken) if broken else 'conforms'}")
