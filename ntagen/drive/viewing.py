"""Messages of a run that common viewers can draw: Foxglove's schemas.

The needle is written twice, because no viewer draws everything: as scene entities and transforms,
and as poses and points. Everything is in metres, as viewers expect, in the frame ``world``, whose
axes are those of the environment file.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any, Final, cast

from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.Pose_pb2 import Pose as PoseMessage
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntityDeletion_pb2 import SceneEntityDeletion
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.message import Message
from google.protobuf.timestamp_pb2 import Timestamp

from ntagen.drive.records import (
    Answered,
    CutShort,
    Ended,
    Estimated,
    Followed,
    Forgotten,
    Found,
    Guaranteed,
    Learned,
    Measured,
    Predicted,
    Promised,
    Record,
    Relied,
    Transition,
    Visited,
)
from ntagen.drive.states import Event
from ntagen.drive.story import of_strategy, text_of
from ntagen.needle.kinematics import bending_axis
from ntagen.needle.path import sample_poses
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Pose, Region, RegionKind, Scene, Vector
from ntagen.shapes import Sphere, triangles

TOPICS: Final[dict[str, type[Message]]] = {
    "/tf": FrameTransforms,
    "/scene": SceneUpdate,
    "/needle/tip": PoseInFrame,
    "/needle/plan": PosesInFrame,
    "/needle/measured": PointCloud,
    "/log": Log,
}
"""The topics for viewers and their message types."""

ROUTINE: Final = frozenset({Event.ACTED.value, Event.AS_PREDICTED.value})
"""Events of every cycle, which have no line of text."""

_M_PER_MM: Final = 1e-3
_FRAME: Final = "world"
_PLAN_SPACING_MM: Final = 1.0
_COLOURS: Final = {
    "target": (0.16, 0.62, 0.29, 0.35),
    "critical": (0.78, 0.16, 0.24, 0.6),
    "detection": (0.91, 0.54, 0.05, 0.2),
    "unexplored": (0.36, 0.39, 0.45, 0.4),
    "safe": (0.25, 0.65, 0.63, 0.15),
}
_PLAN_COLOUR: Final = (0.12, 0.37, 0.75, 1.0)
_SHAFT_COLOUR: Final = (0.04, 0.15, 0.27, 1.0)
_SHAFT_SPACING_MM: Final = 1.0
_HIDDEN_ALPHA: Final = 0.15
"""Regions that the driver does not know are nearly transparent."""

Shown = Iterator[tuple[str, Message]]


def show_scene(scene: Scene) -> Shown:
    """The regions of a scene."""
    update = SceneUpdate()
    for region in scene.regions:
        _add_region(update, region, 0.0)
    yield "/scene", update


def show_plan(synthesis: Synthesis, time_s: float) -> Shown:
    """The best plan of a synthesis, as a line and as poses; without one the last plan vanishes."""
    if synthesis.best is None:
        yield "/scene", _without("plan", time_s)
        return
    poses = sample_poses(synthesis.best.plan.arcs(synthesis.scene.needle), _PLAN_SPACING_MM)
    message = PosesInFrame(timestamp=_stamp(time_s), frame_id=_FRAME, poses=map(_pose, poses))
    places = [pose.position_mm for pose in poses]
    yield "/scene", _line("plan", time_s, places, 2.0, _PLAN_COLOUR)
    yield "/needle/plan", message


def show_hidden(actual: Scene, told: Scene) -> Shown:
    """The regions that are there but that the driver does not know; only a simulation has them."""
    update = SceneUpdate()
    for region in actual.avoided:
        if region not in told.regions:
            _add_region(update, region, 0.0, prefix="hidden ")
    if update.entities:
        yield "/scene", update


class Shaft:
    """The needle in the tissue as a line through the places where its tip was, from the entry.

    The driver's prediction of a place counts more than the noisy measurement before it. What lies
    deeper than the tip is dropped, since the needle was pulled back.
    """

    def __init__(self, entry_mm: Vector) -> None:
        # Places with their depths, at least a spacing apart.
        self._points: list[tuple[float, Vector]] = [(0.0, entry_mm)]
        self._depth_mm = 0.0
        self._shown: list[tuple[float, Vector]] = []

    def show(self, record: Record, *, is_due: bool = True) -> Shown:
        """The line after a record, if it has changed by about a millimetre and is to be seen."""
        match record:
            case Measured():
                self._depth_mm = record.depth_mm
                while len(self._points) > 1 and self._points[-1][0] >= record.depth_mm:
                    self._points.pop()
                if record.depth_mm - self._points[-1][0] >= _SHAFT_SPACING_MM:
                    self._points.append((record.depth_mm, record.position_mm))
            case Predicted() | Estimated() if self._points[-1][0] == self._depth_mm > 0.0:
                self._points[-1] = (self._depth_mm, record.position_mm)
            case _:
                return
        if not is_due or self._points == self._shown:
            return
        self._shown = self._points.copy()
        places = [position_mm for _, position_mm in self._points]
        yield "/scene", _line("shaft", record.time_s, places, 4.0, _SHAFT_COLOUR)


def _line(
    name: str,
    time_s: float,
    places_mm: Sequence[Vector],
    thickness: float,
    colour: tuple[float, float, float, float],
) -> SceneUpdate:
    """A line through places, as an entity with this name."""
    update = SceneUpdate()
    entity = update.entities.add(id=name, frame_id=_FRAME, timestamp=_stamp(time_s))
    line = entity.lines.add(thickness=thickness, scale_invariant=True, color=_colour(colour))
    line.pose.orientation.w = 1.0
    for place in places_mm:
        x, y, z = (c * _M_PER_MM for c in place)
        line.points.add(x=x, y=y, z=z)
    return update


def show_record(record: Record) -> Shown:
    """The messages of a record for viewers."""
    match record:
        case Measured():
            yield "/needle/measured", _cloud(record)
        case Predicted() | Estimated():
            pose = _pose(Pose(record.position_mm, record.heading, record.bevel))
            stamp = _stamp(record.time_s)
            yield "/needle/tip", PoseInFrame(timestamp=stamp, frame_id=_FRAME, pose=pose)
            yield "/tf", _transform(pose, stamp)
        case Learned():
            update = SceneUpdate()
            ball = Sphere(record.center_mm, record.radius_mm)
            kind = cast(RegionKind, record.kind)
            _add_region(update, Region(record.name, kind, ball), record.time_s)
            yield "/scene", update
        case Forgotten():
            yield "/scene", _without(_id(record.kind, record.name), record.time_s)
    text = _text(record)
    if text:
        level = Log.WARNING if isinstance(record, Learned) else Log.INFO
        yield "/log", Log(timestamp=_stamp(record.time_s), level=level, name="ntagen", message=text)


def _text(record: Record) -> str:
    match record:
        case Transition() if record.event not in ROUTINE:
            return f"{record.state}: {record.event} -> {record.following}"
        case Learned():
            return f"learned {record.kind} region '{record.name}'"
        case CutShort():
            return f"{record.reason}: the push ended after {record.made_mm:.2f} mm"
        case Followed() | Guaranteed() | Promised():
            return of_strategy(record)
        case Relied():
            return record.text
        case Found() | Answered():
            return text_of(record) or ""
        case Visited():
            return f"reached target '{record.target}'"
        case Ended():
            return f"{record.outcome}: {record.reason}"
    return ""


def _add_region(
    update: Any,  # noqa: ANN401  the generated class has no fields for a type checker
    region: Region,
    time_s: float,
    prefix: str = "",
) -> None:
    """Adds a region: a sphere as such, any other shape as triangles."""
    entity = update.entities.add(
        id=prefix + _id(region.kind, region.name), frame_id=_FRAME, timestamp=_stamp(time_s)
    )
    colour = _COLOURS[region.kind]
    colour = (*colour[:3], _HIDDEN_ALPHA) if prefix else colour
    if isinstance(region.shape, Sphere):
        sphere = entity.spheres.add(color=_colour(colour))
        x, y, z = (c * _M_PER_MM for c in region.center_mm)
        sphere.pose.position.x, sphere.pose.position.y, sphere.pose.position.z = x, y, z
        sphere.pose.orientation.w = 1.0
        diameter = 2.0 * region.radius_mm * _M_PER_MM
        sphere.size.x = sphere.size.y = sphere.size.z = diameter
        return
    points, indices = triangles(region.shape)
    drawn = entity.triangles.add(color=_colour(colour), indices=indices)
    drawn.pose.orientation.w = 1.0
    for point in points * _M_PER_MM:
        drawn.points.add(x=float(point[0]), y=float(point[1]), z=float(point[2]))


def _without(entity: str, time_s: float) -> SceneUpdate:
    """The message that an entity is no more."""
    update = SceneUpdate()
    update.deletions.add(timestamp=_stamp(time_s), type=SceneEntityDeletion.MATCHING_ID, id=entity)
    return update


def _id(kind: str, name: str) -> str:
    """The id of a region's entity; a later one with the same id takes the place of the former."""
    return f"{kind} {name}"


