# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The typed model of a scenario file. SI units and radians; nothing unknown is accepted."""

import hashlib
import re
from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError, ValidationInfo, model_validator

from satform.common.spec import Spec, require_consistent
from satform.files.named_file import BY_CONTENT, with_copies
from satform.scenario.consistency import consistency_complaints
from satform.scenario.definition import ScenarioDefinition
from satform.scenario.parts import SatelliteFields
from satform.scenario.satellite_start import chief_complaints, without_chief
from satform.scenario.variation import refusal, varied

_CHANNELS: Any = {"links": {"default": {"channel"}, "edges": {"__all__": {"channel"}}}}
"""Fields of links that are radio or optical ones."""

_NOT_IN_YAML = re.compile("[\x7f-\x9f\u2028\u2029\ufeff\ufffe\uffff]")
"""Characters that stand in JSON as they are, but not in YAML, which reads it otherwise as its own."""


class _RefusedInSentences(type(Spec)):  # type: ignore[misc]
    """Class of a model whose constructor raises `ScenarioError` instead of pydantic's own error."""

    def __call__(cls, /, **fields: Any) -> Any:
        try:
            return super().__call__(**fields)
        except ValidationError as error:
            raise refusal(cls, fields, error.errors(include_url=False)) from None


class Scenario(ScenarioDefinition, metaclass=_RefusedInSentences):
    """A formation, its flight and what is expected of it. A run is a pure function of this."""

    @model_validator(mode="after")
    def _about_the_chief(self) -> "Scenario":
        if self.orbit.chief is not None:
            require_consistent(chief_complaints(self.dynamics))
            # All who ask the truth model for chief and date find those of the orbit.
            about = self.dynamics.about(self.orbit.chief.orbit, self.orbit.chief.time_zero)
            self.__dict__["dynamics"] = about
        return self

    @model_validator(mode="after")
    def _consistent(self, info: ValidationInfo) -> "Scenario":
        recorded = bool(getattr(info.context, "recorded", False))
        require_consistent(consistency_complaints(self, recorded=recorded))
        return self

    def with_(self, changes: Mapping[str, Any] | None = None, /, **fields: Any) -> "Scenario":
        """This scenario with some fields set to other values, checked like a file.

        Args:
            changes: values by the path of a field as messages print it, such as `{"timing.step": 0.5}`,
                `{"satellites[sat1].scale": 2.0}`, or `{"satellites[*].controller.boundary_layer": 1e-3}` for
                all satellites.
            **fields: whole fields of the scenario, such as `seed=3` or `graph=RingSpec()`.

        Returns:
            A new scenario. Where the flight became shorter, what is expected, breaks or changes beyond its
            new end is left out.

        Raises:
            ScenarioError: a path leads nowhere, or the changed scenario cannot fly; all problems at once.
        """
        return varied(type(self), self.to_json(), self.files(), {**(changes or {}), **fields})

    def __repr__(self) -> str:
        count, timing = len(self.satellites), self.timing
        satellites = "1 satellite" if count == 1 else f"{count} satellites"
        dynamics = getattr(self.dynamics, "kind", type(self.dynamics).__name__)
        return f"<Scenario {self.name}: {satellites}, {dynamics}, {timing.steps} steps of {timing.step:g} s>"

    __str__ = __repr__

    def to_json(self) -> str:
        """The scenario as JSON text, from which the same scenario is read again.

        Files that it names stand there by the names of their copies, the keys of `files`.
        """
        text, _ = with_copies(self, indent=1, exclude_unset=True)
        return _NOT_IN_YAML.sub(lambda found: f"\\u{ord(found[0]):04x}", text)

    def files(self) -> dict[str, bytes]:
        """Content of the files that the scenario names, by the names of their copies."""
        return with_copies(self, exclude_unset=True)[1]

    def digest(self) -> str:
        """SHA-256 of the scenario's meaning: the same for two files that describe the same run."""
        satellites = tuple(self.satellite(index) for index in range(len(self.satellites)))
        parts = {"satellites": satellites, "satellite_defaults": SatelliteFields()}
        # What follows from the orbit is counted with the orbit: its last digits may differ among processors.
        explicit = self.model_copy(update={**parts, "dynamics": without_chief(self.dynamics, self.orbit)})
        links = () if self.links is None else (self.links.default, *self.links.edges)
        without_channel = not any(link.channel is not None for link in links)
        omitted = {"sensors", "navigation"}
        without_sensors = {
            index: {"external": True}
            | {name: True for name in omitted if not getattr(satellite, name)}
            | ({} if satellite.estimates_attitude else {"attitude": {"filter"}})
            for index, satellite in enumerate(satellites)
        }
        without_start = [index for index, satellite in enumerate(satellites) if satellite.start is None]
        # Where the parts run does not change what is flown, nor what is not judged what is judged; nor
        # does it matter that an orbit was allowed, who looks on from the ground, or that a scenario could say
        # more and does not.
        return hashlib.sha256(
            explicit.model_dump_json(
                exclude={
                    "hosts": True,
                    "omitted_expectations": True,
                    "orbit": {"allow_below_surface", *(() if self.orbit.chief else ("chief",))},
                    "satellites": {
                        index: absent | ({"start": True} if index in without_start else {})
                        for index, absent in without_sensors.items()
                    },
                    "satellite_defaults": omitted,
                    "external_timeout": True,
                    "stations": True,
                    "publish_orbits": True,
                    "publish_sensor_messages": True,
                    **({} if self.reconfigurations else {"reconfigurations": True}),
                    **(_CHANNELS if self.links is not None and without_channel else {}),
                    "line_of_sight_margin": True,
                },
                context=BY_CONTENT,
            ).encode()
        ).hexdigest()
