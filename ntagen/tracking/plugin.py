"""A tracker of another package: its faults become faults of a device."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final

from ntagen.drive.device import require_finite
from ntagen.errors import DeviceError
from ntagen.extensions import TRACKERS, guarded, load, opened
from ntagen.needle.measurement import Measurement
from ntagen.tracking.frames import Transform

_NEEDS: Final = ("measure", "newest", "measures_force")


@dataclass(frozen=True, slots=True)
class PluginSource:
    """A tracker of a plugin: its name, and what stands behind it."""

    name: str
    argument: str


class PluginTracker:
    """A `ntagen.drive.device.LiveSensor` of a plugin, with all that it may do wrong caught.

    Args:
        name: The name of the plugin.
        inner: What it opened.
    """

    def __init__(self, name: str, inner: Any) -> None:  # noqa: ANN401  it is of a stranger
        self._name = name
        self._inner = inner

    @property
    def description(self) -> str:
        """What it says about itself; empty if nothing."""
        with guarded(self._name, "describe itself"):
            return str(getattr(self._inner, "description", ""))

    @property
    def measures_force(self) -> bool:
        """Whether measurements have a force."""
        with guarded(self._name, "tell whether it measures a force"):
            return bool(self._inner.measures_force)

    def measure(self) -> Measurement:
        """See `ntagen.drive.device.Sensor.measure`."""
        with guarded(self._name, "measure"):
            return self._checked(self._inner.measure())

    def newest(self) -> Measurement:
        """See `ntagen.drive.device.LiveSensor.newest`."""
        with guarded(self._name, "tell its newest sample"):
            return self._checked(self._inner.newest())

    def _checked(self, found: object) -> Measurement:
        if not isinstance(found, Measurement):
            raise DeviceError(f"it gave {type(found).__name__}, which is no Measurement")
        require_finite(found)
        return found


@contextlib.contextmanager
def open_bare(
    source: PluginSource, transform: Transform, now_s: Callable[[], float]
) -> Iterator[Any]:
    """What a plugin opens, with nothing around it: for tests of plugins.

    Raises:
        InputError: No such plugin is installed.
        DeviceError: It cannot be opened, or is no tracker.
    """
    factory = load(TRACKERS, source.name)
    with opened(source.name, lambda: factory(source.argument, transform, now_s), _NEEDS) as inner:
        yield inner


@contextlib.contextmanager
def open_plugin(
    source: PluginSource, transform: Transform, now_s: Callable[[], float]
) -> Iterator[PluginTracker]:
    """The tracker of a plugin, until the end of the block.

    Args:
        source: Which one.
        transform: From the tracker's frame to that of the scene.
        now_s: The clock of the actuator.

    Raises:
        InputError: No such plugin is installed.
        DeviceError: It cannot be opened, or is no tracker.
    """
    with open_bare(source, transform, now_s) as inner:
        yield PluginTracker(source.name, inner)
