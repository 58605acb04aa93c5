# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Packages of one's own: a folder for each kind of part, from which `satform new` makes one."""
