"""Recursive filters of a needle, for comparison with the product's estimator.

Both have the state tip pose, curvature in two components (in the plane of the bevel and across it),
ratio of the roll lag, and the tracker's slowly varying error; and both know what the estimator's
`Priors` say. Curvature and tracker's error forget exponentially (Ornstein-Uhlenbeck). A filter only
knows the present; for a pull both take up the state again that they had at this depth.

* `KalmanFilter`: an unscented Kalman filter on the group of poses. Its state is a pose and a vector
  of errors, with rotations as rotation vectors about the axes of the tip. A measurement is linear
  in the errors, so its update needs no sigma points. (S. J. Julier, J. K. Uhlmann, "Unscented
  filtering and nonlinear estimation", Proc. IEEE 92, 2004; M. Brossard, S. Bonnabel and J.-P.
  Condomines, "Unscented Kalman filtering on Lie groups", IROS 2017.)
* `ParticleFilter`: Rao-Blackwellised. Particles carry directions, curvature and lag; the place and
  the tracker's error are normally distributed in each of them, with the same covariance in all.
"""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ntagen.needle.measurement import Measurement
from ntagen.needle.priors import Priors
from ntagen.scene import Pose

_Array = NDArray[np.float64]

MEMORY_MM = 8.0
"""The length over which the curvature forgets; ours, not tuned."""

DISTORTION_MEMORY_MM = 4.5
"""The same of the tracker's error."""

PIECE_MM = 1.0
"""Pushes are made in pieces of this length at most."""

_LAG_DEPTH_MM = 100.0
_HELD = 0.7
"""The standard deviation of a fluctuation, relative to its change over 10 mm."""

# The places of the errors.
_POSITION, _ROTATION, _CURVATURE = slice(0, 3), slice(3, 6), slice(6, 8)
_LAG, _BIAS, _SIZE = 8, slice(9, 12), 12


@dataclass
class Predicted:
    """A predicted tip: its place and heading, and the covariance of both, in six rows."""

    position_mm: _Array
    heading: _Array
    covariance: _Array


@dataclass
class _Model:
    """What both filters assume."""

    curvature_per_mm: float
    priors: Priors

    @property
    def stds(self) -> _Array:
        p = self.priors
        ratio = math.hypot(p.curvature_ratio, _HELD * p.curvature_drift)
        lag = 1.0 if p.lag_rad > 0.0 else 0.0
        rotations = [p.bevel_rad, p.heading_rad, p.heading_rad]
        turned = p.turn_drift_rad
        curvature = [ratio, turned]
        return np.array([*[p.position_mm] * 3, *rotations, *curvature, lag, *[p.distortion_mm] * 3])

    def kept(self, length_mm: float) -> tuple[float, float]:
        """How much of curvature and tracker's error is left after a length."""
        return math.exp(-length_mm / MEMORY_MM), math.exp(-length_mm / DISTORTION_MEMORY_MM)

    def roll_error_rad(self, depth_mm: float) -> float:
        return self.priors.lag_rad * (depth_mm / _LAG_DEPTH_MM) ** 2


def _rotations(vectors: _Array) -> _Array:
    """The rotation matrices of rotation vectors (Rodrigues)."""
    angles = np.linalg.norm(vectors, axis=-1)[..., None, None]
    cross = np.zeros((*vectors.shape[:-1], 3, 3))
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    cross[..., 0, 1], cross[..., 0, 2], cross[..., 1, 2] = -z, y, -x
    cross[..., 1, 0], cross[..., 2, 0], cross[..., 2, 1] = z, -y, x
    first = np.sinc(angles / math.pi)
    second = 0.5 * np.sinc(0.5 * angles / math.pi) ** 2
    return np.eye(3) + first * cross + second * (cross @ cross)


def _vectors(rotations: _Array) -> _Array:
    """The rotation vectors of rotation matrices, for angles less than pi."""
    cosine = 0.5 * (np.trace(rotations, axis1=-2, axis2=-1) - 1.0)
    angles = np.arccos(np.clip(cosine, -1.0, 1.0))
    odd = np.stack(
        [
            rotations[..., 2, 1] - rotations[..., 1, 2],
            rotations[..., 0, 2] - rotations[..., 2, 0],
            rotations[..., 1, 0] - rotations[..., 0, 1],
        ],
        axis=-1,
    )
    return np.asarray(0.5 * odd / np.sinc(angles / math.pi)[..., None])


