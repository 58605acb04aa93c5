# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""All that any node needs, imported and looked up before the processes part ways."""

# ruff: noqa: F401 - imported so that every process forked later has them

import scipy.linalg
import scipy.special

import satform_nodes.display.node
import satform_nodes.plant.flight_loop
import satform_nodes.recorder.flight_loop
import satform_nodes.satellite.group_node
import satform_nodes.satellite.single_node
from satform.scenario import Scenario
from satform_nodes.transport import topic_types

# Makes the validators of scenarios, which every node loads.
Scenario.model_rebuild()

for _message_type in topic_types.TYPES.values():
    # Loads the C libraries that turn these messages into bytes.
    _message_type.__class__.__import_type_support__()
