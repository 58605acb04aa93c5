# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""How a command or a node's process ends: the one table of exit codes.

Which of them `satform run` gives is decided in `satform_tools.run.run_result`.
"""

EXIT_DONE = 0
"""Done; what was judged is as expected."""

EXIT_MISSED = 1
"""An expectation was missed, or no plan keeps its constraints."""

EXIT_BAD_INPUT = 2
"""Something that was given cannot be used: a scenario, a parameter, a folder."""

EXIT_LOST = 3
"""A process was lost, or something of the flight."""

EXIT_ENDED_EARLY = 4
"""The flight ended early: a quantity was not finite or beyond its limit, or a satellite hit the ground."""

EXIT_STOPPED = 130
"""Stopped by a signal: Ctrl-C, SIGTERM, or SIGHUP of a closed terminal."""
