# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The protocol of plant and satellites without ROS: which step is taken when, by whom, on which messages.

The nodes of `satform_nodes` carry these objects: they hand them messages and publish what they are asked to.
Imports `flight` and below.
"""
