"""What a whole shape tells more than the tip alone, on the phantom needle.

    python -m tests.benchmarks.shapes [--seeds 200] [--noise 0.3] [--radius 30] [--push 2]
        [--narrow 1 1.2] [--tasks 0] [--known all] [--workers 2]

Each phantom is pushed with one compensated roll by 180 deg at 20 mm, and measured once after each
push, by its tip or by its whole shape, with the same noise of each coordinate. Two needles are
looked at: one whose curvature is known to 2 % before, as after a calibration, and one of which it
is known to 30 % only.

Printed are, after 10, 20, 30 and 40 mm: the error of the tip and of the predicted tip 5 mm further
on (root mean square), the error of the radius that is expected over the next 30 mm, relative to the
true one, and how many of the true tips lie in the ellipsoid that should have 95 % of them. Then the
pushes until the tube is *narrow*: from there to the roll, the tip 5 mm further on is known to the
given length in all directions at a confidence of 0.98 (two-sided); median and 90 % quantile.

With ``--tasks N``, random tasks of `tests.benchmarks.parts` are driven with both, and printed is
how many reach the target and how many touch a region. Ends with 1 if one is touched.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import Final

import numpy as np

from ntagen.drive.configure import COMMAND_LINE, configure
from ntagen.drive.settings import Settings
from ntagen.drive.torsion import Compensated, Lag
from ntagen.needle.estimate import Estimate, Estimator
from ntagen.needle.kinematics import push, roll
from ntagen.needle.measurement import squared_length_bound
from ntagen.needle.phantom import PhantomNeedle
from ntagen.needle.virtual import SimulatedClock
from ntagen.nsl.driving import read_settings
from ntagen.scene import Limits, Needle, Pose, Region, Scene
from tests.benchmarks.parts import End, Job, driven, has_plan

ENTRY: Final = Pose((0.0, 0.0, 0.0), heading=(0.0, -1.0, 0.0), bevel=(0.0, 0.0, 1.0))
KINDS: Final = ("tip", "shape")
KNOWN: Final = {"2 %": 0.02, "30 %": 0.3}
LENGTH_MM: Final = 40.0
ROLL_AT_MM: Final = 20.0
LOOK_MM: Final = 10.0
AHEAD_MM: Final = 5.0
CIRCLE_MM: Final = 30.0
_SIGMAS: Final = NormalDist().inv_cdf(0.99)


@dataclass(frozen=True)
class Way:
    """What is done with each phantom: its noise, radius, pushes, and the widths that are narrow."""

    noise_mm: float
    radius_mm: float
    push_mm: float
    narrow_mm: tuple[float, ...]


@dataclass(frozen=True)
class Look:
    """An estimate beside the truth: squares in mm^2, parts, and in standard deviations."""

    tip_mm2: float
    ahead_mm2: float
    radius_ratio: float
    tip_squares: float
    ahead_squares: float


def settings_of(way: Way, scene: Scene) -> Settings:
    """The settings with which the driver steers such a phantom."""
    texts = (f"noise {way.noise_mm} mm", "whole shape on")
    return configure(read_settings(texts, COMMAND_LINE), scene, needle="phantom").settings


def scene_of(way: Way) -> Scene:
    """An open scene with this needle."""
    target = Region.ball("T1", "target", (0.0, -50.0, 0.0), 5.0)
    limits = Limits(2.0, (math.pi,), 2, 2.0)
    return Scene("open", Needle(ENTRY, way.radius_mm, 1.0), (0.0, -1.0, 0.0), limits, (target,))


def watched(
    way: Way, seed: int
) -> Iterator[tuple[float, PhantomNeedle, dict[tuple[str, str], Estimate]]]:
    """The depth, the phantom and all estimates after each push."""
    scene = scene_of(way)
    settings = settings_of(way, scene)
    texts = (f"noise {way.noise_mm} mm", "whole shape on")
    chosen = configure(read_settings(texts, COMMAND_LINE), scene, needle="phantom").needle
    assert chosen.parameters is not None
    device = PhantomNeedle(scene.needle, (), seed, SimulatedClock(), chosen.parameters)
    actuator = Compensated(device, Lag(chosen.parameters.torsion.lag_rad))
    estimators = {
        (known, kind): Estimator(
            ENTRY, way.radius_mm, replace(settings.priors, curvature_ratio=ratio)
        )
        for known, ratio in KNOWN.items()
        for kind in KINDS
    }
    for number in range(1, round(LENGTH_MM / way.push_mm) + 1):
        depth_mm = number * way.push_mm
        actuator.push(way.push_mm)
        device.wait(chosen.parameters.sensing.latency_s)
        found = device.measure()
        for (_, kind), estimator in estimators.items():
            estimator.push(way.push_mm)
            estimator.measure(found if kind == "shape" else replace(found, shape=()))
        yield depth_mm, device, {key: one.estimate() for key, one in estimators.items()}
        if abs(depth_mm - ROLL_AT_MM) < 0.5 * way.push_mm:
            actuator.roll(math.pi)
            for estimator in estimators.values():
                estimator.roll(math.pi)


Looks = dict[tuple[str, str, float], Look]
"""By what is known of the curvature, what is measured, and the depth."""

Pushes = dict[tuple[str, str, float], int]
"""By what is known of the curvature, what is measured, and the width."""


def looks(way: Way, seed: int) -> tuple[Looks, Pushes]:
    """What a phantom showed: the looks, and the pushes until the tube was narrow."""
    found: Looks = {}
    narrow: Pushes = {
        (known, kind, width_mm): 0
        for known in KNOWN
        for kind in KINDS
        for width_mm in way.narrow_mm
    }
    for depth_mm, device, estimates in watched(way, seed):
        number = round(depth_mm / way.push_mm)
        for (known, kind), estimate in estimates.items():
            known_mm = _SIGMAS * estimate.position_std_mm(AHEAD_MM)
            for width_mm in way.narrow_mm if depth_mm <= ROLL_AT_MM else ():
                if known_mm > width_mm:
                    narrow[known, kind, width_mm] = number + 1
        if abs(depth_mm / LOOK_MM - round(depth_mm / LOOK_MM)) < 1e-9:
            truth = ahead_of(device)
            for (known, kind), estimate in estimates.items():
                found[known, kind, depth_mm] = compared(way, device, estimate, truth)
    return found, {key: max(1, number) for key, number in narrow.items()}


def ahead_of(device: PhantomNeedle) -> np.ndarray:  # type: ignore[type-arg]
    """Where the tip would be after a further push, followed here through the true tissue."""
    tip, tissue = device.true_tip, device.tissue
    depth_mm = sum(arc.length_mm for arc in device.pierced)
    turned = tissue.turn_rad(tissue.cell(depth_mm))
    step_mm = 0.25
    for _ in range(round(AHEAD_MM / step_mm)):
        cell = tissue.cell(depth_mm)
        tip = roll(tip, tissue.turn_rad(cell) - turned)
        turned = tissue.turn_rad(cell)
        tip = push(tip, device.radius_mm / tissue.curvature_ratio(cell), step_mm)
        depth_mm += step_mm
    return np.array(tip.position_mm)


def compared(
    way: Way,
    device: PhantomNeedle,
    estimate: Estimate,
    ahead: np.ndarray,  # type: ignore[type-arg]
) -> Look:
    """An estimate beside the truth."""
    tissue = device.tissue
    depth_mm = sum(arc.length_mm for arc in device.pierced)
    at_mm = np.arange(0.0, CIRCLE_MM, 0.25)
    left = CIRCLE_MM - at_mm
    ratios = [tissue.curvature_ratio(tissue.cell(depth_mm + float(one))) for one in at_mm]
    radius_mm = way.radius_mm / float(np.average(ratios, weights=left))
    tip = np.subtract(device.true_tip.position_mm, estimate.tip.position_mm)
    guess = push(estimate.tip, estimate.radius_mm, AHEAD_MM).position_mm
    off = ahead - np.array(guess)
    return Look(
        float(tip @ tip),
        float(off @ off),
        estimate.radius_mm / radius_mm - 1.0,
        float(tip @ np.linalg.solve(estimate.position_covariance_mm2(0.0), tip)),
        float(off @ np.linalg.solve(estimate.position_covariance_mm2(AHEAD_MM), off)),
    )


def show(way: Way, found: list[tuple[Looks, Pushes]]) -> None:
    """Prints the table of the looks, and that of the pushes."""
    bound = squared_length_bound(0.05)
    print("curvature known  depth  measured  tip [mm]  5 mm ahead [mm]  radius  tip, ahead in 95 %")
    for known in KNOWN:
        for depth_mm in np.arange(LOOK_MM, LENGTH_MM + 1e-9, LOOK_MM).tolist():
            for kind in KINDS:
                all_looks = [one[known, kind, depth_mm] for one, _ in found]
                tip, ahead = (
                    math.sqrt(np.mean([getattr(one, name) for one in all_looks]))
                    for name in ("tip_mm2", "ahead_mm2")
                )
                radius = math.sqrt(np.mean([one.radius_ratio**2 for one in all_looks]))
                inside = [
                    np.mean([getattr(one, name) <= bound for one in all_looks])
                    for name in ("tip_squares", "ahead_squares")
                ]
                print(
                    f"{known:>15}  {depth_mm:5.0f}  {kind:8}  {tip:8.3f}  {ahead:15.3f}  "
                    f"{100.0 * radius:5.1f} %  {100.0 * inside[0]:5.1f} %, "
                    f"{100.0 * inside[1]:5.1f} %"
                )
    most = round(ROLL_AT_MM / way.push_mm)
    print(f"pushes of {way.push_mm:g} mm until the tube is narrow, of {most} before the roll:")
    for known, kind, width_mm in found[0][1]:
        counts = [narrow[known, kind, width_mm] for _, narrow in found]
        never = sum(one > most for one in counts)
        print(
            f"{known:>15}  {kind:8}  {width_mm:g} mm: median {np.median(counts):.0f}, "
            f"90 % {np.percentile(counts, 90):.0f}; not narrow at the roll: {never} of "
            f"{len(counts)}"
        )


def drive_all(way: Way, count: int, known: str, workers: int) -> int:
    """Drives random tasks; prints how they end, and returns how many touch a region."""
    touched = 0
    radii = (30.0, 164.0)
    with multiprocessing.Pool(workers) as pool:
        kept = pool.starmap(has_plan, [(one, radii) for one in range(count)], chunksize=1)
        tasks = [one for one, has in enumerate(kept) if has]
        for kind in KINDS:
            given = (
                f"noise {way.noise_mm} mm",
                f"whole shape {'on' if kind == 'shape' else 'off'}",
            )
            jobs = [Job(one, radii, 100 * one, known, "", None, False, given) for one in tasks]
            ends: list[End] = pool.map(driven, jobs, chunksize=1)
            reached = sum(one.is_reached for one in ends)
            beside = sum(
                one.ended.outcome == "target reached" and not one.is_reached for one in ends
            )
            pierced = sum(one.clearance_mm < 0.0 for one in ends)
            pulls = np.mean([one.ended.adjustments for one in ends])
            print(
                f"random tasks, regions known: {known}, {kind:5}: {reached} of {len(ends)} reach "
                f"the target, {beside} only seem to, {pierced} touch a region, "
                f"{pulls:.2f} pull-backs each",
                flush=True,
            )
            touched += pierced
    return touched


def main() -> int:
    """Prints all tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--noise", type=float, default=0.3, help="in mm")
    parser.add_argument("--radius", type=float, default=30.0, help="in mm")
    parser.add_argument("--push", type=float, default=2.0, help="in mm")
    parser.add_argument("--narrow", type=float, nargs="+", default=[1.0, 1.2], help="in mm")
    parser.add_argument("--tasks", type=int, default=0, help="so many random tasks are drawn")
    parser.add_argument("--known", default="all", help="all or none")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    way = Way(given.noise, given.radius, given.push, tuple(given.narrow))
    print(f"{given.seeds} phantoms, radius {way.radius_mm:g} mm, noise {way.noise_mm:g} mm")
    with multiprocessing.Pool(given.workers) as pool:
        found = pool.starmap(looks, [(way, seed) for seed in range(given.seeds)], chunksize=4)
    show(way, found)
    return 1 if given.tasks and drive_all(way, given.tasks, given.known, given.workers) else 0


if __name__ == "__main__":
    sys.exit(main())
