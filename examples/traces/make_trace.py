"""Makes a synthetic trace of a needle's tip, as a tracker would measure it.

    python examples/traces/make_trace.py two_rolls --seed 1 > examples/traces/two_rolls.csv

The tip is moved by small pieces of arcs; nothing of ntagen is used. The start lies anywhere and
points anywhere. The kinds:

* `arc`: one arc;
* `drift`: an arc that bends 1.5 % more every 10 mm, in a plane that turns by 1 deg every 10 mm;
* `one_roll` and `two_rolls`: exact arcs between rolls of 90, 180 or 270 deg, at even depths;
* `irregular`: one roll, drift, and layers of 15 mm that bend up to 15 % more or less.
"""

from __future__ import annotations

import argparse
import math
import random
from dataclasses import dataclass
from typing import NamedTuple

KINDS = ("arc", "drift", "one_roll", "two_rolls", "irregular")
PIECE_MM = 0.05
SPEED_MM_PER_S = 1.0


class Vector(NamedTuple):
    """Three numbers along the axes, with a little algebra."""

    x: float
    y: float
    z: float

    def plus(self, factor: float, other: Vector) -> Vector:
        """The sum with a multiple of another one."""
        return Vector(*(a + factor * b for a, b in zip(self, other, strict=True)))

    def dot(self, other: Vector) -> float:
        """The scalar product."""
        return sum(a * b for a, b in zip(self, other, strict=True))

    def cross(self, other: Vector) -> Vector:
        """The vector product."""
        (a, b, c), (d, e, f) = self, other
        return Vector(b * f - c * e, c * d - a * f, a * e - b * d)

    def unit(self) -> Vector:
        """The direction, with the length 1."""
        return Vector(*(a / math.hypot(*self) for a in self))

    def turned(self, axis: Vector, angle: float) -> Vector:
        """Turned about a unit axis at a right angle to it."""
        across = axis.cross(self)
        return Vector(0, 0, 0).plus(math.cos(angle), self).plus(math.sin(angle), across)


@dataclass(frozen=True)
class Made:
    """A trace, and the truth about it.

    Attributes:
        points: The measured positions in mm.
        rolls: The depth in mm and the angle in degrees of each roll.
        heading: The first heading.
        bevel: The first bevel direction.
    """

    points: list[Vector]
    rolls: list[tuple[float, float]]
    heading: Vector
    bevel: Vector


def make(
    kind: str,
    seed: int,
    *,
    length_mm: float = 100.0,
    radius_mm: float = 60.0,
    noise_mm: float = 0.05,
    spacing_mm: float = 0.5,
) -> Made:
    """A trace of a kind; `noise_mm` is the standard deviation of each coordinate."""
    chance = random.Random(f"{kind} {seed}")
    position, heading, rough = (Vector(*(chance.gauss(0, 1) for _ in range(3))) for _ in range(3))
    position, heading = Vector(0, 0, 0).plus(40.0, position), heading.unit()
    bevel = rough.plus(-rough.dot(heading), heading).unit()
    count = {"one_roll": 1, "two_rolls": 2, "irregular": 1}.get(kind, 0)
    rolls = rolls_of(chance, count, length_mm)
    drifts = kind in ("drift", "irregular")
    layers = [chance.uniform(0.85, 1.15) if kind == "irregular" else 1.0 for _ in range(20)]
    made = Made([], rolls, heading, bevel)
    depth_mm, next_mm, left = 0.0, 0.0, list(rolls)
    while depth_mm <= length_mm + 1e-9:
        if depth_mm >= next_mm - 1e-9:
            made.points.append(Vector(*(a + chance.gauss(0, noise_mm) for a in position)))
            next_mm += spacing_mm
        if left and depth_mm >= left[0][0] - 1e-9:
            bevel = bevel.turned(heading, math.radians(left.pop(0)[1]))
        bend = layers[int(depth_mm / 15.0)] / radius_mm
        if drifts:
            bend *= 1.0 + 0.015 * depth_mm / 10.0
            bevel = bevel.turned(heading, math.radians(0.1 * PIECE_MM))
        # The chord of a small arc has the direction in its middle; the bevel points away from the
        # centre, so the axis of the bend is bevel x heading.
        axis = bevel.cross(heading).unit()
        middle = heading.turned(axis, bend * PIECE_MM / 2.0)
        position = position.plus(PIECE_MM, middle)
        heading = heading.turned(axis, bend * PIECE_MM).unit()
        bevel = heading.cross(axis).unit()
        depth_mm += PIECE_MM
    return made


def rolls_of(chance: random.Random, count: int, length_mm: float) -> list[tuple[float, float]]:
    """Rolls at even depths, well inside the trace and apart."""
    shares = {0: [], 1: [(0.25, 0.75)], 2: [(0.2, 0.4), (0.55, 0.8)]}[count]
    places = [2.0 * round(chance.uniform(*share) * length_mm / 2.0) for share in shares]
    return [(place, chance.choice([90.0, 180.0, 270.0])) for place in places]


def table(made: Made, spacing_mm: float) -> str:
    """The trace as CSV."""
    lines = ["time_s,x_mm,y_mm,z_mm"]
    for number, point in enumerate(made.points):
        time_s = number * spacing_mm / SPEED_MM_PER_S
        lines.append(f"{time_s:.2f},{point.x:.3f},{point.y:.3f},{point.z:.3f}")
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("kind", choices=KINDS)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--noise", type=float, default=0.05, help="in mm")
    given = options.parse_args()
    trace = make(given.kind, given.seed, noise_mm=given.noise)
    print(table(trace, 0.5), end="")
