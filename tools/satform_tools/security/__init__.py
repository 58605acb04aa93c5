# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""SROS 2 policies, permissions and keys of a formation."""
