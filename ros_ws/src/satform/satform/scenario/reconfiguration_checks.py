# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Checks of new targets of satellites against the rest of a scenario, also of those asked for in flight."""

from collections.abc import Mapping, Sequence

from satform.attitude.satellite_pointing import SatellitePointingSpec
from satform.common.spec import Complaint
from satform.consensus.arc_length import Announces
from satform.membership.faults import step_at
from satform.membership.reconfiguration import ReconfigurationSpec, TargetSpec
from satform.orbits.curve_specs import InertialPointSpec
from satform.scenario.parts import SatelliteSpec, Timing
from satform.scenario.start import beyond_distance, singular_references


def reconfiguration_complaints(
    reconfigurations: Sequence[ReconfigurationSpec],
    satellites: Mapping[str, SatelliteSpec],
    timing: Timing,
    announces: Announces,
    nominal_period: float,
    largest_distance: float,
) -> list[Complaint]:
    """What is wrong with reconfigurations.

    Args:
        reconfigurations: in their order in the scenario.
        satellites: by their names, each with what it has from the defaults.
        timing: of the flight.
        announces: what satellites send each other.
        nominal_period: about the time of one revolution, s.
        largest_distance: of a reference from the chief, m.
    """
    complaints: list[Complaint] = []
    present: dict[str, TargetSpec] = {}
    taken: dict[tuple[int, str], float] = {}
    for index, own in sorted(enumerate(reconfigurations), key=lambda numbered: numbered[1].at):
        field = ("reconfigurations", index)
        step = step_at(own.at, timing.step)
        if own.at >= timing.duration:
            sentence = f"at {own.at:g} s is not earlier than the flight's end at {timing.duration:g} s"
            complaints.append(((*field, "at"), sentence))
        if step < 1:
            sentence = f"at {own.at:g} s is the first step: give the satellites these targets themselves"
            complaints.append(((*field, "at"), sentence))
        for row, target in enumerate(own.targets):
            whole = target.target.over(present.get(target.satellite, TargetSpec()))
            found = target_complaints(
                target.satellite, whole, satellites, announces, nominal_period, largest_distance
            )
            present[target.satellite] = whole
            if (step, target.satellite) in taken:
                found.append(f"{target.satellite} has another target at this step")
            taken[step, target.satellite] = own.at
            complaints += [((*field, "targets", row), sentence) for sentence in found]
    return complaints


def target_complaints(
    name: str,
    target: TargetSpec,
    satellites: Mapping[str, SatelliteSpec],
    announces: Announces,
    nominal_period: float,
    largest_distance: float,
) -> list[str]:
    """Why a satellite cannot have a target; a sentence for each reason.

    Args:
        name: of the satellite.
        target: with what it leaves out from the target before.
        satellites: by their names, each with what it has from the defaults.
        announces: what satellites send each other.
        nominal_period: about the time of one revolution, s.
        largest_distance: of a reference from the chief, m.
    """
    satellite = satellites.get(name)
    if satellite is None:
        return [f"there is no satellite {name}; there are {', '.join(sorted(satellites))}"]
    if announces != "arc_length":
        return ["satellites that follow a neighbour have no targets of their own"]
    if any(isinstance(curve, InertialPointSpec) for curve in (satellite.curve, target.curve)):
        return [f"{name}: a satellite neither leaves nor reaches an inertial_point by a new target"]
    found = []
    watchers = [other for other, spec in satellites.items() if _points_at(spec, name)]
    if watchers:
        found.append(
            f"{', '.join(watchers)} {'points' if len(watchers) == 1 else 'point'} at {name} by "
            "the curve that the scenario gives it, so that it has to keep that"
        )
    if satellite.curve is None:
        return found
    try:
        curve, scale = target.flown(satellite.curve, satellite.scale)
    except ArithmeticError:
        # The check below names the curve.
        curve, scale = target.curve or satellite.curve, satellite.scale
    whole = satellite.model_copy(update={"curve": curve, "scale": scale})
    singular = [sentence for _, sentence in singular_references([whole], nominal_period)]
    if target.curve is not None and not singular:
        far = beyond_distance(whole, largest_distance)
        singular = [far] if far else []
    return [*found, *singular]


def _points_at(satellite: SatelliteSpec, name: str) -> bool:
    """Whether a satellite points at another one."""
    pointing = None if satellite.attitude is None else satellite.attitude.pointing
    return isinstance(pointing, SatellitePointingSpec) and pointing.target == name
