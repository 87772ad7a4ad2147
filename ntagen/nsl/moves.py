"""How regions move: the values with their places, tables from files, and the motions of these."""

from __future__ import annotations

import io
import math
import os
from collections.abc import Sequence
from itertools import pairwise
from typing import Final

from ntagen import rules
from ntagen.motion import Breath, Gate, Motion
from ntagen.nsl import tree
from ntagen.nsl.diagnostics import Reporter
from ntagen.nsl.draft import Draft, DraftMoves, DraftRegion, Placed, kept
from ntagen.nsl.evaluate import Evaluator, Scope
from ntagen.nsl.quantity import ANGLE, LENGTH, NUMBER, TIME
from ntagen.nsl.source import Span
from ntagen.nsl.vectors import times, unit
from ntagen.scene import Limits, Vector
from ntagen.values import dataclass

COLUMNS: Final = ("time_s", "x_mm", "y_mm", "z_mm")
"""The columns of a file with a motion."""

LONGEST_S: Final = 600.0
"""A period is at most this long."""

MOST_ROWS: Final = 10_000
MOST_BYTES: Final = 1024 * 1024

DEFAULT_PAUSES: Final = 1
_TURN_RAD: Final = 2.0 * math.pi

_Rows = tuple[tuple[float, Vector], ...]


class MovesResolver:
    """Resolves motions of regions, waits and gates.

    Args:
        reporter: Collects the mistakes.
        evaluator: Evaluates expressions.
        folders: Folders below which files may lie.
    """

    def __init__(self, reporter: Reporter, evaluator: Evaluator, folders: Sequence[str]) -> None:
        self._reporter = reporter
        self._evaluator = evaluator
        self._folders = folders

    def moves(self, moves: tree.Moves, name: str, scope: Scope) -> DraftMoves:
        """How a region moves."""
        evaluator = self._evaluator
        period = evaluator.number(moves.period, scope, TIME, f"the period of `{name}`")
        draft = DraftMoves(moves.span, period)
        if moves.path is not None:
            draft.table = self._from_file(moves.path)
            draft.is_table = True
        elif moves.way is None:
            draft.is_table = True
            draft.table = [
                (
                    evaluator.number(time, scope, TIME, f"a time of `{name}`"),
                    evaluator.vector(place, scope, LENGTH, f"a displacement of `{name}`"),
                )
                for place, time in moves.places
            ]
        else:
            way, towards = moves.way
            draft.way = evaluator.number(way, scope, LENGTH, f"the way of `{name}`")
            draft.towards = evaluator.vector(towards, scope, NUMBER, f"the way of `{name}`")
            if moves.phase is not None:
                draft.phase = evaluator.number(moves.phase, scope, ANGLE, f"the phase of `{name}`")
        return draft

    def wait(self, statement: tree.Wait, scope: Scope, draft: Draft) -> None:
        """How the needle may wait."""
        draft.wait = self._evaluator.number(statement.length, scope, TIME, "a wait")
        if statement.at_most is not None:
            role = "the number of waits"
            draft.max_pauses = self._evaluator.whole(statement.at_most, scope, role)

    def gate(self, statement: tree.Gate, scope: Scope, draft: Draft) -> None:
        """When the needle may be pushed."""
        first = self._evaluator.number(statement.first, scope, ANGLE, "a phase")
        draft.gate = (first, self._evaluator.number(statement.last, scope, ANGLE, "a phase"))
        draft.gate_span = statement.span

    def _from_file(self, path: tree.Identifier) -> list[tuple[Placed[float], Placed[Vector]]]:
        """The rows of a file; none after a mistake."""
        span = path.span
        try:
            rows = _read_table(
                os.path.join(os.path.dirname(span.source.path), path.text), self._folders
            )
        except (OSError, ValueError) as error:
            said = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
            self._reporter.report(
                "motion-table-wrong",
                span,
                f"`{path.text}` has no motion: {said}",
                hint=f"its first line is `{','.join(COLUMNS)}`, and the others have these numbers",
            )
            return []
        return [(Placed(time_s, span), Placed(place, span)) for time_s, place in rows]


