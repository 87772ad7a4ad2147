"""What prospects gain: random tasks, driven on the phantom needle with and without them.

    python tests/benchmarks/prospects.py [--first 0] [--tasks 40] [--seeds 1] [--workers 2]

Each task has a target 40 to 100 mm deep, a needle with a radius of 30 to 160 mm, and up to seven
critical regions, all known; tasks without a plan are left out. Printed are, with prospects
(`ntagen.plan.prospects`) and without: the drives that reach the target, those that hit a region or
only seem to reach the target, the means of syntheses and pull-backs, and the time of a whole
synthesis. The last line is the ratio of the drives that fail. The truth is computed by
``drives.py``. Ends with 1 if a region was hit.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import random
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

from drives import Drive, End, made, percentile

from ntagen.drive.settings import Settings
from ntagen.drive.simulate import synthesiser_for
from ntagen.nsl import load

RADII_MM = (30, 45, 60, 100, 130, 160)
ANGLES = ("90, 180, 270", "60, 120, 180, 240, 300")
PULLED = "strategy from farther back"


def task(number: int) -> str:
    """A random task; critical regions are spheres, which ``drives.py`` can measure."""
    draw = random.Random(f"prospects {number}")
    depth_mm = draw.uniform(40.0, 100.0)
    middle = (draw.uniform(-10.0, 10.0), -depth_mm, draw.uniform(-10.0, 10.0))
    radius_mm = draw.choice([3, 4, 5, 8])
    regions = []
    for _ in range(draw.randint(1, 7)):
        place = (
            draw.uniform(-14.0, 14.0),
            -draw.uniform(12.0, depth_mm - 12.0),
            draw.uniform(-14.0, 14.0),
        )
        regions.append((place, draw.choice([2, 3, 4, 5])))
    lines = [
        f"environment task_{number} {{",
        "  needle { tip (0, 0, 0) mm heading -y bevel +z "
        f"radius {draw.choice(RADII_MM)} mm speed 1 mm/s length 120 mm }}",
        f"  motion {{ step 2 s roll by {draw.choice(ANGLES)} deg at most {draw.choice([1, 2, 2])} "
        "times at least 4 mm apart }",
        f"  target T sphere {_shown(middle)} radius {radius_mm} mm",
        *(
            f"  critical C{index} sphere {_shown(place)} radius {size} mm"
            for index, (place, size) in enumerate(regions)
        ),
        "  safety swept",
        "}",
    ]
    return "\n".join(lines)


def _shown(place: tuple[float, float, float]) -> str:
    return "({:.3f}, {:.3f}, {:.3f}) mm".format(*place)


@dataclass(frozen=True)
class Job:
    """A drive, with prospects or without."""

    drive: Drive
    has_prospects: bool


def driven(job: Job) -> End:
    """Makes the drive."""
    if job.has_prospects:
        return made(job.drive)
    with patch("ntagen.drive.planning.prefers", return_value=False):
        return made(job.drive)


def shown(name: str, ends: list[End]) -> tuple[int, int]:
    """Prints the line of one way to choose plans; returns how many drives fail and hit."""
    reached = sum(end.is_reached for end in ends)
    seem = sum(end.outcome == "target reached" and not end.is_reached for end in ends)
    hit = sum(end.clearance_mm <= 0.0 for end in ends)
    seconds = [one for end in ends for one in end.synthesis_s]
    pulls = sum(word.startswith(PULLED) for end in ends for word in end.story)
    print(
        f"{name:18} {reached:4} of {len(ends)} reach the target, {hit} hit, {seem} beside it; "
        f"{len(seconds) / len(ends):5.1f} syntheses and {pulls / len(ends):4.2f} pull-backs each; "
        f"synthesis p50 {1e3 * percentile(seconds, 0.5):4.0f} ms, "
        f"p99 {1e3 * percentile(seconds, 0.99):4.0f} ms",
        flush=True,
    )
    return len(ends) - reached, hit


def main() -> int:
    """Drives, and prints both lines and the ratio."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--tasks", type=int, default=40)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as name, multiprocessing.Pool(asked.workers) as pool:
        paths = []
        for number in range(asked.first, asked.first + asked.tasks):
            path = Path(name) / f"task_{number}.nsl"
            path.write_text(task(number))
            if synthesiser_for(Settings())(load(path)).best is not None:
                paths.append(path)
        drives = [
            Drive(path, "phantom", "all", 0.0, 0.0, seed)
            for path in paths
            for seed in range(1, asked.seeds + 1)
        ]
        print(f"{len(paths)} of {asked.tasks} tasks have a plan")
        results = []
        for label, has_prospects in (("with prospects", True), ("without", False)):
            jobs = [Job(drive, has_prospects) for drive in drives]
            results.append(shown(label, pool.map(driven, jobs, chunksize=1)))
    (failed, hit), (failed_without, hit_without) = results
    print(f"ratio of the drives that fail: {failed / max(1, failed_without):.2f}")
    return 1 if hit or hit_without else 0


if __name__ == "__main__":
    sys.exit(main())
