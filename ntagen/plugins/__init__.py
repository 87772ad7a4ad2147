"""What the author of a plugin needs: the protocols, the errors, and a helper for blocking calls.

``docs/plugins.md`` says what a plugin must be and has a whole example; `ntagen.testing` checks one.
"""

from __future__ import annotations

from ntagen.drive.device import WATCH_S, Halted, LiveSensor, Watch, WatchedActuator
from ntagen.drive.plugin import Speeds
from ntagen.errors import DeviceError
from ntagen.needle.measurement import Measurement
from ntagen.plugins.blocking import run_watched
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