def _read_table(path: str, folders: Sequence[str]) -> _Rows:
    """The rows of a file.

    Raises:
        OSError: It cannot be read.
        ValueError: It has no such rows, or lies elsewhere.
    """
    real = os.path.realpath(path)
    if not any(os.path.commonpath([real, folder]) == folder for folder in folders):
        raise ValueError("it is not below the folder of the first file")
    if os.path.getsize(real) > MOST_BYTES:
        raise ValueError(f"it has more than {MOST_BYTES // 1024} KiB")
    with open(real, encoding="utf-8-sig", newline="") as file:
        import csv

        lines = list(csv.reader(io.StringIO(file.read())))
    if not lines or tuple(part.strip() for part in lines[0]) != COLUMNS:
        raise ValueError("the names of its columns are others")
    rows: list[tuple[float, Vector]] = []
    for number, line in enumerate(lines[1:], start=2):
        if not line:
            continue
        try:
            time_s, x, y, z = map(float, line)
        except ValueError:
            raise ValueError(f"line {number} is `{','.join(line)[:40]}`") from None
        if not all(map(math.isfinite, (time_s, x, y, z))):
            raise ValueError(f"line {number} has something that is no number")
        if rows and time_s <= rows[-1][0]:
            raise ValueError(f"the time of line {number} is not after that of the line before")
        rows.append((time_s, (x, y, z)))
    if len(rows) > MOST_ROWS:
        raise ValueError(f"it has more than {MOST_ROWS} rows")
    return tuple(rows)


