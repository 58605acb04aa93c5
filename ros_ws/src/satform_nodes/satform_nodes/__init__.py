# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The formation's ROS 2 nodes: thin shells that convert, wait and publish around `satform`."""

LEAN = "SATFORM_LEAN"
"""Environment variable: when set, all nodes of the process do without what costs most among many nodes."""

SHARED_SCENARIO = "SATFORM_SHARED_SCENARIO"
"""Environment variable of the process server: the file, in a folder of this user's, by which it is given the
scenario that `runtime.shared_plan` compiles."""

EDGES_OF_SCENARIO = "SATFORM_EDGES_OF_SCENARIO"
"""Environment variable of the plant: when set, a satellite has discovered only those that the scenario has as
its neighbours at some time."""
