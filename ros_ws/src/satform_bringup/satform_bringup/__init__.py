# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""From a scenario to the processes that fly it, and their life from start to end."""

PACKAGE = "satform_nodes"
"""Where the nodes' executables are."""

BAG_FOLDER = "bag"
"""In a run's folder: what was recorded."""

LOG_FOLDER = "log"
"""In a run's folder: what each process printed."""

CHECKPOINT_FOLDER = "checkpoints"
"""In a run's folder: the last checkpoint of each satellite."""

PROCESSES_FILE = "processes.json"
"""In a run's folder: which processes fly, with their arguments, and in which DDS domain."""

GROUPS_FILE = "groups.json"
"""In a run's folder: the satellites of each group, where groups exchange arrays."""
