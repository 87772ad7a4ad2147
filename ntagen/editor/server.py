"""The language server for environments, models and queries, over standard input and output.

Invariants: a request about any text has an answer, never an exception, but for a name that cannot
be changed; mistakes are published for each text that is open, and taken back when it is closed;
those of a text that has changed since are not published; nothing is read but the files that an
environment names, and the file beside a model or its queries.

What is said is in other modules: `environments` for ``.nsl``, `models` for ``.xml``, ``.xta`` and
``.ta`` and for the ``.q`` beside them, `lenses` for answers of queries.
"""

from __future__ import annotations

import re
from functools import cache
from typing import Final

from lsprotocol import types
from pygls.exceptions import JsonRpcException
from pygls.lsp.server import LanguageServer

from ntagen.editor.desk import Desk, path_of
from ntagen.editor.environments import Environments
from ntagen.editor.lenses import CANCEL, CHECK, Lenses
from ntagen.editor.models import Models, file_of
from ntagen.editor.outline import outline
from ntagen.editor.pairs import kind_of
from ntagen.editor.renaming import RenamingError
from ntagen.editor.surveys import Surveys
from ntagen.editor.verdicts import Verdicts
from ntagen.explanations import explanations
from ntagen.nsl.diagnostics import CAPTIONS
from ntagen.serve.processes import Limits
from ntagen.version import VERSION

_EXAMPLE: Final = re.compile(r"^```([a-z]+) ([a-z]+)$", re.MULTILINE)


class Server(LanguageServer):
    """The server, and the parts of it that answer."""

    def __init__(self, limits: Limits | None = None, allow_external: tuple[str, ...] = ()) -> None:
        """Begins with no text.

        Args:
            limits: What the check of one query may take.
            allow_external: The libraries that models may import, or their folders.
        """
        super().__init__("ntagen", VERSION)
        self.desk = Desk(self)
        self.environments = Environments(self.desk)
        self.models = Models(self.desk, Surveys(allow_external))
        verdicts = Verdicts(limits or Limits(), self.desk.refresh)
        self.lenses = Lenses(self.desk, self.models, verdicts)

    def look(self, uri: str, *, is_typed: bool = False) -> None:
        """Looks for mistakes of a text."""
        if _is_model(uri):
            self.models.look(uri)
            self.lenses.outdate(uri)
        else:
            self.environments.look(uri, is_typed=is_typed)

    def take_back(self, uri: str) -> None:
        """Takes back the mistakes of a text that was closed."""
        (self.models if _is_model(uri) else self.environments).take_back(uri)

    async def hover(self, uri: str, place: types.Position) -> types.Hover | None:
        """What the mistakes mean that are shown at a place, and then what its word means."""
        shown = self.desk.published.get(uri, [])
        here = [one for one in shown if one.range.start <= place <= one.range.end]
        texts = list(dict.fromkeys(_explained(str(one.code)) for one in here))
        area = here[0].range if here else None
        if _is_model(uri):
            found = await self.models.meaning(uri, place)
        else:
            found = self.environments.meaning(uri, place)
        if found is not None:
            texts.append(found[0])
            area = found[1]
        if not texts:
            return None
        text = "\n\n---\n\n".join(texts)
        return types.Hover(types.MarkupContent(types.MarkupKind.Markdown, text), area)

    async def formatted(self, uri: str) -> list[types.TextEdit] | None:
        """The change that brings a text into the standard layout, if it has one."""
        source = self.desk.text(uri)
        if _is_model(uri):
            done = await self.models.formatted(uri)
        else:
            done = self.environments.formatted(uri)
        if done is None or done == source.source:
            return None if done is None else []
        return [types.TextEdit(source.area(0, len(source.source)), done)]

    async def symbols(self, uri: str) -> list[types.DocumentSymbol]:
        """The names that a text declares."""
        if not _is_model(uri):
            return self.environments.symbols(uri)
        current = await self.models.current(uri)
        if current is None:
            return []
        return outline(current[1].survey, file_of(uri), self.desk.text(uri))


def make_server(limits: Limits | None = None, allow_external: tuple[str, ...] = ()) -> Server:
    """A server that answers; `Server.start_io` runs it. The arguments are those of `Server`."""
    server = Server(limits, allow_external)
    _add_texts(server)
    _add_words(server)
    _add_names(server)
    _add_queries(server)
    return server


def _add_texts(server: Server) -> None:
    """What is done when texts are opened, changed and closed."""

    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    def opened(params: types.DidOpenTextDocumentParams) -> None:
        server.desk.open(params.text_document.uri)
        server.look(params.text_document.uri)

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    def changed(params: types.DidChangeTextDocumentParams) -> None:
        server.look(params.text_document.uri, is_typed=True)

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    def closed(params: types.DidCloseTextDocumentParams) -> None:
        server.desk.close(params.text_document.uri)
        server.take_back(params.text_document.uri)


