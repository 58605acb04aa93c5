# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Parts that every room uses: base class of specifications, lists of names, exit codes, angles as text.

Imports no other room.
"""
