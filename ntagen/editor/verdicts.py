"""Answers of queries, for the places where they stand.

Each is asked by `ntagen check` in a process of its own, with limits of time and memory. Invariants:
an answer is kept as long as its texts are the same; a check of other texts is stopped.
"""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from ntagen import checker
from ntagen.checker.survey import Asked, Texts
from ntagen.editor.pairs import Pair
from ntagen.serve.jobs import Job
from ntagen.serve.processes import Limits
from ntagen.values import dataclass

_LOOK_S: Final = 0.05
"""So often it is looked whether a check has ended."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """What is known of a query.

    Attributes:
        is_running: Whether its check goes on.
        words: The verdict and its value, in a few words.
        more: What else is to be said, such as why there is no verdict.
        is_expected: Whether it is what the file expects; ``None`` if that says nothing.
    """

    is_running: bool
    words: str = ""
    more: str = ""
    is_expected: bool | None = None


class _Asking:
    """The answers to queries of the same texts, by the number of the query."""

    def __init__(self, texts: Texts) -> None:
        self.texts = texts
        self.verdicts: dict[int, Verdict] = {}
        self.tasks: dict[int, asyncio.Task[None]] = {}


class Verdicts:
    """The answers of the pairs that are open."""

    def __init__(self, limits: Limits, tell: Callable[[], None]) -> None:
        """Begins with none.

        Args:
            limits: What one check may take.
            tell: Called whenever there is another answer.
        """
        self._limits = limits
        self._tell = tell
        self._by_pair: dict[Pair, _Asking] = {}
        self._slots = asyncio.Semaphore(limits.jobs)

    def of(self, pair: Pair, texts: Texts) -> Mapping[int, Verdict]:
        """What is known of the queries of texts, by their numbers."""
        asking = self._by_pair.get(pair)
        return asking.verdicts if asking is not None and asking.texts == texts else {}

    def outdate(self, pair: Pair, texts: Texts) -> bool:
        """Forgets what was said of other texts; whether there was anything."""
        asking = self._by_pair.get(pair)
        if asking is None or asking.texts == texts:
            return False
        self.forget(pair)
        return True

    def ask(self, pair: Pair, texts: Texts, queries: Sequence[Asked], number: int) -> None:
        """Begins to check a query of texts."""
        self.outdate(pair, texts)
        asking = self._by_pair.setdefault(pair, _Asking(texts))
        if number in asking.tasks and not asking.tasks[number].done():
            return
        asking.verdicts[number] = Verdict(is_running=True)
        asking.tasks[number] = asyncio.create_task(self._check(asking, queries, number))
        self._tell()

    def cancel(self, pair: Pair, number: int) -> None:
        """Stops a check."""
        asking = self._by_pair.get(pair)
        if asking is not None and number in asking.tasks:
            asking.tasks[number].cancel()

    def forget(self, pair: Pair) -> None:
        """Forgets all answers about a pair, and stops its checks."""
        asking = self._by_pair.pop(pair, None)
        if asking is not None:
            for task in asking.tasks.values():
                task.cancel()

    async def _check(self, asking: _Asking, queries: Sequence[Asked], number: int) -> None:
        try:
            async with self._slots:
                report = await self._report(asking.texts, needed(queries, number))
            asking.verdicts[number] = _told(report, queries[number])
        except asyncio.CancelledError:
            asking.verdicts.pop(number, None)
            raise
        finally:
            self._tell()

    async def _report(self, texts: Texts, asked: Sequence[str]) -> dict[str, Any]:
        """What a process says about queries."""
        with tempfile.TemporaryDirectory(prefix="ntagen-lsp-") as name:
            folder = Path(name)
            path = _path_of(texts, folder)
            arguments = ["check", str(path), "--json", *(f"--query={one}" for one in asked)]
            limits = self._limits
            arguments += [f"--timeout={limits.timeout_s}s", f"--memory={limits.memory_bytes}B"]
            job = Job(arguments, folder, limits)
            try:
                while job.is_running:
                    await asyncio.sleep(_LOOK_S)
            finally:
                job.cancel()
            return job.report()


def needed(queries: Sequence[Asked], number: int) -> list[str]:
    """A query, behind those that define the strategies which it uses."""
    asked = [queries[number].text]
    form = checker.form_of(asked[0])
    wanted = {form.uses} if form is not None else set()
    for one in reversed(queries[:number]):
        form = checker.form_of(one.text)
        if form is not None and form.defines is not None and form.defines in wanted:
            wanted.discard(form.defines)
            wanted.add(form.uses)
            asked.append(one.text)
    return asked[::-1]


def _path_of(texts: Texts, folder: Path) -> Path:
    """The file of a model; a copy if the file is not as the text is."""
    path = Path(texts.path)
    data = texts.model.encode("utf-8", "replace")
    try:
        if path.read_bytes() == data:
            return path.absolute()
    except OSError:
        pass
    copy = folder / path.name
    copy.write_bytes(data)
    return copy


def _told(report: Mapping[str, Any], query: Asked) -> Verdict:
    """What the report of a check says about its last query."""
    answers = report.get("answers") or [{}]
    answer = answers[-1]
    verdict = answer.get("verdict")
    message = answer.get("message") or report.get("message") or ""
    if verdict is None:
        return Verdict(False, "no answer", message)
    value = answer.get("value")
    words = str(verdict)
    if verdict == "unknown" and answer.get("stop"):
        words = f"unknown: the limit of {answer['stop']} was reached"
    if isinstance(value, int | float | str):
        words = f"{words}, {value}"
    asked = checker.queries.Query(query.text, query.comment, query.expect)
    expected = checker.expected_of(asked)
    is_expected = None
    if expected is not None:
        is_expected = checker.is_as_expected(expected, verdict, value)
        words += "" if is_expected else f" (expected: {expected})"
    return Verdict(False, words, message, is_expected)
