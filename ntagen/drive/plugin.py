"""A device of another package: its faults become faults of a device, and it is held to its word."""

from __future__ import annotations

import contextlib
import math
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final, NoReturn

from ntagen.drive.device import Halted, Watch, can_screw, screw_on
from ntagen.errors import DeviceError
from ntagen.extensions import DEVICES, guarded, load, opened

_DEAF_S: Final = 1.0
"""A device that has not called its watch for so long in a motion is stopped."""

_NEEDS: Final = ("now_s", "push", "roll", "pull", "stop")


@dataclass(frozen=True, slots=True)
class Speeds:
    """How fast a device should move.

    Attributes:
        push_mm_per_s: The speed of insertion.
        pull_mm_per_s: The speed of pulling.
        roll_rad_per_s: The speed of rolling.
    """

    push_mm_per_s: float = 1.0
    pull_mm_per_s: float = 5.0
    roll_rad_per_s: float = math.pi / 2.0


class _Attention:
    """Stops a device that does not call its watch, in a thread of its own, until the block ends.

    Args:
        stop: Stops it.

    Attributes:
        is_deaf: Whether that was necessary.
    """

    def __init__(self, stop: Callable[[], object]) -> None:
        self.is_deaf = False
        self._stop = stop
        self._heard_s = time.monotonic()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._work, name="plugin attention", daemon=True)

    def __enter__(self) -> _Attention:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join(_DEAF_S)

    def note(self) -> None:
        """Its watch was called."""
        self._heard_s = time.monotonic()

    def _work(self) -> None:
        while not self._over.wait(max(0.0, self._heard_s + _DEAF_S - time.monotonic())):
            if time.monotonic() >= self._heard_s + _DEAF_S:
                self.is_deaf = True
                # Its failure shows in the motion, which goes on.
                with contextlib.suppress(BaseException):
                    self._stop()
                return


