"""How often the driver reaches the target, and whether a critical region is ever hit.

    python tests/benchmarks/drives.py [--seeds 30] [--noise 0.1 1 2] [--roll-error 1]
        [--known all none] [--needle phantom] [--workers 2] [--least 0.95] [--runs] [SCENE.nsl …]

Each scene is driven with each noise and each seed on the virtual needle (or with each seed on the
phantom needle, which has its own noise), with plans from the engine, and with the critical regions
known or hidden. Printed are the runs that reached the target, those that hit a critical region, the
least true clearance, how the others ended, and the times of whole syntheses (render, load, solve,
certify, rank): the median and the 99th percentile. With `--runs`, each run that failed has a line:
its end, what cost it time, and what it learned. The yardstick: no region is hit, and where there is
a plan from the entry of the true scene, at least 95 % of the runs (`--least`) reach the target.
Default: the paper's scene and the scenarios.

The truth is computed here: the arcs that were really cut are sampled, with code that shares nothing
with the driver or the needles. Ends with 1 if a region was hit, with 2 if too few runs reached the
target.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import os
import sys
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ntagen.drive.needles import NAMES, choose
from ntagen.drive.records import Journals, Learned, Measured, Record, Transition
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import Simulated, simulate, synthesiser_for
from ntagen.needle.kinematics import Arc
from ntagen.needle.virtual import Errors, Obstacle
from ntagen.nsl import load
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Needle, Region, Scene, Vector
from ntagen.units import rad_from_deg

ROOT = Path(__file__).resolve().parents[2]
SPACING_MM = 0.01
EVENTS = ("deviation", "force", "strategy from farther back", "the plan no longer holds")


@dataclass(frozen=True)
class Drive:
    """A run that is wanted."""

    path: Path
    needle: str
    known: str
    noise_mm: float
    roll_rad: float
    seed: int


@dataclass(frozen=True)
class End:
    """A run that was made; the distances are those of this module."""

    seed: int
    outcome: str
    time_s: float
    clearance_mm: float
    target_mm: float
    synthesis_s: list[float]
    story: list[str]

    @property
    def is_reached(self) -> bool:
        """Whether the driver says so, and it is true."""
        return self.outcome == "target reached" and self.target_mm <= 0.0


class Watched:
    """A needle whose cut arcs are noted before each pull, when some may be lost."""

    def __init__(self, needle: Simulated) -> None:
        self._needle = needle
        self._arcs: dict[Arc, None] = {}

    def __getattr__(self, name: str) -> object:
        return getattr(self._needle, name)

    def pull(self, length_mm: float) -> None:
        """Notes what was cut, and pulls."""
        self._arcs.update(dict.fromkeys(self._needle.pierced))
        self._needle.pull(length_mm)

    def cut(self) -> list[Arc]:
        """All arcs that were cut up to now."""
        return [*self._arcs, *self._needle.pierced]


def clearance_mm(arcs: Iterable[Arc], regions: Iterable[Region]) -> float:
    """The least distance of the arcs to the surfaces of the regions, by samples.

    It is never too great: half the distance between two samples is taken off.
    """
    least_mm = math.inf
    spheres = [(np.array(region.center_mm), region.radius_mm) for region in regions]
    for arc in arcs if spheres else ():
        count = 2 + int(arc.length_mm / SPACING_MM)
        turned = np.linspace(0.0, arc.length_mm / arc.radius_mm, count)[:, None]
        points = (
            np.array(arc.start.position_mm)
            + arc.radius_mm * np.sin(turned) * np.array(arc.start.heading)
            - arc.radius_mm * (1.0 - np.cos(turned)) * np.array(arc.start.bevel)
        )
        for center, radius_mm in spheres:
            nearest_mm = float(np.sqrt(((points - center) ** 2).sum(axis=1)).min())
            least_mm = min(least_mm, nearest_mm - radius_mm - 0.5 * SPACING_MM)
    return least_mm


class Story:
    """A journal that keeps what cost a run time, and what was learned."""

    def __init__(self) -> None:
        self.words: list[str] = []
        self._depth_mm = 0.0

    def record(self, record: Record) -> None:
        """Notes events and learned critical regions."""
        if isinstance(record, Measured):
            self._depth_mm = record.depth_mm
        elif isinstance(record, Transition) and record.event in EVENTS:
            self.words.append(f"{record.event} at {record.time_s:.0f} s, {self._depth_mm:.1f} mm")
        elif isinstance(record, Learned) and record.kind == "critical":
            x, y, z = record.center_mm
            self.words.append(f"learned r {record.radius_mm:.1f} at ({x:.1f}, {y:.1f}, {z:.1f})")

    def started(self, scene: Scene) -> None:
        """Does nothing."""

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Does nothing."""


