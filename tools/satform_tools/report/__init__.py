# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Reports of flights: page, plots, tables, exports, gallery."""
