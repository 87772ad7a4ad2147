"""Whether a tracker keeps the protocol of `ntagen.drive.device.LiveSensor`; nothing is moved."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Final

from ntagen.drive.device import WATCH_S, LiveSensor
from ntagen.needle.measurement import Measurement
from ntagen.needle.vectors import dot, norm
from ntagen.testing.checks import Check, need, run

_COUNT: Final = 10
_LOOKS: Final = 50
_TOLERANCE: Final = 1e-3
_OLDEST_S: Final = 2.0
_EARLY_S: Final = 0.05


def tracker_contract(
    sensor: LiveSensor,
    now_s: Callable[[], float] = time.monotonic,
    report: Callable[[Check], None] = lambda _: None,
) -> list[Check]:
    """Checks a tracker that sees the needle.

    Args:
        sensor: The tracker, open.
        now_s: The clock with which it was opened.
        report: Is told each check when it is made.
    """
    checks = []
    for name, check in _CHECKS.items():
        checks.append(run(name, lambda check=check: check(sensor, now_s)))  # type: ignore[misc]
        report(checks[-1])
        if checks[-1].problem:
            break
    return checks


_Now = Callable[[], float]


def _says_force(sensor: LiveSensor, _: _Now) -> None:
    found: object = sensor.measures_force
    need(isinstance(found, bool), f"measures_force is {found!r}")


def _measures(sensor: LiveSensor, _: _Now) -> None:
    for _number in range(_COUNT):
        _require_whole(sensor.measure(), sensor.measures_force)


def _require_whole(found: object, has_force: bool) -> None:
    if not isinstance(found, Measurement):
        need(False, f"it gives {type(found).__name__}, which is no Measurement")
        return
    numbers = (*found.position_mm, found.force_n, found.time_s)
    need(len(found.position_mm) == 3, f"a position is {found.position_mm}")
    need(all(math.isfinite(number) for number in numbers), f"{found} has what is no number")
    need(has_force or found.force_n == 0.0, f"without a force sensor the force is {found.force_n}")
    for name, direction in (("heading", found.heading), ("bevel", found.bevel)):
        length = 1.0 if direction is None else norm(direction)
        need(abs(length - 1.0) <= _TOLERANCE, f"the {name} has the length {length:.3g}, not 1")
    if found.heading is not None and found.bevel is not None:
        across = dot(found.heading, found.bevel)
        need(abs(across) <= _TOLERANCE, "heading and bevel are not at a right angle")


def _times(sensor: LiveSensor, now_s: _Now) -> None:
    last_s = -math.inf
    for _ in range(_COUNT):
        time_s, after_s = sensor.measure().time_s, now_s()
        need(time_s >= last_s, f"a measurement of {time_s:.3f} s came after one of {last_s:.3f} s")
        need(
            time_s <= after_s + _EARLY_S, f"a measurement is of {time_s:.3f} s, at {after_s:.3f} s"
        )
        need(time_s >= after_s - _OLDEST_S, f"a measurement is {after_s - time_s:.1f} s old")
        last_s = time_s


def _newest(sensor: LiveSensor, _: _Now) -> None:
    sensor.measure()
    took_s = []
    for _number in range(_LOOKS):
        began_s = time.monotonic()
        found = sensor.newest()
        took_s.append(time.monotonic() - began_s)
        _require_whole(found, sensor.measures_force)
    usual_s = sorted(took_s)[int(0.9 * _LOOKS)]
    need(
        usual_s <= 0.5 * WATCH_S,
        f"it takes {1e3 * usual_s:.1f} ms; half of {1e3 * WATCH_S:.0f} ms is allowed",
    )


def _goes_on(sensor: LiveSensor, _: _Now) -> None:
    first_s = sensor.newest().time_s
    until_s = time.monotonic() + _OLDEST_S
    while time.monotonic() < until_s:
        if sensor.newest().time_s > first_s:
            return
        time.sleep(WATCH_S)
    need(False, f"newest() gives the same sample for {_OLDEST_S:g} s")


_CHECKS: Final[dict[str, Callable[[LiveSensor, _Now], None]]] = {
    "it says whether it measures a force": _says_force,
    "measurements are whole": _measures,
    "measurements have times on the clock of the needle": _times,
    "newest() never waits": _newest,
    "newest() gets new samples by itself": _goes_on,
}
