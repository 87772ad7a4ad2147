"""Repeats the decisions of a logged run.

The driver runs once more, on a device that does not move and reports the logged measurements. All
its decisions (each state, command, prediction, estimate, synthesis and learned region) are compared
with the log, record by record. The driver depends only on measurements, scene, settings and engine,
so the decisions must be the same. If they differ, the program, its engine or the log has changed.

Numbers may differ by one part in a million: mathematical libraries round differently.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from ntagen.drive.controller import Controller
from ntagen.drive.reading import RunLog
from ntagen.drive.records import CutShort, Ended, Measured, Record, Transition, Truth
from ntagen.drive.states import Event
from ntagen.errors import DeviceError, Halted, LimitError
from ntagen.needle.measurement import Measurement
from ntagen.plan.synthesise import Synthesis, Synthesiser
from ntagen.scene import Scene, Vector
from ntagen.shapes import vector_of

_RELATIVE: Final = 1e-6
_ABSOLUTE: Final = 1e-6


@dataclass(frozen=True, slots=True)
class Comparison:
    """The result of a replay.

    Attributes:
        compared: The number of decisions that were compared.
        logged: The first logged record that was decided differently; None if all are the same.
        decided: The decision instead; None if there was none.
        complete: Whether the run was compared to its end; a log that is cut off is not.
    """

    compared: int
    logged: Record | None
    decided: Record | None
    complete: bool

    @property
    def is_same(self) -> bool:
        """Whether all decisions were the same."""
        return self.logged is None and self.decided is None


class _Different(Exception):  # noqa: N818  it reports a finding, not an error
    """The driver decided differently; ends the replay."""

    def __init__(self, logged: Record | None, decided: Record | None) -> None:
        super().__init__()
        self.logged = logged
        self.decided = decided


class _LogOver(Exception):  # noqa: N818
    """The log ends before the run did; ends the replay."""


def replay(log: RunLog, synthesise: Synthesiser) -> Comparison:
    """Runs the decisions of a log again and compares them.

    Args:
        log: The log.
        synthesise: Finds plans, with the settings of the log.

    Raises:
        InputError: The log has no scene or no settings.
        LimitError: The engine reached a limit that it did not reach in the run.
    """
    stage = _Stage(record for record in log.records if not isinstance(record, Truth))
    controller = Controller(
        log.scene,
        stage,
        synthesise,
        log.settings,
        stage,
        stage.listen,
        agree=lambda _: stage.listen(),
        course=log.course,
        policy=log.policy,
    )
    try:
        controller.run()
    except _LogOver:
        return Comparison(stage.compared, None, None, complete=False)
    except _Different as found:
        return Comparison(stage.compared, found.logged, found.decided, complete=False)
    left = stage.next_logged
    return Comparison(stage.compared, left, None, complete=left is None)


class _Stage:
    """The device of a replay and its journal; both read the same log."""

    def __init__(self, records: Iterable[Record]) -> None:
        self._records = tuple(records)
        self._place = 0
        self.compared = 0

    @property
    def next_logged(self) -> Record | None:
        """The next record in the log."""
        return self._records[self._place] if self._place < len(self._records) else None

    # The device.

    def now_s(self) -> float:
        """The time of the next record."""
        following = self.next_logged or (self._records[-1] if self._records else None)
        return following.time_s if following else 0.0

    def push(self, length_mm: float) -> None:
        """Repeats how the push ended; the command was compared as a record."""
        self._repeat_failure()
        logged = self.next_logged
        if isinstance(logged, CutShort):
            halted = Halted(logged.reason)
            halted.part = min(1.0, logged.made_mm / length_mm)
            raise halted

    def spin(self, length_mm: float, fraction: float) -> None:
        """Repeats how the push ended; the spin was compared as a part of the record."""
        self.push(length_mm)

    def settle(self) -> None:
        """Does nothing: the device does not move."""
        self._repeat_failure()

    def roll(self, angle_rad: float) -> None:
        """Does nothing: the device does not move."""
        self._repeat_failure()

    def pull(self, length_mm: float) -> None:
        """Does nothing: the device does not move."""
        self._repeat_failure()

    def wait(self, seconds: float) -> None:
        """Does nothing: the time is that of the log."""
        self._repeat_failure()

    def stop(self) -> None:
        """Does nothing: the device does not move."""

    def measure(self) -> Measurement:
        """The logged measurement at this point."""
        logged = self._expected()
        if not isinstance(logged, Measured):
            self._repeat_abort(logged)
            raise _Different(logged, None)
        return Measurement(
            time_s=logged.time_s,
            position_mm=logged.position_mm,
            force_n=logged.force_n,
            heading=_vector_or_none(logged.heading),
            bevel=_vector_or_none(logged.bevel),
            shape=logged.shape,
        )

    # The operator.

    def listen(self) -> None:
        """Ends the run if the logged run was ended here."""
        self._repeat_failure()

    # The journal.

    def record(self, record: Record) -> None:
        """Compares a record with the log."""
        logged = self._expected()
        if not isinstance(record, Transition | Ended):
            self._repeat_abort(logged)
        if not _is_same(logged, record):
            raise _Different(logged, record)
        self._place += 1
        self.compared += type(record).decided

    def started(self, scene: Scene) -> None:
        """Does nothing: the scene comes from the log itself."""

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Does nothing: the record of the synthesis is compared."""

    def _expected(self) -> Record:
        logged = self.next_logged
        if logged is None:
            raise _LogOver
        return logged

    def _repeat_failure(self) -> None:
        """Raises the same fault as the logged motion, if it had one."""
        if self.next_logged is not None:
            self._repeat_abort(self.next_logged)

    def _repeat_abort(self, logged: Record) -> None:
        """Raises what came from outside in the logged run: a fault, or the operator's end."""
        if not isinstance(logged, Transition):
            return
        ended = self._records[-1]
        reason = ended.reason if isinstance(ended, Ended) else ""
        if logged.event == Event.INTERRUPT.value:
            raise KeyboardInterrupt(reason)
        if logged.event == Event.TIMED_OUT.value:
            raise LimitError(reason)
        if logged.event == Event.FAULT.value:
            raise DeviceError(reason)


def _is_same(logged: Record, decided: Record) -> bool:
    if type(logged) is not type(decided):
        return False
    if not type(logged).decided:
        return True
    return all(
        _is_close(getattr(logged, field.name), getattr(decided, field.name))
        for field in dataclasses.fields(logged)
    )


def _is_close(one: object, other: object) -> bool:
    if isinstance(one, float) and isinstance(other, float | int):
        return math.isclose(one, other, rel_tol=_RELATIVE, abs_tol=_ABSOLUTE)
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(_is_close, one, other))
    return one == other


def _vector_or_none(values: tuple[float, ...]) -> Vector | None:
    if not values:
        return None
    return vector_of(values)
