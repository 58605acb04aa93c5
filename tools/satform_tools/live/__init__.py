# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The live page: a flight under way, or a stored one, in a browser."""
