# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The commands and their options; what they do is in the other rooms."""
