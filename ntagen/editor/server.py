"""The language server for ``.nsl``, over standard input and output.

Invariants: a request about any text has an answer, never an exception; mistakes are published for
each text that is open, and taken back when it is closed; those of a text that has changed since
are not published; nothing is read but the files that an environment names.

While somebody types, mistakes are looked for when the keys rest: see `REST_S` and
`ntagen.editor.checks`.

The protocol counts places as the editor wishes (mostly in UTF-16), the language in characters.
"""

from __future__ import annotations

import asyncio
from typing import Final
from urllib.parse import urlsplit

from lsprotocol import types
from pygls.lsp.server import LanguageServer
from pygls.uris import from_fs_path, to_fs_path
from pygls.workspace import TextDocument

from ntagen.editor import language
from ntagen.editor.checks import CheckEndedError, Checks
from ntagen.nsl import Diagnostic, SourceError, format_text
from ntagen.version import VERSION

REST_S: Final = 0.15
"""So long no key is pressed before mistakes are looked for."""

_SEVERITIES = {
    "error": types.DiagnosticSeverity.Error,
    "warning": types.DiagnosticSeverity.Warning,
}
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


class Server(LanguageServer):
    """The server, and the files about which each open text has mistakes."""

    def __init__(self) -> None:
        super().__init__("ntagen", VERSION)
        self._told: dict[str, set[str]] = {}
        self._published: dict[str, list[types.Diagnostic]] = {}
        self._checks = Checks()
        self._running: dict[str, asyncio.Task[None]] = {}

    def look(self, uri: str, rest_s: float = 0.0) -> None:
        """Looks for mistakes of a text after a rest; what was begun for it before is given up."""
        self._give_up(uri)
        self._running[uri] = asyncio.create_task(self._tell(uri, rest_s))

    def _give_up(self, uri: str) -> None:
        task = self._running.pop(uri, None)
        if task is not None:
            task.cancel()

    async def _tell(self, uri: str, rest_s: float) -> None:
        """Publishes the mistakes of a text and of the files that it includes."""
        await asyncio.sleep(rest_s)
        document = self.workspace.get_text_document(uri)
        path = _path(uri)
        try:
            mistakes = await self._checks.mistakes(document.source, path)
        except CheckEndedError:
            message = f"the check of {path} ended without an answer; standard error says why"
            self.window_show_message(types.ShowMessageParams(types.MessageType.Error, message))
            return
        by_uri: dict[str, list[types.Diagnostic]] = {uri: []}
        for one in mistakes:
            of = uri if one.path == path else from_fs_path(one.path) or uri
            by_uri.setdefault(of, []).append(self._shown(document if of == uri else None, one))
        for gone in self._told.get(uri, set()) - set(by_uri):
            by_uri[gone] = []
        self._told[uri] = set(by_uri)
        for of, found in by_uri.items():
            self._publish(of, found, document.version if of == uri else None)

    def take_back(self, uri: str) -> None:
        """Takes back the mistakes of a text that was closed."""
        self._give_up(uri)
        for of in self._told.pop(uri, {uri}):
            self._publish(of, [])

    def _publish(self, uri: str, found: list[types.Diagnostic], version: int | None = None) -> None:
        self._published[uri] = found
        params = types.PublishDiagnosticsParams(uri, found, version)
        self.text_document_publish_diagnostics(params)

    def hover(self, document: TextDocument, place: types.Position) -> types.Hover | None:
        """What the mistakes mean that are shown at a place, and then what its word means."""
        here = [one for one in self._published.get(document.uri, []) if _is_in(place, one.range)]
        texts = list(dict.fromkeys(language.explained(str(one.code)) for one in here))
        area = here[0].range if here else None
        found = language.meaning(document.source, self.offset(document, place))
        if found is not None:
            told, start, end = found
            texts.append(told)
            area = types.Range(self.place(document, start), self.place(document, end))
        if not texts:
            return None
        text = "\n\n---\n\n".join(texts)
        return types.Hover(types.MarkupContent(types.MarkupKind.Markdown, text), area)

    def place(self, document: TextDocument, offset: int) -> types.Position:
        """Where a character stands."""
        before = document.source[:offset]
        line = before.count("\n")
        column = offset - (before.rfind("\n") + 1)
        return self._in_units(document, line, column)

    def offset(self, document: TextDocument, position: types.Position) -> int:
        """The character at a place; a place behind the end of a line is the end."""
        lines = document.source.split("\n")
        if position.line >= len(lines):
            return len(document.source)
        start = sum(len(line) + 1 for line in lines[: position.line])
        text = lines[position.line]
        units, column = 0, 0
        while column < len(text) and units < position.character:
            units += document.position_codec.client_num_units(text[column])
            column += 1
        return start + column

    def _in_units(self, document: TextDocument, line: int, column: int) -> types.Position:
        lines = document.source.split("\n")
        text = lines[line] if line < len(lines) else ""
        return types.Position(line, document.position_codec.client_num_units(text[:column]))

    def _shown(self, document: TextDocument | None, one: Diagnostic) -> types.Diagnostic:
        line = max(0, one.line - 1)
        start, end = one.column - 1, one.column - 1 + one.length
        if one.line == 0:
            area = types.Range(types.Position(0, 0), types.Position(0, 1))
        elif document is None:
            codec = self.workspace.position_codec
            first, last = (
                types.Position(line, codec.client_num_units(one.source_line[:at]))
                for at in (start, end)
            )
            area = types.Range(first, last)
        else:
            area = types.Range(
                self._in_units(document, line, start), self._in_units(document, line, end)
            )
        notes = [f"note: {note}" for note in one.notes]
        hints = [f"hint: {one.hint}"] if one.hint else []
        return types.Diagnostic(
            range=area,
            message="\n".join([one.message, *notes, *hints]),
            severity=_SEVERITIES[one.severity],
            code=one.code,
            source="ntagen",
        )


