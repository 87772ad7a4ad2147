"""The greatest fixed point of safe cells of the random walk, by numpy: nothing is drawn at random.

The errors of a step are those of a grid of their own, ends included. So a cell that is safe here is
safe for the worst errors, too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Cells = npt.NDArray[np.bool_]
Numbers = npt.NDArray[np.float64]

FAST = (0.17, 0.05)
SLOW = (0.1, 0.12)
"""How far a step leads in place and time."""


@dataclass(frozen=True)
class Walk:
    """A walk on a grid of `cells` cells along each axis, with `samples` a cell and axis."""

    cells: int
    samples: int
    error: float
    errors: int
    inside: float = 1e-6

    def _along_axis(self) -> Numbers:
        """The samples of all cells along an axis: by cell, then by sample."""
        parts = np.arange(self.samples) / (self.samples - 1)
        parts[-1] = 1.0 - self.inside
        starts = np.arange(self.cells)[:, None] + parts[None, :]
        return np.asarray(starts * (1.0 / self.cells), dtype=np.float64)

    def _is_kept(self, step: tuple[float, float], safe: Cells) -> Cells:
        """In which cells a step keeps the walker in safe cells, or ends the walk in time."""
        values = self._along_axis()
        errors = np.linspace(-self.error, self.error, self.errors) if self.error else np.zeros(1)
        kept = np.ones((self.cells, self.cells), dtype=bool)
        for dx in errors:
            for dt in errors:
                x = values + step[0] + dx
                t = values + step[1] + dt
                at_x = np.minimum((x * self.cells).astype(int), self.cells - 1)
                at_t = np.minimum((t * self.cells).astype(int), self.cells - 1)
                # Axes: the cell and the sample in place, then those in time.
                stays = safe[at_x[:, :, None, None], at_t[None, None, :, :]]
                arrives = (x >= 1.0)[:, :, None, None]
                is_late = (t >= 1.0)[None, None, :, :]
                kept &= ((stays | arrives) & ~is_late).all(axis=(1, 3))
        return kept

    def solve(self) -> dict[str, Cells]:
        """The cells in which each step is allowed."""
        safe = np.ones((self.cells, self.cells), dtype=bool)
        kept: Callable[[tuple[float, float]], Cells] = lambda step: self._is_kept(step, safe)  # noqa: E731
        while True:
            fast, slow = kept(FAST), kept(SLOW)
            now = safe & (fast | slow)
            if (now == safe).all():
                return {"fast": fast & safe, "slow": slow & safe}
            safe = now
