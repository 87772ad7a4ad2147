"""The tracker and the force sensor of the phantom: late, noisy, rounded, and with lost readings."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from ntagen.errors import DeviceError
from ntagen.needle.measurement import Measurement
from ntagen.needle.phantom_parameters import Sensing
from ntagen.needle.phantom_tissue import Tissue
from ntagen.needle.vectors import combine
from ntagen.needle.virtual import SimulatedClock
from ntagen.scene import Vector

_KEPT = 2
"""States from before the latency that are kept: an interpolation needs one."""


@dataclass(frozen=True, slots=True)
class Seen:
    """The needle at a time.

    Attributes:
        time_s: The time.
        position_mm: The true position of the tip.
        depth_mm: The true depth.
        force_n: The total axial force, without noise.
    """

    time_s: float
    position_mm: Vector
    depth_mm: float
    force_n: float


class PhantomSensor:
    """Measures states that it is shown.

    Args:
        sensing: Its errors.
        tissue: It has the correlated error of the tracker.
        seed: The seed of noise and losses.
        clock: The clock; a lost reading takes time on it.
    """

    def __init__(
        self,
        sensing: Sensing,
        tissue: Tissue,
        seed: np.random.SeedSequence,
        clock: SimulatedClock,
    ) -> None:
        self._sensing = sensing
        self._tissue = tissue
        self._clock = clock
        noise, losses = seed.spawn(2)
        self._noise = np.random.default_rng(noise)
        self._losses = np.random.default_rng(losses)
        self._is_lost = False
        self._states: deque[Seen] = deque()

    def note(self, state: Seen) -> None:
        """Notes the needle's present state; between two notes it moves evenly."""
        if self._states and self._states[-1].time_s >= state.time_s:
            self._states[-1] = state
        else:
            self._states.append(state)
        oldest_s = state.time_s - self._sensing.latency_s
        while len(self._states) > _KEPT and self._states[1].time_s <= oldest_s:
            self._states.popleft()

    def measure(self) -> Measurement:
        """The next reading that is not lost.

        Raises:
            DeviceError: Too many readings in a row were lost.
        """
        sensing = self._sensing
        waited_s = 0.0
        while self._loses():
            waited_s += sensing.frame_s
            self._clock.advance(sensing.frame_s)
            if waited_s >= sensing.patience_s:
                raise DeviceError(
                    f"the tracker gave no reading for {waited_s:.1f} s\n"
                    "hint: is the sensor in its field?"
                )
        state = self._state_at(self._clock.now_s() - sensing.latency_s)
        drawn = self._noise.normal(size=4)
        error = self._tissue.distortion_mm(state.depth_mm) + sensing.noise_mm * drawn[:3]
        x, y, z = np.array(state.position_mm) + error
        return Measurement(
            time_s=state.time_s,
            position_mm=(
                _rounded(x, sensing.step_mm),
                _rounded(y, sensing.step_mm),
                _rounded(z, sensing.step_mm),
            ),
            force_n=_rounded(state.force_n + sensing.noise_n * drawn[3], sensing.step_n),
        )

    def _loses(self) -> bool:
        """Whether this reading is lost; losses come in bursts."""
        drawn = float(self._losses.uniform())
        sensing = self._sensing
        self._is_lost = (
            drawn >= sensing.found_ratio if self._is_lost else drawn < sensing.lost_ratio
        )
        return self._is_lost

    def _state_at(self, time_s: float) -> Seen:
        """The state at an earlier time; before the first one, the first one."""
        before = self._states[0]
        for after in self._states:
            if after.time_s > time_s:
                span_s = after.time_s - before.time_s
                share = max(0.0, (time_s - before.time_s) / span_s) if span_s > 0.0 else 0.0
                return Seen(
                    max(0.0, time_s),
                    combine(1.0 - share, before.position_mm, share, after.position_mm),
                    (1.0 - share) * before.depth_mm + share * after.depth_mm,
                    (1.0 - share) * before.force_n + share * after.force_n,
                )
            before = after
        return Seen(time_s, before.position_mm, before.depth_mm, before.force_n)


def _rounded(value: float, step: float) -> float:
    """The nearest multiple of a step; the value itself for a step of 0."""
    return round(float(value) / step) * step if step > 0.0 else float(value)
