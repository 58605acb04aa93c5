# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The node that publishes markers, poses, paths and transforms. Imports `runtime` and `transport`."""
