"""Makes the five insertions that calibrate a needle, with a phantom needle.

    python examples/tracker/make_insertions.py examples/needles/bent_tip.nsl > insertions.csv
    ntagen calibrate needle examples/needles/bent_tip.nsl insertions.csv

The phantom bends with another radius than the task says, its bevel is turned, and its tip lags; so
what the calibration finds can be compared with `--radius`, `--bevel` and `--lag`.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

from ntagen.needle.kinematics import orthonormal, roll
from ntagen.needle.phantom import PhantomNeedle
from ntagen.needle.phantom_parameters import PhantomParameters
from ntagen.needle.virtual import SimulatedClock
from ntagen.nsl import load
from ntagen.scene import Needle

SPACING_MM = 1.0
REST_S = 0.1


def asked() -> argparse.Namespace:
    """What the command line says."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("environment", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--radius", type=float, default=64.0, help="the true one, in mm")
    parser.add_argument("--bevel", type=float, default=6.0, help="from that of the task, in deg")
    parser.add_argument("--lag", type=float, default=40.0, help="at a depth of 100 mm, in deg")
    parser.add_argument("--noise", type=float, default=0.08, help="in mm")
    return parser.parse_args()


def main() -> None:
    """Prints the table."""
    given = asked()
    command = [sys.executable, "-m", "ntagen", "calibrate", "needle", str(given.environment)]
    recipe = json.loads(subprocess.check_output([*command, "--json"], text=True))
    needle = load(given.environment).needle
    tip = orthonormal(roll(needle.tip, math.radians(given.bevel)))
    usual = PhantomParameters()
    parameters = replace(
        usual,
        torsion=replace(usual.torsion, lag_rad=math.radians(given.lag)),
        sensing=replace(usual.sensing, noise_mm=given.noise),
    )
    print("insertion,depth_mm,roll_deg,x_mm,y_mm,z_mm")
    for number, one in enumerate(recipe["insertions"], start=1):
        true = Needle(tip, given.radius, 1.0, needle.length_mm)
        seed = 1000 * given.seed + number
        phantom = PhantomNeedle(true, (), seed, SimulatedClock(), parameters)
        roll_deg = 0
        for step in range(1, round(one["depth_mm"] / SPACING_MM) + 1):
            phantom.push(SPACING_MM)
            # What a tracker shows is late, so the needle rests first.
            phantom.wait(REST_S)
            x, y, z = phantom.measure().position_mm
            depth_mm = step * SPACING_MM
            print(f"{number},{depth_mm:g},{roll_deg},{x:.2f},{y:.2f},{z:.2f}")
            if depth_mm == one["roll_at_mm"]:
                roll_deg = one["roll_deg"]
                phantom.roll(math.radians(roll_deg))


if __name__ == "__main__":
    main()
