"""Opens what moves a real needle, as the user and the task describe it."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from ntagen.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from ntagen.drive.device import WatchedActuator
    from ntagen.drive.plugin import Speeds
    from ntagen.drive.settings import Settings
    from ntagen.grbl.axes import Axes
    from ntagen.grbl.port import Port
    from ntagen.hardware import GrblDevice
    from ntagen.nsl import Task
    from ntagen.scene import Needle


def described(task: Task, path: Path) -> GrblDevice:
    """The device that a task describes.

    Raises:
        InputError: It describes none.
    """
    if task.device is None:
        raise InputError(
            f"{path}: the task describes no device\n"
            'hint: write for example device grbl "/dev/ttyACM0" '
            "{ insert X 80 steps/mm  roll A 8.89 steps/deg }"
        )
    return task.device


def axes_for(device: GrblDevice, needle: Needle, settings: Settings) -> Axes:
    """The axes of a device, at the speeds of the needle and of the settings.

    Raises:
        InputError: The axes are impossible.
    """
    from ntagen.grbl.axes import axes_of
    from ntagen.units import deg_from_rad

    speeds = speeds_for(needle, settings)
    return axes_of(
        device,
        push_mm_per_s=speeds.push_mm_per_s,
        pull_mm_per_s=speeds.pull_mm_per_s,
        roll_deg_per_s=deg_from_rad(speeds.roll_rad_per_s),
    )


@contextlib.contextmanager
def opened_steppers(
    wire: Port, axes: Axes, needle: Needle, settings: Settings
) -> Iterator[WatchedActuator]:
    """Connects to the controller that moves the needle, until the end of the block.

    Args:
        wire: The port, which is closed at the end.
        axes: Which axis does what, and how fast.
        needle: The needle.
        settings: How to drive.

    Raises:
        InputError: Axes, speeds or settings do not fit the controller.
        DeviceError: It is not ready to move.
    """
    from ntagen.drive.fitting import overrun_mm
    from ntagen.drive.real import require_overrun
    from ntagen.grbl.actuator import GrblActuator

    with contextlib.closing(wire):
        actuator = GrblActuator(wire, axes)
        needs_mm = overrun_mm(needle.speed_mm_per_s, actuator.ramp_mm_per_s2)
        require_overrun(settings, needs_mm)
        yield actuator


def speeds_for(needle: Needle, settings: Settings) -> Speeds:
    """The speeds of a needle and of the settings."""
    from ntagen.drive.plugin import Speeds

    return Speeds(
        push_mm_per_s=needle.speed_mm_per_s,
        pull_mm_per_s=settings.pull_speed_ratio * needle.speed_mm_per_s,
        roll_rad_per_s=settings.roll_rad_per_s,
    )


@contextlib.contextmanager
def opened_plugin(
    name: str, argument: str, needle: Needle, settings: Settings
) -> Iterator[WatchedActuator]:
    """Opens the device of a plugin, until the end of the block.

    Args:
        name: The name of the plugin.
        argument: What stands behind it.
        needle: The needle.
        settings: How to drive.

    Raises:
        InputError: The settings do not fit the device.
        DeviceError: The plugin fails.
    """
    from ntagen.drive.fitting import overrun_mm
    from ntagen.drive.plugin import open_device
    from ntagen.drive.real import require_overrun

    with open_device(name, argument, speeds_for(needle, settings)) as actuator:
        ramp_mm_per_s2 = actuator.ramp_mm_per_s2
        if ramp_mm_per_s2 is not None:
            require_overrun(settings, overrun_mm(needle.speed_mm_per_s, ramp_mm_per_s2))
        yield actuator
