"""How well the estimator predicts a phantom needle, with and without forgetting, and how fast.

    python tests/benchmarks/predictions.py [--seeds 100] [--radius 30]

Each phantom is pushed 50 mm with two compensated rolls, with a measurement every 0.25 mm: 200
measurements. Then the estimator predicts the tip at its place and 10 and 20 mm further on. Printed
are the error (median and 95 % quantile), and the error in the standard deviations that the
estimator states (root mean square of the normalised error; 1 if it knows itself, greater if it is
too sure). Last comes the time of an estimate: the first one, and one after another measurement,
as in a run.
"""

from __future__ import annotations

import argparse
import math
import time
from collections import defaultdict
from dataclasses import replace

import numpy as np

from ntagen.drive.configure import configure
from ntagen.drive.torsion import Compensated, Lag
from ntagen.needle.estimate import Estimator, Priors
from ntagen.needle.kinematics import push
from ntagen.needle.phantom import PhantomNeedle
from ntagen.needle.virtual import SimulatedClock
from ntagen.scene import Limits, Needle, Pose, Region, Scene

ENTRY = Pose((0.0, 0.0, 0.0), heading=(0.0, -1.0, 0.0), bevel=(0.0, 0.0, 1.0))
SPACING_MM = 0.25
MOVES = (("push", 20.0), ("roll", math.pi), ("push", 18.0), ("roll", 0.5 * math.pi), ("push", 12.0))
AHEAD_MM = (0.0, 10.0, 20.0)


def priors_for_phantom(needle: Needle) -> Priors:
    """The priors with which the driver steers a phantom needle."""
    target = Region.ball("T1", "target", (0.0, -50.0, 0.0), 5.0)
    scene = Scene("open", needle, (0.0, -1.0, 0.0), Limits(2.0, (math.pi,), 2, 2.0), (target,))
    return configure([], scene, needle="phantom").settings.priors


def watched(
    needle: Needle, seed: int, priors: dict[str, Priors]
) -> tuple[PhantomNeedle, dict[str, Estimator]]:
    """A phantom after the moves, and the estimators that watched it."""
    device = PhantomNeedle(needle, (), seed, SimulatedClock())
    actuator = Compensated(device, Lag(device.parameters.torsion.lag_rad))
    estimators = {name: Estimator(needle.tip, needle.radius_mm, p) for name, p in priors.items()}
    for kind, value in MOVES:
        count = round(value / SPACING_MM) if kind == "push" else 1
        for _ in range(count):
            getattr(actuator, kind)(value / count)
            for estimator in estimators.values():
                getattr(estimator, kind)(value / count)
            if kind == "push":
                measurement = device.measure()
                for estimator in estimators.values():
                    estimator.measure(measurement)
    return device, estimators


def main() -> None:
    """Prints errors, normalised errors and times."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--radius", type=float, default=30.0, help="in mm")
    arguments = parser.parse_args()
    needle = Needle(ENTRY, arguments.radius, 1.0)
    forgetting = priors_for_phantom(needle)
    priors = {
        "one curvature": Priors(noise_mm=forgetting.noise_mm),
        "one curvature, correlated noise": replace(
            forgetting, curvature_drift=0.0, turn_drift_rad=0.0
        ),
        "forgetting": forgetting,
    }
    errors, normalised, times = defaultdict(list), defaultdict(list), defaultdict(list)
    for seed in range(arguments.seeds):
        device, estimators = watched(needle, seed, priors)
        estimates = {}
        for name, estimator in estimators.items():
            for kind in ("first", "next"):
                estimator.measure(device.measure())
                start = time.perf_counter()
                estimates[name] = estimator.estimate()
                times[name, kind].append(1e3 * (time.perf_counter() - start))
        pushed_mm = 0.0
        for length_mm in AHEAD_MM:
            device.push(length_mm - pushed_mm)
            pushed_mm = length_mm
            for name, estimate in estimates.items():
                guess = push(estimate.tip, estimate.radius_mm, length_mm).position_mm
                error = np.subtract(device.true_tip.position_mm, guess)
                covariance = estimate.position_covariance_mm2(length_mm)
                errors[name, length_mm].append(float(np.linalg.norm(error)))
                normalised[name, length_mm].append(error @ np.linalg.solve(covariance, error) / 3)
    print(f"{arguments.seeds} phantoms, radius {arguments.radius:g} mm, 200 measurements")
    for name in priors:
        for length_mm in AHEAD_MM:
            found = errors[name, length_mm]
            print(
                f"{name:32} +{length_mm:2.0f} mm: error median {np.median(found):.2f}, "
                f"95 % {np.percentile(found, 95):.2f} mm; "
                f"normalised {math.sqrt(np.mean(normalised[name, length_mm])):.2f}"
            )
        for kind in ("first", "next"):
            found = times[name, kind]
            print(
                f"{name:32} {kind:5} estimate: median {np.median(found):.1f}, "
                f"95 % {np.percentile(found, 95):.1f} ms"
            )


if __name__ == "__main__":
    main()
