"""What a run that goes on knows from the runs before it: their logs are played again.

The driver decides each of them again, up to the place at which it was cut off; so it has the same
channel, readings, regions and line of the force as the driver that was cut off. A log that is
decided otherwise now is of another program: nobody would know what that driver knew.

A record of a motion comes before the motion. So the last motion of a log may have been made, or a
part of it, or nothing: it is left out here, and found by what is measured.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from ntagen.drive.device import (
    Counts,
    Device,
    counts_of,
    lies,
    rest,
    settle,
    spin_on,
)
from ntagen.drive.reading import RunLog
from ntagen.drive.records import (
    Command,
    CutShort,
    Ended,
    Found,
    Journal,
    Record,
    Transition,
    Truth,
)
from ntagen.drive.stage import Different, LogOver, Stage
from ntagen.drive.states import ENDS
from ntagen.errors import Halted, InputError
from ntagen.needle.measurement import Measurement
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Scene

_MOTIONS: Final = frozenset({"push", "pull", "roll"})
_ENDS: Final = frozenset(state.value for state in ENDS)
_SAME_MM: Final = 1e-6


@dataclass(frozen=True, slots=True)
class Leg:
    """A run up to where it was cut off.

    Attributes:
        records: What it decided, without the way in which it ended.
        pending: The motion in which it was cut off; None between two motions.
        ended: How it ended; None if it was cut off.
    """

    records: tuple[Record, ...]
    pending: Command | None
    ended: Ended | None

    @staticmethod
    def of(records: Sequence[Record]) -> Leg:
        """The leg of a log."""
        kept: list[Record] = []
        ended = next((one for one in records if isinstance(one, Ended)), None)
        for record in records:
            if isinstance(record, Truth):
                continue
            if isinstance(record, Ended) or (
                isinstance(record, Transition) and record.following in _ENDS
            ):
                break
            kept.append(record)
        last = kept[-1] if kept else None
        pending = last if isinstance(last, Command) and last.kind in _MOTIONS else None
        return Leg(tuple(kept[:-1] if pending else kept), pending, ended)


_MOST_LEGS: Final = 100
"""A log may be of a run that goes on from so many others, one from the other; ours."""


def legs_of(log: RunLog) -> tuple[Leg, ...]:
    """The runs in a log, the first one from the entry: those before it are in it, too.

    Raises:
        InputError: One of them cannot be read.
    """
    return (*legs_before(log), Leg.of(log.records))


def legs_before(log: RunLog) -> tuple[Leg, ...]:
    """The runs from which the run of a log goes on, the first one from the entry.

    Raises:
        InputError: One of them cannot be read.
    """
    legs: list[Leg] = []
    while (earlier := log.earlier) is not None:
        legs.insert(0, Leg.of(earlier.records))
        if len(legs) > _MOST_LEGS:
            raise InputError(f"{log.path}: more than {_MOST_LEGS} runs go on from each other")
        log = earlier
    return tuple(legs)


def depth_mm(legs: Sequence[Leg]) -> float:
    """How deep the needle is at the end of some runs, by their commands and what was found."""
    depth_mm = pushed_mm = 0.0
    for record in (one for leg in legs for one in leg.records):
        match record:
            case Command(kind="push"):
                depth_mm, pushed_mm = depth_mm + record.value, record.value
            case CutShort():
                depth_mm += record.made_mm - pushed_mm
            case Command(kind="pull"):
                depth_mm = max(0.0, depth_mm - record.value)
            case Found():
                depth_mm = record.depth_mm
    return depth_mm


class Resumable(Protocol):
    """A driver that can be brought to where one was that was cut off."""

    def run(self) -> Ended:
        """Drives from the entry."""

    def resume(self) -> Ended:
        """Goes on in the tissue."""

    def was_cut(self, pending: Command | None) -> None:
        """Notes that a run was cut off."""


class Relay:
    """The device of a run, its journal and its operator: those of logs first, then the real ones.

    Args:
        device: The device.
        journal: The journal.
        listen: Raises `KeyboardInterrupt` if somebody wants the run to end.
        agree: As in `Controller`.
        ask: As in `Controller`.
        shadow: A simulated needle that makes all motions of the logs once more, and is the device
            then; without one, the device does nothing meanwhile.
    """

    def __init__(
        self,
        device: Device,
        journal: Journal,
        listen: Callable[[], None] = lambda: None,
        agree: Callable[[str], None] = lambda _: None,
        ask: Callable[[str], bool] = lambda _: False,
        *,
        shadow: bool = False,
    ) -> None:
        self._device, self._journal = device, journal
        self._listen, self._agree, self._ask = listen, agree, ask
        self._has_shadow = shadow
        self._stage: Stage | None = None

    def play(self, leg: Leg) -> Stage:
        """Is the device and the journal of a log from now on."""
        self._stage = Stage(leg.records)
        return self._stage

    def end_leg(self, leg: Leg) -> None:
        """The log is over; a simulated needle ends the motion in which it was cut off."""
        self._stage = None
        pending = leg.pending
        if not self._has_shadow or pending is None:
            return
        if pending.kind == "push":
            self.spin(pending.value, pending.spin)
        else:
            {"pull": self.pull, "roll": self.roll}[pending.kind](pending.value)

    # The device.

    def now_s(self) -> float:
        """The time on the clock of the log, or of the device."""
        return self._device.now_s() if self._stage is None else self._stage.now_s()

    def push(self, length_mm: float) -> None:
        """See `Actuator.push`."""
        self.spin(length_mm, 0.0)

    def spin(self, length_mm: float, fraction: float) -> None:
        """See `Spinning.spin`; without a spin, it is a push."""
        made_mm, halted = length_mm, None
        if self._stage is not None:
            try:
                self._stage.push(length_mm)
            except Halted as error:
                made_mm, halted = error.part * length_mm, error
        if self._moves and fraction:
            spin_on(self._device, made_mm, fraction)
        elif self._moves:
            self._device.push(made_mm)
        if halted is not None:
            raise halted

    def settle(self) -> None:
        """See `Spinning.settle`."""
        if self._moves:
            settle(self._device)

    def roll(self, angle_rad: float) -> None:
        """See `Actuator.roll`."""
        if self._moves:
            self._device.roll(angle_rad)

    def pull(self, length_mm: float) -> None:
        """See `Actuator.pull`."""
        if self._moves:
            self._device.pull(length_mm)

    def wait(self, seconds: float) -> None:
        """See `rest`."""
        if self._moves:
            rest(self._device, seconds)

    def stop(self) -> None:
        """See `Actuator.stop`."""
        if self._moves:
            self._device.stop()

    def counts(self) -> Counts | None:
        """See `counts_of`."""
        return counts_of(self._device) if self._stage is None else self._stage.counts()

    def lies(self, depth_mm: float, wound_rad: float) -> None:
        """See `Compensating.lies`."""
        if self._moves:
            lies(self._device, depth_mm, wound_rad)

    def measure(self) -> Measurement:
        """See `Sensor.measure`."""
        if self._stage is None:
            return self._device.measure()
        logged = self._stage.measure()
        if self._has_shadow:
            self._require_same(self._device.measure(), logged)
        return logged

    @property
    def _moves(self) -> bool:
        """Whether motions are made."""
        return self._stage is None or self._has_shadow

    def _require_same(self, found: Measurement, logged: Measurement) -> None:
        """Refuses a log that is not of this simulated needle.

        Raises:
            InputError: It is of another one.
        """
        pairs = zip(found.position_mm, logged.position_mm, strict=True)
        if max(abs(a - b) for a, b in pairs) > _SAME_MM:
            raise InputError(
                "the simulated needle cannot be brought back to where the log left it: it is "
                "measured elsewhere now\n"
                "hint: was the log written by another version of ntagen, or on another machine? A "
                "needle in a lab (`ntagen device simulate`) keeps its place while the driver is "
                "ended"
            )

    # The operator.

    def listen(self) -> None:
        """Listens to the operator of this run."""
        if self._stage is None:
            self._listen()

    def agree(self, text: str) -> None:
        """What was agreed to in a log needs no question."""
        if self._stage is None:
            self._agree(text)

    def ask(self, question: str) -> bool:
        """Asks the operator, or the log."""
        return self._ask(question) if self._stage is None else self._stage.answer(question)

    # The journal.

    def record(self, record: Record) -> None:
        """Records it, or compares it with the log."""
        (self._stage or self._journal).record(record)

    def started(self, scene: Scene) -> None:
        """Passes the scene on."""
        (self._stage or self._journal).started(scene)

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Passes the synthesis on."""
        (self._stage or self._journal).synthesised(number, synthesis)


