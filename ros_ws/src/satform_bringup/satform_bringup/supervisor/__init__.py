# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A flight's processes from start to end: process server, supervisor, run registry, rejoin.

Imports `deployment`.
"""
