# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""In which DDS domain the formation flies that is to be looked at."""

from satform_bringup.deployment.domain import DomainError, shell_domain
from satform_bringup.deployment.runtime_folder import RuntimeFolderError
from satform_bringup.supervisor import run_registry
from satform_bringup.supervisor.run_registry import RunUnderWay
from satform_tools.errors import CommandError


def domain(asked: int | None) -> int:
    """The domain that is asked for, else the shell's, else that of the only run on this machine.

    Args:
        asked: on the command line; None when nothing is.

    Returns:
        A DDS domain.

    Raises:
        CommandError: nothing is asked for, and no run or more than one is under way.
    """
    if asked is not None:
        return asked
    try:
        given = shell_domain()
    except DomainError as error:
        raise CommandError(str(error)) from None
    if given is not None:
        return given
    runs = runs_here()
    if not runs:
        raise CommandError(
            "no run is under way on this machine; start one with satform run, or name a domain with --domain"
        )
    if len(runs) > 1:
        raise CommandError(f"{len(runs)} {others(runs)}; name one with --domain")
    return runs[0].domain


def nobody_flies(number: int, namespace: str | None = None) -> str:
    """The sentence that no formation has been found in a domain, and where there are some.

    Args:
        number: of the domain.
        namespace: in which one was looked for; None for any.
    """
    inside = "" if namespace is None else f" in the namespace {namespace or '/'}"
    runs = runs_here()
    elsewhere = others(runs) if runs else "no run is under way here"
    return f"no formation is flying on domain {number}{inside}; {elsewhere}"


def runs_here() -> list[RunUnderWay]:
    """This user's runs on this machine, by domain.

    Raises:
        CommandError: the folder in which they are described is not the user's alone.
    """
    try:
        return run_registry.runs_under_way()
    except RuntimeFolderError as error:
        raise CommandError(str(error)) from None


def others(runs: list[RunUnderWay]) -> str:
    """Runs in words."""
    named = ", ".join(f"{run.domain} ({run.scenario})" for run in runs)
    return f"runs under way on this machine: {named}"
