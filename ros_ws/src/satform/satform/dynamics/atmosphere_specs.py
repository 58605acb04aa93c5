# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Specifications of the atmospheres that drag may be computed with."""

from typing import Annotated, Literal

from pydantic import Field

from satform.common.spec import Spec


class HarrisPriesterSpec(Spec):
    """Harris-Priester, 100 to 1000 km: a table for mean solar activity (F10.7 of 150), which is fixed."""

    kind: Literal["harris_priester"] = "harris_priester"
    exponent: Annotated[float, Field(ge=2.0, le=6.0)] = 6.0
    """Of the cosine of half the angle to the density's bulge: 2 for low inclinations, 6 for polar orbits."""


class Nrlmsise00Spec(Spec):
    """NRLMSISE-00 at constant solar and geomagnetic activity."""

    kind: Literal["nrlmsise00"] = "nrlmsise00"
    f107: Annotated[float, Field(ge=50.0, le=400.0)] = 150.0
    """Solar flux at 10.7 cm, of the day and of its mean over 81 days [1e-22 W/(m^2 Hz)]: 70 at the minimum
    of the solar cycle, 150 on the mean, 230 at its maximum."""
    ap: Annotated[float, Field(ge=0.0, le=400.0)] = 15.0
    """Geomagnetic index Ap: 4 when quiet, 15 on the mean, above 100 in a storm."""
