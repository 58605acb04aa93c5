# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of a formation as messages that RViz and Foxglove draw.

Poses, paths and transforms are in metres, in the frame of the flight. Markers may have another scale, since
tools made for rooms do not show 100 km well; they are then in a frame of their own, to which no transform
leads: a transform has no scale.
"""

from collections.abc import Iterable, Sequence

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, PoseStamped, Quaternion, Transform, TransformStamped, Vector3
from geometry_msgs.msg import Pose as PoseMessage
from nav_msgs.msg import Path
from std_msgs.msg import ColorRGBA, Header
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from satform.communication import topic_table
from satform.communication.sim_time import Stamps
from satform.display.scene import LinkView, Picture, Pose, SatelliteView
from satform.display.shapes import Colour
from satform.numeric.elementwise import Array

MARKER_FRAMES = {1.0: topic_table.FRAME, 1e-3: f"{topic_table.FRAME}_km"}
"""Frames of the markers by the length in them of one metre."""

_SCALED_FRAME = f"{topic_table.FRAME}_scaled"
"""Frame of markers of any other scale."""

_DIAMETER, _ARROW, _TEXT, _LINE = 0.04, 0.16, 0.07, 0.006
"""Sizes of a satellite, its heading, its name and of lines, per extent of the formation."""


class MarkerMessages:
    """Turns pictures into messages that are stamped in simulated time."""

    def __init__(self, stamps: Stamps, scale: float, extent: float, namespace: str = "/") -> None:
        """Messages for one display.

        Args:
            stamps: of the scenario's steps.
            scale: length in the markers of one metre.
            extent: of the formation, m, by which sizes are chosen.
            namespace: of the formation, with which the names of the satellites' frames begin.
        """
        self._stamps = stamps
        self._scale = scale
        self._marker_frame = MARKER_FRAMES.get(scale, _SCALED_FRAME)
        self._prefix = f"{namespace.strip('/')}/" if namespace.strip("/") else ""
        self._size = extent * scale
        # Desired orbits never change, and making their points costs as much as all else.
        self._orbits: dict[str, list[Point]] = {}

    def pose(self, seen: Pose) -> PoseStamped:
        """Where a satellite was seen, at the time at which it was there."""
        pose = PoseMessage(position=_point(seen.position), orientation=_quaternion(seen))
        return PoseStamped(header=self._header(seen.step), pose=pose)

    def transforms(self, picture: Picture) -> TFMessage:
        """From the formation's frame to each satellite's own, at the time at which it was there."""
        return TFMessage(transforms=[self._transform(view) for view in picture.satellites])

    def _transform(self, view: SatelliteView) -> TransformStamped:
        x, y, z = view.pose.position.tolist()
        return TransformStamped(
            header=self._header(view.pose.step),
            child_frame_id=f"{self._prefix}{view.name}",
            transform=Transform(translation=Vector3(x=x, y=y, z=z), rotation=_quaternion(view.pose)),
        )

    def path(self, view: SatelliteView) -> Path:
        """Where a satellite has been, the oldest pose first."""
        poses = [self.pose(seen) for seen in view.trail]
        return Path(header=self._header(view.pose.step), poses=poses)

    def markers(self, picture: Picture) -> MarkerArray:
        """Satellites with names, headings, trails and desired orbits, and the edges of the graph."""
        markers: list[Marker] = []
        for number, view in enumerate(picture.satellites):
            markers += self._satellite(number, view)
        return MarkerArray(markers=[*markers, self._links(picture)])

    def _satellite(self, number: int, view: SatelliteView) -> Iterable[Marker]:
        now, size = view.pose, self._size
        at = self._pose(now)
        ball = self._marker("satellites", number, Marker.SPHERE, now.step, view.colour)
        ball.pose = at
        ball.scale.x = ball.scale.y = ball.scale.z = _DIAMETER * size
        arrow = self._marker("headings", number, Marker.ARROW, now.step, view.colour)
        arrow.pose = at
        arrow.scale.x, arrow.scale.y, arrow.scale.z = _ARROW * size, _LINE * 2 * size, _LINE * 4 * size
        name = self._marker("names", number, Marker.TEXT_VIEW_FACING, now.step, (1.0, 1.0, 1.0, 1.0))
        name.text = view.name
        name.scale.z = _TEXT * size
        name.pose.position = self._point(now.position)
        name.pose.position.z += _TEXT * size
        been = [self._point(seen.position) for seen in view.trail]
        trail = self._line("trails", number, now.step, view.colour, been)
        if view.name not in self._orbits:
            self._orbits[view.name] = [self._point(point) for point in view.orbit]
        faint = (*view.colour[:3], 0.35)
        orbit = self._line("orbits", number, now.step, faint, self._orbits[view.name])
        return ball, arrow, name, trail, orbit

    def _links(self, picture: Picture) -> Marker:
        marker = self._marker("links", 0, Marker.LINE_LIST, picture.step, (1.0, 1.0, 1.0, 1.0))
        marker.scale.x = _LINE * self._size
        if not picture.links:
            # RViz complains of a list of lines without a line.
            marker.action = Marker.DELETE
        for link in picture.links:
            marker.points += self._ends(link)
            marker.colors += [_colour(link.colour)] * 2
        return marker

    def _ends(self, link: LinkView) -> list[Point]:
        return [self._point(link.start), self._point(link.end)]

    def _line(
        self, namespace: str, number: int, step: int, colour: Colour, points: Sequence[Point]
    ) -> Marker:
        marker = self._marker(namespace, number, Marker.LINE_STRIP, step, colour)
        marker.scale.x = _LINE * self._size
        if len(points) < 2:
            marker.action = Marker.DELETE
        else:
            marker.points = points
        return marker

    def _marker(self, namespace: str, number: int, kind: int, step: int, colour: Colour) -> Marker:
        header = self._header(step, self._marker_frame)
        marker = Marker(header=header, ns=namespace, id=number, type=kind, action=Marker.ADD)
        marker.pose.orientation.w = 1.0
        marker.color = _colour(colour)
        return marker

    def _pose(self, seen: Pose) -> PoseMessage:
        return PoseMessage(position=self._point(seen.position), orientation=_quaternion(seen))

    def _point(self, position: Array) -> Point:
        return _point(position * self._scale)

    def _header(self, step: int, frame: str = topic_table.FRAME) -> Header:
        seconds, nanoseconds = self._stamps.at(step)
        return Header(stamp=Time(sec=seconds, nanosec=nanoseconds), frame_id=frame)


def _point(position: Array) -> Point:
    x, y, z = position.tolist()
    return Point(x=x, y=y, z=z)


def _quaternion(seen: Pose) -> Quaternion:
    x, y, z, w = seen.orientation.tolist()
    return Quaternion(x=x, y=y, z=z, w=w)


def _colour(colour: Colour) -> ColorRGBA:
    red, green, blue, opacity = colour
    return ColorRGBA(r=red, g=green, b=blue, a=opacity)
