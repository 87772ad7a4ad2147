"""What became of each query of `ntagen check`, and the exit code that follows."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any, Final

from ntagen.cli.models.queries import Asked
from ntagen.cli.signals import LimitReached
from ntagen.errors import InputError, LimitError, ModelError
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.checker import Answer, Expected

NOT_SATISFIED: Final = 1

_SEVERITIES: Final = (
    0,
    NOT_SATISFIED,
    LimitError.exit_code,
    ModelError.exit_code,
    InputError.exit_code,
)
"""Exit codes of single queries; the one that is last in this order decides."""

_CODES: Final = {
    "satisfied": 0,
    "not satisfied": NOT_SATISFIED,
    "maybe": LimitError.exit_code,
    "unknown": LimitError.exit_code,
    "error": ModelError.exit_code,
    "refused": InputError.exit_code,
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a query.

    Attributes:
        query: The query.
        answer: The answer; ``None`` if the query is refused, or a limit came before there was any.
        refusal: Why there is none: the diagnostics, or what the limit has stopped.
        notes: Lines for the user about the answer.
        stop: ``time``, ``memory`` or ``states`` if that limit came before the answer, or before all
            that was asked for beside it: its check, evidence, a list of plans.
        is_compared: Whether the answer is compared with what is expected.
        expected: What is expected; ``None`` if nothing is said about it.
    """

    query: Asked
    answer: Answer | None
    refusal: str = ""
    notes: tuple[str, ...] = ()
    stop: str | None = None
    is_compared: bool = False
    expected: Expected | None = None

    def stopped(self, reached: LimitReached) -> Outcome:
        """The outcome if a limit came before there was an answer that could be shown."""
        return replace(self, answer=None, refusal=f"error: {reached}", notes=(), stop=reached.limit)

    @property
    def shows_runs(self) -> bool:
        """Whether it is a query for random runs themselves."""
        return self.query.form is not None and self.query.form.kind == "simulate"

    @property
    def verdict(self) -> str:
        """The verdict of the answer, ``refused``, or ``unknown`` if a limit came first."""
        if self.answer is not None:
            return self.answer.verdict
        return "refused" if self.stop is None else "unknown"

    @property
    def is_as_expected(self) -> bool | None:
        """Whether the answer is as expected; ``None`` if that is not said or not known."""
        from ntagen.checker import is_as_expected

        if not self.is_compared or self.expected is None:
            return None
        value = None if self.answer is None else self.answer.value
        return is_as_expected(self.expected, self.verdict, value)

    @property
    def code(self) -> int:
        """The exit code that this query alone would give."""
        stopped = LimitError.exit_code if self.stop else 0
        code = max(_CODES[self.verdict], stopped)
        if not self.is_compared:
            return code
        if self.is_as_expected:
            return stopped
        if self.is_as_expected is False and self.verdict not in ("error", "refused"):
            return NOT_SATISFIED
        # Nothing is said about the answer, or there is none.
        return 0 if code == NOT_SATISFIED else code

    @property
    def is_fault(self) -> bool:
        """Whether the run fails because of this query."""
        return self.code != 0


def exit_code(outcomes: Sequence[Outcome]) -> int:
    """The exit code of all queries together."""
    return max((one.code for one in outcomes), key=_SEVERITIES.index, default=0)


def summary(outcomes: Sequence[Outcome]) -> str:
    """All queries on one line, such as ``3 queries: 2 satisfied, 1 refused``."""
    counts = Counter(one.verdict for one in outcomes)
    verdicts = ", ".join(f"{counts[verdict]} {verdict}" for verdict in _CODES if counts[verdict])
    text = f"{len(outcomes)} {'query' if len(outcomes) == 1 else 'queries'}: {verdicts}"
    if not any(one.is_compared for one in outcomes):
        return text
    judged = Counter(one.is_as_expected for one in outcomes if one.expected is not None)
    said = [f"{judged[True]} as expected", f"{judged[False]} not as expected"]
    said += [f"{judged[None]} without an answer"] if judged[None] else []
    silent = sum(one.expected is None for one in outcomes)
    said += [f"{silent} without an expectation"] if silent else []
    return f"{text}; {', '.join(said)}"


def fault_of(outcome: Outcome) -> str:
    """Why the run fails because of a query, on one line: the verdict, and what was expected."""
    answer = outcome.answer
    if answer is None and outcome.stop is not None:
        return outcome.refusal.removeprefix("error: ").partition("\n")[0]
    if answer is None:
        first = next(mistakes_in(outcome.refusal), None)
        return f"refused: {outcome.refusal.partition(chr(10))[0] if first is None else first.text}"
    text: str = answer.verdict
    if answer.verdict == "unknown":
        text = f"stopped by the {answer.limit_text}"
    elif answer.value is not None:
        text += f", value {answer.value}"
    elif outcome.stop:
        text += f", but the {outcome.stop} limit came before all that was asked for"
    if outcome.is_as_expected is False:
        text += f"; expected: {outcome.expected}"
    return text if not answer.message else f"{text}: {answer.message}"


@dataclass(frozen=True, slots=True)
class Mistake:
    """A diagnostic of a model, an environment or a query.

    Attributes:
        path: The file.
        line: The line, from 1.
        column: The character in the line, from 1.
        code: The code that ``ntagen explain`` explains.
        text: What is wrong.
        severity: ``error`` or ``warning``.
        lines: The diagnostic as it is printed.
    """

    path: str
    line: int
    column: int
    code: str
    text: str
    severity: str
    lines: tuple[str, ...] = field(default=())


_MISTAKE: Final = re.compile(
    r"(?P<path>.+?)(?::(?P<line>\d+):(?P<column>\d+))?: "
    r"(?P<severity>error|warning)\[(?P<code>[A-Z]\d+)\]: (?P<text>.*)"
)


def mistakes_in(text: str) -> Iterator[Mistake]:
    """The diagnostics in what the engine or an environment's reader says."""
    found: list[tuple[re.Match[str], list[str]]] = []
    for line in text.splitlines():
        if match := _MISTAKE.fullmatch(line):
            found.append((match, [line]))
        elif found:
            found[-1][1].append(line)
    for match, lines in found:
        parts: dict[str, Any] = match.groupdict()
        parts |= {name: int(match[name] or 0) for name in ("line", "column")}
        yield Mistake(**parts, lines=tuple(lines))
