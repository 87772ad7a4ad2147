"""The product's estimator against recursive filters: errors, honesty and cost on phantoms.

    python -m tests.benchmarks.filters [--seeds 100] [--methods smoother kalman particles]
        [--noise 0.1] [--latency 0.05] [--lost 0.01] [--grid] [--brief] [--traces DIR]

Each phantom is pushed 20 mm, rolled (with compensation), pushed 15 mm, pulled back 10 mm, rolled,
and pushed 20 mm in a new channel, with a measurement every 0.25 mm. Its entry differs from the
expected one as the priors say. Looked at are the tip after 5, 20 and 35 mm, and at the end; from
the last two also the places 10, 20 and 30 mm further on.

An error that is normalised with the covariance that the method states has a chi-square distribution
(NEES: normalised estimation error squared), with three degrees of freedom for a place and five for
a place with a direction. Printed are its mean over the degrees of freedom (1 if the method knows
itself, greater if it is too sure), and the share of insertions inside the two-sided 95 % band. The
same is printed for the mean curvature over the next 30 mm, and what the method states of it.

`--grid` goes through noise, latency and drop-outs. `--traces` predicts the unseen rest of measured
insertions: the files `FullStateGroundTruthPos.dat` below a folder, three floats a line, in mm.
"""

from __future__ import annotations

import argparse
import copy
import math
import pathlib
import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from ntagen.drive.configure import configure
from ntagen.drive.fitting import settings_for_phantom
from ntagen.drive.torsion import Compensated, Lag
from ntagen.needle.circle import CurvaturePrior, fit_circle
from ntagen.needle.estimate import Estimator
from ntagen.needle.kinematics import bending_axis, orthonormal, push
from ntagen.needle.measurement import Measurement
from ntagen.needle.phantom import PhantomNeedle
from ntagen.needle.phantom_parameters import PhantomParameters, Sensing
from ntagen.needle.priors import Priors
from ntagen.needle.vectors import rotate, scale
from ntagen.needle.virtual import SimulatedClock
from ntagen.scene import Limits, Needle, Pose, Region, Scene
from tests.benchmarks.recursive import KalmanFilter, ParticleFilter, Predicted

_Array = NDArray[np.float64]

ENTRY = Pose((0.0, 0.0, 0.0), heading=(0.0, -1.0, 0.0), bevel=(0.0, 0.0, 1.0))
SPACING_MM = 0.25
MOVES = (
    ("push", 5.0),
    ("look", 0.0),
    ("push", 15.0),
    ("look", 0.0),
    ("roll", math.pi),
    ("push", 15.0),
    ("look", 30.0),
    ("pull", 10.0),
    ("roll", 0.5 * math.pi),
    ("push", 20.0),
    ("look", 30.0),
)
AHEAD_MM = (10.0, 20.0, 30.0)
BANDS = {freedom: chi2.ppf((0.025, 0.975), freedom) for freedom in (1, 3, 5)}
TRACE_RADIUS_MM = 77.0
BASE = Sensing()
GRID = [
    *[replace(BASE, noise_mm=noise_mm) for noise_mm in (0.1, 0.3, 1.0)],
    *[replace(BASE, noise_mm=0.1, latency_s=latency_s) for latency_s in (0.0, 0.2)],
    *[replace(BASE, noise_mm=0.1, lost_ratio=ratio) for ratio in (0.0, 0.2)],
    replace(BASE, noise_mm=1.0, latency_s=0.2, lost_ratio=0.2),
]


class Smoother:
    """The product's estimator, with what it predicts."""

    def __init__(self, entry: Pose, radius_mm: float, priors: Priors) -> None:
        self._expected_mm = radius_mm
        self._estimator = Estimator(entry, radius_mm, priors)
        self.push, self.roll = self._estimator.push, self._estimator.roll
        self.pull = self._estimator.pull

    def measure(self, measurement: Measurement, behind_mm: float = 0.0) -> None:
        """Takes a position."""
        self._estimator.measure(measurement, self._estimator.depth_mm - behind_mm)

    def estimate(self) -> None:
        """Estimates from everything so far."""
        self._estimate = self._estimator.estimate()

    def predict(self, length_mm: float) -> Predicted:
        """The tip after a further push; its heading is right for a length of 0."""
        estimate = self._estimate
        tip = push(estimate.tip, estimate.radius_mm, length_mm)
        x, y, z = tip.heading
        slopes = np.zeros((6, 7))
        slopes[:3, :3] = np.eye(3)
        slopes[3:, 3:6] = -np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        covariance = slopes @ np.array(estimate.covariance) @ slopes.T
        covariance[:3, :3] = estimate.position_covariance_mm2(length_mm)
        return Predicted(np.array(tip.position_mm), np.array(tip.heading), covariance)

    @property
    def curvature(self) -> tuple[float, float]:
        """The ratio of the curvature to the expected one, and its standard deviation."""
        ratio = self._expected_mm / self._estimate.radius_mm
        return ratio, ratio * self._estimate.radius_std_mm / self._estimate.radius_mm


