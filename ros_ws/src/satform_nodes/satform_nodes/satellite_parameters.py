"""A satellite's ROS parameters: its control laws, orbit and phase, to be changed in flight."""

from collections.abc import Callable
from typing import Any

from satform.adjustments import Adjustments
from satform.satellite import Satellite
from satform.scenario import Scenario
from satform.spec import Spec
from satform_nodes.parameters import FormationNode, declare_spec, on_spec_change

Change = tuple[str, list[float]]
"""Name of a parameter and its new value."""


class SatelliteParameters:
    """The specifications in force of one satellite, as parameters of its node."""

    def __init__(
        self,
        node: FormationNode,
        scenario: Scenario,
        index: int,
        to_change: Callable[[], tuple[Satellite, int]],
        changes: list[Change],
    ) -> None:
        """Declare them as the scenario has them.

        Args:
            node: of the satellite.
            scenario: what is flown.
            index: place of the satellite.
            to_change: gives the flight software that is changed, and the step from which it flies otherwise.
            changes: to which each change is added, to be told to others.
        """
        self._node = node
        self._scenario = scenario
        self._index = index
        self._to_change = to_change
        self._changes = changes
        self.start_afresh()
        for prefix in self._adjustments.specs:
            self._declare(prefix)

    def start_afresh(self) -> None:
        """Have the specifications of the scenario in force again."""
        self._adjustments = Adjustments(self._scenario, self._index)

    def _declare(self, prefix: str) -> None:
        def accept(spec: Spec, fields: dict[str, Any]) -> str:
            return self._accept(prefix, spec, fields)

        declare_spec(self._node, prefix, self._adjustments.specs[prefix])
        on_spec_change(self._node, prefix, lambda: self._adjustments.specs[prefix], accept)

    def _accept(self, prefix: str, spec: Spec, fields: dict[str, Any]) -> str:
        satellite, step = self._to_change()
        self._adjustments.use(satellite, prefix, spec)
        for name, value in fields.items():
            numbers = list(value) if isinstance(value, list | tuple) else [float(value)]
            self._changes.append((f"{prefix}.{name}", numbers))
        return f"takes effect at step {step}"
