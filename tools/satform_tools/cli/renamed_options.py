# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Options under earlier names: the error sentence gives the present name."""

import re
from typing import Any

import typer
from typer.core import TyperGroup

RENAMED = {
    "--group": "--satellites-per-process",
    "--measure": "--measure-round-trip",
    "--without-recorder": "--continue-without-recorder",
    "--wait": "--timeout",
    "--times": "--repetitions",
    "--keep": "--history",
}
"""Earlier name of an option -> its present name."""

_OPTION = re.compile(r"--[a-z][a-z-]*")


def renamed_in(message: str, options: set[str]) -> str:
    """What became of the renamed option that an error message names.

    Args:
        message: of an error in arguments, such as `No such option: --group`.
        options: that the command has.

    Returns:
        Such as `--group is now --satellites-per-process`; empty where the command has no such option.
    """
    for old in _OPTION.findall(message):
        if RENAMED.get(old) in options:
            return f"{old} is now {RENAMED[old]}"
    return ""


class RootGroup(TyperGroup):
    """The root of all commands; an error about an earlier name of an option gives the present name."""

    def invoke(self, context: Any) -> Any:
        """Run the command that the arguments name."""
        try:
            return super().invoke(context)
        except typer.TyperException as error:
            # The class of an error in arguments has no public name in Typer; it is the one with a context.
            command = getattr(getattr(error, "ctx", None), "command", None)
            parameters = command.params if command else ()
            options = {option for parameter in parameters for option in parameter.opts}
            sentence = renamed_in(error.format_message(), options)
            if sentence:
                vars(error).update(message=sentence, possibilities=None)
            raise
