# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Links before a flight: matching of an antenna, budget of each link."""
