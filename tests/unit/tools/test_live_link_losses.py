# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Ages and losses of links on the live page, against what the satellites of the same flight received."""

import numpy as np

from flights import shortened
from satform.flight.simulate import simulate
from satform_tools.live.link_losses import LOSS_WINDOW, LinkLosses


def test_ages_and_losses_are_those_of_the_messages_that_the_flight_delivered() -> None:
    scenario = shortened("lossy_links", 300.0)
    record = simulate(scenario)
    history = record.links
    assert history is not None
    edges = [(receiver, sender) for sender, receiver in history.edges.tolist()]
    losses = LinkLosses(scenario, edges)
    window = round(LOSS_WINDOW / record.step)
    for step in (3, 40, 41, 150, record.steps - 1):
        age, loss = losses.at(step)
        for column in range(len(edges)):
            arrived = np.flatnonzero(history.delivered[: step + 1, column])
            assert age[column] == (step - arrived[-1]) * record.step
            if step >= window:
                recent = history.delivered[step + 1 - window : step + 1, column]
                assert abs(loss[column] - (1.0 - recent.mean())) < 1e-12
    assert 0.1 < np.mean(loss) < 0.5
