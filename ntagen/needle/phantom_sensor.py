"""The tracker and the force sensor of the phantom: late, noisy, rounded, and with lost readings."""

from __future__ import annotations

import functools
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ntagen.errors import DeviceError
from ntagen.needle.kinematics import orthonormal
from ntagen.needle.measurement import Measurement
from ntagen.needle.phantom_parameters import Sensing
from ntagen.needle.phantom_tissue import Tissue
from ntagen.needle.vectors import combine, norm, rotate, scale
from ntagen.needle.virtual import SimulatedClock
from ntagen.scene import Pose, Vector

_Array = NDArray[np.float64]

_LEAST_NORM = 0.1
_KEPT = 2
"""States from before the latency that are kept: an interpolation needs one."""


def _nothing() -> tuple[Vector, ...]:
    return ()


@dataclass(frozen=True, slots=True)
class Seen:
    """The needle at a time.

    Attributes:
        time_s: The time.
        tip: The true position and directions of the tip.
        depth_mm: The true depth.
        force_n: The total axial force, without noise.
        shaft: Gives places behind the tip, one after the other, if the whole shape is measured.
    """

    time_s: float
    tip: Pose
    depth_mm: float
    force_n: float
    shaft: Callable[[], tuple[Vector, ...]] = _nothing


@dataclass(frozen=True, slots=True)
class Frame:
    """One reading.

    Attributes:
        measurement: What was measured.
        is_lost: Whether the tracker did not see the needle. The force is there all the same.
    """

    measurement: Measurement
    is_lost: bool


class PhantomSensor:
    """Measures states that it is shown.

    Args:
        sensing: Its errors.
        tissue: It has the correlated error of the tracker.
        seed: The seed of noise and losses.
        clock: The clock; a lost reading takes time on it.
        reports_pose: Whether the tracker sees directions, too.
    """

    def __init__(
        self,
        sensing: Sensing,
        tissue: Tissue,
        seed: np.random.SeedSequence,
        clock: SimulatedClock,
        *,
        reports_pose: bool = False,
    ) -> None:
        self._reports_pose = reports_pose
        self._sensing = sensing
        self._tissue = tissue
        self._clock = clock
        noise, losses, directions, shaft = seed.spawn(4)
        self._noise = np.random.default_rng(noise)
        self._direction_noise = np.random.default_rng(directions)
        self._losses = np.random.default_rng(losses)
        self._shaft_noise = np.random.default_rng(shaft)
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
        return self._read()

    def frame(self) -> Frame:
        """The present reading, lost or not; it takes no time on the clock."""
        return Frame(self._read(), self._loses())

    def _read(self) -> Measurement:
        sensing = self._sensing
        state = self._state_at(self._clock.now_s() - sensing.latency_s)
        drawn = self._noise.normal(size=4)
        error = self._tissue.distortion_mm(state.depth_mm) + sensing.noise_mm * drawn[:3]
        tip_mm = self._seen_mm(state.tip.position_mm, error)
        seen = self._turned(state.tip) if self._reports_pose else None
        shaft = tuple(reversed(self._shaft_mm(state)))
        return Measurement(
            time_s=state.time_s,
            position_mm=tip_mm,
            force_n=_rounded(state.force_n + sensing.noise_n * drawn[3], sensing.step_n),
            heading=None if seen is None else seen.heading,
            bevel=None if seen is None else seen.bevel,
            shape=(*shaft, tip_mm) if shaft else (),
        )

    def _seen_mm(self, place_mm: Vector, error_mm: _Array) -> Vector:
        """A place with an error, rounded."""
        x, y, z = (_rounded(one, self._sensing.step_mm) for one in np.add(place_mm, error_mm))
        return x, y, z

    def _shaft_mm(self, state: Seen) -> list[Vector]:
        """The measured places behind the tip, one after the other."""
        sensing, found = self._sensing, []
        for number, place_mm in enumerate(state.shaft(), start=1):
            depth_mm = state.depth_mm - number * sensing.shape_apart_mm
            noise_mm = sensing.noise_mm * self._shaft_noise.normal(size=3)
            error_mm = self._tissue.distortion_mm(max(0.0, depth_mm)) + noise_mm
            found.append(self._seen_mm(place_mm, error_mm))
        return found

    def _turned(self, tip: Pose) -> Pose:
        """The directions with noise."""
        x, y, z = (
            float(angle_rad)
            for angle_rad in self._sensing.direction_rad * self._direction_noise.normal(size=3)
        )
        turn_rad = norm((x, y, z))
        if turn_rad == 0.0:
            return tip
        axis = scale(1.0 / turn_rad, (x, y, z))
        return replace(
            tip,
            heading=rotate(tip.heading, axis, turn_rad),
            bevel=rotate(tip.bevel, axis, turn_rad),
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
                    _between(before.tip, after.tip, share),
                    (1.0 - share) * before.depth_mm + share * after.depth_mm,
                    (1.0 - share) * before.force_n + share * after.force_n,
                    functools.partial(_shaft_between, before, after, share),
                )
            before = after
        return replace(before, time_s=time_s)


def _between(one: Pose, other: Pose, share: float) -> Pose:
    """A pose between two that are near to each other."""

    def mixed(a: Vector, b: Vector) -> Vector:
        return combine(1.0 - share, a, share, b)

    between = Pose(
        mixed(one.position_mm, other.position_mm),
        mixed(one.heading, other.heading),
        mixed(one.bevel, other.bevel),
    )
    # Opposite directions have no mean; such a turn in one step is seen at its end.
    is_turned = min(norm(between.heading), norm(between.bevel)) < _LEAST_NORM
    return orthonormal(other if is_turned else between)


def _shaft_between(one: Seen, other: Seen, share: float) -> tuple[Vector, ...]:
    """The places behind the tip between two states that are near to each other."""
    pairs = zip(one.shaft(), other.shaft(), strict=False)
    return tuple(combine(1.0 - share, a, share, b) for a, b in pairs)


def _rounded(value: float, step: float) -> float:
    """The nearest multiple of a step; the value itself for a step of 0."""
    return round(float(value) / step) * step if step > 0.0 else float(value)
