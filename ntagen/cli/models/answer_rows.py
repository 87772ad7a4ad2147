"""The answers of `ntagen check` for people: a row for each query, and a last line for all."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ntagen.cli.loading import pointer_to_page
from ntagen.cli.models.outcomes import Outcome, summary
from ntagen.cli.terminal import Styled, echo, echo_message

if TYPE_CHECKING:
    from ntagen.checker import Answer, Distribution, Estimate, Model

_MARK: Final = {
    "satisfied": ("yes", "green"),
    "not satisfied": ("no", "red"),
    "maybe": ("maybe", "yellow"),
    "unknown": ("stopped", "yellow"),
    "error": ("error", "red"),
    "refused": ("refused", "red"),
}

REMARKS_SHOWN: Final = 4
"""So many lines of a query's comment are shown."""


class Format:
    """How answers are printed; this one prints nothing.

    Args:
        path: The model.
        trace_is_written: Whether traces are written anyway.
    """

    def __init__(self, path: Path, *, trace_is_written: bool) -> None:
        self.path = str(path)
        self.trace_is_written = trace_is_written

    def loaded(self, model: Model) -> None:
        """The model is accepted."""

    def refused(self, rejection: str) -> None:
        """The model, or the list of queries, is rejected; it is printed as any other error, too."""

    def one(self, outcome: Outcome) -> None:
        """A query is answered or refused."""

    def end(self, outcomes: Sequence[Outcome]) -> None:
        """All queries are answered."""


class Human(Format):
    """Prints each answer as soon as it is there."""

    def loaded(self, model: Model) -> None:
        """Prints which model is asked."""
        echo(f"{self.path}: loaded in {1000 * model.load_seconds:.1f} ms")

    def one(self, outcome: Outcome) -> None:
        """Prints the row of a query."""
        if outcome.answer is None:
            echo_message(outcome.refusal)
        mark, colour = _MARK[outcome.verdict]
        query = outcome.query
        label = f"{query.name}: {query.text}" if query.name else query.text
        parts: list[str | Styled] = ["  ", Styled(f"{mark:<8}", fg=colour, bold=True), label]
        if outcome.is_as_expected is not None:
            is_right = outcome.is_as_expected
            said = "as expected" if is_right else f"not as expected: {outcome.expected}"
            parts += ["  ", Styled(f"({said})", fg="green" if is_right else "red")]
        echo(*parts)
        lines = [*query.remark[:REMARKS_SHOWN]]
        if outcome.answer is not None:
            if outcome.shows_runs:
                lines += _shown_runs(outcome.answer)
            lines += self._facts(outcome.answer, shows_runs=outcome.shows_runs)
        for line in [*lines, *outcome.notes]:
            echo(f"          {line}")

    def end(self, outcomes: Sequence[Outcome]) -> None:
        """Prints all queries on one line, and once how to learn more about a mistake."""
        if len(outcomes) > 1:
            echo(summary(outcomes))
        refusals = "\n".join(one.refusal for one in outcomes if one.answer is None)
        if pointer := pointer_to_page(refusals):
            echo(pointer, err=True)

    def _facts(self, answer: Answer, *, shows_runs: bool) -> list[str]:
        if answer.estimate is not None and not answer.estimate.is_computed:
            return _estimated(answer, answer.estimate)
        if shows_runs:
            return _made(answer)
        explored = "1 state" if answer.explored == 1 else f"{answer.explored} states"
        facts = [f"{explored} explored", f"{answer.stored} stored"]
        facts.append(f"{1000 * answer.seconds:.1f} ms")
        facts.append(f"{answer.peak_bytes / 2**20:.1f} MiB")
        if answer.stop:
            facts.insert(0, f"stopped by the {answer.limit_text}")
        lines = [f"value: {json.dumps(answer.value)}"] if answer.value is not None else []
        if answer.estimate is not None:
            lines = [f"value: {_ends(answer.estimate)}"]
        lines.append(", ".join(facts))
        lines += [answer.message] if answer.message else []
        if answer.wrapped is not None and answer.verdict != "error":
            where = f"first at {answer.wrapped}"
            lines.append(f"a result does not fit into 32 bits and wraps round, {where}")
        return lines if self.trace_is_written else [*lines, *_way_to_failure(answer)]


