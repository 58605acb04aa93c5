# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The node that records every message of a flight into a bag. Imports `bag`, `runtime` and `transport`."""
