"""How long whole syntheses take, on the computer's clock."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from ntagen.plan.best_plan import BestPlanSynthesiser
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Scene


@dataclass(frozen=True, slots=True)
class TimedSynthesiser:
    """A synthesiser that says how long it took: `Synthesis.loop_seconds`.

    Attributes:
        inner: Finds the plans.
    """

    inner: BestPlanSynthesiser

    def __call__(self, scene: Scene, asked: Scene | None = None) -> Synthesis:
        """The synthesis, with its time."""
        start_s = time.perf_counter()
        synthesis = self.inner(scene, asked)
        return replace(synthesis, loop_seconds=time.perf_counter() - start_s)


def timed(synthesis: Synthesis, work: Callable[[Synthesis], Synthesis]) -> Synthesis:
    """What further work makes of a synthesis, with the time of that work."""
    start_s = time.perf_counter()
    done = work(synthesis)
    seconds = synthesis.loop_seconds + time.perf_counter() - start_s
    return replace(done, loop_seconds=seconds)