_USUAL_METHODS: Final = ("Clopper-Pearson", "Student (asymptotic)")
"""Methods of intervals that need no line of their own."""


def _estimated(answer: Answer, estimate: Estimate) -> list[str]:
    """What random runs say: the estimate with its interval, and what it took."""
    lines = [f"value: {_interval(estimate)}"]
    if estimate.method not in _USUAL_METHODS:
        lines.append(f"interval: {estimate.method}")
    runs = _runs(estimate)
    if estimate.compared is not None:
        lines.append(f"compared with: {_interval(estimate.compared)}")
        runs += f", and {_runs(estimate.compared)}"
    stopped = [f"stopped by the {answer.limit_text}"] if answer.stop else []
    lines.append(", ".join([*stopped, runs, f"{1000 * answer.seconds:.1f} ms"]))
    if (optimised := answer.optimised) is not None:
        lines.append(_learned(answer, optimised.leaves))
    values = answer.distribution
    if values is not None and (shown := _distribution_line(values)) is not None:
        lines.append(shown)
    return [*lines, answer.message] if answer.message else lines


def _learned(answer: Answer, leaves: int) -> str:
    """What a learned strategy sees, and how large it is."""
    from ntagen.checker import LearnedStrategy

    count = "1 leaf" if leaves == 1 else f"{leaves:,} leaves"
    if not isinstance(strategy := answer.strategy, LearnedStrategy):
        return f"strategy: {count}"
    discrete, continuous = (", ".join(one) for one in (strategy.discrete, strategy.continuous))
    return f"strategy: {count}; it sees {{{discrete}}} -> {{{continuous}}}"


def _made(answer: Answer) -> list[str]:
    """How many runs `simulate` has made, and what it took."""
    count = len(answer.trajectories)
    facts = [f"stopped by the {answer.limit_text}"] if answer.stop else []
    facts += [f"{count:,} run" + ("s" if count != 1 else ""), f"{1000 * answer.seconds:.1f} ms"]
    return [", ".join(facts), *([answer.message] if answer.message else [])]


_HEIGHTS: Final = "▁▂▃▄▅▆▇█"
_MOST_BARS: Final = 30


def _distribution_line(found: Distribution) -> str | None:
    """When runs reach what is asked, or what they are worth; ``None`` if none of them has a value.

    For example ``reached at 1.83 to 9.97, mean 6.41 ▁▁▂▃▅▆█▇▆▅▃``.
    """
    if found.min is None or found.max is None or found.mean is None:
        return None
    if found.of == "value":
        said = "values"
    else:
        verb = "broken" if found.broken else "reached"
        said = f"{verb} after" if found.of == "moves" else f"{verb} at"
        said += f" {found.label.removeprefix('value of the clock ')} =" * (found.of == "clock")
    unit = " moves" if found.of == "moves" else ""
    if found.min == found.max:
        return f"{said} {found.min:.6g}{unit} in {found.count:,} of {found.runs:,} runs"
    line = f"{said} {found.min:.6g} to {found.max:.6g}{unit}, mean {found.mean:.6g}"
    shown = bars(found.to_json()["histogram"]["counts"])
    return f"{line}  {shown}" if _is_printable(shown) else line


