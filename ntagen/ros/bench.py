"""A needle in tissue on a stage that goes where it is told: the physical part of a lab.

`ntagen.ros.lab` puts topics around it. Time is that of the computer times a speed.
"""

from __future__ import annotations

import math
import threading
import time
from typing import Final

from ntagen.drive.plant import NeedlePlant, simulated_axes
from ntagen.drive.plugin import Speeds
from ntagen.lab.lab import Truth
from ntagen.lab.needles import Placed
from ntagen.needle.phantom_sensor import Frame
from ntagen.ros.stage import Place
from ntagen.scene import Scene
from ntagen.units import deg_from_rad

_FASTER: Final = 1.5
"""The stage can go so much faster than it is led, so that it keeps up."""


class Bench:
    """A stage with a needle.

    Args:
        scene: The actual scene.
        placed: The needle in it.
        speeds: How fast the stage is led.
        speed: How many seconds pass here in one second outside.
    """

    def __init__(self, scene: Scene, placed: Placed, speeds: Speeds, speed: float = 1.0) -> None:
        self._scene = scene
        self._placed = placed
        self._speeds = speeds
        self._speed = speed
        self._axes = simulated_axes(speeds.push_mm_per_s)
        self._plant = NeedlePlant(placed.needle, self._axes)
        self._lock = threading.Lock()
        self._began_s = self._now_s = time.monotonic()
        self._at = self._goal = Place(0.0, 0.0)
        self._moved_s: float | None = None

    @property
    def speed(self) -> float:
        """How many seconds pass here in one second outside."""
        return self._speed

    def now_s(self) -> float:
        """How long the bench has been there, on its own clock."""
        return self._speed * (time.monotonic() - self._began_s)

    def tell(self, place: Place) -> None:
        """Tells the stage where it should be."""
        with self._lock:
            self._advance()
            self._goal = place

    def where(self) -> Place:
        """Where the stage is."""
        with self._lock:
            self._advance()
            return self._at

    def look(self) -> Frame:
        """What tracker and force sensor show now, also in the middle of a motion."""
        with self._lock:
            self._settle()
            return self._placed.frame()

    def idle_s(self) -> float | None:
        """How long nothing has moved, in seconds outside; `None` if nothing ever has."""
        return None if self._moved_s is None else time.monotonic() - self._moved_s

    def truth(self) -> Truth:
        """What has really happened until now."""
        with self._lock:
            self._settle()
            has_moved = self._moved_s is not None
            return Truth.of(self._scene, self._placed, self.now_s(), has_moved=has_moved)

    def _settle(self) -> None:
        """Lets the needle come to where the stage is now."""
        self._advance()
        self._placed.clock.set(self.now_s())
        self._plant.settle()
        # The sensor notes a needle at rest, too.
        self._placed.needle.roll_on(0.0)

    def _advance(self) -> None:
        """Moves the stage up to now; the lock is held."""
        now_s = time.monotonic()
        passed_s, self._now_s = self._speed * (now_s - self._now_s), now_s
        ways = (
            self._goal.depth_mm - self._at.depth_mm,
            self._goal.roll_rad - self._at.roll_rad,
        )
        fastest = max(self._speeds.push_mm_per_s, self._speeds.pull_mm_per_s)
        mm = _limited(ways[0], _FASTER * fastest * passed_s)
        rad = _limited(ways[1], _FASTER * self._speeds.roll_rad_per_s * passed_s)
        if mm == 0.0 and rad == 0.0:
            return
        self._at = Place(self._at.depth_mm + mm, self._at.roll_rad + rad)
        steps = {self._axes.insert.letter: mm, self._axes.roll.letter: deg_from_rad(rad)}
        self._plant.move(steps, passed_s)
        self._moved_s = now_s


def _limited(way: float, most: float) -> float:
    return math.copysign(min(abs(way), most), way) if way else 0.0
