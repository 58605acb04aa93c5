# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Topics, QoS, executor, CDR codec, authorised publishers, discovery.

Imports no other room of this package.
"""
