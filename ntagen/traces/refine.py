"""The exact fit of one chain to a trace: its start, and its curvature if that is free.

Minimises the squared distances from the measured points to the chain (orthogonal distances, as in
`ntagen.needle.circle`) by `scipy.optimize.least_squares`. The measured points are moved into the
frame of the chain; the unknowns are a small turn, a shift, and the curvature. Two further
observations say what the distances alone do not: how far along the chain its start lies, and, as
far as the trace is too short to tell, the curvature.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.optimize  # type: ignore[import-untyped]
from scipy.spatial.transform import Rotation  # type: ignore[import-untyped]

from ntagen.traces.chain import LEAST_CURVATURE_PER_MM, Array, Feet, Rolls, chain_points, feet_of
from ntagen.tracking.registration import best_motion, best_rotation

ERROR_MM: Final = 0.2
"""The error of a measured position together with that of the model, as far as it decides how much a
prior counts: fits of real insertions are so far off."""

CURVATURE_STD_RATIO: Final = 0.2
"""The standard deviation of the curvature that is assumed before a fit of it."""

ALONG_WEIGHT: Final = 0.1
"""The weight of the way along the chain from its start to the first point: so many mm of distance
count as much as one mm of this way. A chain that begins earlier, with later rolls, is the same
path."""

_MOST_EVALUATIONS: Final = 60
"""A nearly straight chain leaves its bevel open; then more evaluations change nothing."""

_RELATIVE: Final = 1e-5
"""The relative change of the curvature in a difference quotient."""


@dataclass(frozen=True, slots=True)
class Fitted:
    """A chain that was fitted.

    Attributes:
        curvature_per_mm: Its curvature.
        position_mm: Its start.
        frame: Heading, bevel and their product at its start, as columns.
        squares_mm2: The sum of squared distances of the points from it.
        along_mm: How far behind the start the first point lies, along the first heading.
    """

    curvature_per_mm: float
    position_mm: Array
    frame: Array
    squares_mm2: float = 0.0
    along_mm: float = 0.0

    @property
    def cost_mm2(self) -> float:
        """What is least for the best chain."""
        return self.squares_mm2 + (ALONG_WEIGHT * self.along_mm) ** 2


@dataclass(frozen=True, slots=True)
class Freedom:
    """What a fit may change.

    Attributes:
        position: Whether the start's position is free.
        orientation: Whether the start's orientation is free.
        curvature: Whether the curvature is free.
        expected_per_mm: The curvature that is expected, if it is free.
    """

    position: bool
    orientation: bool
    curvature: bool
    expected_per_mm: float


def pose_from_depths(
    points_mm: Array, depths_mm: Array, rolls: Rolls, curvature_per_mm: float
) -> tuple[Array, Array]:
    """Position and frame of the start at which the chain's places at the depths fit best."""
    places = chain_points(curvature_per_mm, rolls, depths_mm)[0]
    frame, position_mm = best_motion(places, points_mm)
    return position_mm, frame


def turned_from_depths(
    points_mm: Array, depths_mm: Array, rolls: Rolls, curvature_per_mm: float, position_mm: Array
) -> Array:
    """The frame of a start at a given position at which the chain fits best."""
    places = chain_points(curvature_per_mm, rolls, depths_mm)[0]
    return best_rotation(places, points_mm - position_mm)


def fit_chain(
    points_mm: Array, rolls: Rolls, length_mm: float, begin: Fitted, freedom: Freedom
) -> Fitted:
    """The chain that fits the points best, from a first guess.

    Args:
        points_mm: The measured points.
        rolls: The rolls of the chain, one row.
        length_mm: Its length.
        begin: The guess.
        freedom: What may change.
    """
    local = (points_mm - begin.position_mm) @ begin.frame
    problem = _Problem(local, rolls, length_mm, begin.curvature_per_mm, freedom)
    unknowns = np.zeros(problem.count)
    if problem.count:
        found = scipy.optimize.least_squares(
            problem.residuals,
            unknowns,
            jac=problem.slopes,
            method="lm",
            x_scale="jac",
            ftol=1e-7,
            max_nfev=_MOST_EVALUATIONS,
        )
        unknowns = found.x
    turn, shift, curvature = problem.parts(unknowns)
    rotation = _turn(turn)
    # A measured point p is at rotation (frame^T (p - position)) + shift in the chain's frame.
    frame = begin.frame @ rotation.T
    distances, along_mm = problem.outcome(unknowns)
    return Fitted(
        curvature_per_mm=curvature,
        position_mm=begin.position_mm - frame @ shift,
        frame=frame,
        squares_mm2=float(distances @ distances),
        along_mm=along_mm,
    )


