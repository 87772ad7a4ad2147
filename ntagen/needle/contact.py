"""Where a region lies that was felt: the ball that explains all contacts, and all silence.

At a contact the tip is at a known distance from a region's surface. So each contact tells how far
its centre is from the tip, and each place that the tip passed tells how far it is at least. One
contact leaves the direction open: then the region is assumed straight ahead. A second one on
another side of the same region leaves a circle, a third one two points; the channels that were cut
exclude most of the rest. The best ball is found by least squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ntagen.scene import Vector

_Array = NDArray[np.float64]

_FELT_STD_MM: Final = 0.3
"""How well the distance at a contact is known: a push, and the noise of the force."""

_AHEAD_STD_MM: Final = 4.0
"""How well a region lies straight ahead."""

_RADIUS_STD_MM: Final = 1.5
"""How well the radius of a region is guessed."""

_EXPLAINED_MM: Final = 1.0
"""A ball explains contacts and channels if no distance is wrong by more than this."""

_LEAST_RADIUS_MM: Final = 0.5


@dataclass(frozen=True, slots=True)
class Assumed:
    """What is assumed of regions that nobody told.

    Attributes:
        margin_mm: The force begins to rise at this distance from the surface.
        clearance_mm: The needle passes them at this distance or more.
        radius_mm: The radius of one that was felt once.
    """

    margin_mm: float
    clearance_mm: float
    radius_mm: float


@dataclass(frozen=True, slots=True)
class Contact:
    """A place from which the needle did not go on, since the force rose.

    Attributes:
        position_mm: The tip.
        heading: Its direction of travel.
        away_mm: Its distance from the surface of the region.
    """

    position_mm: Vector
    heading: Vector
    away_mm: float


@dataclass(frozen=True, slots=True)
class Ball:
    """Where a region is assumed.

    Attributes:
        center_mm: Its centre.
        radius_mm: Its radius.
        center_std_mm: The standard deviation of the centre in the direction that is known worst.
    """

    center_mm: Vector
    radius_mm: float
    center_std_mm: float


def ball_of(contacts: Sequence[Contact], passed: Sequence[Vector], assumed: Assumed) -> Ball | None:
    """The ball that explains these contacts and these places; None without one.

    Args:
        contacts: One or more contacts with the same region.
        passed: Places that the tip passed.
        assumed: What is assumed of the region.
    """
    points = np.array([one.position_mm for one in contacts])
    headings = np.array([one.heading for one in contacts])
    away_mm = np.array([one.away_mm for one in contacts])
    places = np.array(passed).reshape(-1, 3)
    ahead = points + (away_mm + assumed.radius_mm)[:, None] * headings

    def parts(unknowns: _Array) -> tuple[_Array, _Array]:
        """By how much the distances of contacts and of places that were passed are wrong."""
        center, radius_mm = unknowns[:3], unknowns[3]
        felt = np.linalg.norm(points - center, axis=1) - radius_mm - away_mm
        away = np.linalg.norm(places - center, axis=1) - radius_mm
        return felt, np.minimum(0.0, away - assumed.clearance_mm)

    def residuals(unknowns: _Array) -> _Array:
        felt, near = parts(unknowns)
        return np.concatenate(
            [
                felt / _FELT_STD_MM,
                near / _FELT_STD_MM,
                ((unknowns[:3] - ahead) / (_AHEAD_STD_MM * len(contacts) ** 0.5)).ravel(),
                [(unknowns[3] - assumed.radius_mm) / _RADIUS_STD_MM],
            ]
        )

    start = np.append(ahead.mean(axis=0), assumed.radius_mm)
    lower = [-np.inf, -np.inf, -np.inf, min(_LEAST_RADIUS_MM, 0.5 * assumed.radius_mm)]
    # Few runs feel a region, and the import takes half a second.
    from scipy.optimize import least_squares  # type: ignore[import-untyped]

    result = least_squares(residuals, start, bounds=(lower, np.inf))
    found = result.x
    felt, near = parts(found)
    worst_mm = max(float(np.max(np.abs(felt))), float(np.max(-near, initial=0.0)))
    if worst_mm > _EXPLAINED_MM:
        return None
    covariance = np.linalg.pinv(result.jac.T @ result.jac)
    std_mm = float(np.sqrt(np.linalg.eigvalsh(covariance[:3, :3])[-1]))
    x, y, z, radius = (float(value) for value in found)
    return Ball((x, y, z), radius, std_mm)