def make_server() -> Server:
    """A server that answers; `Server.start_io` runs it."""
    server = Server()

    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    def opened(params: types.DidOpenTextDocumentParams) -> None:
        server.look(params.text_document.uri)

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    def changed(params: types.DidChangeTextDocumentParams) -> None:
        server.look(params.text_document.uri, REST_S)

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    def closed(params: types.DidCloseTextDocumentParams) -> None:
        server.take_back(params.text_document.uri)

    @server.feature(types.TEXT_DOCUMENT_HOVER)
    def hover(params: types.HoverParams) -> types.Hover | None:
        document = server.workspace.get_text_document(params.text_document.uri)
        return server.hover(document, params.position)

    @server.feature(types.TEXT_DOCUMENT_COMPLETION)
    def complete(params: types.CompletionParams) -> list[types.CompletionItem]:
        document = server.workspace.get_text_document(params.text_document.uri)
        words = language.possible(document.source, server.offset(document, params.position))
        return [
            types.CompletionItem(
                label=word.text,
                kind=_KINDS[word.kind],
                detail=word.detail or None,
                sort_text=f"{number:04d}",
            )
            for number, word in enumerate(words)
        ]

    @server.feature(types.TEXT_DOCUMENT_FORMATTING)
    def formatted(params: types.DocumentFormattingParams) -> list[types.TextEdit] | None:
        document = server.workspace.get_text_document(params.text_document.uri)
        try:
            text = format_text(document.source, _path(params.text_document.uri))
        except SourceError:
            # The mistakes are shown already.
            return None
        if text == document.source:
            return []
        whole = types.Range(types.Position(0, 0), server.place(document, len(document.source)))
        return [types.TextEdit(whole, text)]

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def symbols(params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        document = server.workspace.get_text_document(params.text_document.uri)
        found = []
        for one in language.declared(document.source):
            area = types.Range(server.place(document, one.start), server.place(document, one.end))
            kind = _SYMBOLS.get(one.kind, types.SymbolKind.Object)
            found.append(types.DocumentSymbol(one.name, kind, area, area, detail=one.kind))
        return found

    return server


def _is_in(place: types.Position, area: types.Range) -> bool:
    """Whether a place is in an area, or at its end: there the cursor stands after the last key."""
    return area.start <= place <= area.end


def _path(uri: str) -> str:
    """The file of a text; a text that is no file yet has its name only."""
    return to_fs_path(uri) or urlsplit(uri).path or uri
