# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of a satellite's flight software that can be changed in flight, by their ROS names.

Values are validated by pydantic in `changed`, which the parameter callback of the nodes
(`satform_nodes.runtime.parameters.on_spec_change`) calls.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from satform.attitude.mrp_tracking import AttitudeTrackingSpec
from satform.common.spec import Number, Spec
from satform.control.protocol import ControllerSpec
from satform.flight.plans import ParameterPlan
from satform.flight.satellite import Satellite
from satform.membership.reconfiguration import Target, TargetSpec
from satform.orbits.curve_specs import CurveSpec
from satform.orbits.path_reference import Path


class PhaseSpec(Spec):
    """By how much a satellite leads the formation's agreement."""

    offset: Number = 0.0
    """Generalised arc length by which the satellite leads, m."""


class OnlineParameters:
    """The specifications in force of one satellite: control laws, orbit and phase.

    Attributes:
        specs: by the name that begins their parameters, such as `controller` of `controller.gain`.
    """

    def __init__(self, plan: ParameterPlan) -> None:
        """As they are at the start of the flight."""
        self._plan = plan
        self._target = TargetSpec()
        self._setting = plan.setting
        self.specs: dict[str, Spec] = {
            "controller": plan.controller,
            "curve": plan.curve,
            "phase": PhaseSpec(offset=plan.phase_offset),
        }
        if plan.attitude_controller is not None:
            self.specs["attitude_controller"] = plan.attitude_controller

    def use(self, satellite: Satellite, prefix: str, spec: Spec) -> None:
        """Have a satellite fly by another specification from its next step on.

        Args:
            satellite: the one whose adjustments these are.
            prefix: which of `specs`.
            spec: of the same class as the one in force.

        Raises:
            ValueError: the satellite cannot fly by it.
        """
        match spec:
            case AttitudeTrackingSpec():
                satellite.use_attitude_controller(spec)
            case ControllerSpec():
                satellite.use_controller(spec, self._setting)
            case CurveSpec():
                satellite.use_curve(spec.build())
            case PhaseSpec():
                satellite.use_phase_offset(spec.offset)
        self.specs[prefix] = spec

    def retarget(self, satellite: Satellite, target: Target) -> None:
        """Have a satellite fly by another target from its next step on.

        Parameters of curve and phase that were changed in flight stay where the target does not set these
        fields.

        Args:
            satellite: the one whose adjustments these are.
            target: in force.
        """
        plan, spec = self._plan, target.spec
        # A target in between may have passed unseen.
        new = target.fields | spec.different_from(self._target)
        self._target = spec
        offset = float(satellite.plan.phase_offset)
        if "phase_offset" in new:
            offset = plan.phase_offset if spec.phase_offset is None else spec.phase_offset
            self.specs["phase"] = PhaseSpec(offset=offset)
        if "curve" in new:
            self.specs["curve"] = plan.curve if spec.curve is None else spec.curve
        path, nominal = satellite.plan.path, float(satellite.plan.nominal_rate)
        if new & {"curve", "scale"}:
            path = target_path(plan, TargetSpec(curve=self.specs["curve"], scale=spec.scale), path)
            nominal = plan.nominal_motion.rate_along(float(path.period))
        satellite.use_target(path, offset, nominal, target.since)

    def set(self, satellite: Satellite, name: str, value: Sequence[float]) -> None:
        """Change one parameter, as it was noted down when it was changed in flight.

        Args:
            satellite: the one whose adjustments these are.
            name: of the parameter, for example `controller.proportional_gain`.
            value: one number, or several for a value per axis.

        Raises:
            ValueError: there is no such parameter, or it cannot have this value.
        """
        prefix, _, field = name.partition(".")
        spec = self.specs.get(prefix)
        if spec is None or not field:
            raise ValueError(f"{name}: there is no such parameter")
        single = value[0] if len(value) == 1 else list(value)
        self.use(satellite, prefix, changed(spec, {field: single}))


def target_path(plan: ParameterPlan, target: TargetSpec, path: Path) -> Path:
    """The path of a target.

    Args:
        plan: what the scenario gives the satellite.
        target: what is other than that.
        path: of the satellite at any time of the flight, whose parameter and feed-forward it keeps.
    """
    curve, scale = target.flown(plan.curve, plan.scale)
    return replace(path, curve=curve.build(), scale=np.asarray(scale, dtype=np.float64)[()])


def changed(spec: Spec, fields: dict[str, Any]) -> Spec:
    """A specification with fields changed.

    Args:
        spec: as it was.
        fields: new values by dotted names, such as `law.gain` for the field of a specification within it.

    Raises:
        ValueError: there is no such field; or, as pydantic's ValidationError, a value is not allowed.
    """
    data = spec.model_dump()
    for name, value in fields.items():
        *path, last = name.split(".")
        parent: Any = data
        for part in path:
            parent = parent.get(part) if isinstance(parent, dict) else None
        if not isinstance(parent, dict) or last not in parent:
            raise ValueError(f"{name}: there is no such field")
        parent[last] = value
    return type(spec).model_validate(data)
