"""Makes `ribs.nsl`: a rib cage, and a target behind it that moves with the breath.

    python examples/ribs/make_ribs.py > examples/ribs/ribs.nsl

Each rib is a chain of capsules on an ellipse around the chest, thinner towards the front. All
numbers are ours; they are about those of an adult. The ribs rise a little with each breath, and the
target goes up and down behind the diaphragm.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

RIBS = 5
SPACING_MM = 22.0
HALF_WIDTH_MM = 62.0
HALF_DEPTH_MM = 48.0
SKIN_MM = 9.0
SLOPE = 0.18
RADIUS_MM = 4.0
PIECES = 6
RISE_MM = 1.5
PERIOD_S = 4.0

HEAD = """\
// A rib cage, and a target behind it that moves with the breath; made by make_ribs.py.
environment ribs {{
  needle {{
    tip (0, 0, 0) mm  heading -y  bevel free
    radius 45 mm  speed 4 mm/s  length 120 mm
  }}
  motion {{
    step 0.5 s
    wait 0.5 s  at most 1 times
    push only while phase between 250 deg and 110 deg   // around rest, when the target is slow
    roll by 90, 180, 270 deg  at most 2 times  at least 4 mm apart
  }}
  target    tumour  sphere (6, -62, -6) mm  radius 8 mm  moves 12 mm along -z every {period:g} s
  critical  vessel  capsule {vessel}  radius 2.5 mm  moves 8 mm along -z every {period:g} s
"""
VESSEL = "(-12, -46, 12) mm to (14, -42, 15) mm"


def place(rib: int, share: float) -> tuple[float, float, float]:
    """A point on the middle line of a rib; the share goes from -1 (left) to 1 (right)."""
    angle = share * math.radians(72.0)
    x = HALF_WIDTH_MM * math.sin(angle)
    y = -SKIN_MM - HALF_DEPTH_MM * (1.0 - math.cos(angle))
    z = (rib - (RIBS - 1) / 2.0) * SPACING_MM + 0.5 * SPACING_MM - SLOPE * abs(x)
    return x, y, z


def pieces() -> Iterator[str]:
    """The lines of all ribs."""
    for rib in range(RIBS):
        for piece in range(PIECES):
            ends = [place(rib, -1.0 + 2.0 * (piece + i) / PIECES) for i in (0, 1)]
            start, end = (f"({', '.join(f'{part:.1f}' for part in point)})" for point in ends)
            yield (
                f"  critical  rib{rib + 1}_{piece + 1}  capsule {start} mm to {end} mm  "
                f"radius {RADIUS_MM:g} mm  moves {RISE_MM:g} mm along +z every {PERIOD_S:g} s"
            )


if __name__ == "__main__":
    print(HEAD.format(period=PERIOD_S, vessel=VESSEL) + "\n".join(pieces()) + "\n}")
