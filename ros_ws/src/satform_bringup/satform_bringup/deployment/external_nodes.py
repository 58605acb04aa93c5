# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What somebody who starts the node of an external satellite needs: its name, the environment, the time."""

import shlex
from collections.abc import Mapping
from pathlib import Path

from satform.common.name_list import listed
from satform.communication.topic_table import in_namespace
from satform.files.durable_file import write_durably
from satform.flight.compile import FormationPlan

ENVIRONMENT_FILE = "environment.sh"
"""File of a run that sets in a shell what its nodes have in their environment."""


def write_environment(out: Path, domain: int, variables: Mapping[str, str]) -> None:
    """Write the environment of a run's nodes as a file for `sh`.

    Args:
        out: existing folder of the run.
        domain: DDS domain of the run.
        variables: of its nodes; an empty value stands for a variable that is not set.

    Raises:
        OSError: the folder cannot be written to.
    """
    own = {name: value for name, value in variables.items() if name != "ROS_LOG_DIR"}
    lines = [f"export ROS_DOMAIN_ID={domain}"]
    lines += [
        f"export {name}={shlex.quote(value)}" if value else f"unset {name}"
        for name, value in sorted(own.items())
    ]
    write_durably(out / ENVIRONMENT_FILE, ("\n".join(lines) + "\n").encode())


def awaited(plan: FormationPlan, out: Path, namespace: str = "") -> str:
    """Which nodes the run waits for, for how long, and how they find it.

    Args:
        plan: of the flight.
        out: folder of the run.
        namespace: of all nodes; empty for the root.
    """
    names = [in_namespace(f"/{name}", namespace) for name in plan.external]
    nodes = "the node" if len(names) == 1 else "the nodes"
    source = shlex.quote(str((out / ENVIRONMENT_FILE).absolute()))
    return (
        f"waiting up to {plan.timing.external_timeout:g} s for {nodes} {listed(names)}, which somebody else "
        f"starts; in the shell that does: . {source}"
    )
