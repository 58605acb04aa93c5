# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Topics and QoS, executor, CDR codec, validation of messages and publishers, discovery.

Imports no node.
"""
