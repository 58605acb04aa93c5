# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The set-up behind `tools/satform`: makes the environment, keeps it up to date, starts programs in it.

It runs before anything is installed, so it uses the standard library alone; and at every start, so it imports
little.
"""