def _frame(pose: Pose) -> _Array:
    """A rotation matrix: its columns are heading, bevel, and the bending axis backwards."""
    return np.stack([pose.heading, pose.bevel, np.cross(pose.heading, pose.bevel)], axis=-1)


def _moved(
    positions: _Array, frames: _Array, curvatures: _Array, length_mm: float
) -> tuple[_Array, _Array]:
    """Places and frames after a push; curvatures in the plane of the bevel and across it, per mm.

    A tip turns about its bending axis and its bevel; half of the turn is made before the way and
    half after it.
    """
    turn = np.zeros((*curvatures.shape[:-1], 3))
    turn[..., 2], turn[..., 1] = -length_mm * curvatures[..., 0], length_mm * curvatures[..., 1]
    middle = frames @ _rotations(0.5 * turn)
    return positions + length_mm * middle[..., :, 0], frames @ _rotations(turn)


def _pieces(length_mm: float) -> list[float]:
    count = max(1, math.ceil(length_mm / PIECE_MM - 1e-9))
    return [length_mm / count] * count


class _Filter:
    """Commands that both filters take in the same way."""

    def __init__(self, entry: Pose, radius_mm: float, priors: Priors) -> None:
        self.model = _Model(1.0 / radius_mm, priors)
        self.depth_mm = 0.0
        self._passed: list[tuple[float, object]] = []

    def push(self, length_mm: float) -> None:
        for piece_mm in _pieces(length_mm):
            self._passed.append((self.depth_mm, self._state()))
            self._advance(piece_mm)
            self.depth_mm += piece_mm

    def pull(self, length_mm: float) -> None:
        target_mm = max(0.0, self.depth_mm - length_mm)
        while self._passed and self._passed[-1][0] > target_mm - 1e-9:
            self.depth_mm, state = self._passed.pop()
            self._restore(state)
        if target_mm > self.depth_mm + 1e-9:
            self._advance(target_mm - self.depth_mm)
            self.depth_mm = target_mm

    def _state(self) -> object:
        raise NotImplementedError

    def _restore(self, state: object) -> None:
        raise NotImplementedError

    def _advance(self, length_mm: float) -> None:
        raise NotImplementedError


