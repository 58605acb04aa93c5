"""What linear theory says about the agreement on the arc length, to be drawn beside a flight."""

import numpy as np
from scipy.linalg import expm

from satform.consensus.arc_length import ArcLengthConsensusSpec
from satform.elementwise import Array
from satform.satellite import flight_plan
from satform.scenario import Scenario

_MOST_SATELLITES = 200


def arc_length_spread(scenario: Scenario, time: Array) -> Array | None:
    """Spread of the arc lengths under continuous-time consensus on the scenario's graph.

    Args:
        scenario: whose gains, graph and start are taken.
        time: evenly spaced from zero, s, shape (K,) with K of at least 2.

    Returns:
        Largest minus smallest arc length less the desired offsets, m, shape (K,); None where the law
        is not the linear one on reference points that all share one nominal rate.

    Source: Ren & Beard, ch. 4, second-order consensus, by the exponential of its matrix.
    """
    law, count = scenario.consensus, len(scenario.satellites)
    if (
        not isinstance(law, ArcLengthConsensusSpec)
        or law.arc_length_source != "reference"
        or count > _MOST_SATELLITES
    ):
        return None
    plans = [flight_plan(scenario, index) for index in range(count)]
    nominal = np.array([float(plan.nominal_rate) for plan in plans])
    if np.ptp(nominal) > 1e-9 * np.max(np.abs(nominal), initial=1.0):
        return None
    laplacian = scenario.communication_graph().laplacian()
    matrix = np.block(
        [
            [np.zeros((count, count)), np.eye(count)],
            [-law.coupling_gain * laplacian, -law.tracking_gain * np.eye(count) - law.rate_gain * laplacian],
        ]
    )
    advance = expm(matrix * (time[1] - time[0]))
    phase = np.array([float(plan.arc_length - plan.phase_offset) for plan in plans])
    state = np.concatenate((phase, np.array([float(plan.rate) for plan in plans]) - nominal))
    spread = np.empty(len(time))
    for row in range(len(time)):
        spread[row] = np.ptp(state[:count])
        state = advance @ state
    return spread
