# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of a flight by subject, and the expectations that judge it. Imports `flight` and below."""

# The scenario's model loads the modules of this package that define expectations. It is imported first, so
# that a program may import any of these modules first.
import satform.scenario  # noqa: F401
