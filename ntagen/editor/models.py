"""Models and their queries in editors, in the words of the protocol.

Invariants: mistakes are published for both files of a pair, and those of texts that have changed
since are not. Mistakes are looked for at once: that takes less time than a rest would.
"""

from __future__ import annotations

import asyncio
from typing import Final

from lsprotocol import types

from ntagen.checker.survey import MODEL, QUERIES, Mistake, Place, Symbol, SymbolKind, Texts
from ntagen.editor.checks import CheckEndedError
from ntagen.editor.completing import Language, Possible, part_of_xml, possible
from ntagen.editor.desk import SEVERITIES, Desk, path_of
from ntagen.editor.pairs import MODELS, Pair, kind_of, pair_of, says_it_is_a_model
from ntagen.editor.renaming import Renaming, RenamingError, renamed, renaming_at
from ntagen.editor.surveys import Looked, OutdatedError, Surveys
from ntagen.xta import format_model

_KINDS: Final[dict[str, types.CompletionItemKind]] = {
    "constant": types.CompletionItemKind.Constant,
    "variable": types.CompletionItemKind.Variable,
    "clock": types.CompletionItemKind.Unit,
    "channel": types.CompletionItemKind.Event,
    "type": types.CompletionItemKind.Struct,
    "field": types.CompletionItemKind.Field,
    "function": types.CompletionItemKind.Function,
    "parameter": types.CompletionItemKind.TypeParameter,
    "template": types.CompletionItemKind.Class,
    "process": types.CompletionItemKind.Module,
    "location": types.CompletionItemKind.EnumMember,
    "bound": types.CompletionItemKind.Variable,
    "strategy": types.CompletionItemKind.Interface,
    "keyword": types.CompletionItemKind.Keyword,
    "built-in": types.CompletionItemKind.Function,
}
_SHOWN: Final[dict[SymbolKind, str]] = {"bound": "bound value"}


