# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The node of the plant: publishers, subscriptions, services. Imports `runtime` and `transport`."""
