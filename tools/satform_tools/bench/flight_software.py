# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""CPU time of one step of a satellite's flight software, without messages."""

import time

import numpy as np

from satform.attitude.guidance import Attitude
from satform.communication.messages import WIDTH, encode
from satform.communication.neighbour_buffer import Received
from satform.control.protocol import Motion
from satform.flight.compile import compile_scenario
from satform.flight.satellite import Satellite
from satform.scenario import Scenario

_WARM_UP = 200


def step_cost(scenario: Scenario, index: int = 0, steps: int = 1000) -> float:
    """Median processor time of a step, from plain numbers to the command, s.

    Args:
        scenario: that has the satellite.
        index: of the satellite in the scenario.
        steps: how many are measured.

    Returns:
        The median.
    """
    plan = compile_scenario(scenario)
    kind = scenario.consensus.announces
    neighbours = plan.membership.graph.neighbours(index)
    satellite = Satellite(plan.satellite(index), len(plan.membership.possible_graph.neighbours(index)))
    messages = np.zeros((len(neighbours), 1 + WIDTH[kind]))
    for row, neighbour in enumerate(neighbours):
        messages[row, 1:] = encode(Satellite(plan.satellite(neighbour)).announce())
    start = satellite.plan.start
    position, velocity = start.position.tolist(), start.velocity.tolist()
    turned = None
    if scenario.satellite(index).attitude is not None:
        turned = Attitude(np.zeros(3), np.zeros(3), np.zeros(3))
    costs = []
    for _ in range(_WARM_UP + steps):
        begin = time.thread_time_ns()
        motion = Motion(np.array(position), np.array(velocity))
        received = Received.whole(messages[:, 1:], messages[:, 0])
        satellite.act(motion, received, satellite.state.step, turned)
        costs.append(time.thread_time_ns() - begin)
    return float(np.median(costs[_WARM_UP:])) * 1e-9
