"""Messages of ROS 2 from plain values, and back; lengths change their unit here."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Final

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, PointStamped, PoseArray, PoseStamped, WrenchStamped
from geometry_msgs.msg import Pose as PoseMessage
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker as MarkerMessage
from visualization_msgs.msg import MarkerArray

from ntagen.ros.frames import Quaternion, axes_of, quaternion_of
from ntagen.ros.shown import Marker
from ntagen.scene import Pose, Vector

_S_PER_NS: Final = 1e-9
_KINDS: Final = {
    "sphere": MarkerMessage.SPHERE,
    "line": MarkerMessage.LINE_STRIP,
    "triangles": MarkerMessage.TRIANGLE_LIST,
}


def header(stamp: Time, frame: str) -> Header:
    """The head of a message."""
    return Header(stamp=stamp, frame_id=frame)


def point(place_mm: Vector, mm_per_unit: float) -> Point:
    """A place."""
    x, y, z = (float(number) / mm_per_unit for number in place_mm)
    return Point(x=x, y=y, z=z)


def pose(position_mm: Vector, rotation: Quaternion, mm_per_unit: float) -> PoseMessage:
    """A pose."""
    message = PoseMessage(position=point(position_mm, mm_per_unit))
    turn = message.orientation
    turn.x, turn.y, turn.z, turn.w = map(float, rotation)
    return message


def needle_pose(of: Pose, mm_per_unit: float) -> PoseMessage:
    """A pose of the needle: z ahead, x towards the bevel."""
    return pose(of.position_mm, quaternion_of(axes_of(of)), mm_per_unit)


def stamped_pose(head: Header, inner: PoseMessage) -> PoseStamped:
    """A pose with its head."""
    return PoseStamped(header=head, pose=inner)


def stamped_point(head: Header, place_mm: Vector, mm_per_unit: float) -> PointStamped:
    """A place with its head."""
    return PointStamped(header=head, point=point(place_mm, mm_per_unit))


def pose_array(head: Header, poses: Sequence[Pose], mm_per_unit: float) -> PoseArray:
    """Poses of the needle with their head."""
    return PoseArray(header=head, poses=[needle_pose(one, mm_per_unit) for one in poses])


def wrench(head: Header, force_n: float) -> WrenchStamped:
    """A force along z."""
    message = WrenchStamped(header=head)
    message.wrench.force.z = float(force_n)
    return message


def marker_array(head: Header, markers: Iterable[Marker], mm_per_unit: float) -> MarkerArray:
    """Markers for RViz, whose unit is what the numbers say."""
    return MarkerArray(markers=[_marker(head, one, mm_per_unit) for one in markers])


def _marker(head: Header, of: Marker, mm_per_unit: float) -> MarkerMessage:
    message = MarkerMessage(header=head, ns=of.name, id=0)
    message.pose.orientation.w = 1.0
    if of.shape == "nothing":
        message.action = MarkerMessage.DELETE
        return message
    message.type = _KINDS[of.shape]
    message.action = MarkerMessage.ADD
    red, green, blue, alpha = map(float, of.colour)
    message.color = ColorRGBA(r=red, g=green, b=blue, a=alpha)
    size = of.size_mm / mm_per_unit
    match of.shape:
        case "sphere":
            message.pose.position = point(of.center_mm, mm_per_unit)
            message.scale.x = message.scale.y = message.scale.z = size
        case "line":
            message.scale.x = size
        case _:
            message.scale.x = message.scale.y = message.scale.z = 1.0
    message.points = [point(place_mm, mm_per_unit) for place_mm in of.points_mm]
    return message


def diagnostics(
    stamp: Time, level: int, text: str, values: Iterable[tuple[str, str]]
) -> DiagnosticArray:
    """The state of the driver: level 0 is well, 1 a warning, 2 an error."""
    status = DiagnosticStatus(name="ntagen: driver", hardware_id="needle", message=text)
    status.level = bytes([level])
    status.values = [KeyValue(key=key, value=value) for key, value in values]
    return DiagnosticArray(header=header(stamp, ""), status=[status])


def place_of(message: Any, mm_per_unit: float) -> Vector:  # noqa: ANN401  a Point or a Vector3
    """The place in a message, in mm."""
    return (message.x * mm_per_unit, message.y * mm_per_unit, message.z * mm_per_unit)


def rotation_of(message: Any) -> Quaternion:  # noqa: ANN401  a Quaternion of ROS
    """The rotation in a message."""
    return (message.x, message.y, message.z, message.w)


def stamp_of(head: Header) -> float | None:
    """When the sender made a message, in seconds; None if it does not say."""
    if not head.stamp.sec and not head.stamp.nanosec:
        return None
    return float(head.stamp.sec + _S_PER_NS * head.stamp.nanosec)