Method = Smoother | KalmanFilter | ParticleFilter
METHODS: dict[str, Callable[[Pose, float, Priors], Method]] = {
    "smoother": Smoother,
    "kalman": KalmanFilter,
    "particles": ParticleFilter,
}


def priors_for(needle: Needle, sensing: Sensing) -> Priors:
    """The priors with which the driver steers such a phantom."""
    target = Region.ball("T1", "target", (0.0, -50.0, 0.0), 5.0)
    scene = Scene("open", needle, (0.0, -1.0, 0.0), Limits(2.0, (math.pi,), 2, 2.0), (target,))
    usual = configure([], scene, needle="phantom").settings
    parameters = PhantomParameters(sensing=sensing)
    return settings_for_phantom(usual, parameters, scene, "all").priors


def entered(priors: Priors, seed: int) -> Pose:
    """A true entry, off the expected one as the priors say."""
    drawn = np.random.default_rng([seed, 77]).normal(size=6)
    heading, bevel = ENTRY.heading, ENTRY.bevel
    axes = (ENTRY.heading, ENTRY.bevel, bending_axis(ENTRY))
    stds = (priors.bevel_rad, priors.heading_rad, priors.heading_rad)
    for axis, angle_rad in zip(axes, drawn[3:] * stds, strict=True):
        heading, bevel = rotate(heading, axis, angle_rad), rotate(bevel, axis, angle_rad)
    x, y, z = (priors.position_mm * float(value) for value in drawn[:3])
    return orthonormal(Pose((x, y, z), heading, bevel))


@dataclass
class Results:
    """Errors, normalised squares and times, by what was looked at."""

    errors: dict[str, list[float]]
    squares: dict[tuple[str, int], list[float]]
    update_s: list[float]
    estimate_s: list[float]
    stated: dict[str, list[float]]

    @staticmethod
    def empty() -> Results:
        return Results(defaultdict(list), defaultdict(list), [], [], defaultdict(list))

    def note(self, name: str, truth: Pose, guess: Predicted, *, directed: bool) -> None:
        """Compares a predicted tip with the true one."""
        off = np.subtract(truth.position_mm, guess.position_mm)
        self.errors[name].append(float(np.linalg.norm(off)))
        self.squares[name, 3].append(_square(off, guess.covariance[:3, :3]))
        if directed:
            across = np.linalg.svd(guess.heading[None, :])[2][1:]
            basis = np.zeros((5, 6))
            basis[:3, :3], basis[3:, 3:] = np.eye(3), across
            both = np.concatenate([off, np.subtract(truth.heading, guess.heading)])
            square = _square(basis @ both, basis @ guess.covariance @ basis.T)
            self.squares[name, 5].append(square)


def _square(error: _Array, covariance: _Array) -> float:
    return float(error @ np.linalg.solve(covariance, error))


def insertion(
    seed: int, radius_mm: float, sensing: Sensing, priors: Priors, results: dict[str, Results]
) -> None:
    """One phantom, watched by all methods."""
    needle = Needle(entered(priors, seed), radius_mm, 1.0)
    parameters = PhantomParameters(sensing=sensing)
    device = PhantomNeedle(needle, (), seed, SimulatedClock(), parameters)
    methods = {name: METHODS[name](ENTRY, radius_mm, priors) for name in results}
    actuator = Compensated(device, Lag(parameters.torsion.lag_rad))
    looked = 0
    for kind, value in MOVES:
        if kind == "look":
            looked += 1
            look(looked, device, methods, value, results, radius_mm)
            continue
        count = round(value / SPACING_MM) if kind == "push" else 1
        for _ in range(count):
            began_s = device.now_s()
            getattr(actuator, kind)(value / count)
            measurement = device.measure() if kind == "push" else None
            for name, method in methods.items():
                start = time.perf_counter()
                getattr(method, kind)(value / count)
                if measurement is not None:
                    went_mm = max(0.0, needle.speed_mm_per_s * (measurement.time_s - began_s))
                    method.measure(measurement, max(0.0, value / count - went_mm))
                    results[name].update_s.append(time.perf_counter() - start)


