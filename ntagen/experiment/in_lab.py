"""A run of a row whose needle stands in a lab: each run opens a lab of its own."""

from __future__ import annotations

from dataclasses import replace

from ntagen.drive.configure import Configuration
from ntagen.drive.fitting import overrun_mm
from ntagen.drive.plant import (
    ACCELERATION_MM_PER_S2,
    NeedlePlant,
    simulated_axes,
    simulated_controller,
)
from ntagen.drive.real import require_overrun
from ntagen.drive.records import Journal
from ntagen.drive.simulate import synthesiser_for
from ntagen.drive.steppers import axes_for, speeds_for
from ntagen.grbl.axes import Axes
from ntagen.lab.driving import InLab, drive_in
from ntagen.lab.lab import Lab
from ntagen.lab.needles import Placed, place
from ntagen.nsl import Task
from ntagen.units import deg_from_rad


def driven_in_lab(
    task: Task,
    configuration: Configuration,
    known: str,
    speed: float,
    journal: Journal,
) -> InLab:
    """Opens a lab, and drives the needle in it.

    Args:
        task: The task.
        configuration: The settings, the needle and the seed.
        known: The critical regions that the driver knows (`ntagen.drive.knowledge.told`).
        speed: How many seconds pass in the lab in one second.
        journal: Records what happens, with the truth at each measurement.

    Raises:
        InputError: The controller cannot have the axes of the task.
        DeviceError: The lab cannot be reached.
    """
    scene, settings = task.scene, configuration.settings
    placed, axes = _placed(task, configuration), _axes(task, configuration)
    with Lab(scene, placed, axes=axes, speed=speed) as lab:
        return drive_in(lab, axes, scene, synthesiser_for(settings), settings, journal, known=known)


def require_fitting(task: Task, configuration: Configuration) -> None:
    """Refuses settings and axes with which no lab can be driven; opens nothing.

    Raises:
        InputError: They do not fit the emulated controller.
    """
    axes = _axes(task, configuration)
    simulated_controller(NeedlePlant(_placed(task, configuration).needle, axes), axes)
    speed_mm_per_s = task.scene.needle.speed_mm_per_s
    require_overrun(configuration.settings, overrun_mm(speed_mm_per_s, ACCELERATION_MM_PER_S2))


def _placed(task: Task, configuration: Configuration) -> Placed:
    margin_mm = configuration.settings.sensing_margin_mm
    return place("phantom", task.scene, configuration.seed, margin_mm, configuration.errors)


def _axes(task: Task, configuration: Configuration) -> Axes:
    """The axes of the device in the task; without one, those of our emulated controller."""
    needle, settings = task.scene.needle, configuration.settings
    if task.device is not None:
        return axes_for(task.device, needle, settings)
    speeds = speeds_for(needle, settings)
    return replace(
        simulated_axes(speeds.push_mm_per_s),
        pull_mm_per_s=speeds.pull_mm_per_s,
        roll_deg_per_s=deg_from_rad(speeds.roll_rad_per_s),
    )
