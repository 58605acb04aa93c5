"""The true states of all satellites: commands in, states out."""

from satform.control.protocol import Motion
from satform.dynamics.protocol import DynamicsSetting
from satform.elementwise import Array
from satform.satellite import motion_at_start
from satform.scenario.model import Scenario


class Plant:
    """What really happens to the satellites of a scenario.

    Attributes:
        step: number of the step that comes next.
    """

    def __init__(self, scenario: Scenario) -> None:
        setting = DynamicsSetting(
            mean_motion=scenario.orbit.rate,
            step=scenario.timing.step,
            satellite_count=len(scenario.satellites),
            seed=scenario.seed,
        )
        self._dynamics = scenario.dynamics.build(setting)
        start = motion_at_start(scenario)
        self._state = self._dynamics.start(start.position, start.velocity)
        self.step = 0

    def motion(self) -> Motion:
        """Position in m and velocity in m/s of all satellites in LVLH, shapes (N, 3)."""
        position, velocity = self._dynamics.lvlh(self._state)
        return Motion(position, velocity)

    def advance(self, acceleration: Array) -> None:
        """Move on by one step.

        Args:
            acceleration: commands of all satellites, held over the step, LVLH, m/s^2, shape (N, 3).
        """
        self._state = self._dynamics.advance(self._state, acceleration, self.step)
        self.step += 1
