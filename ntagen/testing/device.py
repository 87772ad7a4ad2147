"""Whether a device keeps the protocol of `ntagen.drive.device.WatchedActuator`.

The checks move the needle for real: pushes, pulls and rolls of the given size. Take the needle out
of the tissue first. At the end it stands about where it stood before.
"""

from __future__ import annotations

import itertools
import math
import threading
import time
from collections.abc import Callable
from typing import Final

from ntagen.drive.device import WATCH_S, Halted, WatchedActuator
from ntagen.drive.plugin import Speeds
from ntagen.errors import DeviceError
from ntagen.testing.checks import Check, Wrong, need, run

LENGTH_MM: Final = 1.0
ANGLE_RAD: Final = math.radians(30.0)

_FAST_RATIO: Final = 0.8
"""A motion may take this share of its time at the speed that was asked for."""

_SLOW_RATIO: Final = 2.0
_SLOW_S: Final = 3.0
_LONGEST_GAP_S: Final = 10.0 * WATCH_S
_TRIES: Final = 3
_REST_S: Final = 0.2
_STOP_S: Final = 0.5
_SMALL_MM: Final = 0.05


class Told(Exception):  # noqa: N818  the watch raises it on purpose
    """What the watch of a check raises."""


class _Bench:
    """A device on the bench, and the moments at which its watch was called."""

    def __init__(
        self, device: WatchedActuator, speeds: Speeds, length_mm: float, angle_rad: float
    ) -> None:
        self.device = device
        self.speeds = speeds
        self.length_mm = length_mm
        self.angle_rad = angle_rad
        self.calls: list[float] = []
        self._error: BaseException | None = None
        self._from_s = math.inf
        self.told_s = math.inf
        device.watch = self._watch

    def _watch(self) -> None:
        now_s = time.monotonic()
        self.calls.append(now_s)
        if self._error is not None and now_s >= self._from_s:
            self.told_s = min(self.told_s, now_s)
            raise self._error

    def moved(self, command: Callable[[], None]) -> float:
        """Makes a motion; returns how long it took, in seconds."""
        self.calls = []
        began_s = time.monotonic()
        command()
        return time.monotonic() - began_s

    def told(
        self, error: BaseException, command: Callable[[], None], after_s: float
    ) -> BaseException | None:
        """Makes a motion whose watch raises after a time; returns what it raised."""
        self._error, self._from_s = error, time.monotonic() + after_s
        self.told_s = math.inf
        try:
            self.moved(command)
        except BaseException as raised:
            if isinstance(raised, KeyboardInterrupt) and raised is not error:
                raise
            return raised
        finally:
            self._error = None
        return None

    @property
    def seconds(self) -> float:
        """How long a push takes at the speed that was asked for."""
        return self.length_mm / self.speeds.push_mm_per_s


def device_contract(
    device: WatchedActuator,
    speeds: Speeds,
    length_mm: float = LENGTH_MM,
    angle_rad: float = ANGLE_RAD,
    report: Callable[[Check], None] = lambda _: None,
) -> list[Check]:
    """Checks a device with small motions.

    Args:
        device: The device, open and at rest.
        speeds: The speeds for which it was opened.
        length_mm: How far it is pushed and pulled.
        angle_rad: How far it is rolled.
        report: Is told each check when it is made.
    """
    bench = _Bench(device, speeds, length_mm, angle_rad)
    checks = []
    for name, check in _CHECKS.items():
        checks.append(run(name, lambda check=check: check(bench)))  # type: ignore[misc]
        report(checks[-1])
        if check in _NEEDED and checks[-1].problem:
            break
    return checks


def _clock(bench: _Bench) -> None:
    times = [bench.device.now_s()]
    began_s = time.monotonic()
    while time.monotonic() < began_s + _REST_S:
        times.append(bench.device.now_s())
        time.sleep(WATCH_S)
    need(all(math.isfinite(t) for t in times), f"it says {times}")
    need(times == sorted(times), "it goes back")
    need(times[-1] > times[0], "it stands")


