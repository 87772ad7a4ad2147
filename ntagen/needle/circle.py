"""The fit of a circle to measured points in space, and the pose that it implies.

Three steps (Chernov, "Circular and linear regression", 2010; Al-Sharadqah and Chernov, "Error
analysis for circle fitting algorithms", 2009):

1. the plane through the centroid by a singular value decomposition;
2. an algebraic fit in the plane, with the *hyper* constraint that has no essential bias. The usual
   Kåsa fit is biased to small radii on short arcs: 22 mm for 30 mm on an arc of 10 mm with noise of
   0.1 mm;
3. a geometric fit (Levenberg-Marquardt) in the parametrisation (curvature, direction, offset),
   which passes through curvature 0 without a singularity, as (centre, radius) does not.

A short arc tells little about its curvature. With `n` points over a length `L` and noise `s` its
standard deviation is ``s / L^2 sqrt(720 / (n + 4))`` (Gluckstern, 1963). For 5 mm, 20 points and
0.1 mm this is two thirds of the curvature of a circle of 30 mm. So a prior for the curvature can be
given; it counts as one more observation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ntagen.needle.vectors import combine, cross, dot, scale, subtract, unit
from ntagen.scene import Pose, Vector
from ntagen.shapes import vector_of

_Array = NDArray[np.float64]

_SMALLEST_CURVATURE_PER_MM = 1e-7
"""A radius of 10 km: a straighter arc gets this curvature, so that it has a centre."""


@dataclass(frozen=True, slots=True)
class CurvaturePrior:
    """The knowledge about the curvature before the fit, as a normal distribution.

    Attributes:
        mean_per_mm: The expected curvature.
        std_per_mm: Its standard deviation, greater than 0.
    """

    mean_per_mm: float
    std_per_mm: float


@dataclass(frozen=True, slots=True)
class CircleFit:
    """A circle in space, fitted to points in the order of motion.

    Attributes:
        center_mm: The centre.
        normal: Unit normal of the plane; the motion turns right-handed about it.
        curvature_per_mm: One over the radius.
        curvature_std_per_mm: Its standard deviation, from the noise and the shape of the arc.
        rms_mm: Root mean square of the distances of the points from the circle, in space.
    """

    center_mm: Vector
    normal: Vector
    curvature_per_mm: float
    curvature_std_per_mm: float
    rms_mm: float

    @property
    def radius_mm(self) -> float:
        """The radius."""
        return 1.0 / self.curvature_per_mm

    def pose_at(self, point_mm: Vector) -> Pose:
        """The pose of a tip that moves on the circle, at the point nearest to the given one.

        The heading is the tangent in the direction of motion, the bevel points away from the
        centre.
        """
        from_center = subtract(point_mm, self.center_mm)
        in_plane = subtract(from_center, scale(dot(from_center, self.normal), self.normal))
        bevel = unit(in_plane)
        position = combine(1.0, self.center_mm, self.radius_mm, bevel)
        return Pose(position, heading=cross(self.normal, bevel), bevel=bevel)


def fit_circle(
    points_mm: _Array, noise_mm: float = 0.1, prior: CurvaturePrior | None = None
) -> CircleFit:
    """Fits a circle to points in the order of motion.

    Args:
        points_mm: One point a row, at least three that do not coincide.
        noise_mm: Standard deviation of the measurement; with a prior it decides the weight of the
            points.
        prior: The knowledge about the curvature before the fit.

    Raises:
        ValueError: Fewer than three points, points that are not finite, or all at one place.
    """
    points = np.asarray(points_mm, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or len(points) < 3:
        raise ValueError(f"a circle needs at least three points in space, not {points.shape}")
    if not np.isfinite(points).all():
        raise ValueError("a point to be fitted is not finite")
    centroid = points.mean(axis=0)
    _, spread, axes = np.linalg.svd(points - centroid, full_matrices=False)
    if spread[0] <= 0.0:
        raise ValueError("the points to be fitted are all at one place")
    flat = (points - centroid) @ axes[:2].T
    start = _algebraic(flat / spread[0]) * np.array([1.0 / spread[0], 1.0, spread[0]])
    shape, std_per_mm = _geometric(flat, start, noise_mm, prior)
    return _in_space(points, centroid, axes, shape, std_per_mm)


def _algebraic(flat: _Array) -> _Array:
    """(curvature, direction, offset) of the hyper fit of centred points in a plane.

    Minimises the mean square of ``A (x^2 + y^2) + B x + C y + D`` under the hyper constraint: the
    generalised eigenvector of the smallest positive eigenvalue. The constraint has one negative
    direction, so exactly one eigenvalue is negative, and the second one is the right one.
    """
    x, y = flat.T
    squares = x * x + y * y
    design = np.column_stack([squares, x, y, np.ones_like(x)])
    moments = design.T @ design / len(x)
    constraint = np.array(
        [
            [8.0 * squares.mean(), 4.0 * x.mean(), 4.0 * y.mean(), 2.0],
            [4.0 * x.mean(), 1.0, 0.0, 0.0],
            [4.0 * y.mean(), 0.0, 1.0, 0.0],
            [2.0, 0.0, 0.0, 0.0],
        ]
    )
    values, vectors = np.linalg.eig(np.linalg.solve(constraint, moments))
    a, b, c, d = np.real(vectors[:, np.argsort(np.real(values))[1]])
    if a < 0.0:
        a, b, c, d = -a, -b, -c, -d
    slope = math.hypot(b, c)
    root = math.sqrt(max(b * b + c * c - 4.0 * a * d, 1e-300))
    return np.array([2.0 * a / root, math.atan2(-c, -b), 2.0 * d / (slope + root)])


def _residuals(shape: _Array, flat: _Array) -> _Array:
    """Signed distances of points from the circle; positive outside, finite for curvature 0 as well.

    With ``q`` from the circle's point nearest to the origin and ``n`` the direction to the centre,
    the distance ``|q - n/k| - 1/k`` is written as ``g / (1 + sqrt(1 + k g))`` with ``g = k q.q - 2
    q.n``.
    """
    curvature, direction, offset = shape
    normal = np.array([math.cos(direction), math.sin(direction)])
    from_foot = flat - offset * normal
    g = curvature * (from_foot * from_foot).sum(axis=1) - 2.0 * from_foot @ normal
    return np.asarray(g / (1.0 + np.sqrt(np.maximum(1.0 + curvature * g, 0.0))))


def _geometric(
    flat: _Array, start: _Array, noise_mm: float, prior: CurvaturePrior | None
) -> tuple[_Array, float]:
    """The shape of least squared distances (and prior), and its curvature's standard deviation."""
    # Few runs need a circle, and the import takes half a second.
    from scipy.optimize import OptimizeResult, least_squares  # type: ignore[import-untyped]

    def weighted(shape: _Array) -> _Array:
        residuals = _residuals(shape, flat) / noise_mm
        if prior is None:
            return residuals
        return np.append(residuals, (shape[0] - prior.mean_per_mm) / prior.std_per_mm)

    def solve(first: _Array) -> OptimizeResult:
        # Three points without a prior leave as many residuals as unknowns, which the method allows.
        return least_squares(weighted, first, method="lm", x_scale="jac")

    result = solve(start)
    if prior is not None:
        # Noise can turn the algebraic start to the wrong side, where the prior makes a second
        # minimum.
        mirrored = np.array([prior.mean_per_mm, start[1] + math.pi, -start[2]])
        result = min(result, solve(mirrored), key=lambda found: float(found.cost))
    covariance = np.linalg.pinv(result.jac.T @ result.jac)
    return result.x, float(math.sqrt(covariance[0, 0]))


def _in_space(
    points: _Array, centroid: _Array, axes: _Array, shape: _Array, std_per_mm: float
) -> CircleFit:
    """The circle of the plane in space; its motion is right-handed about the normal."""
    curvature, direction, offset = shape
    if curvature < 0.0:
        curvature, direction, offset = -curvature, direction + math.pi, -offset
    curvature = max(curvature, _SMALLEST_CURVATURE_PER_MM)
    to_center = math.cos(direction) * axes[0] + math.sin(direction) * axes[1]
    center = centroid + (offset + 1.0 / curvature) * to_center
    # The sign of the area that the ray from the centre sweeps is that of the motion, also for more
    # than half a turn.
    swept = np.cross(points[:-1] - center, np.diff(points, axis=0)).sum(axis=0)
    normal = axes[2] if float(np.dot(swept, axes[2])) >= 0.0 else -axes[2]
    in_plane = _residuals(
        np.array([curvature, direction, offset]), (points - centroid) @ axes[:2].T
    )
    out_of_plane = (points - centroid) @ axes[2]
    rms_mm = math.sqrt(float(np.mean(in_plane**2 + out_of_plane**2)))
    return CircleFit(vector_of(center), vector_of(normal), float(curvature), std_per_mm, rms_mm)
