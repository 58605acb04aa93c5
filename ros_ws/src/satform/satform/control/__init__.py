# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Control laws of a single satellite, and the protocol that they implement.

Imports `dynamics` and below.
"""