def look(
    number: int,
    device: PhantomNeedle,
    methods: dict[str, Method],
    ahead_mm: float,
    results: dict[str, Results],
    radius_mm: float,
) -> None:
    """Compares what the methods say now with the truth, here and ahead."""
    ahead = copy.deepcopy(device)
    truths = [ahead.true_tip]
    for length_mm in np.diff((0.0, *AHEAD_MM)):
        ahead.push(float(length_mm))
        truths.append(ahead.true_tip)
    cells = [30.0 - 0.5 * step - 0.25 for step in range(60)]
    depth_mm = device._depth_mm
    tissue = device._tissue
    ratios = [tissue.curvature_ratio(tissue.cell(depth_mm + 30.0 - left)) for left in cells]
    ratio = float(np.average(ratios, weights=cells))
    for name, method in methods.items():
        if isinstance(method, Smoother):
            start = time.perf_counter()
            method.estimate()
            results[name].estimate_s.append(time.perf_counter() - start)
        results[name].note(f"look {number}", truths[0], method.predict(0.0), directed=True)
        if ahead_mm:
            for length_mm, truth in zip(AHEAD_MM, truths[1:], strict=True):
                guess = method.predict(length_mm)
                results[name].note(f"look {number} +{length_mm:.0f}", truth, guess, directed=False)
        found, std = method.curvature
        results[name].errors[f"curvature {number}"].append(abs(found / ratio - 1.0))
        results[name].stated[f"curvature {number}"].append(std)
        results[name].squares[f"curvature {number}", 1].append(((found - ratio) / std) ** 2)


def table(name: str, results: Results) -> None:
    """Prints what one method reached."""
    for what, errors in results.errors.items():
        line = f"{name:10} {what:12} error median {np.median(errors):.3f}"
        line += f", 95 % {np.percentile(errors, 95):.3f}"
        if what in results.stated:
            line += f", stated {np.mean(results.stated[what]):.3f}"
        for freedom in (1, 3, 5):
            if (what, freedom) in results.squares:
                squares = np.array(results.squares[what, freedom])
                low, high = BANDS[freedom]
                inside = np.mean((squares >= low) & (squares <= high))
                line += f" | NEES/{freedom} {np.mean(squares) / freedom:.2f}"
                line += f" ({100.0 * inside:.0f} % inside)"
        print(line)
    times = f"{1e3 * np.mean(results.update_s):.3f} ms for a measurement"
    if results.estimate_s:
        times += f", {1e3 * np.median(results.estimate_s):.1f} ms for an estimate"
    print(f"{name:10} {times}")


def compare(arguments: argparse.Namespace, sensing: Sensing) -> None:
    """Prints the table of one setting."""
    print(
        f"\n{arguments.seeds} phantoms, radius {arguments.radius:g} mm: noise "
        f"{sensing.noise_mm:g} mm, latency {sensing.latency_s:g} s, lost {sensing.lost_ratio:g}"
    )
    priors = priors_for(Needle(ENTRY, arguments.radius, 1.0), sensing)
    results = {name: Results.empty() for name in arguments.methods}
    for seed in range(arguments.seeds):
        insertion(seed, arguments.radius, sensing, priors, results)
    for name in arguments.methods:
        (brief if arguments.brief else table)(name, results[name])


def brief(name: str, results: Results) -> None:
    """Prints what one method reached in three lines, all places taken together."""
    tips = [what for what in results.errors if what.startswith("look") and "+" not in what]
    groups = {"tip": (tips, (3, 5))}
    for length_mm in AHEAD_MM:
        ahead = [what for what in results.errors if what.endswith(f"+{length_mm:.0f}")]
        groups[f"+{length_mm:.0f} mm"] = (ahead, (3,))
    parts = []
    for group, (names, freedoms) in groups.items():
        errors = np.concatenate([results.errors[what] for what in names])
        part = f"{group} {np.median(errors):.2f}/{np.percentile(errors, 95):.2f} mm"
        for freedom in freedoms:
            squares = np.concatenate([results.squares[what, freedom] for what in names])
            low, high = BANDS[freedom]
            inside = 100.0 * np.mean((squares >= low) & (squares <= high))
            part += f" {np.mean(squares) / freedom:.2f} ({inside:.0f} %)"
        parts.append(part)
    cost = 1e3 * (np.mean(results.update_s) * 5.0 / SPACING_MM)
    if results.estimate_s:
        cost += 1e3 * np.median(results.estimate_s)
    print(f"{name:10} " + " | ".join(parts) + f" | {cost:.0f} ms for 5 mm", flush=True)


