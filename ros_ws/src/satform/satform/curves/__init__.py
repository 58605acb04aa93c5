"""Closed relative orbits: position, arc length and Frenet frame as functions of an angle.

A curve is parametrised by an angle theta that increases without bound lap after lap. Arc length l
is zero at theta = 0 and grows with theta by one perimeter a lap. All positions are in the chief's
LVLH frame.
"""

from satform.curves.curve import Curve, CurvePoint, FixedPoint, QuickCurve
from satform.curves.ellipse import Ellipse, ellipse
from satform.curves.specs import CircleSpec, CurveSpec, EllipseSpec, FixedPointSpec

__all__ = [
    "CircleSpec",
    "Curve",
    "CurvePoint",
    "CurveSpec",
    "Ellipse",
    "EllipseSpec",
    "FixedPoint",
    "FixedPointSpec",
    "QuickCurve",
    "ellipse",
]
