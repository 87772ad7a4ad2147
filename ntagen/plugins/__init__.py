"""What the author of a plugin needs: the protocols, the errors, and a helper for blocking calls.

``docs/plugins.md`` says what a plugin must be and has a whole example; `ntagen.testing` checks one.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Final

from ntagen.drive.device import WATCH_S, Halted, LiveSensor, Watch, WatchedActuator
from ntagen.drive.plugin import Speeds
from ntagen.errors import DeviceError
from ntagen.needle.measurement import Measurement
from ntagen.tracking.frames import IDENTITY, Transform

__all__ = [
    "IDENTITY",
    "WATCH_S",
    "DeviceError",
    "Halted",
    "LiveSensor",
    "Measurement",
    "Speeds",
    "Transform",
    "Watch",
    "WatchedActuator",
    "run_watched",
]


_PERIOD_S: Final = WATCH_S / 2.0
_END_S: Final = 3.0


def run_watched(
    move: Callable[[], object],
    watch: Watch,
    stop: Callable[[], object],
    part: Callable[[], float] | None = None,
    end_s: float = _END_S,
) -> None:
    """Makes a motion that is one blocking call in a thread, and calls the watch while it lasts.

    If the watch raises, the motion is stopped; when the blocking call has returned, what the watch
    raised goes on to the caller. Whatever the blocking call itself raises goes on, too, unless it
    was stopped.

    Args:
        move: The call that blocks until the motion is over.
        watch: The `watch` of the device.
        stop: Stops the motion; it must be allowed in another thread than `move`.
        part: How much of the motion was made, from 0 to 1; asked when the needle stands. Without
            it, a motion that was ended early counts as made in full, which is never too little.
        end_s: The blocking call must return within this time after the stop.

    Raises:
        DeviceError: It does not.
    """
    failures: list[BaseException] = []

    def run() -> None:
        try:
            move()
        except BaseException as error:
            failures.append(error)

    # Before it starts, too: nothing must move that would be stopped at once.
    watch()
    thread = threading.Thread(target=run, name="blocking motion", daemon=True)
    thread.start()
    try:
        while thread.is_alive():
            watch()
            thread.join(_PERIOD_S)
    except BaseException as told:
        stop()
        thread.join(end_s)
        if thread.is_alive():
            raise DeviceError(
                f"the motion did not end within {end_s:g} s after a stop\n"
                "hint: stop the needle by its hardware switch"
            ) from told
        if isinstance(told, Halted):
            told.part = 1.0 if part is None else max(0.0, min(1.0, part()))
        raise
    if failures:
        raise failures[0]