def _refusals(bench: _Bench) -> None:
    device = bench.device
    for name, command, values in (
        ("push", device.push, (-bench.length_mm, math.nan, math.inf)),
        ("pull", device.pull, (-bench.length_mm, math.nan, math.inf)),
        ("roll", device.roll, (math.nan, math.inf)),
    ):
        for value in values:
            try:
                _refuses(bench, lambda command=command, value=value: command(value))  # type: ignore[misc]
            except Wrong as wrong:
                raise Wrong(f"{name}({value:g}): {wrong}") from None


def _refuses(bench: _Bench, command: Callable[[], None]) -> None:
    """Says that a command must be refused; a device that begins to move all the same is stopped."""
    raised = bench.told(Told("of a check"), command, after_s=0.0)
    if bench.calls:
        bench.device.stop()
        raise Wrong("it moves")
    need(raised is not None, "it is accepted")
    need(isinstance(raised, DeviceError), f"it raises {raised!r}, not DeviceError")


def _nothing(bench: _Bench) -> None:
    for command in (bench.device.push, bench.device.pull, bench.device.roll):
        took_s = bench.moved(lambda command=command: command(0.0))  # type: ignore[misc]
        need(took_s < _SLOW_S, f"it takes {took_s:.1f} s")


def _stop_at_rest(bench: _Bench) -> None:
    bench.device.stop()
    bench.device.stop()


def _durations(bench: _Bench) -> None:
    device, speeds = bench.device, bench.speeds
    for name, command, value, speed in (
        ("push", device.push, bench.length_mm, speeds.push_mm_per_s),
        ("pull", device.pull, bench.length_mm, speeds.pull_mm_per_s),
        ("roll", device.roll, bench.angle_rad, speeds.roll_rad_per_s),
        ("roll", device.roll, -bench.angle_rad, speeds.roll_rad_per_s),
    ):
        began_s = device.now_s()
        command(value)
        took_s, ideal_s = device.now_s() - began_s, abs(value) / speed
        need(
            took_s >= _FAST_RATIO * ideal_s,
            f"{name}({value:g}) returns after {took_s:.2f} s, and the motion takes {ideal_s:.2f} s",
        )
        need(
            took_s <= _SLOW_RATIO * ideal_s + _SLOW_S,
            f"{name}({value:g}) takes {took_s:.2f} s instead of {ideal_s:.2f} s",
        )


def _watched(bench: _Bench) -> None:
    """Looks at several pushes if need be: a busy computer may pause once, a wrong device always."""
    for left in reversed(range(_TRIES)):
        try:
            _watched_once(bench)
        except Wrong:
            if not left or not bench.calls:
                raise
        else:
            return


