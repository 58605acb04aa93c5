# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a visualisation of a formation in flight shows. Imports `flight` and below."""
