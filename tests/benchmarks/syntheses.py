"""Whether a thousand syntheses in one process take equal times and leave no memory behind.

    python tests/benchmarks/syntheses.py [--count 1000] [--seed 1]

This is what the driver asks of the engine: after each measurement a model with another pose,
another radius of the motion circle and other regions. Each synthesis renders, loads and solves one,
and keeps nothing. Printed are the median and the 99th percentile of the processor time (which other
load on the machine hardly changes), and the resident memory after the first tenth and at the end,
once garbage is collected.
"""

from __future__ import annotations

import argparse
import gc
import math
import random
import resource
import statistics
import time
from dataclasses import replace
from pathlib import Path

from ntagen import checker
from ntagen.nsl import load
from ntagen.render import render
from ntagen.scene import Pose, Region, Scene, Vector
from ntagen.shapes import Sphere

ROOT = Path(__file__).resolve().parents[2]
QUERY = "control: A<> Checker.Final_TR_Reached"
MOST_TILT_RAD = math.radians(5)
MOST_SHIFT_MM = 2.0
LEAST_RADIUS_MM, MOST_RADIUS_MM = 28.0, 36.0


def _moved(region: Region, numbers: random.Random) -> Region:
    """The region with its centre a little elsewhere and another radius."""
    x, y, z = (part + numbers.uniform(-MOST_SHIFT_MM, MOST_SHIFT_MM) for part in region.center_mm)
    ball = Sphere((x, y, z), region.radius_mm * numbers.uniform(0.9, 1.1))
    return replace(region, shape=ball)


def _tilted(pose: Pose, numbers: random.Random) -> Pose:
    """The pose turned about the x-axis and shifted."""
    angle = numbers.uniform(-MOST_TILT_RAD, MOST_TILT_RAD)
    cosine, sine = math.cos(angle), math.sin(angle)

    def turned(vector: Vector) -> Vector:
        x, y, z = vector
        return (x, cosine * y - sine * z, sine * y + cosine * z)

    x, y, z = pose.position_mm
    shift_mm = numbers.uniform(-MOST_SHIFT_MM, MOST_SHIFT_MM)
    return Pose((x + shift_mm, y, z), turned(pose.heading), turned(pose.bevel))


def _varied(scene: Scene, numbers: random.Random) -> Scene:
    """A scene like this one as it could be measured."""
    tip = _tilted(scene.needle.tip, numbers)
    radius_mm = numbers.uniform(LEAST_RADIUS_MM, MOST_RADIUS_MM)
    return replace(
        scene,
        needle=replace(scene.needle, tip=tip, radius_mm=radius_mm),
        targets=tuple(_moved(region, numbers) for region in scene.targets),
        criticals=tuple(_moved(region, numbers) for region in scene.criticals),
        detections=tuple(_moved(region, numbers) for region in scene.detections),
    )


def _resident_mb() -> float:
    """The resident memory of this process, once garbage is collected."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def main() -> None:
    """Runs the syntheses and prints what they took."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    numbers = random.Random(arguments.seed)
    scene = load(ROOT / "examples/paper.nsl")
    seconds: list[float] = []
    verdicts: dict[str, int] = {}
    early_mb = 0.0
    for index in range(arguments.count):
        varied = _varied(scene, numbers)
        start = time.process_time()
        answer = checker.load(render(varied)).check(QUERY, plans="all", max_plans=1)
        seconds.append(time.process_time() - start)
        verdicts[answer.verdict] = verdicts.get(answer.verdict, 0) + 1
        if index + 1 == max(1, arguments.count // 10):
            early_mb = _resident_mb()
    late_mb = _resident_mb()
    seconds.sort()
    median = statistics.median(seconds)
    ninety_ninth = seconds[math.ceil(0.99 * len(seconds)) - 1]
    print("verdicts         ", ", ".join(f"{count} {name}" for name, count in verdicts.items()))
    print(f"median           {1000 * median:9.2f} ms")
    print(f"99th percentile  {1000 * ninety_ninth:9.2f} ms   ratio {ninety_ninth / median:6.3f}")
    print(f"resident memory  {early_mb:9.2f} MB after a tenth, {late_mb:.2f} MB at the end")


if __name__ == "__main__":
    main()
