# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The node of one satellite, the group of several in one process, and what both publish and subscribe."""
