"""Drives the needle of a lab as a real one is driven, and tells the truth about it.

The driver opens the lab's serial port and connects to its tracker, by the code that does so for
hardware. Its clock is that of the lab, which may be faster than the computer's, while the needle
moves and is measured. What the driver computes meanwhile, with the needle at rest, takes the time
that it takes; and syntheses take none, as with simulated needles: they are timed by themselves.
How old a sample of the tracker is counts on the computer's clock.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

from ntagen.drive.device import LiveSensor, Watch, WatchedActuator, can_screw, screw_on
from ntagen.drive.outcome import Driven
from ntagen.drive.real import RealRun
from ntagen.drive.records import Journal, Journals
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import Witness
from ntagen.drive.steppers import opened_steppers
from ntagen.grbl.axes import Axes
from ntagen.grbl.port import Port, SerialPort
from ntagen.lab.lab import Lab, Truth
from ntagen.needle.measurement import Measurement
from ntagen.plan.synthesise import Synthesis, Synthesiser
from ntagen.scene import Scene
from ntagen.tracking.frames import IDENTITY
from ntagen.tracking.opening import opened_live
from ntagen.tracking.spec import parse_tracker

STALE_S: Final = 2.0
"""A sample is waited for so long, on the computer's clock: a busy computer is no silent tracker."""

_SHORTEST_S: Final = 0.001
"""Waits that are shorter would only keep the computer busy."""


@dataclass(frozen=True, slots=True)
class InLab:
    """The end of a run in a lab, and the truth about it.

    Attributes:
        driven: What the driver says.
        truth: What has really happened.
    """

    driven: Driven
    truth: Truth


def drive_in(
    lab: Lab,
    axes: Axes,
    scene: Scene,
    synthesise: Synthesiser,
    settings: Settings,
    journal: Journal,
    *,
    known: str = "all",
) -> InLab:
    """Drives the needle of a lab that is open.

    Args:
        lab: The lab.
        axes: The axes as the driver uses them.
        scene: The scene.
        synthesise: Finds plans.
        settings: How to drive.
        journal: Records what happens, with the truth at each measurement.
        known: The critical regions that the driver knows (`ntagen.drive.knowledge.told`).

    Raises:
        InputError: Axes or settings do not fit the lab.
        DeviceError: The lab cannot be reached.
    """
    clock = Clock(lab.speed)

    def timeless(scene: Scene, asked: Scene | None = None) -> Synthesis:
        with clock.at_rate(0.0):
            return synthesise(scene, asked)

    text = f"{lab.tracker_address},stale={STALE_S:g}s"
    with (
        opened_steppers(
            _Wire(SerialPort(lab.port), clock), axes, scene.needle, settings
        ) as actuator,
        opened_live(
            text,
            parse_tracker(text),
            IDENTITY,
            scene.needle.tip,
            time.monotonic,
            watches_force=settings.force_sensing,
            force_varies=settings.force_sensing and settings.force_noise_n > 0.0,
        ) as sensor,
    ):
        driven = RealRun(
            scene,
            _Hurried(actuator, clock),
            _Looking(sensor, clock),
            timeless,
            settings,
            Journals(journal, Witness(lab, journal)),
            known=known,
        ).drive()
        return InLab(driven, lab.truth())


class Clock:
    """The lab's clock as the driver reads it, from 0; at first it runs as the computer's does.

    Args:
        speed: How many seconds pass in the lab in one second of the computer.
    """

    def __init__(self, speed: float) -> None:
        self.speed = speed
        self._rate = 1.0
        self._shown_s = 0.0
        self._since_s = time.monotonic()

    def now_s(self) -> float:
        """The time now."""
        return self.at_s(time.monotonic())

    def at_s(self, monotonic_s: float) -> float:
        """The time at a moment on the computer's clock, not long ago."""
        return self._shown_s + self._rate * (monotonic_s - self._since_s)

    def outside_s(self, seconds: float) -> float:
        """How long a wait takes on the computer's clock; not less than `_SHORTEST_S`."""
        return max(_SHORTEST_S, seconds / self._rate)

    @contextlib.contextmanager
    def at_rate(self, rate: float) -> Iterator[None]:
        """Lets so many seconds pass in one second of the computer, until the end of the block."""
        before = self._set(rate)
        try:
            yield
        finally:
            self._set(before)

    def _set(self, rate: float) -> float:
        monotonic_s = time.monotonic()
        self._shown_s, self._since_s = self.at_s(monotonic_s), monotonic_s
        before, self._rate = self._rate, rate
        return before


class _Hurried:
    """An actuator whose motions are on the lab's clock."""

    def __init__(self, inner: WatchedActuator, clock: Clock) -> None:
        self._inner = inner
        self._clock = clock
        self.now_s = clock.now_s

    @property
    def watch(self) -> Watch:
        return self._inner.watch

    @watch.setter
    def watch(self, watch: Watch) -> None:
        self._inner.watch = watch

    def push(self, length_mm: float) -> None:
        with self._clock.at_rate(self._clock.speed):
            self._inner.push(length_mm)

    def screw(self, length_mm: float, angle_rad: float) -> None:
        with self._clock.at_rate(self._clock.speed):
            screw_on(self._inner, length_mm, angle_rad)

    @property
    def can_screw(self) -> bool:
        return can_screw(self._inner)

    def roll(self, angle_rad: float) -> None:
        with self._clock.at_rate(self._clock.speed):
            self._inner.roll(angle_rad)

    def pull(self, length_mm: float) -> None:
        with self._clock.at_rate(self._clock.speed):
            self._inner.pull(length_mm)

    def stop(self) -> None:
        with self._clock.at_rate(self._clock.speed):
            self._inner.stop()


class _Wire:
    """The port of the lab's controller, on the lab's clock."""

    def __init__(self, inner: Port, clock: Clock) -> None:
        self._inner = inner
        self._clock = clock
        self.now_s = clock.now_s
        self.write = inner.write
        self.close = inner.close

    @property
    def name(self) -> str:
        return self._inner.name

    def read(self, timeout_s: float) -> bytes:
        return self._inner.read(min(timeout_s, self._clock.outside_s(timeout_s)))


class _Looking:
    """A sensor whose measurements have times on the lab's clock."""

    def __init__(self, inner: LiveSensor, clock: Clock) -> None:
        self._inner = inner
        self._clock = clock

    @property
    def measures_force(self) -> bool:
        return self._inner.measures_force

    def measure(self) -> Measurement:
        with self._clock.at_rate(self._clock.speed):
            return self._on_clock(self._inner.measure())

    def newest(self) -> Measurement:
        return self._on_clock(self._inner.newest())

    def _on_clock(self, found: Measurement) -> Measurement:
        return replace(found, time_s=self._clock.at_s(found.time_s))
