"""The frames of a lab: of the stage, in which the task is written, and of the needle at its entry.

The origin of the needle's frame is the entry. Its z axis is the direction of insertion there, its
x axis the bevel direction. Poses of the needle, in any frame, have the same axes: z ahead, x
towards the bevel. Everything is in mm; messages are turned into mm before they come here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from ntagen.drive.viewing import quaternion
from ntagen.errors import DeviceError
from ntagen.needle.vectors import cross, dot, rotate, subtract
from ntagen.openigtlink.messages import Columns, Points, Position, turned
from ntagen.openigtlink.messages import Transform as Matrix
from ntagen.scene import Pose, Vector
from ntagen.units import deg_from_rad
from ntagen.values import dataclass

Quaternion = tuple[float, float, float, float]
"""A rotation as x, y, z, w."""

_GUIDE_DEG: Final = 5.0
"""The shaft that a stage reports may be so far from the direction of insertion; ours."""


def axes_of(pose: Pose) -> tuple[Vector, Vector, Vector]:
    """The axes x, y and z of a pose of the needle."""
    return pose.bevel, cross(pose.heading, pose.bevel), pose.heading


def quaternion_of(axes: tuple[Vector, Vector, Vector]) -> Quaternion:
    """The rotation that leads to these axes."""
    x, _, z = axes
    return quaternion(Pose((0.0, 0.0, 0.0), x, z))


@dataclass(frozen=True, slots=True)
class NeedleFrame:
    """The frame of the needle.

    Attributes:
        entry: The pose of the needle at the entry, in the frame of the stage.
    """

    entry: Pose

    def to_needle(self, point_mm: Vector) -> Vector:
        """A place of the stage's frame in that of the needle."""
        return self.turned_to_needle(subtract(point_mm, self.entry.position_mm))

    def turned_to_needle(self, direction: Vector) -> Vector:
        """A direction of the stage's frame in that of the needle."""
        x, y, z = axes_of(self.entry)
        return (dot(x, direction), dot(y, direction), dot(z, direction))

    def to_stage(self, point_mm: Vector) -> Vector:
        """A place of the needle's frame in that of the stage."""
        x, y, z = self.turned_to_stage(point_mm)
        a, b, c = self.entry.position_mm
        return (a + x, b + y, c + z)

    def turned_to_stage(self, direction: Vector) -> Vector:
        """A direction of the needle's frame in that of the stage."""
        rows = zip(*axes_of(self.entry), strict=True)
        x, y, z = (dot((row[0], row[1], row[2]), direction) for row in rows)
        return (x, y, z)

    def pose_to_needle(self, pose: Pose) -> Pose:
        """A pose of the stage's frame in that of the needle."""
        return Pose(
            self.to_needle(pose.position_mm),
            self.turned_to_needle(pose.heading),
            self.turned_to_needle(pose.bevel),
        )

    def measured(self, position_mm: Vector, rotation: Quaternion) -> Matrix:
        """A pose of the needle's frame as a matrix in that of the stage."""
        x, y, z, origin = turned(rotation, position_mm)
        turn = self.turned_to_stage
        return Matrix((turn(x), turn(y), turn(z), self.to_stage(origin)))

    def at_guide(self, depth_mm: float, roll_rad: float) -> tuple[Vector, Quaternion]:
        """How a stage says that the needle is inserted and rolled, in the stage's frame.

        The place is where the tip of a straight needle would be.
        """
        x, y, z = axes_of(self.entry)
        axes = (rotate(x, z, roll_rad), rotate(y, z, roll_rad), z)
        return self.to_stage((0.0, 0.0, depth_mm)), quaternion_of(axes)

    def of_guide(self, matrix: Columns, near_rad: float) -> tuple[float, float]:
        """The depth in mm and the roll in rad that a stage reports, the inverse of `at_guide`.

        Args:
            matrix: The pose in the stage's frame.
            near_rad: A roll that is not far away: whole turns are not in a pose.

        Raises:
            DeviceError: It points elsewhere, or is not a number.
        """
        x, _, z, origin = matrix
        if not all(math.isfinite(number) for column in matrix for number in column):
            raise DeviceError("the stage reports a pose that is not a number")
        own = self.turned_to_needle(x)
        heading = self.turned_to_needle(z)
        off_deg = deg_from_rad(math.acos(max(-1.0, min(1.0, heading[2]))))
        if off_deg > _GUIDE_DEG:
            raise DeviceError(
                f"the stage reports a shaft that is {off_deg:.0f} deg from the direction of "
                f"insertion of the task; {_GUIDE_DEG:g} deg is allowed\n"
                "hint: its z axis must be the shaft; check the frame and `heading` of the task"
            )
        roll_rad = math.atan2(own[1], own[0])
        roll_rad += 2.0 * math.pi * round((near_rad - roll_rad) / (2.0 * math.pi))
        return self.to_needle(origin)[2], roll_rad


def content_of(
    position_mm: Vector, rotation: Quaternion, needle: NeedleFrame | None
) -> Position | Matrix:
    """A measured pose for `ntagen.tracking.mount.tip_of`.

    Args:
        position_mm: Where it is.
        rotation: How it is turned; all zeros say that nobody knows.
        needle: The frame of the needle if the pose is in it; None if it is in another one.
    """
    if needle is not None:
        if not any(rotation):
            return Position(needle.to_stage(position_mm))
        return needle.measured(position_mm, rotation)
    return Position(position_mm, rotation if any(rotation) else None)


def shape_of(places_mm: Sequence[Vector], needle: NeedleFrame | None) -> Points:
    """A measured shape for `ntagen.tracking.live`.

    Args:
        places_mm: Places along the needle, from its base to its tip.
        needle: The frame of the needle if they are in it; None if they are in another one.
    """
    if needle is None:
        return Points(tuple(places_mm))
    return Points(tuple(needle.to_stage(place) for place in places_mm))
