"""The errors of a simulated needle: what a run is told of them, apart from the needle itself."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ntagen.needle.kinematics import orthonormal, roll
from ntagen.scene import Needle
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.needle.phantom_parameters import PhantomParameters


@dataclass(frozen=True, slots=True)
class Errors:
    """The errors of a simulated needle. What is None is as each kind of needle has it.

    Attributes:
        noise_mm: The standard deviation of each coordinate of a measured position; the virtual
            needle has none by itself.
        roll_rad: The standard deviation of each roll of the virtual needle.
        radius_mm: The true radius of the motion circle; None if it is that of the scene.
        radius_ratio: The part by which the true radius is greater than that.
        bevel_rad: The angle about the heading from the bevel of the scene to the true one.
        lag_rad: The lag of the phantom's tip at a depth of 100 mm (`Torsion.lag_rad`).
        latency_s: The age of the phantom's measurements (`Sensing.latency_s`).
        whole_shape: Whether the phantom's whole shape is measured (`Sensing.whole_shape`).
    """

    noise_mm: float | None = None
    roll_rad: float = 0.0
    radius_mm: float | None = None
    radius_ratio: float = 0.0
    bevel_rad: float = 0.0
    lag_rad: float | None = None
    latency_s: float | None = None
    whole_shape: bool = False

    def true_needle(self, needle: Needle) -> Needle:
        """The true needle, if this is the one that the scene describes."""
        tip = orthonormal(roll(needle.tip, self.bevel_rad)) if self.bevel_rad else needle.tip
        radius_mm = needle.radius_mm if self.radius_mm is None else self.radius_mm
        return replace(needle, tip=tip, radius_mm=radius_mm * (1.0 + self.radius_ratio))

    def true_phantom(self, usual: PhantomParameters) -> PhantomParameters:
        """What the phantom is like, if it is usually like this."""
        torsion = usual.torsion
        sensing = replace(usual.sensing, whole_shape=self.whole_shape)
        if self.noise_mm is not None:
            sensing = replace(sensing, noise_mm=self.noise_mm)
        if self.latency_s is not None:
            sensing = replace(sensing, latency_s=self.latency_s)
        if self.lag_rad is not None:
            torsion = replace(torsion, lag_rad=self.lag_rad)
        return replace(usual, sensing=sensing, torsion=torsion)
