# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Ground stations of a scenario."""

import math
from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from satform.common.angle_text import OR_DEGREES
from satform.common.spec import Complaint, Spec
from satform.scenario.parts import Name

_QUARTER = 0.5 * math.pi


class StationSpec(Spec):
    """A ground station, by its geodetic coordinates on the WGS 84 ellipsoid."""

    name: Name
    """Of the station: lower case letters, digits and underscores."""
    latitude: Annotated[float, Field(ge=-_QUARTER, le=_QUARTER), OR_DEGREES]
    """Geodetic latitude [rad]."""
    longitude: Annotated[float, Field(ge=-math.tau, le=math.tau), OR_DEGREES]
    """East of Greenwich [rad]."""
    altitude: Annotated[float, Field(ge=-1e3, le=1e5)] = 0.0
    """Above the ellipsoid [m]."""
    elevation_mask: Annotated[float, Field(ge=-_QUARTER, lt=_QUARTER), OR_DEGREES] = 0.0
    """Elevation above which a satellite is in contact [rad]."""


def station_complaints(stations: Sequence[StationSpec]) -> list[Complaint]:
    """Names that two stations share."""
    names = [station.name for station in stations]
    return [
        (("stations", index, "name"), f"another station is called {name} too; every name has to be its own")
        for index, name in enumerate(names)
        if name in names[:index]
    ]
