# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Which processes run where and how they meet: DDS domain, discovery, hosts, security, preflight checks.

Imports no other room of this package.
"""
