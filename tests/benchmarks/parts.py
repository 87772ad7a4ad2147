"""What each part of the driver gains: random tasks, driven on the phantom needle with and without.

    python -m tests.benchmarks.parts [--first 0] [--count 40] [--seeds 1] [--known all none]
        [--without prospects tube …] [--radii 30,164] [--timeout S] [--workers 2]

Each task has one target 40 to 100 mm deep, and up to seven spheres, capsules and boxes to avoid;
tasks without a plan are left out. For all parts together, and without each that is named, printed
are: the drives that reach the target, those that touch a region and those that only seem to arrive;
the medians of syntheses, pull-backs, cut length and time; median and 99th percentile of a whole
synthesis. What was touched is computed here from the arcs that were really cut.

The parts: ``processes`` (curvature and bend plane swing along the depth; without, they are
constant), ``tube`` (`ntagen.drive.tube`), ``guarantee`` (`ntagen.drive.posterior`), ``prospects``
(`ntagen.plan.prospects`), ``patience`` (a plan with enough reserve is kept; without, a plan is
looked for at each review), ``passing`` (a region that is felt may be passed), ``smaller`` (learned
regions are assumed smaller before the driver gives up), ``time`` (deep targets have more time than
120 s). Ends with 1 if a region was touched.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import statistics
import sys
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import Final
from unittest.mock import patch

import numpy as np

from ntagen import nsl
from ntagen.drive.configure import COMMAND_LINE, configure
from ntagen.drive.records import Ended, Journals
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import Simulated, simulate, synthesiser_for
from ntagen.needle.estimate import Ahead, Estimate, Estimator
from ntagen.needle.kinematics import orthonormal
from ntagen.needle.path import Path
from ntagen.needle.phantom import PhantomNeedle
from ntagen.needle.virtual import Obstacle
from ntagen.nsl.driving import read_settings
from ntagen.scene import Needle, Pose, Vector
from tests.benchmarks.drives import percentile
from tests.benchmarks.rounding import drawn_task, text_of
from tests.benchmarks.spinning import least_mm

_AHEAD_MM: Final = 30.0
"""Estimates give the mean curvature over so much."""

_TOLD_MM: Final = 0.01
"""A tip whose true pose is told is known this well."""


@dataclass(frozen=True)
class Job:
    """A drive, without some part.

    Attributes:
        task: The number of the task.
        radii: The least and the greatest radius of its needle in mm.
        seed: The seed of the phantom.
        known: The critical regions that the driver knows.
        without: The part; empty for none.
        timeout_s: The time limit; None for the usual one.
        is_told: Whether the driver is told the true pose and curvature.
        given: Settings, in the words of `drive { … }`.
    """

    task: int
    radii: tuple[float, float]
    seed: int
    known: str
    without: str
    timeout_s: float | None
    is_told: bool
    given: tuple[str, ...] = ()


@dataclass(frozen=True)
class End:
    """How a drive ended; distances are those of this module, in mm, negative inside."""

    job: Job
    ended: Ended
    clearance_mm: float
    target_mm: float
    synthesis_s: list[float]

    @property
    def is_reached(self) -> bool:
        """Whether the driver says that it is in the target, and it is true."""
        return self.ended.outcome == "target reached" and self.target_mm <= 0.0


def _plain(settings: Settings) -> Settings:
    """The settings with an estimator that knows of no processes."""
    even = {"curvature_drift": 0.0, "turn_drift_rad": 0.0, "distortion_mm": 0.0}
    priors = replace(settings.priors, **even, first_ratio=0.0, bite_mm=0.0)
    return replace(settings, priors=priors)


CHANGES: Final[dict[str, Callable[[Settings], Settings]]] = {
    "processes": _plain,
    "tube": lambda settings: replace(settings, accept=1e-9),
    "guarantee": lambda settings: replace(settings, guarantee=False),
    "passing": lambda settings: replace(settings, felt_clearance_mm=settings.sensing_margin_mm),
    "time": lambda settings: replace(settings, timeout_s=Settings().timeout_s),
}
"""The settings without a part."""

PATCHES: Final[dict[str, tuple[str, Callable[..., object]]]] = {
    "prospects": ("ntagen.drive.planning.by_prospect", lambda synthesis, *_: synthesis),
    "patience": ("ntagen.drive.controller.is_enough", lambda *_: False),
    "smaller": ("ntagen.drive.knowledge.Knowledge.doubted", lambda *_: None),
}
"""What takes the place of a part in the code."""


class Told(Estimator):
    """An estimator that is told the true pose of the tip, and its curvature over the next 30 mm."""

    needle: PhantomNeedle

    def estimate(self) -> Estimate:
        """The estimate, moved to where the needle truly is."""
        found, needle = super().estimate(), Told.needle
        truth, tissue = needle.true_tip, needle.tissue
        cells = range(
            tissue.cell(self.depth_mm), max(1, tissue.cell(self.depth_mm + _AHEAD_MM)) + 1
        )
        ratio = statistics.fmean(tissue.curvature_ratio(cell) for cell in cells)
        covariance = found.ahead.covariance.copy()
        covariance[:6] = covariance[:, :6] = 0.0
        covariance[:6, :6] = _TOLD_MM**2 * np.eye(6)
        return replace(
            found,
            path=_moved(found.path, orthonormal(truth)),
            radius_mm=needle.radius_mm / ratio,
            ahead=Ahead(covariance, found.ahead.differences),
        )


def _moved(path: Path, tip: Pose) -> Path:
    """A path, moved as a whole so that it ends in a pose."""
    before = orthonormal(path.tip)
    turn = _axes(tip).T @ _axes(before)
    middle, origin = np.array(tip.position_mm), np.array(before.position_mm)

    def vector(values: np.ndarray) -> Vector:  # type: ignore[type-arg]
        x, y, z = (float(value) for value in values)
        return (x, y, z)

    def moved(pose: Pose) -> Pose:
        place = middle + turn @ (np.array(pose.position_mm) - origin)
        heading, bevel = (turn @ np.array(one) for one in (pose.heading, pose.bevel))
        return Pose(vector(place), vector(heading), vector(bevel))

    stretches = tuple(
        replace(one, arc=replace(one.arc, start=moved(one.arc.start))) for one in path.stretches
    )
    return Path(moved(path.entry), stretches, path.pending_roll_rad)


def _axes(pose: Pose) -> np.ndarray:  # type: ignore[type-arg]
    """The axes of a pose as rows."""
    return np.array([pose.heading, pose.bevel, np.cross(pose.heading, pose.bevel)])


def driven(job: Job) -> End:
    """Makes a drive."""
    task = drawn_task(job.task, job.radii)
    scene = nsl.loads(text_of(task))
    given = read_settings(job.given, COMMAND_LINE)
    configuration = configure(given, scene, job.known, "phantom")
    settings = CHANGES.get(job.without, lambda one: one)(configuration.settings)
    if job.timeout_s is not None:
        settings = replace(settings, timeout_s=job.timeout_s)

    def make(needle: Needle, obstacles: tuple[Obstacle, ...], seed: int) -> Simulated:
        Told.needle = configuration.needle.make(needle, obstacles, seed)  # type: ignore[assignment, misc]
        return Told.needle

    with ExitStack() as stack:
        if job.without in PATCHES:
            stack.enter_context(patch(*PATCHES[job.without]))
        if job.is_told:
            stack.enter_context(patch("ntagen.drive.steering.Estimator", Told))
        synthesise = synthesiser_for(settings)
        result = simulate(
            scene,
            synthesise,
            settings,
            Journals(),
            known=job.known,
            make=make,
            seed=job.seed,
        )
    seconds = [one.loop_seconds for one in result.syntheses]
    away_mm = result.target_distance_mm
    return End(job, result.ended, least_mm(task, result), away_mm, seconds)


def has_plan(task: int, radii: tuple[float, float]) -> bool:
    """Whether a task has a plan from the entry."""
    scene = nsl.loads(text_of(drawn_task(task, radii)))
    return synthesiser_for(Settings())(scene).best is not None


def show(name: str, ends: list[End], all_reached: int) -> int:
    """Prints the line of all drives without a part; returns how many touched a region."""
    reached = sum(end.is_reached for end in ends)
    touched = sum(end.clearance_mm < 0.0 for end in ends)
    beside = sum(end.ended.outcome == "target reached" and not end.is_reached for end in ends)
    seconds = [one for end in ends for one in end.synthesis_s]
    arrived = [end.ended for end in ends if end.is_reached] or [ends[0].ended]
    syntheses = statistics.median(one.syntheses for one in arrived)
    cut_mm, time_s = (
        statistics.median(getattr(one, name) for one in arrived) for name in ("cut_mm", "time_s")
    )
    print(
        f"{name:18} {reached:4} of {len(ends)} reach the target "
        f"({reached / max(1, all_reached):.3f}), {touched} touch a region, {beside} beside it; "
        f"medians of those that arrive: {syntheses:.0f} syntheses, {cut_mm:.0f} mm cut, "
        f"{time_s:.0f} s; "
        f"{statistics.fmean(one.ended.adjustments for one in ends):.2f} pull-backs each; "
        f"synthesis p50 {1e3 * percentile(seconds, 0.5):.0f} ms, "
        f"p99 {1e3 * percentile(seconds, 0.99):.0f} ms",
        flush=True,
    )
    others = Counter(end.ended.reason for end in ends if not end.is_reached)
    for reason, count in others.most_common():
        print(f"    {count} end: {reason}", flush=True)
    return touched


def asked() -> argparse.Namespace:
    """What the command line says."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=40, help="so many tasks")
    parser.add_argument("--seeds", type=int, default=1, help="so many drives of each")
    parser.add_argument("--known", nargs="+", default=["all"], help="all, none, or names")
    parser.add_argument(
        "--without", nargs="*", default=["prospects", "tube"], choices=[*CHANGES, *PATCHES]
    )
    parser.add_argument("--radii", default="30,164", help="in mm")
    parser.add_argument("--timeout", type=float, help="in s on the needle's clock")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    # The driver is told the true pose and curvature: how much is left to gain by estimating.
    parser.add_argument("--oracle", action="store_true", help=argparse.SUPPRESS)
    return parser.parse_args()


def main() -> int:
    """Drives, and prints a line for each part."""
    arguments = asked()
    least, most = map(float, arguments.radii.split(","))
    numbers = range(arguments.first, arguments.first + arguments.count)
    touched = 0
    with multiprocessing.Pool(arguments.workers) as pool:
        kept = pool.starmap(has_plan, [(one, (least, most)) for one in numbers], chunksize=1)
        tasks = [one for one, has in zip(numbers, kept, strict=True) if has]
        print(f"{len(tasks)} of {len(numbers)} tasks have a plan")
        for known in arguments.known:
            ways = [("all parts", "", False)]
            ways += [(f"without {one}", one, False) for one in arguments.without]
            ways += [("told the truth", "", True)] if arguments.oracle else []
            reached = 0
            for name, without, is_told in ways:
                jobs = [
                    Job(task, (least, most), seed, known, without, arguments.timeout, is_told)
                    for task in tasks
                    for seed in range(100 * task, 100 * task + arguments.seeds)
                ]
                ends = pool.map(driven, jobs, chunksize=1)
                reached = reached or sum(end.is_reached for end in ends)
                touched += show(f"{known}: {name}", ends, reached)
    return 1 if touched else 0


if __name__ == "__main__":
    sys.exit(main())