def _watched_once(bench: _Bench) -> None:
    began_s = time.monotonic()
    took_s = bench.moved(lambda: bench.device.push(bench.length_mm))
    calls = list(bench.calls)
    bench.device.pull(bench.length_mm)
    need(bool(calls), "the watch is never called in a push")
    times = [began_s, *calls, began_s + took_s]
    gaps_s = sorted(b - a for a, b in itertools.pairwise(times))
    usual_s = gaps_s[len(gaps_s) // 2]
    need(
        usual_s <= 1.5 * WATCH_S,
        f"the watch is called every {1e3 * usual_s:.0f} ms; {1e3 * WATCH_S:.0f} ms is allowed",
    )
    need(
        gaps_s[-1] <= _LONGEST_GAP_S,
        f"the watch is not called for {1e3 * gaps_s[-1]:.0f} ms of a push",
    )
    rest = len(bench.calls)
    time.sleep(_REST_S)
    need(len(bench.calls) == rest, "the watch is called at rest")


def _passes(bench: _Bench) -> None:
    for error in (Told("of a check"), KeyboardInterrupt("of a check")):
        after_s = 0.5 * bench.seconds
        raised = bench.told(error, lambda: bench.device.push(bench.length_mm), after_s)
        _home(bench, time.monotonic() - bench.told_s + after_s)
        need(
            raised is error,
            f"the watch raised {error!r}, and the push "
            + ("returned as if nothing had been" if raised is None else f"raised {raised!r}"),
        )


def _home(bench: _Bench, moved_s: float) -> None:
    """Pulls back what a push that was ended may have made, if nothing better is known."""
    moved_mm = min(bench.length_mm, bench.speeds.push_mm_per_s * max(0.0, moved_s))
    bench.device.stop()
    bench.device.pull(moved_mm)


def _halted(bench: _Bench, after_s: float) -> Halted:
    """Makes a push whose watch halts it after a time; returns what the watch raised."""
    halted = Halted("of a check")
    raised = bench.told(halted, lambda: bench.device.push(bench.length_mm), after_s)
    need(raised is halted, f"the push ended with {raised!r}, not with the Halted of its watch")
    return halted


def _ends_early(bench: _Bench) -> None:
    after_s = 0.3 * bench.seconds
    began_s = time.monotonic()
    halted = _halted(bench, after_s)
    took_s = time.monotonic() - began_s
    if 0.0 < halted.part <= 1.0:
        bench.device.pull(halted.part * bench.length_mm)
    late_s = took_s - after_s
    need(
        late_s <= _STOP_S,
        f"the push returned {late_s:.2f} s after its watch had raised; {_STOP_S:g} s is allowed",
    )


def _part(bench: _Bench) -> None:
    for share in (0.3, 0.6):
        after_s = share * bench.seconds
        part = _halted(bench, after_s).part
        need(0.0 <= part <= 1.0, f"the part of the motion that was made is {part}")
        bench.device.pull(part * bench.length_mm)
        # From the first call of the watch on, it moved at the speed that was asked for, or slower.
        most = bench.speeds.push_mm_per_s * (bench.told_s - bench.calls[0] + _STOP_S)
        made = f"{part:.2f} of {bench.length_mm:g} mm, which is too"
        found = f"a push that was ended after {after_s:.2f} s has made {made}"
        need(part * bench.length_mm <= most + _SMALL_MM, f"{found} much")
        need(part >= 0.3 * share, f"{found} little")


def _stop_in_motion(bench: _Bench) -> None:
    began_s = time.monotonic()
    failures: list[str] = []

    def stop() -> None:
        try:
            bench.device.stop()
        except Exception as error:
            failures.append(f"stop() raises {error!r} in a motion")

    stopping = threading.Timer(0.4 * bench.seconds, stop)
    stopping.start()
    problem = ""
    try:
        bench.device.push(bench.length_mm)
        problem = "the push returned as if it had been made in full"
    except Exception as error:
        if not isinstance(error, DeviceError):
            problem = f"the push ended with {error!r}, not with DeviceError"
    took_s = time.monotonic() - began_s
    stopping.join()
    _home(bench, took_s)
    need(
        took_s <= 0.4 * bench.seconds + _STOP_S,
        f"the push goes on for {took_s - 0.4 * bench.seconds:.2f} s after stop()",
    )
    need(not failures, "".join(failures))
    need(not problem, problem)


_CHECKS: Final[dict[str, Callable[[_Bench], None]]] = {
    "the clock goes forward": _clock,
    "impossible commands are refused with DeviceError": _refusals,
    "stop works at rest, also twice": _stop_at_rest,
    "push, pull and roll by 0 return at once": _nothing,
    "push, pull and roll return when the motion is over": _durations,
    "the watch is called in motion, and only then": _watched,
    "what the watch raises goes on to the caller": _passes,
    "the motion ends when the watch raises": _ends_early,
    "Halted.part says how much was made": _part,
    "stop ends a motion from another thread": _stop_in_motion,
}

_NEEDED: Final = (_clock, _refusals, _durations)
"""If one of these does not hold, the others say nothing, or might move too far."""
