"""What stands beside queries: a way to check each, and its answer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from lsprotocol import types

from ntagen.checker.survey import Asked
from ntagen.editor.desk import Desk
from ntagen.editor.models import Models, file_of
from ntagen.editor.verdicts import Verdict, Verdicts

CHECK: Final = "ntagen.checkQuery"
CANCEL: Final = "ntagen.cancelQuery"
"""The commands; each has the URI of the text, the number of the query, and its formula."""


class Lenses:
    """Answers what stands beside the queries of a text, and checks them."""

    def __init__(self, desk: Desk, models: Models, verdicts: Verdicts) -> None:
        self._desk = desk
        self._models = models
        self._verdicts = verdicts

    async def lenses(self, uri: str) -> list[types.CodeLens]:
        """A lens above each query."""
        found = []
        for number, query, verdict in await self._queries(uri):
            title, command = "check this query", CHECK
            if verdict is not None and verdict.is_running:
                title, command = "checking; stop", CANCEL
            elif verdict is not None:
                title = f"{verdict.words}; check again"
            arguments = [uri, number, query.text]
            area = self._area(uri, query)
            found.append(types.CodeLens(area, types.Command(title, command, arguments=arguments)))
        return found

    async def hints(self, uri: str, within: types.Range) -> list[types.InlayHint]:
        """The verdict behind each query that has one."""
        found = []
        for _, query, verdict in await self._queries(uri):
            end = self._area(uri, query).end
            if verdict is None or verdict.is_running or not within.start <= end <= within.end:
                continue
            hint = types.InlayHint(end, verdict.words, padding_left=True)
            hint.tooltip = verdict.more or None
            found.append(hint)
        return found

    async def check(self, uri: str, number: int, formula: str) -> None:
        """Begins to check a query; one that is not there any more is not checked."""
        current = await self._models.current(uri)
        if current is None or current[0].model is None:
            if current is not None:
                self._desk.say("there is no model beside the queries, so none can be checked")
            return
        pair, looked = current
        queries = looked.survey.queries
        if number < len(queries) and queries[number].text == formula:
            self._verdicts.ask(pair, looked.texts, queries, number)

    def cancel(self, uri: str, number: int) -> None:
        """Stops the check of a query."""
        pair = self._models.pair(uri)
        if pair is not None:
            self._verdicts.cancel(pair, number)

    def outdate(self, uri: str) -> None:
        """Takes back what was said of other texts than those that are there now."""
        pair = self._models.pair(uri)
        if pair is not None and self._verdicts.outdate(pair, self._models.texts(pair)):
            self._desk.refresh()

    async def _queries(self, uri: str) -> Sequence[tuple[int, Asked, Verdict | None]]:
        """The queries of a text by their numbers, and what is known of them."""
        current = await self._models.current(uri)
        if current is None:
            return []
        pair, looked = current
        known = self._verdicts.of(pair, looked.texts)
        return [
            (number, one, known.get(number))
            for number, one in enumerate(looked.survey.queries)
            if one.at is not None and one.at.file == file_of(uri)
        ]

    def _area(self, uri: str, query: Asked) -> types.Range:
        start, end = (query.at.start, query.at.end) if query.at is not None else (0, 0)
        return self._desk.text(uri).area(start, end)
