"""The needles that can stand in the lab, on a clock that the lab sets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

from ntagen.drive.knowledge import obstacles_of
from ntagen.drive.plant import Movable
from ntagen.errors import InputError
from ntagen.needle.phantom import PhantomNeedle
from ntagen.needle.phantom_parameters import PhantomParameters
from ntagen.needle.phantom_sensor import Frame
from ntagen.needle.virtual import Errors, SimulatedClock, VirtualNeedle
from ntagen.scene import Pose, Scene

NAMES: Final = ("phantom", "virtual")
"""The needles by their names."""


class LabClock(SimulatedClock):
    """A clock that somebody else sets: the axes say how long a motion takes, not the needle."""

    def __init__(self) -> None:
        super().__init__()
        self._set_s = 0.0

    def now_s(self) -> float:
        """The time that was set last."""
        return self._set_s

    def set(self, now_s: float) -> None:
        """Sets the time."""
        self._set_s = now_s

    def advance(self, seconds: float) -> None:
        """Does nothing: time passes by itself."""


class Known(Movable, Protocol):
    """A simulated needle, which knows the truth."""

    @property
    def true_tip(self) -> Pose:
        """The true pose of the tip."""

    def true_clearance_mm(self) -> float:
        """The smallest distance of all that was cut to any actual critical region."""


@dataclass(frozen=True, slots=True)
class Placed:
    """A needle at the entry.

    Attributes:
        needle: The needle.
        clock: Its clock.
        frame: What tracker and force sensor show of it now.
        latency_s: How old that is, on its clock.
    """

    needle: Known
    clock: LabClock
    frame: Callable[[], Frame]
    latency_s: float


def place(
    name: str, scene: Scene, seed: int, margin_mm: float, errors: Errors | None = None
) -> Placed:
    """A needle at the entry of a scene, in tissue with all of the scene's critical regions.

    Args:
        name: One of `NAMES`.
        scene: The actual scene.
        seed: The seed of all that is random.
        margin_mm: The distance at which a region without a detection region is felt.
        errors: The errors of the needle; by default those that it has by itself.

    Raises:
        InputError: There is no needle of this name.
    """
    obstacles = obstacles_of(scene, margin_mm)
    clock = LabClock()
    errors = errors or Errors()
    true = errors.true_needle(scene.needle)
    if name == "phantom":
        parameters = errors.true_phantom(PhantomParameters())
        phantom = PhantomNeedle(true, obstacles, seed, clock, parameters, reports_pose=True)
        return Placed(phantom, clock, phantom.frame, parameters.sensing.latency_s)
    if name == "virtual":
        virtual = VirtualNeedle(true, obstacles, errors, seed, clock, reports_pose=True)
        return Placed(virtual, clock, lambda: Frame(virtual.measure(), is_lost=False), 0.0)
    raise InputError(f"the lab has no needle '{name}'\nhint: choose from {', '.join(NAMES)}")
