# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Navigation filters against those of Stone Soup, which shares no code with satform."""

import sys
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from range_measurement import PROCESS, TRANSITION, Array, Ranges, flight, prior
from satform.navigation.estimate import GaussianEstimate
from satform.navigation.gaussian_filters import (
    GaussianFilter,
    cubature_filter,
    extended_filter,
    unscented_filter,
)
from satform.navigation.information_fusion import NeighbourEstimate, fused

PACKAGES = Path(__file__).parents[2] / ".venv" / "stonesoup"
pytestmark = [
    pytest.mark.unmeasured,
    pytest.mark.skipif(
        not PACKAGES.is_dir(),
        reason="NOT TESTED: Stone Soup is not installed; requirements-stonesoup.txt says how",
    ),
]
START = prior(200.0, 0.05, (0.0, 1500.0, 300.0, 0.1, 0.0, 0.3))
FUNCTION = Ranges(np.array([[0.0, 0.0, 0.0], [0.0, 400.0, -900.0]]), 5.0)


@pytest.fixture(scope="module")
def _stone_soup() -> Iterator[None]:
    """Its packages, behind those that the environment has."""
    sys.path.append(str(PACKAGES))
    yield
    sys.path.remove(str(PACKAGES))


def of_stone_soup(kind: str, measured: Array) -> tuple[Array, Array]:
    """Means and covariances after each measurement."""
    from stonesoup.models.measurement.nonlinear import NonLinearGaussianMeasurement
    from stonesoup.models.transition.linear import LinearGaussianTimeInvariantTransitionModel
    from stonesoup.predictor.kalman import KalmanPredictor
    from stonesoup.types.array import StateVector, StateVectors
    from stonesoup.types.detection import Detection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.state import GaussianState
    from stonesoup.types.update import GaussianStateUpdate
    from stonesoup.updater.kalman import (
        CubatureKalmanUpdater,
        ExtendedKalmanUpdater,
        UnscentedKalmanUpdater,
    )

    class RangeModel(NonLinearGaussianMeasurement):  # type: ignore[misc]
        """Ranges, in Stone Soup's columns."""

        @property
        def ndim_meas(self) -> int:
            return FUNCTION.width

        def function(self, state: Any, noise: Any = False, **_: Any) -> Any:
            columns = np.asarray(state.state_vector, dtype=float)
            ranges = FUNCTION.predicted(columns.T).T
            return StateVector(ranges) if columns.shape[1] == 1 else StateVectors(ranges)

        def jacobian(self, state: Any, **_: Any) -> Array:
            return FUNCTION.jacobian(np.asarray(state.state_vector, dtype=float)[:, 0])

    model = RangeModel(ndim_state=6, mapping=(0, 1, 2), noise_covar=np.diag(FUNCTION.variance))
    updater = {
        "extended": lambda: ExtendedKalmanUpdater(model),
        "unscented": lambda: UnscentedKalmanUpdater(model, alpha=0.3, beta=2.0, kappa=1.0),
        "cubature": lambda: CubatureKalmanUpdater(model),
    }[kind]()
    predictor = KalmanPredictor(LinearGaussianTimeInvariantTransitionModel(TRANSITION, PROCESS))
    begin = datetime(2026, 1, 1, tzinfo=UTC)
    state: Any = GaussianState(START.mean[:, None], START.covariance, begin)
    means, covariances = [], []
    for number, reading in enumerate(measured):
        time = begin + timedelta(seconds=number)
        prediction = predictor.predict(state, timestamp=time) if number else state
        detection = Detection(StateVector(reading[:, None]), timestamp=time, measurement_model=model)
        state = updater.update(SingleHypothesis(prediction, detection))
        assert isinstance(state, GaussianStateUpdate)
        means.append(np.asarray(state.state_vector, dtype=float)[:, 0])
        covariances.append(np.asarray(state.covar, dtype=float))
    return np.array(means), np.array(covariances)


def of_satform(filter_: GaussianFilter, measured: Array) -> tuple[Array, Array]:
    memory, nothing = filter_.start(START, np.zeros(0)), np.zeros(0)
    means, covariances = [], []
    for number, reading in enumerate(measured):
        if number:
            memory = filter_.predict(memory, TRANSITION, np.zeros(6), PROCESS, nothing)
        memory, _ = filter_.update(memory, reading, FUNCTION, nothing)
        means.append(memory.mean)
        covariances.append(memory.covariance)
    return np.array(means), np.array(covariances)


@pytest.mark.usefixtures("_stone_soup")
@pytest.mark.parametrize(
    ("kind", "own"),
    [
        ("extended", extended_filter()),
        ("unscented", unscented_filter(alpha=0.3, beta=2.0, kappa=1.0)),
        ("cubature", cubature_filter()),
    ],
)
def test_a_filter_has_the_estimates_of_stone_soup(kind: str, own: GaussianFilter) -> None:
    _, measured = flight(START, FUNCTION, 40, seed=5)
    means, covariances = of_satform(own, measured)
    expected_means, expected_covariances = of_stone_soup(kind, measured)
    deviations = np.sqrt(np.einsum("tii->ti", expected_covariances))
    assert np.max(np.abs(means - expected_means) / deviations) < 1e-6
    scale = deviations[:, :, None] * deviations[:, None, :]
    assert np.max(np.abs(covariances - expected_covariances) / scale) < 1e-6


@pytest.mark.usefixtures("_stone_soup")
def test_exchanged_estimates_are_fused_as_by_stone_soup() -> None:
    from stonesoup.mixturereducer.gaussianmixture import CovarianceIntersection
    from stonesoup.types.state import GaussianState

    random = np.random.default_rng(3)
    roots = random.normal(size=(3, 6, 6))
    # Of moderate condition, as Stone Soup takes pseudo-inverses.
    covariances = roots @ np.swapaxes(roots, -1, -2) + np.eye(6)
    own, *others = (
        GaussianEstimate(mean, covariance)
        for mean, covariance in zip(random.normal(size=(3, 6)), covariances, strict=True)
    )
    weights = np.array([0.5, 0.3, 0.2])
    received = [NeighbourEstimate(number, other) for number, other in enumerate(others, 1)]
    found = fused("information_consensus", own, received, weights)
    states = [GaussianState(each.mean[:, None], each.covariance) for each in (own, *others)]
    expected = CovarianceIntersection.merge_components(*states, weights=weights)
    assert np.allclose(found.mean, np.asarray(expected.state_vector, dtype=float)[:, 0], rtol=1e-10)
    assert np.allclose(found.covariance, np.asarray(expected.covar, dtype=float), rtol=1e-10)
