"""How regions move with the breath: the same way again and again, and where they are when.

A region is written where it is at rest. Its motion moves it from there, without turning it: on a
sinusoid, or through the places of a table, which are joined by straight lines. The clock of the
breath is at 0 when a model begins, or at the clock of its scene.

The displacement of a sinusoid at the time ``t`` is ``way (1 - cos(2 pi t / period + phase)) / 2``:
at phase 0 the region is at rest, and half a period later at the far end of its way.
"""

from __future__ import annotations

import functools
import math
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from ntagen.shapes import Vector, vector_of
from ntagen.values import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    _Array = NDArray[np.float64]

_STILL: Final[Vector] = (0.0, 0.0, 0.0)
_TURN_RAD: Final = 2.0 * math.pi


@dataclass(frozen=True, slots=True)
class Motion:
    """A motion that repeats itself.

    Attributes:
        period_s: After this time it begins again.
        way_mm: Of a sinusoid, the displacement at the far end.
        phase_rad: Of a sinusoid, by how much it is ahead of the clock.
        table: Of a table, times from the start of a period, and displacements; the last row joins
            the first one of the next period. Empty for a sinusoid.
    """

    period_s: float
    way_mm: Vector = _STILL
    phase_rad: float = 0.0
    table: tuple[tuple[float, Vector], ...] = ()

    def at_mm(self, time_s: float) -> Vector:
        """The displacement at a time of the clock."""
        if not self.table:
            angle_rad = _TURN_RAD * math.fmod(time_s, self.period_s) / self.period_s
            share = 0.5 * (1.0 - math.cos(angle_rad + self.phase_rad))
            x, y, z = self.way_mm
            return (share * x, share * y, share * z)
        since_s = time_s % self.period_s
        for (before_s, before), (after_s, after) in pairwise(self.rows):
            if before_s <= since_s <= after_s:
                share = (since_s - before_s) / (after_s - before_s)
                return vector_of(a + share * (b - a) for a, b in zip(before, after, strict=True))
        return self.table[0][1]

    def many_mm(self, times_s: _Array) -> _Array:
        """The displacements at many times, with the shape (n, 3)."""
        import numpy as np

        if not self.table:
            angles = _TURN_RAD * (times_s % self.period_s) / self.period_s + self.phase_rad
            return np.outer(0.5 * (1.0 - np.cos(angles)), np.array(self.way_mm))
        since = times_s % self.period_s
        knots = np.array([row[0] for row in self.rows])
        places = np.array([row[1] for row in self.rows])
        return np.stack([np.interp(since, knots, places[:, i]) for i in range(3)], axis=1)

    @property
    def rows(self) -> tuple[tuple[float, Vector], ...]:
        """The rows of a table over one whole period, its end included."""
        return _whole(self.table, self.period_s)

    @property
    def speed_mm_per_s(self) -> float:
        """The greatest speed."""
        if not self.table:
            return math.pi * math.hypot(*self.way_mm) / self.period_s
        return max(
            math.dist(before, after) / (after_s - before_s)
            for (before_s, before), (after_s, after) in pairwise(self.rows)
        )

    @property
    def reach_mm(self) -> float:
        """The greatest distance from the place at rest."""
        if not self.table:
            return math.hypot(*self.way_mm)
        return max(math.hypot(*place) for _, place in self.table)

    def extremes_mm(self) -> tuple[Vector, Vector]:
        """The displacements at the two ends of its way, for pictures: the farthest two."""
        if not self.table:
            return _STILL, self.way_mm
        places = [place for _, place in self.table]
        pairs = ((one, other) for one in places for other in places)
        return max(pairs, key=lambda pair: math.dist(*pair))


@functools.lru_cache(maxsize=64)
def _whole(
    table: tuple[tuple[float, Vector], ...], period_s: float
) -> tuple[tuple[float, Vector], ...]:
    """A table with rows at 0 and at the end of the period."""
    (first_s, first), (last_s, last) = table[0], table[-1]
    gap_s = first_s + period_s - last_s
    rows = list(table)
    # At the seam, on the line from the last row to the first one of the next period.
    share = (period_s - last_s) / gap_s if gap_s > 0.0 else 1.0
    x, y, z = (a + share * (b - a) for a, b in zip(last, first, strict=True))
    seam = (x, y, z)
    if first_s > 0.0:
        rows.insert(0, (0.0, seam))
    if last_s < period_s:
        rows.append((period_s, seam))
    return tuple(rows)


@dataclass(frozen=True, slots=True)
class Gate:
    """Pushes are made only while the phase of the breath is between two angles.

    Attributes:
        from_rad: The first one, from 0 to less than a turn.
        to_rad: The second one; if it is not greater, the gate is open over the seam.
    """

    from_rad: float
    to_rad: float

    @property
    def width_rad(self) -> float:
        """How long it is open, as a part of a turn; a whole turn if both angles are equal."""
        return (self.to_rad - self.from_rad) % _TURN_RAD or _TURN_RAD


@dataclass(frozen=True, slots=True)
class Breath:
    """The breath of a scene with moving regions, and what the needle may do about it.

    Attributes:
        period_s: The period of all motions.
        wait_s: The length of one wait.
        max_pauses: At so many places the needle may wait although it may be pushed.
        gate: When it may be pushed; always without one.
        clock_s: The time on the clock of the breath when plans begin.
    """

    period_s: float
    wait_s: float
    max_pauses: int
    gate: Gate | None = None
    clock_s: float = 0.0

    def until_s(self, from_s: float, to_s: float) -> float:
        """How long it takes from one time of the clock to the next one with another's phase."""
        wait_s = (to_s - from_s) % self.period_s
        return 0.0 if self.period_s - wait_s < 1e-6 else wait_s

    def is_open(self, from_s: float, length_s: float) -> bool:
        """Whether the gate is open from a time on for a length."""
        if self.gate is None:
            return True
        width_s = self.gate.width_rad / _TURN_RAD * self.period_s
        if width_s >= self.period_s:
            return True
        since_s = (from_s - self.gate.from_rad / _TURN_RAD * self.period_s) % self.period_s
        if self.period_s - since_s < 1e-6:
            since_s = 0.0
        return since_s + length_s <= width_s + 1e-6
