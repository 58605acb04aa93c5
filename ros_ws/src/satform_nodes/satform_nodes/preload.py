# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""All that any node needs, imported and looked up before the processes part ways."""

import scipy.special

from satform_nodes.display import node as display_node
from satform_nodes.plant import flight_loop as plant_node
from satform_nodes.recorder import flight_loop as recorder_node
from satform_nodes.satellite import group_node
from satform_nodes.satellite import single_node as satellite_node
from satform_nodes.transport import topic_types

MODULES = (scipy.special, display_node, group_node, plant_node, recorder_node, satellite_node)

for _message_type in topic_types.TYPES.values():
    # Loads the C libraries that turn these messages into bytes.
    _message_type.__class__.__import_type_support__()
