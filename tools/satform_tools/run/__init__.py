# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flying a scenario, storing the run, replaying and recovering it."""