def _add_words(server: Server) -> None:
    """What may be asked of any text."""

    @server.feature(types.TEXT_DOCUMENT_HOVER)
    async def hover(params: types.HoverParams) -> types.Hover | None:
        return await server.hover(params.text_document.uri, params.position)

    @server.feature(
        types.TEXT_DOCUMENT_COMPLETION, types.CompletionOptions(trigger_characters=["."])
    )
    async def complete(params: types.CompletionParams) -> list[types.CompletionItem]:
        uri = params.text_document.uri
        if _is_model(uri):
            return await server.models.possible(uri, params.position)
        if params.context is not None and params.context.trigger_character == ".":
            return []
        return server.environments.possible(uri, params.position)

    @server.feature(types.TEXT_DOCUMENT_FORMATTING)
    async def formatted(params: types.DocumentFormattingParams) -> list[types.TextEdit] | None:
        return await server.formatted(params.text_document.uri)

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    async def symbols(params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        return await server.symbols(params.text_document.uri)


def _add_names(server: Server) -> None:
    """What may be asked of the names of models and queries."""
    models = server.models

    @server.feature(types.TEXT_DOCUMENT_DEFINITION)
    async def definition(params: types.DefinitionParams) -> types.Location | None:
        uri = params.text_document.uri
        return await models.definition(uri, params.position) if _is_model(uri) else None

    @server.feature(types.TEXT_DOCUMENT_REFERENCES)
    async def references(params: types.ReferenceParams) -> list[types.Location]:
        uri = params.text_document.uri
        declared = params.context.include_declaration
        if not _is_model(uri):
            return []
        return await models.references(uri, params.position, with_declaration=declared)

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
    async def highlight(params: types.DocumentHighlightParams) -> list[types.DocumentHighlight]:
        uri = params.text_document.uri
        return await models.highlights(uri, params.position) if _is_model(uri) else []

    @server.feature(types.TEXT_DOCUMENT_PREPARE_RENAME)
    async def prepare(params: types.PrepareRenameParams) -> types.PrepareRenamePlaceholder | None:
        uri = params.text_document.uri
        if not _is_model(uri):
            return None
        try:
            _, renaming, area = await models.renaming(uri, params.position)
        except RenamingError as error:
            raise _failed(error) from None
        return types.PrepareRenamePlaceholder(area, renaming.name)

    @server.feature(types.TEXT_DOCUMENT_RENAME, types.RenameOptions(prepare_provider=True))
    async def rename(params: types.RenameParams) -> types.WorkspaceEdit | None:
        uri = params.text_document.uri
        if not _is_model(uri):
            return None
        try:
            return await models.rename(uri, params.position, params.new_name)
        except RenamingError as error:
            raise _failed(error) from None


def _add_queries(server: Server) -> None:
    """What stands beside queries."""

    @server.feature(types.TEXT_DOCUMENT_CODE_LENS, types.CodeLensOptions())
    async def lenses(params: types.CodeLensParams) -> list[types.CodeLens]:
        uri = params.text_document.uri
        return await server.lenses.lenses(uri) if _is_model(uri) else []

    @server.feature(types.TEXT_DOCUMENT_INLAY_HINT)
    async def hints(params: types.InlayHintParams) -> list[types.InlayHint]:
        uri = params.text_document.uri
        return await server.lenses.hints(uri, params.range) if _is_model(uri) else []

    @server.command(CHECK)
    async def check(uri: str, number: int, formula: str) -> None:
        await server.lenses.check(uri, number, formula)

    @server.command(CANCEL)
    def cancel(uri: str, number: int, _formula: str = "") -> None:
        server.lenses.cancel(uri, number)


@cache
def _explained(code: str) -> str:
    """What a code of a mistake means, in Markdown: the text of `ntagen explain`."""
    one = explanations()[code]
    # Editors do not show the words after the language of an example.
    page = _EXAMPLE.sub(lambda found: f"{CAPTIONS[found[2]]}\n\n```{found[1]}", one.page)
    return f"**{one.severity}[{one.code}]: {one.name}**\n\n{page.strip()}"


def _is_model(uri: str) -> bool:
    """Whether a text is a model or queries."""
    return kind_of(path_of(uri)) in ("model", "queries")


def _failed(error: RenamingError) -> JsonRpcException:
    return JsonRpcException(str(error), types.LSPErrorCodes.RequestFailed)