class KalmanFilter(_Filter):
    """An unscented Kalman filter on the group of poses."""

    def __init__(self, entry: Pose, radius_mm: float, priors: Priors) -> None:
        super().__init__(entry, radius_mm, priors)
        self._position = np.array(entry.position_mm)
        self._rotation = _frame(entry)
        self._rest = np.zeros(6)
        self._rest[0] = 1.0
        self._covariance = np.diag(self.model.stds**2)

    def _state(self) -> object:
        return (self._position, self._rotation, self._rest, self._covariance)

    def _restore(self, state: object) -> None:
        assert isinstance(state, tuple)
        self._position, self._rotation, self._rest, self._covariance = state

    def _points(self) -> tuple[_Array, _Array, _Array]:
        """Sigma points of equal weight: places, frames, and curvature, lag and tracker's error."""
        vectors = np.linalg.cholesky(self._covariance + 1e-12 * np.eye(_SIZE))
        vectors = math.sqrt(_SIZE) * np.concatenate([vectors.T, -vectors.T])
        return (
            self._position + vectors[:, _POSITION],
            self._rotation @ _rotations(vectors[:, _ROTATION]),
            self._rest + vectors[:, 6:],
        )

    def _take(self, positions: _Array, frames: _Array, rests: _Array) -> None:
        """The state is the mean and the covariance of these points."""
        self._position = positions.mean(axis=0)
        for _ in range(2):
            errors = _vectors(self._rotation.T @ frames)
            self._rotation = self._rotation @ _rotations(errors.mean(axis=0))
        self._rest = rests.mean(axis=0)
        errors = np.concatenate(
            [
                positions - self._position,
                _vectors(self._rotation.T @ frames),
                rests - self._rest,
            ],
            axis=1,
        )
        self._covariance = errors.T @ errors / len(errors)

    def _advance(self, length_mm: float) -> None:
        positions, frames, rests = self._points()
        kept, kept_bias = self.model.kept(length_mm)
        curvatures = self.model.curvature_per_mm * rests[:, :2]
        positions, frames = _moved(positions, frames, curvatures, length_mm)
        rests = rests.copy()
        rests[:, 0] = 1.0 + kept * (rests[:, 0] - 1.0)
        rests[:, 1] *= kept
        rests[:, 3:] *= kept_bias
        before = self._rotation
        _, self._rotation = _moved(
            self._position, before, self.model.curvature_per_mm * self._rest[:2], length_mm
        )
        self._take(positions, frames, rests)
        fresh = self.model.stds**2
        self._covariance[6, 6] += (1.0 - kept**2) * fresh[6]
        self._covariance[7, 7] += (1.0 - kept**2) * fresh[7]
        for index in range(_BIAS.start, _BIAS.stop):
            self._covariance[index, index] += (1.0 - kept_bias**2) * fresh[index]

    def roll(self, angle_rad: float) -> None:
        positions, frames, rests = self._points()
        error = self.model.roll_error_rad(self.depth_mm)
        error = math.copysign(error, angle_rad)
        turns = np.zeros((len(positions), 3))
        turns[:, 0] = angle_rad + error * rests[:, 2]
        frames = frames @ _rotations(turns)
        self._rotation = self._rotation @ _rotations(np.array([angle_rad, 0.0, 0.0]))
        self._take(positions, frames, rests)
        self._covariance[3, 3] += self.model.priors.roll_rad**2

    def measure(self, measurement: Measurement, behind_mm: float = 0.0) -> None:
        """Takes a position that was measured when the tip was so far behind."""
        slopes = np.zeros((3, _SIZE))
        slopes[:, _POSITION], slopes[:, _BIAS] = np.eye(3), np.eye(3)
        noise = self.model.priors.noise_mm**2 * np.eye(3)
        expected = self._position + self._rest[3:] - behind_mm * self._rotation[:, 0]
        surprise = np.array(measurement.position_mm) - expected
        gain = np.linalg.solve(
            slopes @ self._covariance @ slopes.T + noise, slopes @ self._covariance
        ).T
        change = gain @ surprise
        self._position = self._position + change[_POSITION]
        self._rotation = self._rotation @ _rotations(change[_ROTATION])
        self._rest = self._rest + change[6:]
        left = np.eye(_SIZE) - gain @ slopes
        self._covariance = left @ self._covariance @ left.T + gain @ noise @ gain.T

    def predict(self, length_mm: float) -> Predicted:
        """The tip after a further push."""
        ahead = copy.copy(self)
        for piece_mm in [2.5] * round(length_mm / 2.5):
            ahead._advance(piece_mm)
        # An error about the bevel moves the heading along the third axis, and so on.
        slopes = np.zeros((6, 6))
        slopes[:3, :3] = np.eye(3)
        slopes[3:, 4], slopes[3:, 5] = -ahead._rotation[:, 2], ahead._rotation[:, 1]
        covariance = slopes @ ahead._covariance[:6, :6] @ slopes.T
        return Predicted(ahead._position, ahead._rotation[:, 0], covariance)

    @property
    def curvature(self) -> tuple[float, float]:
        """The ratio of the curvature to the expected one, and its standard deviation."""
        return float(self._rest[0]), math.sqrt(self._covariance[6, 6])


