# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""All that any node needs, imported and looked up before the processes part ways."""

# ruff: noqa: E402, F401 - imported so that every process forked later has them

import gc

# Collections during imports take a fifth of their time and find nothing.
gc.disable()

import scipy.linalg
import scipy.special
from rcl_interfaces import srv as parameter_services
from rclpy.serialization import serialize_message
from satform_msgs.action import Reconfigure
from satform_msgs.srv import SetGraph
from std_srvs.srv import Trigger
from type_description_interfaces.srv import GetTypeDescription

import satform_nodes.display.node
import satform_nodes.plant.flight_loop
import satform_nodes.recorder.flight_loop
import satform_nodes.satellite.group_node
import satform_nodes.satellite.single_node
from satform_nodes.runtime import shared_plan
from satform_nodes.transport import compiled, topic_types

_SERVICES = (
    *(kind for kind in vars(parameter_services).values() if isinstance(kind, type)),
    *(GetTypeDescription, SetGraph, Trigger, Reconfigure),
)

compiled.is_used()
for _kind in {*topic_types.TYPES.values(), *_SERVICES}:
    # Loads the C libraries that turn these messages into bytes.
    _kind.__class__.__import_type_support__()
for _kind in set(topic_types.TYPES.values()):
    # Loads those of the middleware.
    serialize_message(_kind())
shared_plan.take_before_forks()
gc.freeze()
gc.enable()
