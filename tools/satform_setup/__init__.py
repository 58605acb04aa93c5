# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Set-up of `tools/satform`: makes and updates the environment, and starts programs in it.

It runs before anything is installed, so it uses the standard library alone; and at every start, so it imports
little.
"""