def bars(counts: list[int]) -> str:
    """Counts as bars of different heights; many neighbours become one bar."""
    together = -(-len(counts) // _MOST_BARS)
    sums = [sum(counts[i : i + together]) for i in range(0, len(counts), together)]
    # The last bar may stand for fewer buckets than the others.
    sums[-1] = sums[-1] * together // (len(counts) - (len(sums) - 1) * together)
    most = max(sums)
    heights = [-(-one * len(_HEIGHTS) // most) for one in sums]
    return "".join(_HEIGHTS[one - 1] if one else " " for one in heights).rstrip()


def _is_printable(text: str) -> bool:
    """Whether standard output has these characters."""
    try:
        text.encode(sys.stdout.encoding or "ascii")
    except (LookupError, UnicodeEncodeError):
        return False
    return True


def _ends(estimate: Estimate) -> str:
    between = f"in [{_number(estimate.lower)}, {_number(estimate.upper)}]"
    return f"{_number(estimate.value)}, {between}"


def _interval(estimate: Estimate) -> str:
    return f"{_ends(estimate)} at {100 * estimate.confidence:g} % confidence"


def _runs(estimate: Estimate) -> str:
    runs = f"{estimate.runs:,} run" + ("s" if estimate.runs != 1 else "")
    if estimate.satisfied_runs is None:
        return runs
    return f"{estimate.satisfied_runs:,} of {runs} satisfied"


RUNS_SHOWN: Final = 3
"""So many runs of ``simulate`` are shown; ``--json`` has all."""


def _shown_runs(answer: Answer) -> list[str]:
    """The first runs of ``simulate``: between which values each expression was, and its last."""
    lines = []
    runs = answer.trajectories
    for trajectory in runs[:RUNS_SHOWN]:
        for text, points in trajectory.points.items():
            values = [value for _, value in points]
            least, greatest, last = (_number(one) for one in (min(values), max(values), values[-1]))
            between = f"{text} from {least} to {greatest}, at the end {last}"
            lines.append(f"run {trajectory.run}: {between}")
    if len(runs) > RUNS_SHOWN:
        lines.append(f"and {len(runs) - RUNS_SHOWN:,} runs more: --json has all points")
    return lines


def _number(value: float | None) -> str:
    return "?" if value is None else f"{value:.6g}"


MOVES_SHOWN: Final = 12
"""The last transitions before a run-time error that are shown; ``--trace`` shows all."""


def _way_to_failure(answer: Answer) -> list[str]:
    """The trace to a run-time error in short: transitions, and the state in which it happens."""
    text = answer.trace_json() if answer.verdict == "error" else None
    trace = json.loads(text) if text is not None else {}
    if not trace.get("states"):
        return []
    moves, last = trace["transitions"], trace["states"][-1]
    steps = "step" if len(moves) == 1 else "steps"
    lines = [f"the way there, {len(moves)} {steps} (--trace - shows all steps):"]
    if len(moves) > MOVES_SHOWN:
        lines.append(f"  … {len(moves) - MOVES_SHOWN} before")
    first = max(0, len(moves) - MOVES_SHOWN)
    lines += [f"  {first + 1 + i:>3}. {_move(move)}" for i, move in enumerate(moves[first:])]
    places = [f"{process}.{location}" for process, location in last["locations"].items()]
    values = [f"{name}={value}" for name, value in last["variables"].items()]
    lines.append("in the state")
    lines.append("  " + " ".join([*places, *values, *last["zone"]]))
    if "failing" in trace:
        lines += ["in the step", f"  {_move(trace['failing'])}"]
    return lines


def _move(edges: Sequence[dict[str, Any]]) -> str:
    """A transition on one line: the edges that are taken together."""
    return "  |  ".join(_edge(edge) for edge in edges)


def _edge(edge: dict[str, Any]) -> str:
    select = [f"{name}={value}" for name, value in edge["select"].items()]
    labels = "; ".join(
        label for label in (", ".join(select), edge["guard"], edge["sync"], edge["update"]) if label
    )
    arrow = f"{edge['process']}.{edge['source']} -> {edge['target']}"
    return f"{arrow}  {{ {labels} }}" if labels else arrow
