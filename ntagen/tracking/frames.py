"""Frames of coordinates, and rigid transforms between them.

A frame is a name. Two names have a meaning: ``RAS`` (x to the patient's right, y anterior, z
superior) and ``LPS`` (left, posterior, superior), the frames of medical images. They differ by the
signs of x and y, that is by half a turn about z. Numbers alone never show which of the two they are
in, so it is always told and never guessed. All other names are frames of a tracker or a scene.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from ntagen.errors import InputError
from ntagen.needle.vectors import add, dot
from ntagen.scene import Vector

RAS: Final = "RAS"
LPS: Final = "LPS"
ANATOMICAL: Final = (RAS, LPS)

Rows = tuple[Vector, Vector, Vector]
"""The rows of a 3 x 3 matrix."""


def frame_named(text: str) -> str:
    """The frame that a user names; the words RAS and LPS may be in small letters.

    Raises:
        InputError: The name is empty.
    """
    name = text.strip()
    if not name:
        raise InputError("a frame needs a name\nhint: RAS, LPS, or a name of your own")
    return name.upper() if name.upper() in ANATOMICAL else name


def flipped(point: Vector) -> Vector:
    """A point or direction in LPS that was in RAS, or the other way round."""
    return (-point[0], -point[1], point[2])


@dataclass(frozen=True, slots=True)
class Transform:
    """A rigid transform, from one frame to another.

    Attributes:
        source: The frame of the points that it takes.
        target: The frame of the points that it gives.
        rotation: The rows of its rotation.
        translation_mm: Its translation.
    """

    source: str
    target: str
    rotation: Rows
    translation_mm: Vector

    def point(self, point_mm: Vector) -> Vector:
        """A position in the frame `target`."""
        return add(self.direction(point_mm), self.translation_mm)

    def direction(self, vector: Vector) -> Vector:
        """A direction in the frame `target`."""
        x, y, z = self.rotation
        return (dot(x, vector), dot(y, vector), dot(z, vector))

    def between(self, source: str, target: str) -> Transform:
        """The same transform between other frames.

        Raises:
            InputError: A frame would have to be guessed: only RAS and LPS are turned into each
                other.
        """
        rotation, translation_mm = self.rotation, self.translation_mm
        if _differ(self.source, source):
            # The rows are those of R * half turn.
            rotation = (flipped(rotation[0]), flipped(rotation[1]), flipped(rotation[2]))
        if _differ(self.target, target):
            x, y, z = rotation
            rotation = ((-x[0], -x[1], -x[2]), (-y[0], -y[1], -y[2]), z)
            translation_mm = flipped(translation_mm)
        return Transform(source, target, rotation, translation_mm)


IDENTITY: Final = Transform(
    "scene", "scene", ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), (0.0, 0.0, 0.0)
)
"""What is used without a registration: the tracker measures in the scene's frame."""


def _differ(has: str, wanted: str) -> bool:
    """Whether a half turn lies between two frames.

    Raises:
        InputError: They are neither equal nor RAS and LPS.
    """
    if has == wanted:
        return False
    if has in ANATOMICAL and wanted in ANATOMICAL:
        return True
    raise InputError(
        f"the points are in the frame {has}, and nothing says how {wanted} lies in it\n"
        "hint: only RAS and LPS can be turned into each other"
    )
