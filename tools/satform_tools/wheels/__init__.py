# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Wheels of the library and of all the rest, for machines without a compiler."""
