# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The program `satform` where it is installed as a wheel: starts the command line in the right environment.

In a copy of the project `tools/satform` does this. Imports the standard library only, as it replaces itself.
"""

import os
import sys
from pathlib import Path

from satform_setup.ros_distribution import WHEELS
from satform_setup.variables import applied, environment_variables, shell_variables

_BAD_USE = 2


def main() -> None:
    """Replace this process by the command line, or by a program in its environment."""
    prefix = Path(sys.prefix)
    variables = applied(environment_variables(prefix, WHEELS), shell_variables(WHEELS, os.environ))
    words = sys.argv[1:]
    if words[:1] == ["setup"]:
        sys.stderr.write("satform: it is installed as a wheel, so that there is nothing to set up\n")
        sys.exit(0)
    command = [sys.executable, "-P", "-m", "satform_tools", *words]
    if words[:1] == ["exec"]:
        command = words[1:]
    if not command:
        sys.stderr.write("satform: usage: satform exec COMMAND [ARGUMENT...]\n")
        sys.exit(_BAD_USE)
    try:
        os.execvpe(command[0], command, variables)  # noqa: S606 - no shell is wanted
    except FileNotFoundError:
        sys.stderr.write(f"satform: there is no program {command[0]!r} in the environment or on the PATH\n")
        sys.exit(_BAD_USE)
