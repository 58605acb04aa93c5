# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Forces at many instants at once are those of one instant."""

from datetime import UTC, datetime

import numpy as np
import pytest

from satform.dynamics import orbital_forces as forces
from satform.dynamics.atmosphere import atmosphere_of
from satform.dynamics.atmosphere_specs import HarrisPriesterSpec, Nrlmsise00Spec
from satform.dynamics.force_paths import along
from satform.numeric.elementwise import Array
from satform.orbits.earth_orientation import without_file
from satform.orbits.frames import ClosedEarthRotation
from satform.orbits.time_scales import brahe_epoch

EPOCH = brahe_epoch(datetime(2024, 3, 1, tzinfo=UTC))
EQUATOR = without_file().inertial_to_equator_of_date(EPOCH)
CLOSED, FULL = ClosedEarthRotation(0.3), forces.FullEarthRotation(EPOCH)
BODIES = (forces.Body(150.0, 2.0, 2.2, 3.0, 1.5), forces.Body(40.0, 0.5, 2.0, 1.0, 1.0))
TIMES = (0.0, 300.0, 86400.0)


class Odd:
    """A force of somebody else."""

    def acceleration(self, time: float, position: Array, velocity: Array, bodies: object) -> Array:
        return 1e-9 * time * position + velocity


def drag(spec: HarrisPriesterSpec | Nrlmsise00Spec, equator: Array) -> forces.Drag:
    return forces.Drag(atmosphere_of(spec, EPOCH, equator, CLOSED, without_file()), equator)


@pytest.mark.parametrize(
    "force",
    [
        forces.Gravity(0, 0, CLOSED),
        forces.Gravity(12, 8, CLOSED),
        forces.Gravity(4, 4, FULL),
        forces.ThirdBodies(EPOCH, sun=True, moon=False),
        forces.ThirdBodies(EPOCH, sun=False, moon=True),
        forces.ThirdBodies(EPOCH, sun=True, moon=True),
        drag(HarrisPriesterSpec(), np.eye(3)),
        drag(HarrisPriesterSpec(), EQUATOR),
        drag(HarrisPriesterSpec(exponent=3.0), EQUATOR),
        drag(Nrlmsise00Spec(), EQUATOR),
        forces.SolarPressure(EPOCH),
        Odd(),
    ],
    ids=lambda force: type(force).__name__,
)
def test_a_force_at_many_instants_is_the_force_at_each(force: forces.Force) -> None:
    generator = np.random.default_rng(3)
    position = np.array([5.1e6, 3.9e6, 2.1e6]) + 1e5 * generator.normal(size=(3, 2, 3))
    velocity = 5e3 * generator.normal(size=(3, 2, 3))
    model = forces.ForceModel((force,))
    whole = along(model, TIMES)(range(3), position, velocity, BODIES)
    for number, time in enumerate(TIMES):
        one = model.acceleration(time, position[number], velocity[number], BODIES)
        largest = np.abs(force.acceleration(time, position[number], velocity[number], BODIES)).max()
        # The tide of the Sun is what is left of two pulls of 6e-3 m/s^2.
        np.testing.assert_allclose(whole[number] - one, 0.0, atol=1e-14 * largest + 3e-18)
    some = along(model, TIMES)((2,), position[2:], velocity[2:], BODIES)
    assert some.tobytes() == whole[2:].tobytes()
    alone = along(model, TIMES)(range(3), position[:, 1:], velocity[:, 1:], BODIES[1:])
    assert alone.tobytes() == whole[:, 1:].tobytes()
