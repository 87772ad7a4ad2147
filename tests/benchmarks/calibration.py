"""How well five insertions calibrate a needle, on phantoms (`ntagen calibrate needle`).

    python -m tests.benchmarks.calibration [--seeds 100] [--workers 2]

For each kind of needle, each seed draws five phantoms, which differ as insertions do. They are
inserted by the recipe, and measured every mm. The calibration begins with a radius that is 20 % too
great, and a bevel that is off by the true angle. Printed are, for radius, bevel and lag: the true
value, the mean and the standard deviation of what was found, the mean of the claimed standard
deviations, and how many of the true values lie within one and two of them (68 % and 95 % if the
claims are exact; more if they are too large), of so many that were not refused. Ends with 1 if
fewer than 90 % lie within two.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import sys
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ntagen.errors import InputError
from ntagen.needle.kinematics import orthonormal, roll
from ntagen.needle.phantom import PhantomNeedle
from ntagen.needle.phantom_parameters import PhantomParameters
from ntagen.needle.virtual import SimulatedClock
from ntagen.scene import Needle, Pose
from ntagen.tracking.insertions import Insertion, Turn
from ntagen.tracking.needle_fit import Known, find_needle
from ntagen.tracking.recipe import ANGLES_DEG, recipe

ENTRY: Final = Pose((0.0, 0.0, 0.0), heading=(0.0, -1.0, 0.0), bevel=(0.0, 0.0, 1.0))
LEAST: Final = 0.9


@dataclass(frozen=True)
class Kind:
    """A kind of needle: what is true of it, and the noise of the tracker."""

    radius_mm: float
    length_mm: float
    bevel_deg: float
    lag_deg: float
    noise_mm: float


KINDS: Final = (
    Kind(30.0, 60.0, 6.0, 45.0, 0.08),
    Kind(64.0, 120.0, 6.0, 40.0, 0.08),
    Kind(64.0, 120.0, -12.0, 10.0, 0.08),
    Kind(64.0, 120.0, 6.0, 40.0, 0.3),
    Kind(164.0, 120.0, 6.0, 40.0, 0.08),
)


def inserted(kind: Kind, seed: int, spacing_mm: float = 1.0) -> list[Insertion]:
    """The insertions of the recipe."""
    usual = PhantomParameters()
    parameters = replace(
        usual,
        torsion=replace(usual.torsion, lag_rad=math.radians(kind.lag_deg)),
        sensing=replace(usual.sensing, noise_mm=kind.noise_mm),
    )
    tip = orthonormal(roll(ENTRY, math.radians(kind.bevel_deg)))
    needle = Needle(tip, kind.radius_mm, 1.0, kind.length_mm)
    depth_mm, roll_mm = recipe(needle)
    found = []
    for number, angle_deg in enumerate(ANGLES_DEG):
        phantom = PhantomNeedle(needle, (), 1000 * seed + number, SimulatedClock(), parameters)
        one = Insertion(f"insertion {number + 1}")
        for step in range(1, round(depth_mm / spacing_mm) + 1):
            phantom.push(spacing_mm)
            phantom.wait(0.1)
            one.measure(step * spacing_mm, phantom.measure().position_mm)
            if angle_deg and step * spacing_mm == roll_mm:
                one.turns.append(Turn(roll_mm, math.radians(angle_deg)))
                phantom.roll(math.radians(angle_deg))
        found.append(one)
    return found


def calibrated(kind: Kind, seed: int) -> tuple[Known, Known, Known] | None:
    """What is found of one needle; None if the insertions are refused."""
    guess = Needle(ENTRY, 1.2 * kind.radius_mm, 1.0, kind.length_mm)
    try:
        found = find_needle(guess, inserted(kind, seed))
    except InputError:
        return None
    return found.radius_mm, found.bevel_rad, found.lag_rad


def main() -> int:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    is_good = True
    print("noise  what            true   found  spread  claimed  within 1, 2 of the claimed")
    with multiprocessing.Pool(given.workers) as pool:
        for kind in KINDS:
            jobs = [(kind, seed) for seed in range(given.seeds)]
            made = pool.starmap(calibrated, jobs, chunksize=4)
            rows = [row for row in made if row is not None]
            degrees = 180.0 / math.pi
            truths = (
                ("radius [mm]", kind.radius_mm, 1.0),
                ("bevel [deg]", kind.bevel_deg, degrees),
                ("lag [deg]", kind.lag_deg, degrees),
            )
            for index, (name, true, factor) in enumerate(truths):
                values = factor * np.array([row[index].value for row in rows])
                stds = factor * np.array([row[index].std for row in rows])
                off = np.abs(values - true) / stds
                one, two = float(np.mean(off <= 1.0)), float(np.mean(off <= 2.0))
                is_good &= two >= LEAST
                print(
                    f"{kind.noise_mm:5.2f}  {name:12} {true:7.1f} {values.mean():7.1f} "
                    f"{values.std():7.2f} {stds.mean():8.2f}  {100.0 * one:5.0f} %, "
                    f"{100.0 * two:3.0f} % of {len(rows)}",
                    flush=True,
                )
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main())