def bring_back(driver: Resumable, relay: Relay, legs: Sequence[Leg]) -> int:
    """Brings a driver to where the one was that was cut off; returns how much was compared.

    Args:
        driver: The driver, whose device and journal is the relay.
        relay: The relay.
        legs: The runs before, the first one from the entry.

    Raises:
        Different: It decides otherwise now.
        InputError: A simulated needle is elsewhere.
    """
    compared = 0
    for number, leg in enumerate(legs):
        stage = relay.play(leg)
        try:
            driver.resume() if number else driver.run()
        except LogOver:
            if stage.next_logged is not None:
                raise AssertionError("a log was left before its end") from None
        else:
            raise Different(None, None)
        relay.end_leg(leg)
        driver.was_cut(leg.pending)
        compared += stage.compared
    return compared


def go_on(driver: Resumable, relay: Relay, legs: Sequence[Leg]) -> Ended:
    """Drives from where the last of some runs was cut off; without any, from the entry.

    Raises:
        InputError: The driver decides otherwise than the log says; nothing was moved.
    """
    if not legs:
        return driver.run()
    try:
        bring_back(driver, relay, legs)
    except Different as found:
        raise InputError(
            "the runs before are decided otherwise now, so nobody knows what their driver knew; "
            "nothing was moved\n"
            f"logged: {found.logged}\nnow: {found.decided}\n"
            "hint: resume with the version of ntagen that wrote the log (`ntagen replay` says more "
            "about it), or pull the needle back by hand"
        ) from None
    return driver.resume()
