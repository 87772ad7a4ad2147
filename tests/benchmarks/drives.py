"""How often the driver reaches the target, and whether a critical region is ever hit.

    python tests/benchmarks/drives.py [--seeds 30] [--noise 0.1 1 2] [--roll-error 1] [--known none]
        [--needle phantom] [SCENE.nsl …]

Each scene is driven with each noise and each seed on the virtual needle (or with each seed on the
phantom needle, which has its own noise), with plans from the engine. Printed are the runs that
reached the target, those that hit a critical region, how the others ended, and the times of whole
syntheses (render, load, solve, certify, rank): the median and the 99th percentile. Ends with 1 if a
region was hit. Default: the paper's scene and the scenarios.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
import time
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

from ntagen.drive.needles import NAMES, choose
from ntagen.drive.records import Journals
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import simulate, synthesiser_for
from ntagen.needle.virtual import Errors
from ntagen.nsl import load
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Scene
from ntagen.units import rad_from_deg

ROOT = Path(__file__).resolve().parents[2]


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
    """A run that was made."""

    outcome: str
    clearance_mm: float
    target_mm: float
    synthesis_s: list[float]


class _Timed:
    """A synthesiser that notes its wall times."""

    def __init__(self, settings: Settings) -> None:
        self._inner = synthesiser_for(settings)
        self.seconds: list[float] = []

    def __call__(self, scene: Scene) -> Synthesis:
        start = time.perf_counter()
        synthesis = self._inner(scene)
        self.seconds.append(time.perf_counter() - start)
        return synthesis


def made(drive: Drive) -> End:
    """Makes a run."""
    scene = load(drive.path)
    chosen = choose(drive.needle, Errors(drive.noise_mm, drive.roll_rad))
    settings = chosen.fitting(chosen.usual(Settings()), scene, drive.known)
    synthesise = _Timed(settings)
    result = simulate(
        scene,
        synthesise,
        settings,
        Journals(),
        known=drive.known,
        make=chosen.make,
        seed=drive.seed,
    )
    return End(
        result.ended.outcome, result.clearance_mm, result.target_distance_mm, synthesise.seconds
    )


def percentile(values: list[float], part: float) -> float:
    """The value below which this part of the values lies."""
    return sorted(values)[min(len(values) - 1, int(part * len(values)))]


def main() -> int:
    """Drives, and prints a line for each scene and noise; 1 if a region was hit."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scenes", nargs="*", type=Path, metavar="SCENE.nsl")
    parser.add_argument("--seeds", type=int, default=30)
    parser.add_argument("--noise", type=float, nargs="+", default=[0.1], help="in mm")
    parser.add_argument("--roll-error", type=float, default=0.0, help="in degrees")
    parser.add_argument("--known", default="all")
    parser.add_argument("--needle", choices=NAMES, default="virtual")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    asked = parser.parse_args()
    scenes = asked.scenes or [
        ROOT / "examples/paper.nsl",
        *sorted((ROOT / "examples/scenarios").glob("*.nsl")),
    ]
    hits = 0
    roll_rad = rad_from_deg(asked.roll_error)
    with multiprocessing.Pool(asked.workers) as pool:
        for path in scenes:
            for noise_mm in asked.noise:
                drive = Drive(path, asked.needle, asked.known, noise_mm, roll_rad, 0)
                runs = [replace(drive, seed=seed) for seed in range(1, asked.seeds + 1)]
                ends = pool.map(made, runs, chunksize=1)
                reached = sum(
                    end.outcome == "target reached" and end.target_mm <= 0.0 for end in ends
                )
                others = Counter(end.outcome for end in ends if end.outcome != "target reached")
                missed = sum(
                    end.outcome == "target reached" and end.target_mm > 0.0 for end in ends
                )
                hit = sum(end.clearance_mm <= 0.0 for end in ends)
                hits += hit
                seconds = [s for end in ends for s in end.synthesis_s]
                print(
                    f"{path.stem:16} noise {noise_mm:4g} mm: {reached:3} of {len(ends)} reach the "
                    f"target, {hit} hit, least clearance "
                    f"{min(end.clearance_mm for end in ends):5.2f} mm; "
                    f"synthesis p50 {1e3 * percentile(seconds, 0.5):4.0f} ms, "
                    f"p99 {1e3 * percentile(seconds, 0.99):4.0f} ms; "
                    f"{missed} beside the target, {dict(others)}",
                    flush=True,
                )
    return 1 if hits else 0


if __name__ == "__main__":
    sys.exit(main())
