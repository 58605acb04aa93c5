# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Who may say and hear what in a formation, as the policies, permissions and keys of SROS 2."""
