# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Files from anywhere, read within bounds and written whole or not at all. Imports `common` only."""