class Models:
    """Answers about models and queries, and tells of their mistakes."""

    def __init__(self, desk: Desk, surveys: Surveys) -> None:
        self._desk = desk
        self._surveys = surveys
        self._running: dict[Pair, asyncio.Task[None]] = {}
        self._without_model: set[str] = set()
        self._seen: set[str] = set()

    def look(self, uri: str) -> None:
        """Looks for mistakes of a text; what was begun for it before is given up."""
        pair = self.pair(uri)
        if pair is None:
            self._desk.publish(uri, [], self._desk.version(uri))
            return
        self._give_up(pair)
        if pair.model is None and uri not in self._without_model:
            self._without_model.add(uri)
            path = path_of(uri)
            self._desk.say(
                f"there is no model beside {path}, so only the forms of its queries are checked: "
                f"it would have the same name and end in {', '.join(MODELS[:-1])} or {MODELS[-1]}",
                types.MessageType.Warning,
            )
        self._running[pair] = asyncio.create_task(self._tell(pair))

    def take_back(self, uri: str) -> None:
        """Takes back the mistakes of a text that was closed, and of the text beside it."""
        self._seen.discard(uri)
        pair = pair_of(path_of(uri), self._desk.is_there)
        if any(self._desk.is_open(one) for one in pair.paths):
            return
        self._give_up(pair)
        self._surveys.forget(pair)
        for path in pair.paths:
            self._desk.publish(self._desk.uri_of(path), [])

    def _give_up(self, pair: Pair) -> None:
        task = self._running.pop(pair, None)
        if task is not None:
            task.cancel()

    async def _tell(self, pair: Pair) -> None:
        """Publishes the mistakes of a pair."""
        texts = self.texts(pair)
        uris = [self._desk.uri_of(path) for path in pair.paths]
        versions = [
            self._desk.version(uri) if self._desk.is_open(path) else None
            for uri, path in zip(uris, pair.paths, strict=True)
        ]
        try:
            looked = await self._surveys.of(pair, texts)
        except OutdatedError:
            return
        except CheckEndedError:
            self._desk.say(
                f"the check of {pair.paths[0]} ended without an answer; standard error says why"
            )
            return
        found: dict[str, list[types.Diagnostic]] = {uri: [] for uri in uris}
        for one in looked.survey.mistakes:
            file = MODEL if one.at is None else one.at.file
            path = pair.model if file == MODEL else pair.queries
            if path is not None:
                found[self._desk.uri_of(path)].append(self._shown(one, texts.of(file)))
        for uri, version in zip(uris, versions, strict=True):
            self._desk.publish(uri, found[uri], version)

    def _shown(self, one: Mistake, source: str) -> types.Diagnostic:
        area = types.Range(types.Position(0, 0), types.Position(0, 1))
        if one.at is not None:
            # What is missing at a place has no length, and is shown by the character before it.
            start = one.at.start - int(one.at.start == one.at.end > 0)
            area = self._desk.text_of(source).area(start, one.at.end)
        where = [f"in {one.place}"] if one.place else []
        notes = [f"note: {note}" for note in one.notes]
        hints = [f"hint: {one.hint}"] if one.hint else []
        return types.Diagnostic(
            range=area,
            message="\n".join([one.message, *where, *notes, *hints]),
            severity=SEVERITIES[one.severity],
            code=one.code,
            source="ntagen",
        )

    def pair(self, uri: str) -> Pair | None:
        """The pair of a text; ``None`` if it is XML of another kind.

        A text that was a model stays one while it is open: its first line may be typed anew.
        """
        path = path_of(uri)
        if path.lower().endswith(".xml") and uri not in self._seen:
            if not says_it_is_a_model(self._desk.text(uri).source):
                return None
            self._seen.add(uri)
        return pair_of(path, self._desk.is_there)

    def texts(self, pair: Pair) -> Texts:
        """What a pair says now."""
        model = "" if pair.model is None else self._desk.source(pair.model)
        queries = "" if pair.queries is None else self._desk.source(pair.queries)
        return Texts(pair.model or "", model, pair.queries, queries)

    async def current(self, uri: str) -> tuple[Pair, Looked] | None:
        """The pair of a text, and the survey of what it says now; ``None`` if there is none."""
        pair = self.pair(uri)
        if pair is None:
            return None
        try:
            return pair, await self._surveys.of(pair, self.texts(pair))
        except (CheckEndedError, OutdatedError):
            return None

    async def meaning(self, uri: str, place: types.Position) -> tuple[str, types.Range] | None:
        """What the name at a place means, in Markdown, and where it stands."""
        found = await self._name_at(uri, place)
        if found is None:
            return None
        looked, number, at = found
        symbol = looked.survey.symbols[number]
        return self._told(symbol, looked.texts), self._area(looked.texts, at)

    def _told(self, symbol: Symbol, texts: Texts) -> str:
        parts = [f"```xta\n{symbol.detail}\n```"]
        if symbol.comment:
            parts.append(symbol.comment)
        kind = _SHOWN.get(symbol.kind, symbol.kind)
        if symbol.at is None:
            parts.append(f"{kind} of the language")
        else:
            line = texts.of(symbol.at.file).count("\n", 0, symbol.at.start) + 1
            parts.append(f"{kind} on line {line}")
        return "\n\n".join(parts)

    async def possible(self, uri: str, place: types.Position) -> list[types.CompletionItem]:
        """The words that may be written at a place."""
        text = self._desk.text(uri)
        offset = text.offset(place)
        before, language = self._before(uri, text.source, offset)
        pair = self.pair(uri)
        if language is None or pair is None:
            return []
        looked = await self._surveys.latest(pair, self.texts(pair))
        if looked is None:
            return []
        file = file_of(uri)
        at = looked.offset(file, text.source, offset)
        words = possible(looked.names, file, before, at, language)
        return [_item(number, word) for number, word in enumerate(words)]

    @staticmethod
    def _before(uri: str, source: str, offset: int) -> tuple[str, Language | None]:
        """What stands before a place in the same text or part of XML, and its language."""
        if file_of(uri) == QUERIES:
            return source[:offset], "queries"
        if not path_of(uri).lower().endswith(".xml"):
            return source[:offset], "model"
        return part_of_xml(source, offset) or ("", None)

    async def definition(self, uri: str, place: types.Position) -> types.Location | None:
        """Where the name at a place is declared."""
        found = await self._name_at(uri, place)
        if found is None:
            return None
        looked, number, _ = found
        at = looked.survey.symbols[number].at
        return None if at is None else self._location(uri, looked.texts, at)

    async def references(
        self, uri: str, place: types.Position, *, with_declaration: bool
    ) -> list[types.Location]:
        """Where the name at a place stands, in both files."""
        found = await self._name_at(uri, place)
        if found is None:
            return []
        looked, number, _ = found
        places = looked.names.places(number, with_declaration=with_declaration)
        return [self._location(uri, looked.texts, one) for one in places]

    async def highlights(self, uri: str, place: types.Position) -> list[types.DocumentHighlight]:
        """Where the name at a place stands in the same file."""
        locations = await self.references(uri, place, with_declaration=True)
        return [types.DocumentHighlight(one.range) for one in locations if one.uri == uri]

    async def renaming(self, uri: str, place: types.Position) -> tuple[Pair, Renaming, types.Range]:
        """The name at a place, which can be changed, and where it stands.

        Raises:
            RenamingError: There is none.
        """
        current = await self.current(uri)
        if current is None:
            raise RenamingError("the text has not been looked at")
        pair, looked = current
        file = file_of(uri)
        offset = self._desk.text(uri).offset(place)
        renaming = renaming_at(looked.names, looked.texts, file, offset)
        at = next(
            one for one in renaming.places if one.file == file and one.start <= offset <= one.end
        )
        return pair, renaming, self._area(looked.texts, at)

    async def rename(self, uri: str, place: types.Position, name: str) -> types.WorkspaceEdit:
        """The changes that give the name at a place another name, in both files.

        Raises:
            RenamingError: It cannot have this name.
        """
        pair, renaming, _ = await self.renaming(uri, place)
        try:
            await renamed(renaming, name, self._surveys.of_other)
        except CheckEndedError:
            raise RenamingError("the check of the new text ended without an answer") from None
        edits: dict[str, list[types.TextEdit]] = {}
        for one in renaming.places:
            path = pair.model if one.file == MODEL else pair.queries
            if path is not None:
                area = self._area(renaming.texts, one)
                edits.setdefault(self._desk.uri_of(path), []).append(types.TextEdit(area, name))
        return types.WorkspaceEdit(changes=edits)

    async def formatted(self, uri: str) -> str | None:
        """A textual model in the standard layout; ``None`` for what has none or has mistakes."""
        if file_of(uri) == QUERIES or path_of(uri).lower().endswith(".xml"):
            return None
        current = await self.current(uri)
        if current is None or any(
            one.is_of_form and one.at is not None and one.at.file == MODEL
            for one in current[1].survey.mistakes
        ):
            return None
        return format_model(self._desk.text(uri).source)

    async def _name_at(self, uri: str, place: types.Position) -> tuple[Looked, int, Place] | None:
        """The survey of a text, the symbol whose name stands at a place, and the name's place."""
        current = await self.current(uri)
        if current is None:
            return None
        found = current[1].names.number_at(file_of(uri), self._desk.text(uri).offset(place))
        return None if found is None else (current[1], *found)

    def _area(self, texts: Texts, at: Place) -> types.Range:
        return self._desk.text_of(texts.of(at.file)).area(at.start, at.end)

    def _location(self, uri: str, texts: Texts, at: Place) -> types.Location:
        path = texts.path if at.file == MODEL else texts.queries_path
        return types.Location(self._desk.uri_of(path or path_of(uri)), self._area(texts, at))


def file_of(uri: str) -> int:
    """The number of a text in its pair."""
    return QUERIES if kind_of(path_of(uri)) == "queries" else MODEL


def _item(number: int, word: Possible) -> types.CompletionItem:
    told = types.MarkupContent(types.MarkupKind.PlainText, word.comment) if word.comment else None
    return types.CompletionItem(
        label=word.text,
        kind=_KINDS[word.kind],
        detail=word.detail or None,
        documentation=told,
        sort_text=f"{number:04d}",
    )
