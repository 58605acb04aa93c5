# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags (MCAP): writing and recovery; the library reads them. Imports `transport` alone."""
