"""From what a tracker says of a tool to the pose of the needle's tip.

A tracker gives the pose of a tool: a sensor in the shaft, or markers on the hub. How the needle
lies in the tool's own frame is the `Mount`. Everything here is in the tracker's frame, in mm. A
matrix that no rigid tool can have is refused with its likely cause.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from ntagen.errors import DeviceError
from ntagen.needle.vectors import add, combine, cross, dot, norm, scale, unit
from ntagen.openigtlink.messages import Columns, Freedom, Points, Position, Tool, Transform, turned
from ntagen.openigtlink.samples import Pose
from ntagen.scene import Vector
from ntagen.shapes import UPRIGHT

AXES: Final = ("+x", "-x", "+y", "-y", "+z", "-z")

_TOLERANCE: Final = 1e-3
"""Columns may differ from unit length, and from right angles, by this; 32-bit numbers by 1e-7."""


@dataclass(frozen=True, slots=True)
class Mount:
    """How the needle lies in the tool's own frame.

    Attributes:
        axis: The axis of the tool that points in the direction of insertion.
        bevel: The axis that points in the bevel direction (`ntagen.scene`). `None` if the tracker
            does not see how the needle is rolled, as with five degrees of freedom.
        tip_mm: Where the tip is in the tool's frame.
    """

    axis: str = "+z"
    bevel: str | None = None
    tip_mm: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Tip:
    """What is known of the tip: always where it is, perhaps where it points."""

    position_mm: Vector
    heading: Vector | None
    bevel: Vector | None


def tip_of(pose: Pose, mount: Mount, device: str) -> Tip:
    """The needle's tip.

    Args:
        pose: What the tracker says of the tool.
        mount: How the needle lies in it.
        device: The tool's name, for messages.

    Raises:
        DeviceError: The pose is impossible, or has less than the mount needs.
    """
    freedom, columns = _known(pose, device)
    if freedom is Freedom.POSITION:
        if any(mount.tip_mm) or mount.bevel is not None:
            raise DeviceError(
                f"the tracker sends no orientation of '{device}', and the tip offset and the bevel "
                "need one\nhint: let the server send TRANSFORM, or leave out tip and bevel"
            )
        return Tip(columns[3], None, None)
    _require_rotation(columns, device)
    heading = _along(columns, mount.axis)
    if freedom is Freedom.HEADING:
        _require_heading_enough(mount, device)
    tip_mm = add(columns[3], _turned(columns, mount.tip_mm))
    if mount.bevel is None:
        return Tip(tip_mm, unit(heading), None)
    return Tip(tip_mm, unit(heading), unit(_along(columns, mount.bevel)))


def _known(pose: Pose, device: str) -> tuple[Freedom, Columns]:
    """How much is known of a pose, and its matrix."""
    match pose:
        case Position(position_mm, quaternion):
            freedom, columns = Freedom.POSITION, (*UPRIGHT, position_mm)
            if quaternion is not None:
                _require_finite(quaternion, device)
                freedom, columns = Freedom.POSE, _from_quaternion(quaternion, position_mm, device)
        case Points(positions_mm):
            freedom, columns = Freedom.POSITION, (*UPRIGHT, positions_mm[-1])
        case Tool():
            if not isinstance(pose.freedom, Freedom):
                raise DeviceError(
                    f"the tracker sends '{device}' as a tool of the type {pose.freedom}, which "
                    f"{pose.message} does not have\n"
                    "hint: let the server send a position or a pose of it, or name another device"
                )
            freedom, columns = pose.freedom, pose.columns
        case Transform():
            freedom, columns = Freedom.POSE, pose.columns
    checked = [columns[3]] if freedom is Freedom.POSITION else columns
    for column in checked:
        _require_finite(column, device)
    return freedom, columns


def _from_quaternion(
    quaternion: tuple[float, float, float, float], position_mm: Vector, device: str
) -> Columns:
    """The matrix of a unit quaternion x, y, z, w."""
    length = math.hypot(*quaternion)
    if abs(length - 1.0) > _TOLERANCE:
        raise DeviceError(
            f"the orientation of '{device}' is a quaternion of length {length:.4g}, not 1"
        )
    return turned(quaternion, position_mm)


def _require_finite(numbers: Sequence[float], device: str) -> None:
    if not all(map(math.isfinite, numbers)):
        raise DeviceError(
            f"the tracker reports {tuple(numbers)} for '{device}', which is not a number\n"
            "hint: is the tool in view?"
        )


def _require_rotation(columns: Columns, device: str) -> None:
    """Refuses a matrix that scales, shears or mirrors."""
    x, y, z, _ = columns
    lengths = [norm(axis) for axis in (x, y, z)]
    if max(abs(length - 1.0) for length in lengths) > _TOLERANCE:
        words = ", ".join(f"{length:.4g}" for length in lengths)
        raise DeviceError(
            f"the matrix of '{device}' is not a rotation: its columns have the lengths {words}\n"
            "hint: a tracker sends rigid transforms; is this a scaled one, or one in metres?"
        )
    if max(abs(dot(x, y)), abs(dot(y, z)), abs(dot(x, z))) > _TOLERANCE:
        raise DeviceError(
            f"the matrix of '{device}' is not a rotation: its columns are not at right angles"
        )
    if dot(cross(x, y), z) < 0.0:
        raise DeviceError(
            f"the matrix of '{device}' is not a rotation: it mirrors\n"
            "hint: the sign of an axis is wrong somewhere between tracker and server"
        )


def _require_heading_enough(mount: Mount, device: str) -> None:
    """Refuses a mount that needs more than one axis of a tool with five degrees of freedom."""
    across = [
        part for axis, part in zip("xyz", mount.tip_mm, strict=True) if axis not in mount.axis
    ]
    if mount.bevel is not None or any(across) or mount.axis[1] != "z":
        raise DeviceError(
            f"the tracker sees five degrees of freedom of '{device}', without its roll: only its z "
            "axis is known\nhint: use axis=+z or axis=-z, no bevel, and a tip on that axis"
        )


def _along(columns: Columns, axis: str) -> Vector:
    """One of the six axes of a tool."""
    column = columns["xyz".index(axis[1])]
    return scale(-1.0, column) if axis[0] == "-" else column


def _turned(columns: Columns, vector: Vector) -> Vector:
    x, y, z, _ = columns
    return add(combine(vector[0], x, vector[1], y), scale(vector[2], z))
