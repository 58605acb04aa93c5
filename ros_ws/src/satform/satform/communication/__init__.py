# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages between satellites, their topics, and the channel model that loses and delays them.

Imports `membership` and below.
"""