class _Problem:
    """Residuals in mm and their derivatives."""

    def __init__(
        self, local: Array, rolls: Rolls, length_mm: float, curvature: float, freedom: Freedom
    ) -> None:
        self._local = local
        self._rolls = rolls
        self._length_mm = length_mm
        self._curvature = curvature
        self._freedom = freedom
        turns, shifts = 3 * freedom.orientation, 3 * freedom.position
        self._turn, self._shift = slice(0, turns), slice(turns, turns + shifts)
        self._bend = turns + shifts
        self.count = turns + shifts + freedom.curvature

    def parts(self, unknowns: Array) -> tuple[Array, Array, float]:
        """The turn and the shift into the chain's frame, and the curvature."""
        turn, shift = np.zeros(3), np.zeros(3)
        if self._freedom.orientation:
            turn = unknowns[self._turn]
        if self._freedom.position:
            shift = unknowns[self._shift]
        curvature = self._curvature
        if self._freedom.curvature:
            # The unknown is relative to what is expected: it has no unit.
            curvature += float(unknowns[self._bend]) * self._freedom.expected_per_mm
        return turn, shift, max(curvature, LEAST_CURVATURE_PER_MM)

    def outcome(self, unknowns: Array) -> tuple[Array, float]:
        """The distance of each point from the chain, and the way to the first point."""
        away, turned, *_ = self._away(unknowns)
        _, shift, _ = self.parts(unknowns)
        return np.linalg.norm(away, axis=1), float(turned[0, 0] + shift[0])

    def residuals(self, unknowns: Array) -> Array:
        """What separates each point from the nearest place, and the further observations."""
        away, turned, *_ = self._away(unknowns)
        return np.concatenate([away.ravel(), self._further(unknowns, turned)])

    def slopes(self, unknowns: Array) -> Array:
        """The derivatives; a place on an arc gives way along it, an end does not."""
        _, turned, feet, curvature = self._away(unknowns)
        turn, _, _ = self.parts(unknowns)
        columns = []
        if self._freedom.orientation:
            columns += list(np.cross(_left_jacobian(turn).T[:, None, :], turned[None, :, :]))
        if self._freedom.position:
            columns += [np.broadcast_to(axis, turned.shape) for axis in np.eye(3)]
        if self._freedom.curvature:
            step = max(_RELATIVE * curvature, LEAST_CURVATURE_PER_MM)
            more, less = (
                chain_points(curvature + sign * step, self._rolls, feet.depths_mm)[0]
                for sign in (1.0, -1.0)
            )
            columns.append((less - more) * (self._freedom.expected_per_mm / (2.0 * step)))
        stacked = np.stack(columns)
        further = self._further_slopes(stacked)
        along = np.einsum("cnk,nk->cn", stacked, feet.tangents)
        stacked = stacked - along[..., None] * feet.tangents
        return np.vstack([stacked.reshape(self.count, -1).T, further])

    def _away(self, unknowns: Array) -> tuple[Array, Array, Feet, float]:
        turn, shift, curvature = self.parts(unknowns)
        turned = self._local @ _turn(turn).T
        moved = turned + shift
        feet = feet_of(moved, curvature, self._rolls, self._length_mm)
        return moved - feet.points_mm, turned, feet, curvature

    def _further(self, unknowns: Array, turned: Array) -> Array:
        _, shift, curvature = self.parts(unknowns)
        found = []
        if self._freedom.position:
            found.append(ALONG_WEIGHT * (turned[0, 0] + shift[0]))
        if self._freedom.curvature:
            relative = curvature / self._freedom.expected_per_mm - 1.0
            found.append(ERROR_MM * relative / CURVATURE_STD_RATIO)
        return np.array(found)

    def _further_slopes(self, moved: Array) -> Array:
        """The derivatives of the further observations, from those of the points."""
        rows = []
        if self._freedom.position:
            row = ALONG_WEIGHT * moved[:, 0, 0]
            # The curvature moves the chain, not the points.
            rows.append(row * (np.arange(self.count) < 6))
        if self._freedom.curvature:
            rows.append(np.eye(self.count)[self._bend] * ERROR_MM / CURVATURE_STD_RATIO)
        return np.array(rows).reshape(-1, self.count)


