# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The DDS domain of the formation to inspect."""

from satform_bringup.deployment.domain_lock import DomainError, shell_domain
from satform_bringup.deployment.runtime_folder import RuntimeFolderError
from satform_bringup.supervisor import run_registry
from satform_bringup.supervisor.run_registry import RegisteredRun
from satform_tools.errors import CommandError


def domain(asked: int | None) -> int:
    """The requested domain, else that of the shell, else that of the only run on this machine.

    Args:
        asked: on the command line; None when none is.

    Returns:
        A DDS domain.

    Raises:
        CommandError: none is given, and no run or more than one is under way.
    """
    if asked is not None:
        return asked
    try:
        from_shell = shell_domain()
    except DomainError as error:
        raise CommandError(str(error)) from None
    if from_shell is not None:
        return from_shell
    runs = runs_here()
    if not runs:
        raise CommandError(
            "no run is under way on this machine; start one with satform run, or name a domain with --domain"
        )
    if len(runs) > 1:
        raise CommandError(f"{len(runs)} {running(runs)}; name one with --domain")
    return runs[0].domain


def no_formation_sentence(number: int, namespace: str | None = None) -> str:
    """The error sentence that a domain has no formation, and which runs there are.

    Args:
        number: of the domain.
        namespace: of the formation; None for any.
    """
    inside = "" if namespace is None else f" in the namespace {namespace or '/'}"
    runs = runs_here()
    elsewhere = running(runs) if runs else "no run is under way on this machine"
    return f"no formation is flying on domain {number}{inside}; {elsewhere}"


def runs_here() -> list[RegisteredRun]:
    """This user's runs on this machine, by domain.

    Raises:
        CommandError: the folder in which they are described is not the user's alone.
    """
    try:
        return run_registry.registered_runs()
    except RuntimeFolderError as error:
        raise CommandError(str(error)) from None


def running(runs: list[RegisteredRun]) -> str:
    """Runs as text."""
    named = ", ".join(f"{run.domain} ({run.scenario})" for run in runs)
    return f"runs under way on this machine: {named}"
