# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The record of a flight as plain arrays, in process or from a bag. Imports `communication` and below."""