def _skew(vector: Array) -> Array:
    """The matrix of the vector product with a vector."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _turn(vector: Array) -> Array:
    """The rotation about a vector by its length."""
    return np.asarray(Rotation.from_rotvec(vector).as_matrix())


def _left_jacobian(vector: Array) -> Array:
    """How a rotation turns further when its vector changes."""
    angle = float(np.linalg.norm(vector))
    second, third = 0.5, 1.0 / 6.0
    if angle >= 1e-4:
        second, third = (1.0 - math.cos(angle)) / angle**2, (angle - math.sin(angle)) / angle**3
    skew = _skew(vector)
    return np.eye(3) + second * skew + third * skew @ skew


GRID_DEG: Final = 1.0
"""The step of the grid: that of angles in the model, which are whole degrees."""

Place = tuple[int, int, int]


def oriented_on_grid(
    points_mm: Array, rolls: Rolls, length_mm: float, free: Fitted, base: Array
) -> Array:
    """The frame on the grid that explains the points best.

    The earlier work that the paper compares with (Rogalla et al., 2020) lets the model choose the
    needle's first orientation, from finitely many: the pose of a circle fit of the first part,
    tilted about its two transverse axes and then rolled, each by a multiple of `GRID_DEG`. The best
    one is found by steps on the grid, from the place nearest to the best orientation of all.

    Args:
        points_mm: The measured points.
        rolls: The rolls of the chain.
        length_mm: Its length.
        free: The chain with the best orientation of all.
        base: The frame at which the grid begins.
    """
    known: dict[Place, float] = {}

    def squares(place: Place) -> float:
        if place not in known:
            local = (points_mm - free.position_mm) @ frame_at(base, place)
            feet = feet_of(local, free.curvature_per_mm, rolls, length_mm)
            known[place] = float(np.sum((local - feet.points_mm) ** 2))
        return known[place]

    place = _nearest(base, free.frame)
    while True:
        around = [
            (place[0] + a, place[1] + b, place[2] + c)
            for a, b, c in itertools.product((-1, 0, 1), repeat=3)
        ]
        best = min(around, key=squares)
        if squares(best) >= squares(place):
            return frame_at(base, place)
        place = best


def frame_at(base: Array, place: Place) -> Array:
    """The frame at a place of the grid: tilted about y, then about z, then rolled about x."""
    angles_deg = GRID_DEG * np.array(place)
    return np.asarray(base @ Rotation.from_euler("YZX", angles_deg, degrees=True).as_matrix())


def _nearest(base: Array, frame: Array) -> Place:
    """The place of the grid that is nearest to a frame."""
    # R = Ry(a) Rz(b) Rx(c): its first column is (cos a cos b, sin b, -sin a cos b), and its second
    # row is (sin b, cos b cos c, -cos b sin c).
    turned = base.T @ frame
    tilt_y = math.atan2(-turned[2, 0], turned[0, 0])
    tilt_z = math.asin(max(-1.0, min(1.0, float(turned[1, 0]))))
    roll = math.atan2(-turned[1, 2], turned[1, 1])
    y, z, x = (round(math.degrees(angle) / GRID_DEG) for angle in (tilt_y, tilt_z, roll))
    return (y, z, x)
