# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The 3-D scene of reports and of the live page, drawn in a browser, and its JavaScript libraries."""