def _cloud(record: Measured) -> PointCloud:
    cloud = PointCloud()
    cloud.CopyFrom(_point())
    cloud.timestamp.CopyFrom(_stamp(record.time_s))
    cloud.data = struct.pack("<4f", *(c * _M_PER_MM for c in record.position_mm), record.force_n)
    return cloud


@cache
def _point() -> PointCloud:
    """A cloud of one point, without its numbers."""
    names = ("x", "y", "z", "force_n")
    cloud = PointCloud(frame_id=_FRAME, point_stride=4 * len(names))
    cloud.pose.orientation.w = 1.0
    for index, name in enumerate(names):
        cloud.fields.add(name=name, offset=4 * index, type=PackedElementField.FLOAT32)
    return cloud


def _transform(pose: PoseMessage, stamp: Timestamp) -> FrameTransforms:
    message = FrameTransforms()
    message.transforms.add(
        timestamp=stamp,
        parent_frame_id=_FRAME,
        child_frame_id="tip",
        translation=pose.position,
        rotation=pose.orientation,
    )
    return message


def _pose(pose: Pose) -> PoseMessage:
    x, y, z = pose.position_mm
    qx, qy, qz, qw = quaternion(pose)
    return PoseMessage(
        position=Vector3(x=x * _M_PER_MM, y=y * _M_PER_MM, z=z * _M_PER_MM),
        orientation=Quaternion(x=qx, y=qy, z=qz, w=qw),
    )


