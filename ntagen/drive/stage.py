"""A logged run that is played again: the device of the driver and its journal, both from the log.

The driver runs on a device that does not move and reports the logged measurements; what it records
is compared with the log, record by record. `ntagen.drive.replay` compares whole runs so, and a run
that is resumed gets all that the runs before it knew (`ntagen.drive.past`).

Numbers may differ by one part in a million: mathematical libraries round differently.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable
from typing import Final

from ntagen.drive.device import Counts
from ntagen.drive.records import (
    Answered,
    CutShort,
    Ended,
    Looked,
    Measured,
    Record,
    Stood,
    Transition,
    Truth,
)
from ntagen.drive.states import Event
from ntagen.errors import DeviceError, Halted, LimitError
from ntagen.needle.measurement import Measurement
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Scene, Vector
from ntagen.shapes import vector_of

_RELATIVE: Final = 1e-6
_ABSOLUTE: Final = 1e-6


class Different(Exception):  # noqa: N818  it reports a finding, not an error
    """The driver decided differently; ends the replay."""

    def __init__(self, logged: Record | None, decided: Record | None) -> None:
        super().__init__()
        self.logged = logged
        self.decided = decided


class LogOver(Exception):  # noqa: N818
    """The log ends before the run did; ends the replay."""


class Stage:
    """The device of a replay and its journal; both read the same log.

    Args:
        records: The log. What only a simulation knows is left out.

    Attributes:
        compared: How many decisions were compared.
    """

    def __init__(self, records: Iterable[Record]) -> None:
        self._records = tuple(one for one in records if not isinstance(one, Truth))
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

    def counts(self) -> Counts | None:
        """Where the axes stood at this point; None if the log does not say."""
        logged = self.next_logged
        if not isinstance(logged, Stood):
            return None
        return logged.insert_mm, logged.roll_rad

    def lies(self, depth_mm: float, wound_rad: float) -> None:
        """Does nothing: the device does not move."""

    def measure(self) -> Measurement:
        """The logged measurement at this point."""
        logged = self._expected()
        if not isinstance(logged, Measured | Looked):
            self._repeat_abort(logged)
            raise Different(logged, None)
        return Measurement(
            time_s=logged.time_s,
            position_mm=logged.position_mm,
            force_n=logged.force_n,
            heading=_vector_or_none(logged.heading),
            bevel=_vector_or_none(logged.bevel),
            shape=logged.shape if isinstance(logged, Measured) else (),
        )

    # The operator.

    def listen(self) -> None:
        """Ends the run if the logged run was ended here."""
        self._repeat_failure()

    def answer(self, question: str) -> bool:
        """The answer that was given to a question."""
        logged = self._expected()
        if not isinstance(logged, Answered) or logged.question != question:
            self._repeat_abort(logged)
            raise Different(logged, None)
        return logged.agrees

    # The journal.

    def record(self, record: Record) -> None:
        """Compares a record with the log."""
        logged = self._expected()
        if not isinstance(record, Transition | Ended):
            self._repeat_abort(logged)
        if not _is_same(logged, record):
            raise Different(logged, record)
        self._place += 1
        self.compared += type(record).decided

    def started(self, scene: Scene) -> None:
        """Does nothing: the scene comes from the log itself."""

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Does nothing: the record of the synthesis is compared."""

    def _expected(self) -> Record:
        logged = self.next_logged
        if logged is None:
            raise LogOver
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
