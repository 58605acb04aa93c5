# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Campaigns from the command line: run, resume, report, one case."""
