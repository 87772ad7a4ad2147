"""Connects to the tracker of a real needle, and refuses at once what cannot measure it."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from ntagen.drive.device import LiveSensor
from ntagen.errors import InputError
from ntagen.scene import Pose
from ntagen.tracking.frames import Transform
from ntagen.tracking.plausible import LivePlausible
from ntagen.tracking.playback import Playback
from ntagen.tracking.spec import Tracker, open_tracker


@contextlib.contextmanager
def opened_live(
    text: str,
    tracker: Tracker,
    transform: Transform | None,
    entry: Pose | None,
    now_s: Callable[[], float],
    *,
    watches_force: bool,
    force_varies: bool,
) -> Iterator[LiveSensor]:
    """Connects to the tracker of a real needle until the end of the block.

    Args:
        text: The words of the tracker.
        tracker: What they mean; no recording.
        transform: The registration.
        entry: Where the needle is at the start; None if it lies in the tissue, where the driver
            looks for it itself.
        now_s: The clock of the actuator.
        watches_force: Whether the driver relies on a force.
        force_varies: Whether the force has noise (`ntagen.tracking.plausible.Plausible`).

    Raises:
        InputError: The tracker cannot be used so.
        DeviceError: It cannot be reached.
    """
    with open_tracker(tracker, transform, now_s) as sensor:
        if isinstance(sensor, Playback):
            raise AssertionError("a recording cannot measure a real needle")
        require_force(text, sensor.measures_force, watches_force)
        yield LivePlausible(sensor, entry, now_s, force_varies=watches_force and force_varies)


def require_force(text: str, measures_force: bool, watches_force: bool) -> None:
    """Refuses a tracker without a force for a driver that watches the force.

    Raises:
        InputError: It measures none.
    """
    if watches_force and not measures_force:
        raise InputError(
            f"the tracker {text} measures no force, and the driver watches the force\n"
            "hint: name a sensor with force=DEVICE, or add --set 'force sensing off'"
        )
