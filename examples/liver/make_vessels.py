"""Writes vessels.nsl: two trees of vessels in a liver that nobody has, as tapered capsules.

Each tree begins with a trunk and parts in two until its twigs are thin. The radii of the two parts
follow Murray's law (the cube of the trunk's radius is the sum of their cubes), and the thinner part
turns away more. No twig comes near to the tumour or to the other tree's trunk. The numbers are
random with a fixed seed. Run it from this folder::

    python make_vessels.py

The file is included by liver.nsl; a test makes it anew and compares.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

Vector = tuple[float, float, float]

TUMOR: Vector = (6.0, -78.0, -5.0)
KEEP_OFF_MM = 9.0
THINNEST_MM = 0.9
LIVER_MIDDLE: Vector = (0.0, -60.0, 0.0)
LIVER_RADII: Vector = (58.0, 52.0, 42.0)


@dataclass(frozen=True)
class Piece:
    """A piece of a vessel between two places."""

    start: Vector
    end: Vector
    radius_mm: float
    end_radius_mm: float


def plus(one: Vector, two: Vector, factor: float = 1.0) -> Vector:
    """The sum of a vector and a multiple of another."""
    return (one[0] + factor * two[0], one[1] + factor * two[1], one[2] + factor * two[2])


def unit(vector: Vector) -> Vector:
    """The direction of a vector."""
    length = math.hypot(*vector)
    return (vector[0] / length, vector[1] / length, vector[2] / length)


def is_in_liver(place: Vector) -> bool:
    """Whether a place lies in the ellipsoid of the liver."""
    seen = plus(place, LIVER_MIDDLE, -1.0)
    return math.fsum((s / r) ** 2 for s, r in zip(seen, LIVER_RADII, strict=True)) < 1.0


def from_piece(place: Vector, start: Vector, end: Vector) -> float:
    """The distance of a place to the line of a piece."""
    way, seen = plus(end, start, -1.0), plus(place, start, -1.0)
    share = sum(a * b for a, b in zip(way, seen, strict=True)) / sum(a * a for a in way)
    return math.dist(place, plus(start, way, min(1.0, max(0.0, share))))


def is_free(start: Vector, end: Vector, radius_mm: float) -> bool:
    """Whether a piece stays in the liver, and off the tumour."""
    return is_in_liver(end) and from_piece(TUMOR, start, end) > KEEP_OFF_MM + radius_mm


def grow(
    rng: random.Random, start: Vector, heading: Vector, radius_mm: float, length_mm: float
) -> Iterator[Piece]:
    """A piece, and the two parts at its end."""
    if radius_mm < THINNEST_MM:
        return
    for _ in range(20):
        end = plus(start, heading, length_mm)
        if is_free(start, end, radius_mm):
            break
        heading = unit(plus(heading, aside(rng, heading), 0.5))
    else:
        return
    yield Piece(start, end, radius_mm, 0.92 * radius_mm)
    share = rng.uniform(0.3, 0.7)
    turn = aside(rng, heading)
    for part, sign in ((share, 1.0), (1.0 - share, -1.0)):
        angle = math.radians(25.0 + 45.0 * (1.0 - part))
        ahead = plus((0.0, 0.0, 0.0), heading, math.cos(angle))
        onward = unit(plus(ahead, turn, sign * math.sin(angle)))
        narrow = 0.92 * radius_mm * part ** (1.0 / 3.0)
        yield from grow(rng, end, onward, narrow, length_mm * rng.uniform(0.7, 0.9))


def aside(rng: random.Random, heading: Vector) -> Vector:
    """A random direction at right angles to another."""
    drawn = (rng.gauss(0, 1), rng.gauss(0, 1), rng.gauss(0, 1))
    along = sum(a * b for a, b in zip(drawn, heading, strict=True))
    return unit(plus(drawn, heading, -along))


def trees() -> dict[str, list[Piece]]:
    """The pieces of both trees: the portal vein from below, the hepatic veins from above."""
    rng = random.Random(16)
    portal = grow(rng, (-6.0, -68.0, 36.0), unit((0.15, 0.1, -1.0)), 5.0, 24.0)
    hepatic = grow(rng, (4.0, -94.0, -28.0), unit((-0.3, 0.75, 0.55)), 4.5, 26.0)
    return {"Portal": list(portal), "Hepatic": list(hepatic)}


def shown(place: Vector) -> str:
    """A place as the language has it."""
    return f"({', '.join(f'{value + 0.0:.2f}' for value in place)}) mm"


def main() -> None:
    """Writes the file."""
    lines = ["// Made by make_vessels.py; change that file, not this one."]
    for name, pieces in trees().items():
        for number, piece in enumerate(pieces):
            lines.append(
                f"critical {name}[{number}]  capsule {shown(piece.start)} to {shown(piece.end)}"
                f"  radius {piece.radius_mm:.2f} mm to {piece.end_radius_mm:.2f} mm"
            )
    Path(__file__).with_name("vessels.nsl").write_text("\n".join([*lines, ""]), "utf-8")


if __name__ == "__main__":
    main()
