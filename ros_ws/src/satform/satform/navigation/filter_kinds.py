# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Specifications of the filters by kind."""

from typing import Annotated, Any, Literal

from pydantic import Field

from satform.common.spec import Positive
from satform.navigation.cubature_particle_filter import CubatureParticleFilter
from satform.navigation.gaussian_filters import cubature_filter, extended_filter, unscented_filter
from satform.navigation.navigation_spec import NavigationFilterSpec
from satform.navigation.protocol import Filter


class ExtendedNavigationSpec(NavigationFilterSpec):
    """Extended Kalman filter: measurements are linearised at the predicted motion."""

    kind: Literal["extended"] = "extended"

    def kernel(self) -> Filter[Any]:
        """The filter itself."""
        return extended_filter()


class UnscentedNavigationSpec(NavigationFilterSpec):
    """Unscented Kalman filter: measurements are linearised by scaled points."""

    kind: Literal["unscented"] = "unscented"
    alpha: Annotated[float, Field(ge=1e-3, le=1.0)] = 0.1
    """Spread of the points about the mean, in root D standard deviations where kappa is 0."""
    beta: Annotated[float, Field(ge=0.0, le=10.0)] = 2.0
    """Weight of the mean in the covariance; 2 for a normal distribution."""
    kappa: Annotated[float, Field(ge=0.0, le=10.0)] = 0.0
    """Further distance of the points: they are alpha times the root of D + kappa standard deviations away."""

    def kernel(self) -> Filter[Any]:
        """The filter itself."""
        return unscented_filter(self.alpha, self.beta, self.kappa)


class CubatureNavigationSpec(NavigationFilterSpec):
    """Cubature Kalman filter: measurements are linearised by points of a cubature rule."""

    kind: Literal["cubature"] = "cubature"

    def kernel(self) -> Filter[Any]:
        """The filter itself."""
        return cubature_filter()


class CubatureParticleNavigationSpec(NavigationFilterSpec):
    """Cubature particle filter: many weighted cubature filters, for a large initial error."""

    kind: Literal["cubature_particle"] = "cubature_particle"
    particles: Annotated[int, Field(ge=2, le=5000)] = 500
    """Number of particles."""
    curvature: Positive = 0.1
    """Largest deviation of a measurement from a line within a particle, in standard deviations of the
    sensor's noise; beyond it the particle is split."""
    resampling: Annotated[float, Field(ge=0.0, le=1.0)] = 0.2
    """Fraction of the particles; they are resampled when their effective number is smaller."""

    def kernel(self) -> Filter[Any]:
        """The filter itself."""
        return CubatureParticleFilter(self.particles, self.curvature, self.resampling)
