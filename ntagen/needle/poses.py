"""Many poses at once, as arrays, with the closed forms of `ntagen.needle.kinematics`."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from ntagen.scene import Pose
from ntagen.values import dataclass

_Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Poses:
    """Poses as rows: positions in mm, headings and bevels as unit vectors."""

    position: _Array
    heading: _Array
    bevel: _Array

    @staticmethod
    def of(poses: Iterable[Pose]) -> Poses:
        """These poses."""
        vectors = [(one.position_mm, one.heading, one.bevel) for one in poses]
        rows = np.array(vectors, dtype=np.float64).reshape(-1, 3, 3)
        return Poses(rows[:, 0], rows[:, 1], rows[:, 2])

    def at(self, rows: NDArray[np.intp]) -> Poses:
        """Those of these rows."""
        return Poses(self.position[rows], self.heading[rows], self.bevel[rows])

    def rolled(self, angle_rad: _Array) -> Poses:
        """The poses after rolls; see `ntagen.needle.kinematics.roll`."""
        cosine, sine = np.cos(angle_rad)[:, None], np.sin(angle_rad)[:, None]
        turned = cosine * self.bevel + sine * np.cross(self.heading, self.bevel)
        bevel = np.where(angle_rad[:, None] == 0.0, self.bevel, turned)
        return Poses(self.position, self.heading, bevel)

    def pushed(self, radius_mm: float | _Array, length_mm: _Array) -> Poses:
        """The poses after pushes, with one radius or one for each; see `kinematics.push`."""
        turn = length_mm / radius_mm
        cosine, sine = np.cos(turn)[:, None], np.sin(turn)[:, None]
        return Poses(
            self.places(radius_mm, length_mm),
            cosine * self.heading - sine * self.bevel,
            cosine * self.bevel + sine * self.heading,
        )

    def places(self, radius_mm: float | _Array, length_mm: float | _Array) -> _Array:
        """The places after pushes."""
        half = 0.5 * (length_mm / radius_mm)
        chord = length_mm * np.sinc(half / math.pi)
        ahead, aside = (chord * np.cos(half))[:, None], (chord * np.sin(half))[:, None]
        return np.asarray(self.position + ahead * self.heading - aside * self.bevel)

    def away(self, middles: _Array) -> _Array:
        """The distance of each position to each point."""
        return lengths(self.position[:, None] - middles)


def lengths(vectors: _Array) -> _Array:
    """The length of each vector."""
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", vectors, vectors)))
