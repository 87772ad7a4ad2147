"""What the server knows of the editor: the texts that are open, and what it is told about them.

The protocol counts places as the editor wishes (mostly in UTF-16), the languages in characters.
"""

from __future__ import annotations

import os
from typing import Final
from urllib.parse import urlsplit

from lsprotocol import types
from pygls.lsp.server import LanguageServer
from pygls.uris import from_fs_path, to_fs_path

from ntagen.editor.texts import Text
from ntagen.files import MODEL_BYTES, read_file

SEVERITIES: Final = {
    "error": types.DiagnosticSeverity.Error,
    "warning": types.DiagnosticSeverity.Warning,
}

_TEXTS_KEPT: Final = 8


class Desk:
    """The texts that are open, and the mistakes that are shown in them.

    Attributes:
        published: The mistakes that are shown, by file.
    """

    def __init__(self, server: LanguageServer) -> None:
        self._server = server
        self._made: dict[str, Text] = {}
        self._uris: dict[str, str] = {}
        self.published: dict[str, list[types.Diagnostic]] = {}

    def open(self, uri: str) -> None:
        """Notes that a text is open."""
        self._uris[path_of(uri)] = uri

    def close(self, uri: str) -> None:
        """Notes that a text is closed."""
        self._uris.pop(path_of(uri), None)

    def is_open(self, path: str) -> bool:
        """Whether the text of a file is open."""
        return path in self._uris

    def is_there(self, path: str) -> bool:
        """Whether there is a file, in the editor or on the disk."""
        return self.is_open(path) or os.path.isfile(path)

    def uri_of(self, path: str) -> str:
        """How the editor names a file."""
        return self._uris.get(path) or from_fs_path(path) or path

    def version(self, uri: str) -> int | None:
        """The version of a text."""
        return self._server.workspace.get_text_document(uri).version

    def text(self, uri: str) -> Text:
        """The text of a file that is open."""
        return self.text_of(self._server.workspace.get_text_document(uri).source)

    def text_of(self, source: str) -> Text:
        """Any text; those that were asked for last are kept."""
        known = self._made.pop(source, None)
        if known is None:
            known = Text(source, self._server.workspace.position_codec)
        self._made[source] = known
        while len(self._made) > _TEXTS_KEPT:
            self._made.pop(next(iter(self._made)))
        return known

    def source(self, path: str) -> str:
        """What a file says, in the editor or else on the disk; empty if it cannot be read."""
        if self.is_open(path):
            return self.text(self._uris[path]).source
        try:
            data = read_file(path, MODEL_BYTES)
        except OSError:
            return ""
        try:
            return data.decode("utf-8")
        except UnicodeDecodeError:
            return data.decode("latin-1")

    def publish(self, uri: str, found: list[types.Diagnostic], version: int | None = None) -> None:
        """Shows the mistakes of a file instead of those before."""
        self.published[uri] = found
        params = types.PublishDiagnosticsParams(uri, found, version)
        self._server.text_document_publish_diagnostics(params)

    def refresh(self) -> None:
        """Asks the editor to ask again for what stands beside queries, if it can."""
        able = self._server.client_capabilities.workspace
        if able is None:
            return
        if able.code_lens is not None and able.code_lens.refresh_support:
            self._server.workspace_code_lens_refresh(None)
        if able.inlay_hint is not None and able.inlay_hint.refresh_support:
            self._server.workspace_inlay_hint_refresh(None)

    def say(self, message: str, kind: types.MessageType = types.MessageType.Error) -> None:
        """Shows a message."""
        self._server.window_show_message(types.ShowMessageParams(kind, message))


def path_of(uri: str) -> str:
    """The file of a text; a text that is no file yet has its name only."""
    return to_fs_path(uri) or urlsplit(uri).path or uri
