"""What a lab says of its subject: where the target is, and where the needle enters."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from ntagen.errors import DeviceError, InputError
from ntagen.needle.vectors import distance, subtract
from ntagen.ros.topics import ENTRY, TARGET, Topics
from ntagen.ros.tracker import unit_error
from ntagen.scene import Scene, Vector
from ntagen.shapes import UPRIGHT
from ntagen.tracking.plausible import FARTHEST_MM

_SAME_MM: Final = 1e-3


def scene_for(
    scene: Scene, topics: Topics, entry_mm: Vector | None, target_mm: Vector | None
) -> Scene:
    """A scene whose last target is where the lab says; the same one if that is where it was.

    Args:
        scene: The scene of the task.
        topics: The names of topics, for messages, and their unit.
        entry_mm: Where the needle enters, in the frame of the stage; None if nobody says it.
        target_mm: Where the target is; None if nobody says it.

    Raises:
        DeviceError: The entry is not that of the task, or a unit is wrong.
        InputError: The target is where the needle must not go.
    """
    if entry_mm is not None:
        _require_entry(topics, entry_mm, scene.needle.tip.position_mm)
    if target_mm is None:
        return scene
    last = scene.targets[-1]
    _require_unit(topics, TARGET, target_mm, last.center_mm)
    if distance(target_mm, last.center_mm) <= _SAME_MM:
        return scene
    for region in scene.avoided:
        if region.distance_mm(target_mm) <= 0.0:
            raise InputError(
                f"{topics.name(TARGET)} is in the {region.kind} region '{region.name}'\n"
                "hint: choose another target, or move the regions of the task"
            )
    shape = last.shape.placed(UPRIGHT, subtract(target_mm, last.center_mm))
    return scene.with_targets([*scene.targets[:-1], replace(last, shape=shape)])


def _require_entry(topics: Topics, told_mm: Vector, entry_mm: Vector) -> None:
    _require_unit(topics, ENTRY, told_mm, entry_mm)
    away_mm = distance(told_mm, entry_mm)
    if away_mm > FARTHEST_MM:
        raise DeviceError(
            f"{topics.name(ENTRY)} is {away_mm:.1f} mm from the entry of the task; "
            f"{FARTHEST_MM:g} mm is allowed\n"
            "hint: write the tip of the task where the needle is, or remap the topic"
        )


def _require_unit(topics: Topics, usual: str, told_mm: Vector, wanted_mm: Vector) -> None:
    trouble = unit_error(told_mm, wanted_mm, 0.0, topics.name(usual), topics.units)
    if trouble:
        told = trouble.replace("the tip is", "it is").replace("from the entry", "from the task")
        raise DeviceError(told.replace("sensor_units", "units"))