class PluginActuator:
    """A `WatchedActuator` of a plugin, with all that a plugin may do wrong caught.

    Impossible commands never reach it. If it goes on although its watch raised, or does not call
    its watch, it is stopped.

    Args:
        name: The name of the plugin.
        inner: What it opened.
    """

    def __init__(self, name: str, inner: Any) -> None:  # noqa: ANN401  it is of a stranger
        self.watch: Watch = lambda: None
        self._name = name
        self._inner = inner
        self._raised: BaseException | None = None
        self._attention = _Attention(inner.stop)
        self._last_s = -math.inf
        with guarded(name, "take a watch"):
            inner.watch = self._watch
        self._opened_s = self._time_s()

    @property
    def description(self) -> str:
        """What it says about itself; empty if nothing."""
        with guarded(self._name, "describe itself"):
            return str(getattr(self._inner, "description", ""))

    @property
    def ramp_mm_per_s2(self) -> float | None:
        """The acceleration with which it stops a push; `None` if it does not say."""
        with guarded(self._name, "tell its ramp"):
            ramp = getattr(self._inner, "ramp_mm_per_s2", None)
            ramp = None if ramp is None else float(ramp)
        if ramp is not None and not 0.0 < ramp < math.inf:
            raise DeviceError(f"the plugin '{self._name}' says that it brakes with {ramp} mm/s²")
        return ramp

    def counts(self) -> tuple[float, float] | None:
        """Where its axes stand by its own count, in mm and rad; `None` if it does not count.

        Raises:
            DeviceError: It does not say so in numbers.
        """
        count = getattr(self._inner, "counts", None)
        if count is None:
            return None
        with guarded(self._name, "tell where its axes stand"):
            insert_mm, roll_rad = (float(one) for one in count())
        if not (math.isfinite(insert_mm) and math.isfinite(roll_rad)):
            raise DeviceError(
                f"the plugin '{self._name}' says that its axes stand at {insert_mm}, {roll_rad}"
            )
        return insert_mm, roll_rad

    def now_s(self) -> float:
        """The time on the device's clock since it was opened.

        Raises:
            DeviceError: It is no time, or went back.
        """
        return self._time_s() - self._opened_s

    def _time_s(self) -> float:
        with guarded(self._name, "tell the time"):
            now_s = float(self._inner.now_s())
        if not self._last_s <= now_s < math.inf:
            raise DeviceError(
                f"the plugin '{self._name}' says that it is {now_s} s, after {self._last_s} s"
            )
        self._last_s = now_s
        return now_s

    def push(self, length_mm: float) -> None:
        """See `ntagen.drive.device.WatchedActuator.push`."""
        self._move("push", self._inner.push, length_mm, least=0.0)

    @property
    def can_screw(self) -> bool:
        """Whether it can insert the needle and turn it at once."""
        return can_screw(self._inner)

    def screw(self, length_mm: float, angle_rad: float) -> None:
        """See `ntagen.drive.device.Screwing.screw`."""
        if not math.isfinite(angle_rad):
            raise DeviceError(f"the device refuses to screw by {angle_rad}")
        self._move("screw", lambda mm: screw_on(self._inner, mm, angle_rad), length_mm, least=0.0)

    def roll(self, angle_rad: float) -> None:
        """See `ntagen.drive.device.WatchedActuator.roll`."""
        self._move("roll", self._inner.roll, angle_rad, least=-math.inf)

    def pull(self, length_mm: float) -> None:
        """See `ntagen.drive.device.WatchedActuator.pull`."""
        self._move("pull", self._inner.pull, length_mm, least=0.0)

    def stop(self) -> None:
        """See `ntagen.drive.device.WatchedActuator.stop`."""
        with guarded(self._name, "stop"):
            self._inner.stop()

    def _watch(self) -> None:
        """What the plugin calls; once it has raised, it raises until the motion is over."""
        self._attention.note()
        if self._raised is not None:
            raise self._raised
        try:
            self.watch()
        except BaseException as error:
            self._raised = error
            raise

    def _move(self, does: str, command: Callable[[float], Any], value: float, least: float) -> None:
        if not (math.isfinite(value) and value >= least):
            raise DeviceError(f"the device refuses to {does} by {value}")
        self._raised = None
        failure: BaseException | None = None
        self._attention = _Attention(self._inner.stop)
        try:
            with self._attention, guarded(self._name, does):
                command(value)
        except BaseException as error:
            failure = error
        self._end(failure)

    def _end(self, failure: BaseException | None) -> None:
        """Raises what ended a motion early, if anything did."""
        told = self._raised
        if told is None and self._attention.is_deaf and not isinstance(failure, KeyboardInterrupt):
            raise DeviceError(
                f"the plugin '{self._name}' did not call its watch for {_DEAF_S:g} s of a motion, "
                "and was told to stop\n"
                "hint: `ntagen device test` checks a plugin; tell its author what it says"
            ) from failure
        if told is None:
            if failure is not None:
                raise failure
            return
        if failure is not told and (failure is None or failure.__cause__ is not told):
            self._stop_for(told)
        self._require_part(told)
        raise told from None

    def _require_part(self, told: BaseException) -> None:
        """Refuses a motion of which nobody knows how much was made."""
        if isinstance(told, Halted) and not 0.0 <= told.part <= 1.0:
            raise DeviceError(
                f"the plugin '{self._name}' says that {told.part} of the motion was made"
            )

    def _stop_for(self, told: BaseException) -> NoReturn:
        """Stops a device that did not end a motion although its watch told it to."""
        self.stop()
        if not isinstance(told, Halted):
            raise told
        raise DeviceError(
            f"the plugin '{self._name}' did not pass on why the motion had to end ({told}); nobody "
            "knows how far the needle got\n"
            "hint: tell its author: what the watch raises goes on to the caller"
        )


@contextlib.contextmanager
def open_bare(name: str, argument: str, speeds: Speeds) -> Iterator[Any]:
    """What a plugin opens, with nothing around it: for tests of plugins.

    Raises:
        InputError: No such plugin is installed.
        DeviceError: It cannot be opened, or is no device.
    """
    factory = load(DEVICES, name)
    with opened(name, lambda: factory(argument, speeds), _NEEDS) as inner:
        yield inner


@contextlib.contextmanager
def open_device(name: str, argument: str, speeds: Speeds) -> Iterator[PluginActuator]:
    """The device of a plugin, until the end of the block.

    Args:
        name: The name of the plugin.
        argument: What stands behind its name and a colon.
        speeds: How fast it should move.

    Raises:
        InputError: No such plugin is installed.
        DeviceError: It cannot be opened, or is no device.
    """
    with open_bare(name, argument, speeds) as inner:
        yield PluginActuator(name, inner)