def trace(path: pathlib.Path) -> _Array:
    """A measured insertion up to its first jump, thinned to chords of 1 mm."""
    points = np.array([[float(word) for word in line.split()] for line in path.open()])
    jumps = np.flatnonzero(np.linalg.norm(np.diff(points, axis=0), axis=1) > 5.0)
    points = points[: jumps[0] + 1] if len(jumps) else points
    kept = [points[0]]
    for point in points:
        if np.linalg.norm(point - kept[-1]) >= 1.0:
            kept.append(point)
    return np.array(kept)


def predict_trace(points: _Array, results: dict[str, Results]) -> None:
    """Watches the first 30 mm of a measured insertion, and predicts what comes.

    Its entry pose is not known: heading and bevel are those of a circle through the first 15 mm,
    with errors of 3 and 20 degrees.
    """
    expected = CurvaturePrior(1.0 / TRACE_RADIUS_MM, 0.1 / TRACE_RADIUS_MM)
    entry = fit_circle(points[15::-1], 0.1, expected).pose_at(points[0].tolist())
    back = Pose(entry.position_mm, scale(-1.0, entry.heading), entry.bevel)
    sensing = replace(BASE, noise_mm=0.03)
    usual = priors_for(Needle(ENTRY, TRACE_RADIUS_MM, 1.0), sensing)
    entry_rad, bevel_rad = math.radians(3.0), math.radians(20.0)
    priors = replace(usual, heading_rad=entry_rad, bevel_rad=bevel_rad, curvature_ratio=0.05)
    methods = {name: METHODS[name](orthonormal(back), TRACE_RADIUS_MM, priors) for name in results}
    steps_mm = np.linalg.norm(np.diff(points, axis=0), axis=1)
    way_mm = np.concatenate([[0.0], np.cumsum(steps_mm)])
    seen = int(np.searchsorted(way_mm, 30.0))
    for name, method in methods.items():
        for step_mm, point in zip(steps_mm[:seen], points[1 : seen + 1], strict=True):
            start = time.perf_counter()
            method.push(float(step_mm))
            x, y, z = point.tolist()
            method.measure(Measurement(0.0, (x, y, z), 0.0))
            results[name].update_s.append(time.perf_counter() - start)
        if isinstance(method, Smoother):
            method.estimate()
        for length_mm in AHEAD_MM:
            if way_mm[-1] - way_mm[seen] >= length_mm:
                place = int(np.searchsorted(way_mm, way_mm[seen] + length_mm))
                guess = method.predict(round((way_mm[place] - way_mm[seen]) / 2.5) * 2.5)
                beyond_mm = way_mm[place] - way_mm[seen] - round(length_mm / 2.5) * 2.5
                guess.position_mm = guess.position_mm + beyond_mm * guess.heading
                truth = Pose(tuple(points[place].tolist()), ENTRY.heading, ENTRY.bevel)
                results[name].note(f"+{length_mm:.0f} mm", truth, guess, directed=False)


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--radius", type=float, default=30.0, help="in mm")
    parser.add_argument("--methods", nargs="+", choices=[*METHODS], default=[*METHODS])
    parser.add_argument("--noise", type=float, default=0.1, help="in mm")
    parser.add_argument("--latency", type=float, default=BASE.latency_s, help="in s")
    parser.add_argument("--lost", type=float, default=BASE.lost_ratio)
    parser.add_argument("--grid", action="store_true")
    parser.add_argument("--brief", action="store_true", help="a line for each method")
    parser.add_argument("--traces", type=pathlib.Path)
    arguments = parser.parse_args()
    if arguments.traces is not None:
        results = {name: Results.empty() for name in arguments.methods}
        paths = sorted(arguments.traces.rglob("FullStateGroundTruthPos.dat"))
        traces = [points for points in map(trace, paths) if len(points) > 45]
        for points in traces:
            predict_trace(points, results)
        print(f"{len(traces)} measured insertions, 30 mm seen")
        for name in arguments.methods:
            table(name, results[name])
        return
    own = replace(
        BASE, noise_mm=arguments.noise, latency_s=arguments.latency, lost_ratio=arguments.lost
    )
    for sensing in GRID if arguments.grid else [own]:
        compare(arguments, sensing)


if __name__ == "__main__":
    main()
