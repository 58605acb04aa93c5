# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Where and how processes meet: DDS domain, discovery, several hosts, security, preflight checks."""