@dataclass
class MotionBuilder:
    """Makes motions of values, and the breath of an environment; reports what breaks a rule."""

    draft: Draft
    reporter: Reporter
    period_s: float | None = None
    period_span: Span | None = None

    def motion(self, draft: DraftRegion) -> Motion | None:
        """The motion of a region; None without one, or after a mistake."""
        moves = draft.moves
        if moves is None or moves.period.value is None:
            return None
        period_s = moves.period.value
        if not 0.0 < period_s <= LONGEST_S:
            self.reporter.report(
                "period-wrong",
                moves.period.span,
                f"the period of `{draft.name}` is {period_s:g} s",
                hint=f"write more than 0 s and at most {LONGEST_S:g} s, for example `every 4 s`",
            )
            return None
        if not self._is_that_of_others(draft.name, period_s, moves.period.span):
            return None
        if moves.is_table:
            rows = self._rows(draft.name, moves, period_s)
            return None if rows is None else Motion(period_s, table=rows)
        return self._sinusoid(draft, moves, period_s)

    def _sinusoid(self, draft: DraftRegion, moves: DraftMoves, period_s: float) -> Motion | None:
        way, towards = moves.way, moves.towards
        phase_rad = 0.0 if moves.phase is None else moves.phase.value
        if way is None or towards is None or phase_rad is None:
            return None
        if way.value is None:
            return None
        what, hint = f"the way of `{draft.name}`", "write for example `along +z`"
        direction = towards.obeying(self.reporter, rules.direction, what, hint)
        if direction is None:
            return None
        return Motion(period_s, times(way.value, unit(direction)), phase_rad % _TURN_RAD)

    def _is_that_of_others(self, name: str, period_s: float, span: Span) -> bool:
        if self.period_s is None or self.period_span is None:
            self.period_s, self.period_span = period_s, span
            return True
        if self.period_s == period_s:
            return True
        self.reporter.report(
            "periods-differ",
            span,
            f"`{name}` moves every {period_s:g} s, and another region every {self.period_s:g} s",
            hint="all regions move with one breath: give them the same period",
            notes=(f"the other period is at {self.period_span.place}",),
        )
        return False

    def _rows(self, name: str, moves: DraftMoves, period_s: float) -> _Rows | None:
        """The rows of a table; None after a mistake."""
        rows: list[tuple[float, Vector]] = []
        for time, place in moves.table:
            if time.value is None or place.value is None:
                return None
            rows.append((time.value, place.value))
        if not rows:
            return None
        wrong = self._wrong_time(moves, period_s)
        if wrong is not None:
            index, said = wrong
            self.reporter.report(
                "motion-times-wrong",
                moves.table[index][0].span,
                f"the time of place {index + 1} of `{name}`, {rows[index][0]:g} s, is {said}",
                hint=f"write increasing times from 0 s to at most the period, {period_s:g} s",
            )
            return None
        (first_s, first), (last_s, last) = rows[0], rows[-1]
        if last_s - first_s >= period_s * (1.0 - 1e-9):
            if math.dist(first, last) > 1e-6:
                self.reporter.report(
                    "motion-times-wrong",
                    moves.table[-1][1].span,
                    f"`{name}` would jump: the place at the end of the period is not the first one",
                    hint="end the table before the period, or with its first place",
                )
                return None
            rows.pop()
        return tuple(rows)

    @staticmethod
    def _wrong_time(moves: DraftMoves, period_s: float) -> tuple[int, str] | None:
        values = [time.value or 0.0 for time, _ in moves.table]
        for index, (before_s, after_s) in enumerate(pairwise(values)):
            if after_s <= before_s:
                return index + 1, f"not after that of the place before, {before_s:g} s"
        if values[0] < 0.0:
            return 0, "negative"
        if values[-1] > period_s * (1.0 + 1e-9):
            return len(values) - 1, f"after the period, {period_s:g} s"
        return None

    def breath(self, limits: Limits) -> Breath | None:
        """The breath of the environment; None if nothing moves, or after a mistake."""
        draft = self.draft
        if self.period_s is None:
            span = draft.gate_span or (draft.wait.span if draft.wait else None)
            if span is not None and not self.reporter.has_errors:
                self.reporter.report(
                    "nothing-moves",
                    span,
                    "no region moves, so there is nothing to wait for",
                    hint="add for example `moves 12 mm along +z every 4 s` to a region",
                )
            return None
        reporter, role = self.reporter, "a wait"
        wait_s = kept(draft.wait, limits.step_s, reporter, rules.positive, role, "wait-wrong")
        pauses = kept(draft.max_pauses, DEFAULT_PAUSES, reporter, rules.pause_count)
        if wait_s is None or pauses is None or not self._has_common_time(wait_s, limits):
            return None
        breath = Breath(self.period_s, wait_s, pauses, self._gate())
        return breath if self._opens(breath, limits) else None

    def _has_common_time(self, wait_s: float, limits: Limits) -> bool:
        """Whether model time can be counted in whole units; if not, reports it."""
        period_s = self.period_s or 0.0
        times_s = (period_s, limits.step_s, wait_s)
        is_fine = all(
            abs(rules.rounded_time(one) - one) <= 1e-9 * one and rules.rounded_time(one) > 0
            for one in times_s
        )
        if is_fine and all(period_s / rules.common_time(*times_s) < 2**23 for _ in times_s):
            return True
        self.reporter.report(
            "wait-wrong",
            self.draft.wait.span if self.draft.wait else self.period_span or self.draft.span,
            f"the period {period_s:g} s, the step {limits.step_s:g} s and the wait {wait_s:g} s "
            "are not whole multiples of 0.1 ms",
            hint="round them",
        )
        return False

    def _gate(self) -> Gate | None:
        gate = self.draft.gate
        if gate is None or gate[0].value is None or gate[1].value is None:
            return None
        return Gate(gate[0].value % _TURN_RAD, gate[1].value)

    def _opens(self, breath: Breath, limits: Limits) -> bool:
        """Whether the gate is open long enough at whatever time a plan begins."""
        if breath.gate is None or breath.gate.width_rad >= _TURN_RAD:
            return True
        open_s = breath.gate.width_rad / _TURN_RAD * breath.period_s
        apart_s = float(rules.common_time(breath.period_s, breath.wait_s))
        if open_s + 1e-9 >= limits.step_s + apart_s:
            return True
        self.reporter.report(
            "gate-never-open",
            self.draft.gate_span or self.draft.span,
            f"the gate is open for {open_s:.3g} s in each period, which is too short: a push takes "
            f"{limits.step_s:g} s, and after waits of {breath.wait_s:g} s it may begin up to "
            f"{apart_s:g} s too late",
            hint="make the gate wider, or the step or the wait shorter",
        )
        return False
