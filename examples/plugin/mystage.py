"""An example plugin for ntagen: replace `VendorStage` by the library of your hardware.

pip install examples/plugin
ntagen device check mystage:simulated
ntagen device test mystage:simulated
ntagen device test mytracker:simulated
"""

from __future__ import annotations

import contextlib
import math
import threading
import time
from collections.abc import Callable, Iterator

from ntagen.plugins import DeviceError, Measurement, Speeds, Transform, Watch, run_watched


class VendorStage:
    """Stands for a vendor's library: calls block until the motion is over or was stopped."""

    def __init__(self, name: str) -> None:
        if name != "simulated":
            raise OSError(f"no stage is called '{name}'")
        self.position = 0.0
        self._stopped = threading.Event()

    def move(self, way: float, speed: float) -> None:
        """Moves by a way, in units of the axis; blocks."""
        self._stopped.clear()
        start, began_s = self.position, time.monotonic()
        seconds = abs(way) / speed
        while not self._stopped.wait(0.001):
            part = (time.monotonic() - began_s) / seconds if seconds else 1.0
            self.position = start + way * min(1.0, part)
            if part >= 1.0:
                return

    def stop(self) -> None:
        """Stops at once; may be called in another thread."""
        self._stopped.set()


class Stage:
    """A needle on two axes of the vendor: an `ntagen.plugins.WatchedActuator`."""

    description = "a simulated stage with two axes"
    ramp_mm_per_s2 = 100.0  # it needs v²/2a to stop; ntagen counts that into its margins

    def __init__(self, insert: VendorStage, turn: VendorStage, speeds: Speeds) -> None:
        self.watch: Watch = lambda: None  # ntagen sets it
        self._insert, self._turn, self._speeds = insert, turn, speeds
        self._stops = 0

    def now_s(self) -> float:
        """A clock that never goes back; a tracker gives its times on it."""
        return time.monotonic()

    def push(self, length_mm: float) -> None:
        """Inserts the needle."""
        if not 0.0 <= length_mm < math.inf:
            raise DeviceError(f"the stage cannot push by {length_mm} mm")
        self._move(self._insert, length_mm, self._speeds.push_mm_per_s)

    def pull(self, length_mm: float) -> None:
        """Pulls the needle back."""
        if not 0.0 <= length_mm < math.inf:
            raise DeviceError(f"the stage cannot pull by {length_mm} mm")
        self._move(self._insert, -length_mm, self._speeds.pull_mm_per_s)

    def roll(self, angle_rad: float) -> None:
        """Turns the needle, right-handed about the direction of insertion."""
        if not math.isfinite(angle_rad):
            raise DeviceError(f"the stage cannot roll by {angle_rad} rad")
        self._move(self._turn, angle_rad, self._speeds.roll_rad_per_s)

    def stop(self) -> None:
        """Stops both axes, at any time and from any thread."""
        self._stops += 1
        self._insert.stop()
        self._turn.stop()

    def _move(self, axis: VendorStage, way: float, speed: float) -> None:
        if way == 0.0:
            return
        start, stops = axis.position, self._stops

        def watch() -> None:
            if self._stops != stops:
                raise DeviceError("the motion was stopped")
            self.watch()

        run_watched(
            move=lambda: axis.move(way, speed),
            watch=watch,
            stop=self.stop,
            part=lambda: (axis.position - start) / way,
        )
        if self._stops != stops:
            raise DeviceError("the motion was stopped")


@contextlib.contextmanager
def open_stage(argument: str, speeds: Speeds) -> Iterator[Stage]:
    """The device `mystage:ARGUMENT`, until ntagen is done with it."""
    stage = Stage(VendorStage(argument), VendorStage(argument), speeds)
    try:
        yield stage
    finally:
        stage.stop()


class Tracker:
    """A tracker that sees a needle at rest at the origin: an `ntagen.plugins.LiveSensor`."""

    description = "a simulated tracker"
    measures_force = True

    def __init__(self, transform: Transform, now_s: Callable[[], float]) -> None:
        self._transform, self._now_s = transform, now_s
        self._lock = threading.Condition()
        self._sample = self._read()
        self._ended = False
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def measure(self) -> Measurement:
        """A sample that was taken after this call; waits for it."""
        asked_s = self._now_s()
        with self._lock:
            if not self._lock.wait_for(lambda: self._sample.time_s > asked_s, timeout=1.0):
                raise DeviceError("the tracker has sent nothing for 1 s")
            return self._sample

    def newest(self) -> Measurement:
        """The newest sample, at once: ntagen asks for it every few milliseconds of a motion."""
        with self._lock:
            if self._now_s() - self._sample.time_s > 0.5:
                raise DeviceError("the tracker has sent nothing for 0.5 s")
            return self._sample

    def close(self) -> None:
        """Ends the thread."""
        self._ended = True
        self._thread.join()

    def _read(self) -> Measurement:
        """One sample of the hardware, in the frame of the scene."""
        return Measurement(
            time_s=self._now_s(),
            position_mm=self._transform.point((0.0, 0.0, 0.0)),
            force_n=0.0,
            heading=self._transform.direction((0.0, -1.0, 0.0)),
        )

    def _work(self) -> None:
        while not self._ended:
            time.sleep(0.02)
            sample = self._read()
            with self._lock:
                self._sample = sample
                self._lock.notify_all()


@contextlib.contextmanager
def open_tracker(
    argument: str, transform: Transform, now_s: Callable[[], float]
) -> Iterator[Tracker]:
    """The tracker `mytracker:ARGUMENT`, until ntagen is done with it."""
    if argument != "simulated":
        raise DeviceError(f"no tracker is called '{argument}'")
    tracker = Tracker(transform, now_s)
    try:
        yield tracker
    finally:
        tracker.close()
