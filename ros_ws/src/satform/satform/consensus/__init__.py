# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Communication graphs and consensus laws on the generalised arc length. Imports `control` and below."""
