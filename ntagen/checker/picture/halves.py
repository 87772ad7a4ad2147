"""Convex zones over two clocks as intersections of halves of the plane, with exact corners."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

Corner = tuple[Fraction, Fraction]


@dataclass(frozen=True, slots=True)
class Half:
    """A half of the plane: where ``along_x * x + along_y * y`` is at most `bound`.

    Attributes:
        along_x: -1, 0 or 1.
        along_y: -1, 0 or 1.
        bound: The greatest value.
        strict: Whether the bound itself is left out.
    """

    along_x: int
    along_y: int
    bound: Fraction
    strict: bool = False

    @property
    def is_plain(self) -> bool:
        """Whether it only says that a clock is not negative."""
        return self.along_x + self.along_y == -1 and not self.bound and not self.strict

    def excess(self, corner: Corner) -> Fraction:
        """By how much a corner is outside; at most 0 if it is inside."""
        return self.along_x * corner[0] + self.along_y * corner[1] - self.bound


@dataclass(frozen=True, slots=True)
class Axes:
    """The clocks of a picture.

    Attributes:
        x: The name of the clock to the right.
        y: That of the clock upwards; ``None`` if there is only one clock.
        x_end: Up to which value it is drawn.
        y_end: The same upwards.
    """

    x: str
    y: str | None
    x_end: Fraction
    y_end: Fraction


def clipped(corners: Sequence[Corner], halves: Sequence[Half]) -> list[Corner]:
    """The corners of the part of a convex polygon that lies in all these halves.

    It keeps their order. It may be a line (two corners), a point, or empty. After Sutherland and
    Hodgman, "Reentrant polygon clipping" (1974).
    """
    left = list(corners)
    for half in halves:
        kept: list[Corner] = []
        for start, end in pairwise([*left[-1:], *left]):
            before, after = half.excess(start), half.excess(end)
            if (before < 0 < after) or (after < 0 < before):
                share = before / (before - after)
                kept.append(
                    (
                        start[0] + share * (end[0] - start[0]),
                        start[1] + share * (end[1] - start[1]),
                    )
                )
            if after <= 0:
                kept.append(end)
        left = list(dict.fromkeys(kept))
    return left