def made(drive: Drive) -> End:
    """Makes a run."""
    scene = load(drive.path)
    # A needle with its own errors keeps its own noise.
    noise_mm = drive.noise_mm if drive.needle == "virtual" else None
    chosen = choose(drive.needle, Errors(noise_mm, drive.roll_rad))
    settings = chosen.fitting(chosen.usual(Settings(), scene), scene, drive.known)
    watched: list[Watched] = []

    def make(needle: Needle, obstacles: tuple[Obstacle, ...], seed: int) -> Simulated:
        watched.append(Watched(chosen.make(needle, obstacles, seed)))  # type: ignore[misc]
        return watched[-1]  # type: ignore[return-value]

    story = Story()
    result = simulate(
        scene,
        synthesiser_for(settings),
        settings,
        Journals(story),
        known=drive.known,
        make=make,
        seed=drive.seed,
    )
    last = scene.targets[-1]
    tip_mm: Vector = watched[0].true_tip.position_mm  # type: ignore[attr-defined]
    return End(
        drive.seed,
        result.ended.outcome,
        result.ended.time_s,
        clearance_mm(watched[0].cut(), scene.criticals),
        math.dist(tip_mm, last.center_mm) - last.radius_mm,
        [one.loop_seconds for one in result.syntheses],
        story.words,
    )


def has_path(path: Path) -> bool:
    """Whether there is a plan for the true scene from the entry."""
    return synthesiser_for(Settings())(load(path)).best is not None


def percentile(values: list[float], part: float) -> float:
    """The value below which this part of the values lies."""
    return sorted(values)[min(len(values) - 1, int(part * len(values)))]


def shown(drive: Drive, ends: list[End], exists: bool, least: float) -> tuple[bool, bool]:
    """Prints the line of a scene; returns whether no region was hit and enough runs reached."""
    reached = sum(end.is_reached for end in ends)
    others = Counter(end.outcome for end in ends if end.outcome != "target reached")
    missed = sum(end.outcome == "target reached" and not end.is_reached for end in ends)
    hit = sum(end.clearance_mm <= 0.0 for end in ends)
    seconds = [s for end in ends for s in end.synthesis_s]
    is_enough = not exists or reached >= least * len(ends)
    noise = f"noise {drive.noise_mm:4g} mm" if drive.needle == "virtual" else drive.needle
    wanted = f"at least {least:.0%}" if exists else "no plan from the entry"
    print(
        f"{drive.path.stem:14} known {drive.known:4} {noise}: {reached:3} of {len(ends)} reach the "
        f"target ({wanted}: {'met' if is_enough else 'MISSED'}), {hit} hit (0: "
        f"{'MISSED' if hit else 'met'}), least clearance "
        f"{min(end.clearance_mm for end in ends):5.2f} mm; "
        f"synthesis p50 {1e3 * percentile(seconds, 0.5):4.0f} ms, "
        f"p99 {1e3 * percentile(seconds, 0.99):4.0f} ms; "
        f"{missed} beside the target, {dict(others)}",
        flush=True,
    )
    return hit == 0, is_enough


def asked() -> argparse.Namespace:
    """What the command line says."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scenes", nargs="*", type=Path, metavar="SCENE.nsl")
    parser.add_argument("--seeds", type=int, default=30)
    parser.add_argument("--noise", type=float, nargs="+", default=[0.1], help="in mm")
    parser.add_argument("--roll-error", type=float, default=0.0, help="in degrees")
    parser.add_argument("--known", nargs="+", default=["all"], help="all, none, or names")
    parser.add_argument("--needle", choices=NAMES, default="virtual")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--least", type=float, default=0.95, help="the part that must reach")
    parser.add_argument("--runs", action="store_true", help="a line for each run that failed")
    arguments = parser.parse_args()
    if arguments.needle != "virtual":
        arguments.noise = [0.0]
    return arguments


def main() -> int:
    """Drives, and prints a line for each scene, knowledge and noise."""
    arguments = asked()
    scenes = arguments.scenes or [
        ROOT / "examples/paper.nsl",
        *sorted((ROOT / "examples/scenarios").glob("*.nsl")),
    ]
    roll_rad = rad_from_deg(arguments.roll_error)
    unhurt, enough = True, True
    with multiprocessing.Pool(arguments.workers) as pool:
        for path in scenes:
            exists = has_path(path)
            for known in arguments.known:
                for noise_mm in arguments.noise:
                    drive = Drive(path, arguments.needle, known, noise_mm, roll_rad, 0)
                    runs = [replace(drive, seed=seed) for seed in range(1, arguments.seeds + 1)]
                    ends = pool.map(made, runs, chunksize=1)
                    is_unhurt, is_enough = shown(drive, ends, exists, arguments.least)
                    unhurt, enough = unhurt and is_unhurt, enough and is_enough
                    for end in ends if arguments.runs and exists else ():
                        if not end.is_reached:
                            said = "; ".join(end.story)
                            print(f"    seed {end.seed}: {end.outcome}, {end.time_s:.0f} s: {said}")
    if not unhurt:
        return 1
    return 0 if enough else 2


if __name__ == "__main__":
    sys.exit(main())
