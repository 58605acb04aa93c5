# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Compiled part of `satform_nodes`: what is done at every message of a step."""
