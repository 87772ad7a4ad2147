"""Environments in editors, in the words of the protocol; what is said is in `language`.

While somebody types, mistakes are looked for when the keys rest: see `REST_S` and
`ntagen.editor.checks`.
"""

from __future__ import annotations

import asyncio
from typing import Final

from lsprotocol import types
from pygls.uris import from_fs_path

from ntagen.editor import language
from ntagen.editor.checks import CheckEndedError, Checks
from ntagen.editor.desk import SEVERITIES, Desk, path_of
from ntagen.editor.texts import Text
from ntagen.nsl import Diagnostic, SourceError, format_text

REST_S: Final = 0.15
"""So long no key is pressed before mistakes are looked for."""

_KINDS = {
    "keyword": types.CompletionItemKind.Keyword,
    "setting": types.CompletionItemKind.Property,
    "name": types.CompletionItemKind.Variable,
    "choice": types.CompletionItemKind.EnumMember,
}
_SYMBOLS = {
    "environment": types.SymbolKind.Module,
    "let": types.SymbolKind.Constant,
    "for": types.SymbolKind.Variable,
}


class Environments:
    """Answers about environments, and tells of their mistakes."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._told: dict[str, set[str]] = {}
        self._checks = Checks()
        self._running: dict[str, asyncio.Task[None]] = {}

    def look(self, uri: str, *, is_typed: bool) -> None:
        """Looks for mistakes of a text; what was begun for it before is given up."""
        self._give_up(uri)
        self._running[uri] = asyncio.create_task(self._tell(uri, REST_S if is_typed else 0.0))

    def take_back(self, uri: str) -> None:
        """Takes back the mistakes of a text that was closed."""
        self._give_up(uri)
        for of in self._told.pop(uri, {uri}):
            self._desk.publish(of, [])

    def _give_up(self, uri: str) -> None:
        task = self._running.pop(uri, None)
        if task is not None:
            task.cancel()

    async def _tell(self, uri: str, rest_s: float) -> None:
        """Publishes the mistakes of a text and of the files that it includes."""
        await asyncio.sleep(rest_s)
        version, text = self._desk.version(uri), self._desk.text(uri)
        path = path_of(uri)
        try:
            mistakes = await self._checks.mistakes(text.source, path)
        except CheckEndedError:
            self._desk.say(f"the check of {path} ended without an answer; standard error says why")
            return
        by_uri: dict[str, list[types.Diagnostic]] = {uri: []}
        for one in mistakes:
            of = uri if one.path == path else from_fs_path(one.path) or uri
            by_uri.setdefault(of, []).append(self._shown(text if of == uri else None, one))
        for gone in self._told.get(uri, set()) - set(by_uri):
            by_uri[gone] = []
        self._told[uri] = set(by_uri)
        for of, found in by_uri.items():
            self._desk.publish(of, found, version if of == uri else None)

    def meaning(self, uri: str, place: types.Position) -> tuple[str, types.Range] | None:
        """What the word at a place means, in Markdown, and where it stands."""
        text = self._desk.text(uri)
        found = language.meaning(text.source, text.offset(place))
        return None if found is None else (found[0], text.area(found[1], found[2]))

    def possible(self, uri: str, place: types.Position) -> list[types.CompletionItem]:
        """The words that may be written at a place."""
        text = self._desk.text(uri)
        words = language.possible(text.source, text.offset(place))
        return [
            types.CompletionItem(
                label=word.text,
                kind=_KINDS[word.kind],
                detail=word.detail or None,
                sort_text=f"{number:04d}",
            )
            for number, word in enumerate(words)
        ]

    def formatted(self, uri: str) -> str | None:
        """The text in the standard layout; ``None`` if it has mistakes, which are shown already."""
        try:
            return format_text(self._desk.text(uri).source, path_of(uri))
        except SourceError:
            return None

    def symbols(self, uri: str) -> list[types.DocumentSymbol]:
        """The names of a text."""
        text = self._desk.text(uri)
        found = []
        for one in language.declared(text.source):
            area = text.area(one.start, one.end)
            kind = _SYMBOLS.get(one.kind, types.SymbolKind.Object)
            found.append(types.DocumentSymbol(one.name, kind, area, area, detail=one.kind))
        return found

    def _shown(self, text: Text | None, one: Diagnostic) -> types.Diagnostic:
        line = max(0, one.line - 1)
        start, end = one.column - 1, one.column - 1 + one.length
        if one.line == 0:
            area = types.Range(types.Position(0, 0), types.Position(0, 1))
        elif text is None:
            other = self._desk.text_of(one.source_line)
            area = types.Range(
                types.Position(line, other.place(start).character),
                types.Position(line, other.place(end).character),
            )
        else:
            area = types.Range(text.in_line(line, start), text.in_line(line, end))
        notes = [f"note: {note}" for note in one.notes]
        hints = [f"hint: {one.hint}"] if one.hint else []
        return types.Diagnostic(
            range=area,
            message="\n".join([one.message, *notes, *hints]),
            severity=SEVERITIES[one.severity],
            code=one.code,
            source="ntagen",
        )