def quaternion(pose: Pose) -> tuple[float, float, float, float]:
    """The rotation (x, y, z, w) from the world's axes to heading, bending axis and bevel.

    There are four formulas for it; the one that divides by the largest number is used (Shepperd,
    1978).
    """
    h, s, b = pose.heading, bending_axis(pose), pose.bevel
    squares = (
        h[0] - s[1] - b[2],
        s[1] - h[0] - b[2],
        b[2] - h[0] - s[1],
        h[0] + s[1] + b[2],
    )
    largest = max(range(4), key=lambda i: squares[i])
    # The products 4 q_i q_j, from sums and differences of the matrix's other elements.
    xy, xz, yz = h[1] + s[0], h[2] + b[0], s[2] + b[1]
    xw, yw, zw = s[2] - b[1], b[0] - h[2], h[1] - s[0]
    square = squares[largest] + 1.0
    rows = (
        (square, xy, xz, xw),
        (xy, square, yz, yw),
        (xz, yz, square, zw),
        (xw, yw, zw, square),
    )
    factor = 0.5 / float(square**0.5)
    x, y, z, w = (factor * value for value in rows[largest])
    return (x, y, z, w)


def _colour(rgba: tuple[float, float, float, float]) -> Color:
    red, green, blue, alpha = rgba
    return Color(r=red, g=green, b=blue, a=alpha)


def _stamp(time_s: float) -> Timestamp:
    nanoseconds = round(time_s * 1e9)
    return Timestamp(seconds=nanoseconds // 10**9, nanos=nanoseconds % 10**9)
