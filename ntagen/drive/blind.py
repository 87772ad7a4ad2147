"""A plan that is done blindly: nothing is measured, and nothing is corrected."""

from __future__ import annotations

from dataclasses import dataclass

from ntagen.drive.configure import Configuration
from ntagen.drive.simulate import simulated
from ntagen.drive.spinning import steered
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.scene import Scene


@dataclass(frozen=True, slots=True)
class Blind:
    """Where a needle came that followed a plan blindly.

    Attributes:
        clearance_mm: The least distance of its path to any critical region; infinite without one,
            negative if one was pierced.
        target_distance_mm: The distance of its tip to the surface of the last target; negative
            inside.
    """

    clearance_mm: float
    target_distance_mm: float

    @property
    def is_reached(self) -> bool:
        """Whether the tip is in the target, and touched nothing."""
        return self.target_distance_mm <= 0.0 < self.clearance_mm


def drive_blindly(plan: Plan, scene: Scene, configuration: Configuration, seed: int) -> Blind:
    """Does a plan with a simulated needle.

    Args:
        plan: Pushes and rolls.
        scene: The scene; its regions keep still.
        configuration: The needle, and the lag of rolls that is made up for.
        seed: The seed of the needle.
    """
    settings, make = configuration.settings, configuration.needle.made_in(scene)
    needle = simulated(scene, settings, seed, configuration.errors, make)
    actuator = steered(needle, scene, settings.compensated_lag_rad)
    for action in plan.actions:
        if isinstance(action, Push):
            actuator.push(action.length_mm)
        elif isinstance(action, Roll):
            actuator.roll(action.angle_rad)
    target = scene.targets[-1]
    return Blind(
        clearance_mm=needle.true_clearance_mm(),
        target_distance_mm=target.distance_mm(needle.true_tip.position_mm),
    )
