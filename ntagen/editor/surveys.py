"""The surveys of the models that are open, each of its newest text.

Invariants: a survey belongs to the texts that it was made of; the same texts are looked at once;
texts that have changed are not looked at any longer.
"""

from __future__ import annotations

import asyncio
import contextlib
from typing import Final

from ntagen.checker.names import Names
from ntagen.checker.survey import Survey, Texts, read_survey
from ntagen.editor.checks import CheckEndedError, Checks
from ntagen.editor.pairs import Pair
from ntagen.values import dataclass

_PATIENCE_S: Final = 0.5
"""So long a model is still looked at when its text has changed already."""

_LATEST_S: Final = 1.0
"""So long a request waits for the survey of the newest text before an older one must do."""


class OutdatedError(Exception):
    """The texts have changed while they were looked at."""


@dataclass(frozen=True, slots=True)
class Looked:
    """What is known of some texts.

    Attributes:
        texts: The texts.
        survey: The survey of them.
        names: The names in it by their places.
    """

    texts: Texts
    survey: Survey
    names: Names

    def offset(self, file: int, text: str, offset: int) -> int:
        """The place in these texts of a character of a newer one, behind what both begin with."""
        own = self.texts.of(file)
        if own == text:
            return offset
        same = _same(own, text)
        if offset <= same:
            return offset
        return max(same, len(own) - (len(text) - offset))


class Surveys:
    """Surveys by pairs of files."""

    def __init__(self, allow_external: tuple[str, ...] = ()) -> None:
        self._allow_external = allow_external
        self._checks = Checks(_PATIENCE_S)
        self._done: dict[Pair, Looked] = {}
        self._named: dict[Pair, Looked] = {}
        self._running: dict[Pair, tuple[Texts, asyncio.Task[Looked]]] = {}

    async def of(self, pair: Pair, texts: Texts) -> Looked:
        """The survey of texts.

        Raises:
            CheckEndedError: The process that looks at them ended.
            OutdatedError: The pair has other texts meanwhile.
        """
        done = self._done.get(pair)
        if done is not None and done.texts == texts:
            return done
        running = self._running.get(pair)
        if running is None or running[0] != texts or running[1].done():
            self._give_up(pair)
            running = (texts, asyncio.create_task(self._look(pair, texts)))
            self._running[pair] = running
        task = running[1]
        try:
            # Who gives up waiting does not stop those that wait as well.
            return await asyncio.shield(task)
        except asyncio.CancelledError:
            if task.cancelled():
                raise OutdatedError from None
            raise

    async def latest(self, pair: Pair, texts: Texts) -> Looked | None:
        """The names of texts; those of older ones if they have none or that takes long.

        A model in XML has no names while it is not well-formed.
        """
        with contextlib.suppress(TimeoutError, CheckEndedError, OutdatedError):
            await asyncio.wait_for(self.of(pair, texts), _LATEST_S)
        return self._named.get(pair)

    async def of_other(self, texts: Texts) -> Survey:
        """The survey of texts that are not open.

        Raises:
            CheckEndedError: The process that looks at them ended.
        """
        return read_survey(await self._checks.survey(texts, self._allow_external), texts)

    def forget(self, pair: Pair) -> None:
        """Forgets a pair that was closed."""
        self._give_up(pair)
        self._done.pop(pair, None)
        self._named.pop(pair, None)

    async def _look(self, pair: Pair, texts: Texts) -> Looked:
        survey = await self.of_other(texts)
        looked = Looked(texts, survey, Names(survey))
        self._done[pair] = looked
        if looked.names.has_own:
            self._named[pair] = looked
        return looked

    def _give_up(self, pair: Pair) -> None:
        running = self._running.pop(pair, None)
        if running is not None:
            running[1].cancel()


def _same(first: str, second: str) -> int:
    """How many characters two texts begin with that are the same."""
    low, high = 0, min(len(first), len(second))
    while low < high:
        middle = (low + high + 1) // 2
        if first[:middle] == second[:middle]:
            low = middle
        else:
            high = middle - 1
    return low
