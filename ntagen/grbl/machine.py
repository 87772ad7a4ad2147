"""What an emulated controller does with its lines and real-time bytes: states and motions.

The states and their changes are those of GRBL 1.1 (its files ``protocol.c`` and ``system.c``), with
the differences of grblHAL that the `Dialect` names.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final, Protocol

from ntagen.grbl.dialects import Dialect
from ntagen.grbl.gcode import Block, GcodeError, Modal, read, read_jog
from ntagen.grbl.memory import Memory
from ntagen.grbl.names import CRITICAL_ALARMS
from ntagen.grbl.planner import Planner
from ntagen.grbl.reports import Snapshot, StatusWriter, modal_report, offsets_report

_UNLOCK: Final = "[MSG:'$H'|'$X' to unlock]"
_LATER: Final = -1
"""A line whose answer comes when the motion is over."""


class Wire(Protocol):
    """What connects the machine to the world."""

    @property
    def now_s(self) -> float:
        """The time."""

    @property
    def bytes_free(self) -> int:
        """How much it can receive."""

    def say(self, text: str) -> None:
        """Sends a line."""

    def after(self, seconds: float, action: Callable[[], None]) -> None:
        """Does something later."""

    def forget(self, deaf_s: float | None = None) -> None:
        """Forgets what was received; with a time also what is planned, and receives nothing."""


class Machine:
    """The states of a controller.

    Args:
        dialect: The firmware.
        memory: Its stored settings.
        wire: Its connection.
    """

    def __init__(self, dialect: Dialect, memory: Memory, wire: Wire) -> None:
        self.pins = ""
        self.planner = Planner((0.0,) * len(dialect.axes), dialect.lead_s)
        self.dwell_end_s = -math.inf
        self._dialect = dialect
        self._memory = memory
        self._wire = wire
        self._program = [0.0] * len(dialect.axes)
        self._modal = Modal()
        self._state, self._sub = "Idle", 0
        self._needs_reset = False
        self._cancels_jog = self._opens_door = False
        self._line_waits = self._hangs = False
        self._then: Callable[[], None] | None = None
        self._alarm_when_still = 0
        self._latch = 0
        self._status = StatusWriter(dialect)

    def power_on(self) -> None:
        """Starts at position 0, as after a power cut."""
        self.planner.move_to((0.0,) * len(self._dialect.axes))
        self._status = StatusWriter(self._dialect)
        self._state = "Alarm" if self._memory.number(22) else "Idle"
        self._restart(0.0)
        if self._memory.is_blank:
            self._wire.say("error:7")
            self._memory.is_blank = False

    def raise_alarm(self, code: int) -> None:
        """Stops at once and locks itself."""
        self.planner.move_to(self.planner.position)
        self._state, self._then, self._alarm_when_still = "Alarm", None, 0
        self._cancels_jog = self._opens_door = self._line_waits = False
        self._needs_reset = code in CRITICAL_ALARMS
        self._wire.forget()
        self._wire.say(f"ALARM:{code}")
        if self._needs_reset:
            self._wire.say("[MSG:Reset to continue]")

    # The state.

    def is_busy(self) -> bool:
        """Whether lines are not read now."""
        return (
            self._state in ("Hold", "Door", "Home", "Sleep")
            or self._needs_reset
            or self._hangs
            or self._line_waits
            or self.dwell_end_s > self._wire.now_s
            or self.planner.block_count >= self._dialect.planner_blocks
        )

    def arrive(self) -> None:
        """The axes stand: what comes now depends on why they moved."""
        if self._state in ("Hold", "Door") and self._sub != 0:
            self._sub = 0
            if self._state == "Door":
                self._status.accessories_changed()
        if self._cancels_jog:
            self._cancels_jog = False
            self._settle()
            if self._opens_door:
                self._opens_door, self._state, self._sub = False, "Door", 0
                self._status.accessories_changed()
        if self._alarm_when_still:
            self.raise_alarm(self._alarm_when_still)
        elif self._then is not None and not self.planner.block_count:
            then, self._then = self._then, None
            then()
        elif self._state in ("Run", "Jog") and not self._hangs:
            self._state = "Idle"
        if self._line_waits and self._state == "Idle" and self.dwell_end_s <= self._wire.now_s:
            self._line_waits = False
            self._wire.say("ok")

    def _settle(self) -> None:
        """Forgets all motion; the program goes on from where the axes stand."""
        self.planner.move_to(self._memory.rounded(self.planner.position))
        self._program = list(self.planner.position)

    def hold(self) -> None:
        """`!`: slows down and holds; a jog is ended by GRBL, and goes on with grblHAL."""
        if self._state == "Jog":
            if not self._dialect.is_hal:
                self.cancel_jog()
        elif self._state in ("Idle", "Run"):
            self._state, self._sub = "Hold", 1 if self.planner.is_moving else 0
            self.planner.hold()

    def cancel_jog(self) -> None:
        """0x85: ends a jog; does nothing to other motions."""
        if self._state == "Jog" and not self._hangs:
            self._cancels_jog = True
            self.planner.hold()

    def open_door(self) -> None:
        """0x84, or the pin of the safety door: slows down and waits.

        A jog is ended by GRBL, which says that it jogs until the axes stand. grblHAL stands still
        in a jog, says that it jogs, and heeds only `~` and a reset.
        """
        if self._state in ("Alarm", "Check", "Sleep", "Home"):
            return
        self._wire.say("[MSG:Check Door]")
        if self._state == "Jog":
            if self._dialect.is_hal:
                self._hangs = True
            else:
                self._cancels_jog = self._opens_door = True
            self.planner.hold()
            return
        self._state, self._sub = "Door", 2 if self.planner.is_moving else 0
        if self._sub == 0:
            self._status.accessories_changed()
        self.planner.hold()

    @property
    def _is_ajar(self) -> bool:
        return "D" in self.pins

    def resume(self) -> None:
        """`~`: goes on after a hold, once the axes stand and the door is closed."""
        if self._state == "Door" and self._is_ajar:
            return
        is_held = self._state in ("Hold", "Door") and self._sub == 0
        if not is_held and not self._hangs:
            return
        self._hangs = False
        if self._dialect.is_hal and self._state == "Hold":
            self._wire.say("[MSG:]")
        self.planner.resume()
        self._state = "Run" if self.planner.is_moving else "Idle"

    def reset(self) -> None:
        """0x18: a reset in motion loses the position, so it is an alarm."""
        was_moving = self.planner.is_moving or self._hangs
        self._settle()
        self._needs_reset = False
        if was_moving:
            self._state = "Alarm"
            self._wire.say("ALARM:3")
            self._restart(self._dialect.alarm_s)
        else:
            locked = self._state in ("Alarm", "Sleep")
            self._state = "Alarm" if locked else "Idle"
            self._restart(self._dialect.reset_s)

    def _restart(self, seconds: float) -> None:
        """Forgets all but settings, position and alarm, and says the banner after some time."""
        self._wire.forget(deaf_s=seconds)
        self._modal, self._latch, self._then, self._alarm_when_still = Modal(), 0, None, 0
        self._line_waits = self._cancels_jog = self._opens_door = False
        self._needs_reset = self._hangs = False
        self.dwell_end_s = -math.inf
        self._program = list(self.planner.position)
        self._status.reset()
        self._wire.after(seconds, self._greet)

    def _greet(self) -> None:
        self._wire.say("")
        self._wire.say(self._dialect.banner)
        if self._state == "Alarm":
            self._wire.say(_UNLOCK)

    def report(self) -> None:
        """`?`: says a status report; GRBL says none after an alarm that only a reset ends."""
        if self._needs_reset and not self._dialect.is_hal:
            return
        moves = self.planner.is_moving
        self._wire.say(
            self._status.write(
                Snapshot(
                    state=self._state,
                    sub=self._shown_sub(),
                    position=self._memory.rounded(self.planner.position),
                    speed_per_min=60.0 * self.planner.speed() if moves else 0.0,
                    blocks_free=self._dialect.planner_blocks - self.planner.block_count,
                    bytes_free=self._wire.bytes_free,
                    pins=self.pins,
                    mask=int(self._memory.number(10)),
                )
            )
        )

    def _shown_sub(self) -> int | None:
        """The number after the state: of a door, 1 says that the axes stand and it is open."""
        if self._state == "Door" and self._sub == 0:
            return int(self._is_ajar)
        return self._sub if self._state in ("Hold", "Door") else None

    # Lines.

    def answer(self, line: str | None) -> None:
        """Executes a line and says how that went; `None` is a line that was too long."""
        is_command = line is not None and line.startswith("$")
        if line == "":
            code = self._latch = 0
        elif self._latch and not is_command:
            code = self._latch
        else:
            code = 11 if line is None else self._execute(line)
            if self._dialect.latches:
                self._latch = max(0, code)
        if code == 0:
            self._wire.say("ok")
        elif code > 0:
            self._wire.say(f"error:{code}")

    def _execute(self, line: str) -> int:
        """Executes a line; the number of its error, 0 for none."""
        if line.startswith("$"):
            return self._command(line.upper().replace(" ", ""))
        if self._state in ("Alarm", "Jog"):
            return 9
        try:
            block = read(line, self._modal, self._dialect.axes)
        except GcodeError as error:
            return error.code
        target = self._target(block)
        self._modal = block.modal
        if self._state == "Check":
            return 0
        return self._run(block, target)

    def _target(self, block: Block) -> list[float]:
        """Where a motion ends."""
        return [
            p
            if axis not in block.axes
            else block.axes[axis] + (p if block.modal.distance == "G91" else 0.0)
            for axis, p in zip(self._dialect.axes, self._program, strict=True)
        ]

    def _run(self, block: Block, target: list[float]) -> int:
        if block.motion is not None:
            if self._is_beyond(target):
                self._stop_at_soft_limit()
                return _LATER
            is_rapid = block.motion == "G0"
            self._start("Run", target, math.inf if is_rapid else block.modal.feed / 60.0)
        if block.dwell_s is not None:
            self._then = self._dwell(block.dwell_s)
        if block.waits:
            self._line_waits = True
            if not self.planner.is_moving:
                self.arrive()
            return _LATER
        return 0

    def _dwell(self, seconds: float) -> Callable[[], None]:
        def wait() -> None:
            self.dwell_end_s = self._wire.now_s + seconds
            self._state = "Idle"

        return wait

    def _start(self, state: str, target: list[float], speed: float) -> None:
        self._program = target
        self.planner.add(self._memory.rounded(tuple(target)), speed, self._memory.limits())
        if self.planner.is_moving:
            self._state = state

    def _is_beyond(self, target: list[float]) -> bool:
        """Whether soft limits forbid a target: machine space is negative, as in GRBL."""
        if not self._memory.number(20):
            return False
        travels = self._memory.travel()
        return any(not -way <= p <= 0.0 for p, way in zip(target, travels, strict=True))

    def _stop_at_soft_limit(self) -> None:
        if not self.planner.is_moving:
            self.raise_alarm(2)
            return
        self._state, self._sub = "Hold", 1
        self.planner.hold()
        self._alarm_when_still = 2

    def _command(self, line: str) -> int:
        """Executes a ``$`` command."""
        if line.startswith("$J="):
            return self._jog(line[3:])
        number, is_setting, value = line[1:].partition("=")
        if is_setting and number.isdigit():
            if self._state not in ("Idle", "Alarm"):
                return 8
            return self._memory.store(int(number), value)
        commands: dict[str, Callable[[], int]] = {
            "$": lambda: self._tell(["[HLP:$$ $# $G $I $N $x=val $J=line $SLP $C $X $H ~ ! ? ^x]"]),
            "$$": lambda: self._tell_at_rest(self._memory.lines()),
            "$#": lambda: self._tell_at_rest(offsets_report(self._dialect)),
            "$I": lambda: self._tell_at_rest(list(self._dialect.build)),
            "$N": lambda: self._tell_at_rest(["$N0=", "$N1="]),
            "$G": lambda: self._tell([modal_report(self._dialect, self._modal)]),
            "$X": self._unlock,
            "$H": self._home,
            "$C": self._toggle_check,
            "$SLP": self._sleep,
        }
        return commands[line]() if line in commands else 3

    def _tell(self, lines: list[str]) -> int:
        for line in lines:
            self._wire.say(line)
        return 0

    def _tell_at_rest(self, lines: list[str]) -> int:
        return self._tell(lines) if self._state in ("Idle", "Alarm", "Check") else 8

    def _jog(self, text: str) -> int:
        if self._state not in ("Idle", "Jog"):
            return 8
        try:
            block = read_jog(text, self._modal, self._dialect.axes)
        except GcodeError as error:
            return error.code
        target = self._target(block)
        if self._is_beyond(target):
            return 15
        self._start("Jog", target, block.modal.feed / 60.0)
        return 0

    def _unlock(self) -> int:
        if self._state == "Alarm":
            self._wire.say("[MSG:Caution: Unlocked]")
            self._state = "Idle"
        return 0

    def _home(self) -> int:
        """Moves all axes to 0, where the switches are, and back by the pull-off."""
        if not self._memory.number(22):
            return 5
        if self._state not in ("Idle", "Alarm"):
            return 8
        self._state = "Home"
        limits = self._memory.limits()
        away = self._memory.rounded((-self._memory.number(27),) * len(self._dialect.axes))
        seek = self._memory.number(25) / 60.0
        self.planner.add((0.0,) * len(self._dialect.axes), seek, limits)
        self.planner.add(away, self._memory.number(24) / 60.0, limits)
        self._then = self._homed
        if not self.planner.is_moving:
            self.arrive()
        return _LATER

    def _homed(self) -> None:
        self._state = "Idle"
        self._settle()
        self._wire.say("ok")

    def _toggle_check(self) -> int:
        if self._state == "Check":
            self._wire.say("[MSG:Disabled]")
            self._state = "Idle"
            self._wire.after(0.0, lambda: self._restart(self._dialect.reset_s))
            return 0
        if self._state != "Idle":
            return 8
        self._state = "Check"
        self._wire.say("[MSG:Enabled]")
        return 0

    def _sleep(self) -> int:
        if not self._dialect.sleeps:
            return 3
        if self._state not in ("Idle", "Alarm"):
            return 8
        self._wire.say("ok")
        self._wire.say("[MSG:Sleeping]")
        self._state = "Sleep"
        return _LATER
