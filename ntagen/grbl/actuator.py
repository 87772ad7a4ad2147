"""A needle that a GRBL controller moves: one small motion at a time, watched until it is over.

Each motion is a jog, which the controller forgets when it is stopped. While it runs, its status is
asked for and compared with what was commanded: the direction, the way, the time, and that no other
axis moves. In a screw motion the needle is inserted and turned at once. What steppers lose on the
way no controller knows: that shows in the measured position.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from ntagen.errors import DeviceError, Halted
from ntagen.grbl.axes import Axes, Motor, motors
from ntagen.grbl.identity import Identity, identify, position_of, require_ready
from ntagen.grbl.link import Link, RefusedError, Watch
from ntagen.grbl.port import Port
from ntagen.grbl.protocol import HOLD, JOG_CANCEL, RESET, Activity, Status
from ntagen.units import deg_from_rad, rad_from_deg

POLL_S: Final = 0.1
"""How often the status is asked for in motion: GRBL recommends 5 to 10 times a second."""

STOP_BYTES: Final = HOLD + JOG_CANCEL

_SOONEST_POLL_S: Final = 0.02
_BEGIN_S: Final = 0.3
"""A motion that has not begun after this time does not begin."""

_STALL_S: Final = 0.5
"""An axis that moves and has the same position after this time is stuck."""

_LATE_RATIO: Final = 1.25
_LATE_S: Final = 0.5
"""A motion that takes longer than this ratio of its time and these seconds is too slow."""

_STOP_S: Final = 3.0
"""A machine that has not come to rest after this time does not stop."""

_UNKNOWN_COMMAND: Final = 3


class StoppedError(DeviceError):
    """A motion was stopped from outside before it was over."""


@dataclass(frozen=True, slots=True)
class _Way:
    """How far an axis goes in the needle's direction, how fast, and the longest piece of it."""

    motor: Motor
    length: float
    speed: float
    longest: float


@dataclass(frozen=True, slots=True)
class _Goal:
    """A motion.

    Attributes:
        motors: The axes that move, at once; the first one is looked at.
        at_speed_s: How long it takes at full speed.
        start: The positions of all axes at its start.
        end: The positions at its end.
    """

    motors: tuple[Motor, ...]
    at_speed_s: float
    start: tuple[float, ...]
    end: tuple[float, ...]

    @property
    def motor(self) -> Motor:
        return self.motors[0]

    def way_of(self, motor: Motor) -> float:
        return self.end[motor.index] - self.start[motor.index]

    @property
    def way(self) -> float:
        return self.way_of(self.motor)

    @property
    def seconds(self) -> float:
        """How long it takes, with ramps."""
        ways = [(motor, self.way_of(motor)) for motor in self.motors]
        return max(motor.seconds(way, abs(way) / self.at_speed_s) for motor, way in ways if way)

    @property
    def words(self) -> str:
        """The axes and the speed along their common way, whose units are mm and degrees."""
        axes = " ".join(f"{one.axis.letter}{self.way_of(one):.4f}" for one in self.motors)
        speed = math.hypot(*map(self.way_of, self.motors)) / self.at_speed_s
        return f"{axes} F{speed * 60.0:.3f}"


