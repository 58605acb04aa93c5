# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a bag of satform holds beside its messages: names of attachments, metadata records and their keys."""

SCENARIO_ATTACHMENT = "scenario.json"
"""Attachment with the scenario."""

FILE_ATTACHMENTS = "scenario_files/"
"""Before the names of files that the scenario names, which precede it in the bag."""

RUN_METADATA = "satform"
"""Metadata record with the versions that flew."""

ROLE = "satform_topic"
"""Key of a channel's metadata: what the topic is called in a formation in the root namespace."""

GROUPS_METADATA = "groups"
GROUP_MEMBERS, EVERY = "members", "every"
"""Metadata record where groups of satellites exchanged arrays: the satellites of each group as JSON, and the
number of steps to each one in the bag."""

TIME_METADATA = "time"
WALL_CLOCK = "wall clock"
"""Metadata record and its value where the wall clock kept the time of a flight, and steps may be missed."""
