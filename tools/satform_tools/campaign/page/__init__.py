# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of a campaign's report."""
