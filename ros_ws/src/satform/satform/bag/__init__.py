# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags (MCAP) read without ROS, by the message definitions in them: record, scenario, events.

The optional dependencies `satform[bags]` are needed. Imports `flight` and below.
"""
