"""The faults: how each one breaks a run, and what must be noticed.

Each fault strikes once, at a moment that is given; what it breaks stays broken. Some can be noticed
within one motion: then the run must end in a certain state, and the reason must have certain words.
Others show slowly in the measured positions, or not at all: for those the needle must keep out of
all known regions.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from ntagen.drive.states import State
from ntagen.errors import DeviceError, LimitError, ModelError
from ntagen.needle.measurement import Measurement
from ntagen.needle.vectors import add, scale
from ntagen.scene import Vector
from tests.faults.connections import pull_cable
from tests.faults.rig import Reading, Rig

Strike = Callable[[Rig, random.Random], None]


@dataclass(frozen=True)
class Fault:
    """A fault.

    Attributes:
        name: Its name.
        strike: Breaks a run.
        outcome: How the run must end; `None` if the fault may stay unnoticed.
        words: A regular expression that the reason must match; unless it may stay unnoticed.
        raises: What the run raises instead of ending, if the fault is a mistake of the program.
        in_synthesis: Whether it strikes in a synthesis, and not at a moment.
        needs_log: Whether the run must have a log.
        hides_motion: Whether the fault moves the axes or their position itself.
        changes_clock: Whether the clock is wrong after it.
    """

    name: str
    strike: Strike
    outcome: State | None = None
    words: str = ""
    raises: type[BaseException] | None = None
    in_synthesis: bool = False
    needs_log: bool = False
    hides_motion: bool = False
    changes_clock: bool = False


def _controller(act: Callable[[Rig], object]) -> Strike:
    def strike(rig: Rig, _: random.Random) -> None:
        act(rig)

    return strike


def _soft_reset(rig: Rig) -> None:
    """Resets the controller.

    It is no fault if the driver is about to do the same, as it does after a jog was ended.
    """
    rig.is_struck = rig.emulator._machine._state != "Hold"
    rig.emulator.feed(b"\x18")


def _sensor(make: Callable[[Rig, random.Random], Reading]) -> Strike:
    def strike(rig: Rig, draw: random.Random) -> None:
        rig.distort = make(rig, draw)

    return strike


def _raising(error: BaseException) -> Strike:
    def strike(_: Rig, __: random.Random) -> None:
        raise error

    return strike


# The tracker.


def _stale(rig: Rig, _: random.Random) -> Reading:
    def read(_: Measurement) -> Measurement:
        # What `ntagen.tracking.live` does when no sample comes.
        rig.emulator.advance(rig.emulator.now_s + 0.5)
        raise DeviceError("the tracker sent no sample of 'Needle' for 0.5 s")

    return read


def _direction(draw: random.Random) -> Vector:
    z, turn = draw.uniform(-1.0, 1.0), draw.uniform(0.0, 2.0 * math.pi)
    across = math.sqrt(1.0 - z * z)
    return (across * math.cos(turn), across * math.sin(turn), z)


def _jumping(least_mm: float, most_mm: float, *, once: bool) -> Callable[..., Reading]:
    def make(_: Rig, draw: random.Random) -> Reading:
        offset = scale(draw.uniform(least_mm, most_mm), _direction(draw))
        count = 0

        def read(reading: Measurement) -> Measurement:
            nonlocal count
            count += 1
            if once and count > 1:
                return reading
            return replace(reading, position_mm=add(reading.position_mm, offset))

        return read

    return make


def _not_a_number(_: Rig, draw: random.Random) -> Reading:
    wrong = draw.choice([math.nan, math.inf, -math.inf])
    part = draw.choice(["position", "force", "time"])

    def read(reading: Measurement) -> Measurement:
        if part == "force":
            return replace(reading, force_n=wrong)
        if part == "time":
            return replace(reading, time_s=wrong)
        x, _, z = reading.position_mm
        return replace(reading, position_mm=(x, wrong, z))

    return read


def _mirrored(_: Rig, draw: random.Random) -> Reading:
    axis = draw.randrange(3)

    def read(reading: Measurement) -> Measurement:
        position = list(reading.position_mm)
        position[axis] = -position[axis]
        return replace(reading, position_mm=(position[0], position[1], position[2]))

    return read


def _frozen(_: Rig, __: random.Random) -> Reading:
    held: list[Measurement] = []

    def read(reading: Measurement) -> Measurement:
        held.append(reading)
        return replace(held[0], time_s=reading.time_s, force_n=reading.force_n)

    return read


def _late(*, says_so: bool) -> Callable[..., Reading]:
    def make(_: Rig, draw: random.Random) -> Reading:
        delay_s = draw.uniform(0.7, 5.0) if says_so else draw.uniform(0.1, 3.0)
        past: list[Measurement] = []

        def read(reading: Measurement) -> Measurement:
            past.append(reading)
            due_s = reading.time_s - delay_s
            old = next((one for one in reversed(past) if one.time_s <= due_s), past[0])
            return replace(old, time_s=due_s if says_so else reading.time_s)

        return read

    return make


def _force(value_n: Callable[[random.Random], float]) -> Callable[..., Reading]:
    def make(_: Rig, draw: random.Random) -> Reading:
        stuck_n = value_n(draw)
        return lambda reading: replace(reading, force_n=stuck_n)

    return make


# The clock, the operator, the planner.


def _suspend(rig: Rig, draw: random.Random) -> None:
    rig.suspended_s = draw.choice([0.05, 0.3, 1.0, 5.0, 60.0])


def _jump(least_s: float, most_s: float) -> Strike:
    def strike(rig: Rig, draw: random.Random) -> None:
        rig.clock_offset_s += draw.uniform(least_s, most_s)

    return strike


def _late_plan(rig: Rig, draw: random.Random) -> None:
    rig.emulator.advance(rig.emulator.now_s + draw.choice([0.5, 5.0, 30.0, 200.0]))


_OFF = "jumped|where the tracker sees this one|as if the needle bent"
_FAULTED, _LIMIT, _INTERRUPTED = State.FAULTED, State.TIMED_OUT, State.INTERRUPTED

FAULTS: Final = (
    Fault("serial EIO", _controller(lambda r: pull_cable(r.device.port)), _FAULTED, "broken"),
    Fault(
        "silence",
        _controller(lambda r: setattr(r.emulator.faults, "is_silent", True)),
        _FAULTED,
        "no status report|did not answer",
    ),
    Fault(
        "garbage",
        _controller(lambda r: r.emulator.send(b"\xff\xfe\x80\n")),
        _FAULTED,
        "no reply of GRBL",
    ),
    Fault(
        "long garbage",
        _controller(lambda r: r.emulator.send(b"U" * 3000)),
        _FAULTED,
        "no reply of GRBL",
    ),
    Fault(
        "limit switch, ALARM:1",
        _controller(lambda r: r.emulator.raise_alarm(1)),
        _FAULTED,
        "limit switch was hit",
    ),
    Fault("ALARM:3", _controller(lambda r: r.emulator.raise_alarm(3)), _FAULTED, "reset|alarm"),
    Fault("soft reset", _controller(_soft_reset), _FAULTED, "reset|alarm"),
    Fault(
        "power cut",
        _controller(lambda r: r.emulator.power_on()),
        _FAULTED,
        "reset|stands at",
        hides_motion=True,
    ),
    Fault(
        "axes stand still",
        _controller(lambda r: setattr(r.emulator.faults, "pace", 0.0)),
        _FAULTED,
        "stuck|too slow|ended too early",
    ),
    Fault(
        "door",
        _controller(lambda r: r.emulator.feed(b"\x84")),
        _FAULTED,
        "Door|door|did not answer|is stuck",
    ),
    Fault("hold button", _controller(lambda r: r.emulator.feed(b"!"))),
    Fault("slow axes", _controller(lambda r: setattr(r.emulator.faults, "pace", 0.2))),
    Fault("lost steps", _controller(lambda r: r.emulator.faults.lost.update(X=0.1))),
    Fault("insertion jams", _controller(lambda r: r.emulator.faults.lost.update(X=1.0))),
    Fault("roll jams", _controller(lambda r: r.emulator.faults.lost.update(A=1.0))),
    Fault("tracker stale", _sensor(_stale), _FAULTED, "no sample"),
    Fault("tracker jumps far", _sensor(_jumping(25.0, 200.0, once=False)), _FAULTED, "jumped"),
    Fault("tracker jumps far once", _sensor(_jumping(25.0, 200.0, once=True)), _FAULTED, "jumped"),
    Fault("tracker jumps 6 to 20 mm", _sensor(_jumping(6.0, 20.0, once=False)), _FAULTED, _OFF),
    Fault("tracker jumps below 6 mm", _sensor(_jumping(0.0, 6.0, once=False))),
    Fault("tracker jumps once below 6 mm", _sensor(_jumping(0.0, 6.0, once=True))),
    Fault("tracker NaN", _sensor(_not_a_number), _FAULTED, "not a number"),
    Fault("tracker mirrored", _sensor(_mirrored)),
    Fault("tracker frozen", _sensor(_frozen)),
    Fault("tracker late", _sensor(_late(says_so=True)), _FAULTED, "old"),
    Fault("tracker late, unsaid", _sensor(_late(says_so=False))),
    Fault("force stuck at 0", _sensor(_force(lambda _: 0.0))),
    Fault("force at full scale", _sensor(_force(lambda draw: draw.choice([5.0, 50.0])))),
    Fault("synthesis late", _late_plan, in_synthesis=True),
    Fault(
        "engine reaches a limit",
        _raising(LimitError("no answer from the engine: stopped by memory")),
        _LIMIT,
        "stopped by memory",
        in_synthesis=True,
    ),
    Fault(
        "engine finds an error",
        _raising(ModelError("the model of the scene fails: wrapped round")),
        raises=ModelError,
        in_synthesis=True,
    ),
    Fault("engine out of memory", _raising(MemoryError()), raises=MemoryError, in_synthesis=True),
    Fault("engine has a bug", _raising(ValueError("bug")), raises=ValueError, in_synthesis=True),
    Fault("disk full", lambda rig, _: rig.fill_disk(), _FAULTED, "no space left", needs_log=True),
    Fault(
        "SIGINT",
        _controller(lambda r: r.operator.end("interrupted by the operator")),
        _INTERRUPTED,
        "interrupted by the operator",
    ),
    Fault(
        "SIGTERM",
        _controller(lambda r: r.operator.end("ended by the system (SIGTERM)")),
        _INTERRUPTED,
        "SIGTERM",
    ),
    Fault("process suspended", _suspend),
    Fault("clock jumps on", _jump(0.0, 300.0), changes_clock=True),
    Fault("clock jumps back", _jump(-5.0, -0.1), changes_clock=True),
)
"""All of them, in the order of the issue that they come from."""
