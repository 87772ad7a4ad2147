"""What a phantom needle does, beside what real needles were measured to do.

    python tests/benchmarks/phantom.py [--insertions 200] [--seed 0]

Each insertion is one phantom, pushed 55 to 98 mm without rolls, as in the 12 measured insertions
that `ntagen.needle.phantom_parameters` names. The same fits are made as were made there: a circle
to the whole, to both halves, and to windows of 20 mm. Then the base is rolled by half a turn at a
depth of 100 mm, and the angle that is missing at the tip is read; once with the compensation.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ntagen.drive.torsion import Compensated, Lag
from ntagen.needle.circle import CircleFit, fit_circle
from ntagen.needle.phantom import PhantomNeedle
from ntagen.needle.phantom_parameters import PhantomParameters, Sensing
from ntagen.needle.virtual import SimulatedClock
from ntagen.scene import Needle, Pose

Points = NDArray[np.float64]

ENTRY = Pose((0.0, 0.0, 0.0), heading=(0.0, -1.0, 0.0), bevel=(0.0, 0.0, 1.0))
NEEDLE = Needle(ENTRY, 77.6, 1.0)
WINDOW_MM = 20.0
SPACING_MM = 1.0

SMOOTHED = replace(Sensing(), noise_mm=0.02, step_mm=0.0, latency_s=0.0, lost_ratio=0.0)
"""The measured insertions were smoothed: their white noise is 0.015 to 0.03 mm."""


@dataclass(frozen=True, slots=True)
class Spreads:
    """The figures that are compared; ratios in percent, angles in degrees, lengths in mm."""

    whole_std: float
    window_low: float
    window_high: float
    first_window: float
    turn_median: float
    residual: float


PUBLISHED = Spreads(3.9, -27.0, 35.0, 16.0, 9.8, 0.16)
"""Of the 12 insertions."""


def insertion(seed: int, length_mm: float) -> Points:
    """The measured points of one insertion without rolls."""
    parameters = PhantomParameters(sensing=SMOOTHED)
    needle = PhantomNeedle(NEEDLE, (), seed, SimulatedClock(), parameters)
    points = [needle.measure().position_mm]
    for _ in range(int(length_mm / SPACING_MM)):
        needle.push(SPACING_MM)
        points.append(needle.measure().position_mm)
    return np.array(points)


def spreads(insertions: list[Points]) -> Spreads:
    """The figures of many insertions."""
    wholes = [fit_circle(points) for points in insertions]
    curvatures = np.array([fit.curvature_per_mm for fit in wholes])
    first, later, turns, residuals = [], [], [], []
    for points, whole in zip(insertions, wholes, strict=True):
        count = int(WINDOW_MM / SPACING_MM)
        windows = range(0, len(points) - count, count)
        ratios = [_against(fit_circle(points[i : i + count + 1]), whole) for i in windows]
        first.append(ratios[0])
        later += ratios[1:]
        middle = len(points) // 2
        halves = fit_circle(points[:middle]).normal, fit_circle(points[middle:]).normal
        turns.append(math.degrees(math.acos(min(1.0, float(np.dot(*halves))))))
        residuals.append(float(np.mean(_distances(points, whole))))
    return Spreads(
        whole_std=100.0 * float(curvatures.std() / curvatures.mean()),
        window_low=100.0 * float(np.percentile(later, 5)),
        window_high=100.0 * float(np.percentile(later, 95)),
        first_window=100.0 * float(np.mean(first)),
        turn_median=float(np.median(turns)),
        residual=float(np.mean(residuals)),
    )


def lags_deg(count: int, first_seed: int, *, compensated: bool = False) -> Points:
    """What is missing of half a turn at the tip, 100 mm deep."""
    missing = []
    for seed in range(first_seed, first_seed + count):
        needle = PhantomNeedle(NEEDLE, (), seed, SimulatedClock())
        lag = Lag(needle.parameters.torsion.lag_rad if compensated else 0.0)
        actuator = Compensated(needle, lag)
        actuator.push(100.0)
        actuator.roll(math.pi)
        missing.append(180.0 - math.degrees(needle.tip_rad))
    return np.array(missing)


def _against(window: CircleFit, whole: CircleFit) -> float:
    """The curvature of a window relative to that of the whole, minus 1."""
    sign = 1.0 if np.dot(window.normal, whole.normal) >= 0.0 else -1.0
    return sign * window.curvature_per_mm / whole.curvature_per_mm - 1.0


def _distances(points: Points, fit: CircleFit) -> Points:
    """The distances of points from a circle, in space."""
    from_center = points - np.array(fit.center_mm)
    height = from_center @ np.array(fit.normal)
    flat = np.linalg.norm(from_center - np.outer(height, fit.normal), axis=1)
    return np.hypot(flat - fit.radius_mm, height)


def drawn(count: int, first_seed: int) -> list[Points]:
    """Insertions of random lengths."""
    lengths_mm = np.random.default_rng(first_seed).uniform(55.0, 98.0, count)
    return [insertion(first_seed + i, float(length)) for i, length in enumerate(lengths_mm)]


def main() -> None:
    """Prints the figures of phantoms and of real needles."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--insertions", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    ours = spreads(drawn(arguments.insertions, arguments.seed))
    print(f"{arguments.insertions} insertions                               phantom   measured")
    for name, field in (
        ("whole-insertion curvature, standard deviation, %", "whole_std"),
        ("windows of 20 mm, 5 % quantile, %", "window_low"),
        ("windows of 20 mm, 95 % quantile, %", "window_high"),
        ("first window, mean, %", "first_window"),
        ("bend plane between halves, median, deg", "turn_median"),
        ("distance from the circle, mean, mm", "residual"),
    ):
        print(f"{name:50} {getattr(ours, field):7.2f}    {getattr(PUBLISHED, field):7.2f}")
    for compensated in (False, True):
        lags = lags_deg(arguments.insertions, arguments.seed, compensated=compensated)
        name = "with" if compensated else "without"
        print(
            f"lag at 100 mm {name} compensation, deg: median {np.median(np.abs(lags)):.1f}, "
            f"95 % {np.percentile(np.abs(lags), 95):.1f}"
        )


if __name__ == "__main__":
    main()
