# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""ROS parameters of a satellite: settings at its start; control laws, orbit and phase, changed in flight."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from satform.common.spec import Spec
from satform.flight.compile import FormationPlan
from satform.flight.online_parameters import OnlineParameters, changed
from satform.flight.satellite import Satellite
from satform.membership.reconfiguration import Target
from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.runtime.parameters import (
    ParameterError,
    declare_rate,
    declare_spec,
    declare_start,
    known_before_flight,
    on_spec_change,
    show_spec,
)

ChangedParameter = tuple[str, list[float]]
"""Name of a parameter and its new value."""


@dataclass(frozen=True)
class SatelliteSettings:
    """Settings of a satellite's node at its start beside the scenario.

    Attributes:
        name: of the satellite.
        recorded: whether a recorder takes part, to be waited for.
        checkpoints: folder of the checkpoints; empty when none are kept.
        single: whether the satellite has its process for itself.
        rate: simulated seconds in each second of the wall clock; 0 for lockstep.
    """

    name: str
    recorded: bool
    checkpoints: str
    single: bool
    rate: float = 0.0


class SatelliteParameters:
    """The specifications in force of one satellite, as parameters of its node."""

    def __init__(
        self,
        node: FormationNode,
        plan: FormationPlan,
        index: int,
        to_change: Callable[[], tuple[Satellite, int]],
        changes: list[ChangedParameter],
    ) -> None:
        """Declare them with the values of the scenario, or with the overrides of the node.

        An override is validated, takes effect at the first step and is published, as any other change.

        Args:
            node: of the satellite.
            plan: of the flight's parts.
            index: of the satellite.
            to_change: gives the flight software that is changed, and the step from which it flies otherwise.
            changes: to which each change is added, to be published.

        Raises:
            ParameterError: a value that was given at the start cannot be flown.
        """
        self._node = node
        self._plan = plan
        self._index = index
        self._to_change = to_change
        self._changes = changes
        self._adjustments = OnlineParameters(plan.parameters(index))
        self._resets = False
        self._start: dict[str, dict[str, Any]] = {}
        self._kinds = {prefix: type(spec) for prefix, spec in self._adjustments.specs.items()}
        for prefix, spec in self._adjustments.specs.items():
            self._declare(prefix)
            self._start[prefix] = known_before_flight(node, prefix, spec)
        self._use_start()

    def reset(self) -> None:
        """Have the specifications of the scenario in force again, with what was given at the start.

        The parameters show them, whatever they were changed to in flight.
        """
        self._adjustments = OnlineParameters(self._plan.parameters(self._index))
        self._changes.clear()
        self._resets = True
        try:
            for prefix, spec in self._adjustments.specs.items():
                show_spec(self._node, prefix, spec, self._start[prefix])
        finally:
            self._resets = False
        self._use_start()

    def retarget(self, satellite: Satellite, target: Target) -> None:
        """Have the satellite fly by a target of a reconfiguration; the parameters show it.

        The parameters of a curve of another kind than the scenario's cannot: they are then without effect.

        Args:
            satellite: the flight software.
            target: in force.
        """
        self._adjustments.retarget(satellite, target)
        self._resets = True
        try:
            for prefix in ("curve", "phase"):
                spec = self._adjustments.specs[prefix]
                if type(spec) is self._kinds[prefix]:
                    show_spec(self._node, prefix, spec, {})
        finally:
            self._resets = False

    def _use_start(self) -> None:
        """Fly by what was given at the start.

        Raises:
            ParameterError: it cannot be flown.
        """
        for prefix, fields in self._start.items():
            if not fields:
                continue
            try:
                self._accept(prefix, changed(self._adjustments.specs[prefix], fields), fields)
            except ValueError as error:
                raise ParameterError(f"{prefix}: {error}") from None

    def _declare(self, prefix: str) -> None:
        def accept(spec: Spec, fields: dict[str, Any]) -> str:
            return self._accept(prefix, spec, fields)

        declare_spec(self._node, prefix, self._adjustments.specs[prefix])
        on_spec_change(self._node, prefix, lambda: self._adjustments.specs[prefix], accept)

    def _accept(self, prefix: str, spec: Spec, fields: dict[str, Any]) -> str:
        if self._resets:
            return ""
        if type(spec) is not self._kinds[prefix]:
            raise ValueError(
                f"{prefix}: a reconfiguration gave the satellite another kind than these parameters are for; "
                "change it by another target"
            )
        satellite, step = self._to_change()
        self._adjustments.use(satellite, prefix, spec)
        for name, value in fields.items():
            numbers = list(value) if isinstance(value, list | tuple) else [float(value)]
            self._changes.append((f"{prefix}.{name}", numbers))
        return f"takes effect at step {step}"


def declare_settings(node: FormationNode) -> tuple[bool, str, float]:
    """Declare the start parameters that all programs of satellites have: recorder, checkpoints, rate."""
    declare_start(node, "scenario")
    recorded = declare_start(node, "recorded")
    checkpoints = declare_start(node, "checkpoints")
    return recorded, checkpoints, declare_rate(node)