class ParticleFilter(_Filter):
    """A Rao-Blackwellised particle filter."""

    def __init__(
        self, entry: Pose, radius_mm: float, priors: Priors, count: int = 1000, seed: int = 1
    ) -> None:
        super().__init__(entry, radius_mm, priors)
        self._random = np.random.default_rng(seed)
        stds = self.model.stds
        drawn = self._random.normal(size=(count, _SIZE)) * stds
        self._frames = _frame(entry) @ _rotations(drawn[:, _ROTATION])
        self._ratios = drawn[:, _CURVATURE] + np.array([1.0, 0.0])
        self._lags = drawn[:, _LAG]
        # Of place and tracker's error, the same along all axes.
        self._means = np.zeros((count, 2, 3))
        self._means[:, 0] = entry.position_mm
        self._spread = np.diag([priors.position_mm**2, priors.distortion_mm**2])
        self._weights = np.full(count, 1.0 / count)

    def _state(self) -> object:
        return (
            self._frames,
            self._ratios,
            self._lags,
            self._means,
            self._spread,
            self._weights,
        )

    def _restore(self, state: object) -> None:
        assert isinstance(state, tuple)
        self._frames, self._ratios, self._lags, self._means, self._spread, self._weights = state

    def _advance(self, length_mm: float) -> None:
        kept, kept_bias = self.model.kept(length_mm)
        fresh = math.sqrt(1.0 - kept**2) * self.model.stds[_CURVATURE]
        curvatures = self.model.curvature_per_mm * self._ratios
        means = self._means.copy()
        means[:, 0], self._frames = _moved(means[:, 0], self._frames, curvatures, length_mm)
        means[:, 1] *= kept_bias
        self._means = means
        self._ratios = np.array([1.0, 0.0]) + kept * (self._ratios - np.array([1.0, 0.0]))
        self._ratios = self._ratios + fresh * self._random.normal(size=self._ratios.shape)
        step = np.array([1.0, kept_bias])
        self._spread = self._spread * np.outer(step, step)
        self._spread[1, 1] += (1.0 - kept_bias**2) * self.model.priors.distortion_mm**2

    def roll(self, angle_rad: float) -> None:
        error = math.copysign(self.model.roll_error_rad(self.depth_mm), angle_rad)
        turns = np.zeros((len(self._lags), 3))
        drawn = self._random.normal(size=len(self._lags))
        turns[:, 0] = angle_rad + error * self._lags + self.model.priors.roll_rad * drawn
        self._frames = self._frames @ _rotations(turns)

    def measure(self, measurement: Measurement, behind_mm: float = 0.0) -> None:
        """Takes a position that was measured when the tip was so far behind."""
        noise = self.model.priors.noise_mm**2
        slopes = np.ones(2)
        variance = float(slopes @ self._spread @ slopes) + noise
        gain = self._spread @ slopes / variance
        surprises = np.array(measurement.position_mm) - self._means.sum(axis=1)
        surprises = surprises + behind_mm * self._frames[:, :, 0]
        self._means = self._means + gain[:, None] * surprises[:, None, :]
        self._spread = self._spread - np.outer(gain, gain) * variance
        logs = -0.5 * np.sum(surprises**2, axis=1) / variance
        weights = self._weights * np.exp(logs - logs.max())
        self._weights = weights / weights.sum()
        if 1.0 / np.sum(self._weights**2) < 0.5 * len(self._weights):
            self._resample()

    def _resample(self) -> None:
        count = len(self._weights)
        places = (np.arange(count) + self._random.uniform()) / count
        chosen = np.minimum(np.searchsorted(np.cumsum(self._weights), places), count - 1)
        self._ratios, self._lags = self._ratios[chosen], self._lags[chosen]
        self._frames, self._means = self._frames[chosen], self._means[chosen]
        self._weights = np.full(count, 1.0 / count)

    def predict(self, length_mm: float) -> Predicted:
        """The tip after a further push."""
        ahead = copy.copy(self)
        ahead._random = np.random.default_rng(1)
        for piece_mm in [2.5] * round(length_mm / 2.5):
            ahead._advance(piece_mm)
        weights, positions, headings = ahead._weights, ahead._means[:, 0], ahead._frames[:, :, 0]
        position, heading = weights @ positions, weights @ headings
        off = np.hstack([positions - position, headings - heading])
        covariance = (weights[:, None] * off).T @ off
        covariance[:3, :3] += ahead._spread[0, 0] * np.eye(3)
        return Predicted(position, heading / np.linalg.norm(heading), covariance)

    @property
    def curvature(self) -> tuple[float, float]:
        """The ratio of the curvature to the expected one, and its standard deviation."""
        ratio = float(self._weights @ self._ratios[:, 0])
        return ratio, math.sqrt(float(self._weights @ (self._ratios[:, 0] - ratio) ** 2))