class GrblActuator:
    """Moves a needle by a GRBL controller; a `ntagen.drive.device.Actuator`.

    Args:
        port: The wire to the controller. `close` gives it back.
        axes: Which axis does what.
        watch: Is called every few milliseconds while the needle moves. What it raises ends the
            motion: the needle is stopped first, then the error goes on to the caller. A `Halted`
            gets the part of the motion that was made.

    Raises:
        DeviceError: The controller does not answer as a GRBL that is ready to move.
    """

    def __init__(self, port: Port, axes: Axes, watch: Watch = lambda: None) -> None:
        self.watch = watch
        self._link = Link(port)
        self._axes = axes
        self.identity: Identity = identify(self._link)
        self._insert, self._roll = motors(self._link, self.identity, axes)
        # Where the axes must stand: rounded steps must not add up over many motions.
        self._expected = position_of(self.identity.status)
        self._stops = 0
        self._jogs = True

    def now_s(self) -> float:
        """The time on the port's clock, in seconds."""
        return self._link.now_s()

    @property
    def ramp_mm_per_s2(self) -> float:
        """The acceleration with which a push is stopped."""
        return self._insert.acceleration

    @property
    def position(self) -> tuple[float, ...]:
        """Where the axes stand by the controller's count, in mm and degrees."""
        return self._expected

    def counts(self) -> tuple[float, float]:
        """Where the axes stand by the controller's count, in the needle's directions: mm, rad."""
        insert, roll = self._insert, self._roll
        insert_mm = insert.axis.sign * self._expected[insert.index]
        return insert_mm, rad_from_deg(roll.axis.sign * self._expected[roll.index])

    def push(self, length_mm: float) -> None:
        """Inserts the needle by a length.

        Raises:
            DeviceError: The motion is impossible, was stopped, or failed.
            Halted: Who watched it ended it early.
        """
        self._require(length_mm >= 0.0, "push", length_mm)
        self._move(_Way(self._insert, length_mm, self._axes.push_mm_per_s, self._axes.max_mm))

    def pull(self, length_mm: float) -> None:
        """Pulls the needle back by a length.

        Raises:
            DeviceError: The motion is impossible, was stopped, or failed.
        """
        self._require(length_mm >= 0.0, "pull", length_mm)
        self._move(_Way(self._insert, -length_mm, self._axes.pull_mm_per_s, self._axes.max_mm))

    def roll(self, angle_rad: float) -> None:
        """Turns the shaft, right-handed about the heading.

        Raises:
            DeviceError: The motion is impossible, was stopped, or failed.
        """
        self._require(True, "roll", angle_rad)
        self._move(self._turn(angle_rad))

    def screw(self, length_mm: float, angle_rad: float) -> None:
        """Inserts the needle and turns it at once, as fast as the slower of both axes.

        Raises:
            DeviceError: The motion is impossible, was stopped, or failed.
            Halted: Who watched it ended it early; its part is that of the angle.
        """
        self._require(length_mm >= 0.0, "screw", length_mm)
        self._require(True, "screw", angle_rad)
        axes = self._axes
        insertion = _Way(self._insert, length_mm, axes.push_mm_per_s, axes.max_mm)
        self._move(self._turn(angle_rad), insertion)

    def _turn(self, angle_rad: float) -> _Way:
        angle_deg = deg_from_rad(angle_rad)
        return _Way(self._roll, angle_deg, self._axes.roll_deg_per_s, self._axes.max_deg)

    def stop(self) -> None:
        """Stops the needle where it is, and waits until it stands.

        The bytes that stop it are written at once, from any thread, whatever else goes on. A motion
        that another thread waits for ends there with `StoppedError`.

        Raises:
            DeviceError: The machine does not say that it stands. It was reset then, if possible.
        """
        self._stops += 1
        self._link.realtime(STOP_BYTES)
        if not self._link.turn.acquire(timeout=_STOP_S):
            raise self._not_standing("another thread does not let go of the controller")
        try:
            self._confirm()
        finally:
            self._link.turn.release()

    def close(self) -> None:
        """Gives the port back. A motion that runs is not stopped by this."""
        self._link.close()

    # Stopping.

    def _confirm(self) -> None:
        """Waits until two reports say that the axes stand at one place."""
        end_s = self.now_s() + _STOP_S
        last: tuple[float, ...] | None = None
        state = "not known"
        while self.now_s() < end_s:
            try:
                status = self._look()
            except DeviceError as error:
                raise self._not_standing(str(error)) from None
            if status.stands and position_of(status) == last:
                self._rest(status)
                return
            last, state = position_of(status) if status.stands else None, str(status)
        raise self._not_standing(f"its state is {state}")

    def _look(self) -> Status:
        """A status report, also after a failure.

        A limit switch has stopped the motors of GRBL 1.1, which is silent then until it is reset.
        It stays locked.
        """
        try:
            status = self._link.look()
        except DeviceError:
            if not self._link.awaits_reset:
                raise
            self._link.realtime(RESET)
            status = self._link.look()
        self._link.pause(_SOONEST_POLL_S)
        return status

    def _rest(self, status: Status) -> None:
        """Notes where the machine stands, and lets it forget what it has not done.

        Without that, a press on its resume button would move the needle on. A reset of a machine
        that stands keeps its position.
        """
        self._expected = position_of(status)
        if status.activity is Activity.ALARM and self._link.failure is None:
            self._link.fail(f"{self._link.name}: the controller is locked by an alarm")
        if status.activity in (Activity.HOLD, Activity.DOOR):
            if self._link.failure is None:
                self._link.reset()
            else:
                self._link.realtime(RESET)

    def _not_standing(self, reason: str) -> DeviceError:
        """The last resort: a reset stops the steppers at once, and may lose their position."""
        try:
            self._link.realtime(RESET)
        except DeviceError as error:
            reason = str(error)
        return self._link.fail(
            f"{self._link.name}: the controller does not confirm that the needle stands: {reason}\n"
            "hint: stop it by its hardware switch"
        )

    # Moving.

    def _require(self, possible: bool, command: str, value: float) -> None:
        if not possible or not math.isfinite(value):
            raise DeviceError(f"the device refuses to {command} by {value}")

    def _move(self, *ways: _Way) -> None:
        """Moves axes at once, in pieces of which none is longer than the longest one."""
        stops = self._stops
        count = max(1, *(math.ceil(abs(way.length) / way.longest - 1e-9) for way in ways))
        first = ways[0].motor
        way = first.axis.sign * ways[0].length
        with self._link.turn:
            start = self._expected[first.index]
            try:
                for _ in range(count):
                    self._piece(ways, count, stops)
            except Halted as halted:
                made = (self._expected[first.index] - start) / way
                halted.part = max(0.0, min(1.0, made))
                raise

    def _piece(self, ways: Sequence[_Way], count: int, stops: int) -> None:
        def watch() -> None:
            if self._stops != stops:
                raise StoppedError(f"{self._link.name}: the motion was stopped")
            self.watch()

        goal = self._plan(ways, count, watch)
        if abs(goal.way) < goal.motor.tolerance / 2.0:
            return
        try:
            self._begin(goal, watch)
            self._follow(goal, watch)
        except StoppedError:
            # Who stopped it waits until it stands.
            raise
        except BaseException as error:
            self._stop_for(error)
            raise

    def _status(self, watch: Watch) -> Status:
        """A status report that is not yet about a stop by another thread.

        The stop is counted before its bytes are written, so a hold that it causes is never taken
        for a fault.
        """
        status = self._link.status(watch)
        watch()
        return status

    def _plan(self, ways: Sequence[_Way], count: int, watch: Watch) -> _Goal:
        """One of several equal pieces of a motion, from where the axes were left.

        Raises:
            DeviceError: They do not stand there, or the end is outside of the limits.
        """
        self._link.require_whole()
        start = position_of(require_ready(self._link, self._status(watch)))
        for m in (self._insert, self._roll):
            if abs(start[m.index] - self._expected[m.index]) > m.tolerance:
                raise self._link.fail(
                    f"{self._link.name}: the axis {m.axis.letter} stands at {start[m.index]:.3f} "
                    f"{m.unit}, but was left at {self._expected[m.index]:.3f}\n"
                    "hint: something else has moved it; measure where the needle is"
                )
        end = list(self._expected)
        for way in ways:
            motor = way.motor
            end[motor.index] += motor.axis.sign * way.length / count
            if not motor.axis.low <= end[motor.index] <= motor.axis.high:
                raise DeviceError(
                    f"{self._link.name}: {end[motor.index]:.3f} {motor.unit} is outside of the "
                    f"travel of the axis {motor.axis.letter}, {motor.axis.low:g} to "
                    f"{motor.axis.high:g}"
                )
        at_speed_s = max(abs(way.length) / count / way.speed for way in ways)
        return _Goal(tuple(way.motor for way in ways), at_speed_s, start, tuple(end))

    def _begin(self, goal: _Goal, watch: Watch) -> None:
        """Sends the motion, once."""
        word = goal.words
        if self._jogs:
            try:
                watch()
                self._link.command(f"$J=G91 G21 {word}", watch=watch)
                return
            except RefusedError as error:
                if error.code != _UNKNOWN_COMMAND:
                    raise
                self._jogs = False
        watch()
        self._link.command(f"G91 G21 G1 {word}", watch=watch)

    def _follow(self, goal: _Goal, watch: Watch) -> None:
        """Watches a motion until the axis stands at its end.

        A report is at least as new as the question for it. How late it is read says nothing about
        the axis: a computer may be busy in between.
        """
        began_s = changed_s = self.now_s()
        seconds = goal.seconds
        latest_s = began_s + _LATE_RATIO * seconds + _LATE_S
        last = goal.start[goal.motor.index]
        while True:
            asked_s = self.now_s()
            status = self._status(watch)
            now_s, here = self.now_s(), position_of(status)[goal.motor.index]
            self._require_on_way(goal, status)
            if here != last:
                last, changed_s = here, now_s
            if status.activity is Activity.IDLE:
                if all(
                    abs(position_of(status)[one.index] - goal.end[one.index]) <= one.tolerance
                    for one in goal.motors
                ):
                    self._expected = goal.end
                    return
                if here != goal.start[goal.motor.index] or asked_s > began_s + _BEGIN_S:
                    raise self._wrong(goal, status, "ended too early")
            elif asked_s > changed_s + _STALL_S:
                raise self._wrong(goal, status, "is stuck")
            elif asked_s > latest_s:
                raise self._wrong(goal, status, "is too slow")
            left_s = began_s + seconds - now_s
            self._link.pause(max(_SOONEST_POLL_S, min(POLL_S, left_s)), watch)

    def _require_on_way(self, goal: _Goal, status: Status) -> None:
        """Compares a report with the motion.

        Raises:
            DeviceError: Another axis moves, the direction is wrong, or the end was passed.
        """
        if status.activity not in (Activity.IDLE, Activity.RUN, Activity.JOG):
            raise self._wrong(goal, status, "was interrupted")
        position = position_of(status)
        for other in (self._insert, self._roll):
            if other in goal.motors:
                continue
            if abs(position[other.index] - goal.end[other.index]) > other.tolerance:
                raise self._wrong(goal, status, f"also moves the axis {other.axis.letter}")
        for one in goal.motors:
            way, done = goal.way_of(one), position[one.index] - goal.start[one.index]
            along = math.copysign(done, done * way) if done else 0.0
            if along < -one.tolerance:
                raise self._wrong(goal, status, "goes into the wrong direction")
            if along > abs(way) + one.tolerance:
                raise self._wrong(goal, status, "went too far")

    def _wrong(self, goal: _Goal, status: Status, what: str) -> DeviceError:
        """The error about a motion; nothing is moved after it."""
        m = goal.motor
        here = position_of(status)[m.index]
        return self._link.fail(
            f"{self._link.name}: the motion of the axis {m.axis.letter} from "
            f"{goal.start[m.index]:.3f} to {goal.end[m.index]:.3f} {m.unit} {what}: it is at "
            f"{here:.3f} {m.unit}, state {status}\n"
            "hint: check motor, driver, limit switches and load; measure where the needle is"
        )

    def _stop_for(self, error: BaseException) -> None:
        """Stops the needle because of an error, which goes on to the caller."""
        try:
            self.stop()
        except DeviceError as failure:
            if isinstance(error, DeviceError):
                raise DeviceError(f"{error}\n{failure}") from None
            raise
