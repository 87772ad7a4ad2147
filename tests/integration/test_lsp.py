"""The language server as an editor sees it: a process, and the protocol over its pipes."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from lsprotocol import types
from pygls.lsp.client import LanguageClient

from tests import anatomy

PAPER = (Path(__file__).parents[2] / "examples" / "paper.nsl").read_text("utf-8")
MOST_S = 60.0


class Editor(LanguageClient):
    """An editor that remembers what was published about each file."""

    def __init__(self) -> None:
        super().__init__("editor", "1")
        self.published: asyncio.Queue[types.PublishDiagnosticsParams] = asyncio.Queue()

        @self.feature(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
        def _published(params: types.PublishDiagnosticsParams) -> None:
            self.published.put_nowait(params)

    async def next(self, uri: str) -> types.PublishDiagnosticsParams:
        """What is published next about a file."""
        while True:
            params = await asyncio.wait_for(self.published.get(), MOST_S)
            if params.uri == uri:
                return params

    async def mistakes(self, uri: str) -> list[types.Diagnostic]:
        return list((await self.next(uri)).diagnostics)

    def show(self, uri: str, text: str) -> None:
        """Opens a text, and waits for nothing."""
        item = types.TextDocumentItem(uri, "nsl", 1, text)
        self.text_document_did_open(types.DidOpenTextDocumentParams(item))

    async def open(self, uri: str, text: str) -> list[types.Diagnostic]:
        self.show(uri, text)
        return await self.mistakes(uri)

    def press(self, uri: str, version: int, text: str) -> None:
        """Changes a text, and waits for nothing."""
        change = types.TextDocumentContentChangeWholeDocument(text)
        named = types.VersionedTextDocumentIdentifier(version, uri)
        self.text_document_did_change(types.DidChangeTextDocumentParams(named, [change]))

    async def change(self, uri: str, version: int, text: str) -> list[types.Diagnostic]:
        self.press(uri, version, text)
        return await self.mistakes(uri)

    async def hover(self, uri: str, text: str, word: str) -> str | None:
        """What is told about a word."""
        line = text[: text.index(word)].count("\n")
        place = types.Position(line, text.splitlines()[line].index(word))
        found = await asyncio.wait_for(
            self.text_document_hover_async(types.HoverParams(identified(uri), place)), MOST_S
        )
        if found is None:
            return None
        assert isinstance(found.contents, types.MarkupContent)
        return found.contents.value


@asynccontextmanager
async def editor() -> AsyncIterator[Editor]:
    client = Editor()
    await client.start_io(sys.executable, "-m", "ntagen", "lsp")
    await asyncio.wait_for(
        client.initialize_async(types.InitializeParams(types.ClientCapabilities())), MOST_S
    )
    client.initialized(types.InitializedParams())
    try:
        yield client
        await asyncio.wait_for(client.shutdown_async(None), MOST_S)
    finally:
        # After a failure, too: the client waits for the end of the server.
        client.exit(None)
        await client.stop()


def identified(uri: str) -> types.TextDocumentIdentifier:
    return types.TextDocumentIdentifier(uri)


def test_mistakes_come_while_typing_and_go_on_closing(tmp_path: Path) -> None:
    async def session() -> None:
        first, second = ((tmp_path / name).as_uri() for name in ("a.nsl", "b.nsl"))
        async with editor() as client:
            assert await client.open(first, PAPER) == []
            wrong = PAPER.replace("radius 10 mm", "raduis 10 mm")
            (mistake,) = await client.open(second, wrong)
            assert (mistake.code, mistake.source) == ("N015", "ntagen")
            assert "hint: did you mean `radius`?" in mistake.message
            line = wrong[: wrong.index("raduis")].count("\n")
            column = wrong.splitlines()[line].index("raduis")
            assert mistake.range == types.Range(
                types.Position(line, column), types.Position(line, column + len("raduis"))
            )
            # Anything that may stand there while somebody types.
            for version, end in enumerate(range(0, len(PAPER), 97), start=2):
                await client.change(first, version, PAPER[:end])
            assert await client.change(first, 1000, "\0\N{ROCKET}{{{") != []
            assert await client.change(first, 1001, PAPER) == []
            client.text_document_did_close(types.DidCloseTextDocumentParams(identified(second)))
            assert await client.mistakes(second) == []

    asyncio.run(session())


def test_places_are_counted_as_the_protocol_counts(tmp_path: Path) -> None:
    async def session() -> None:
        uri = (tmp_path / "a.nsl").as_uri()
        comment = "/* \N{ROCKET}\N{ROCKET} größer */ "
        async with editor() as client:
            (mistake, *_) = await client.open(uri, comment + "enviroment e { }\n" + PAPER)
            start = len(comment.encode("utf-16-le")) // 2
            assert mistake.range.start == types.Position(0, start)
            await client.change(uri, 2, comment + PAPER)
            at = comment + PAPER
            line = at[: at.index("bevel")].count("\n")
            column = at.splitlines()[line].index("bevel")
            hover = await client.text_document_hover_async(
                types.HoverParams(identified(uri), types.Position(line, column + 1))
            )
            assert hover is not None
            assert hover.range == types.Range(
                types.Position(line, column), types.Position(line, column + len("bevel"))
            )

    asyncio.run(session())


def test_completion_layout_and_names(tmp_path: Path) -> None:
    async def session() -> None:
        uri = (tmp_path / "a.nsl").as_uri()
        async with editor() as client:
            text = "environment e {\n  needle { ra"
            await client.open(uri, text)
            items = await client.text_document_completion_async(
                types.CompletionParams(identified(uri), types.Position(1, 13))
            )
            assert isinstance(items, list)
            assert [item.label for item in items] == sorted(
                ["bevel", "heading", "length", "radius", "speed", "tip"]
            )
            wanted = types.DocumentFormattingParams(
                identified(uri), types.FormattingOptions(tab_size=2, insert_spaces=True)
            )
            assert not await client.text_document_formatting_async(wanted)
            await client.change(uri, 2, PAPER.replace("  needle", "needle"))
            (edit,) = await client.text_document_formatting_async(wanted) or []
            assert edit.new_text == PAPER
            names = await client.text_document_document_symbol_async(
                types.DocumentSymbolParams(identified(uri))
            )
            assert [one.name for one in names or []] == ["paper", "T1", "C1", "D1"]

    asyncio.run(session())


def test_mistakes_of_included_files_stand_in_these_files(tmp_path: Path) -> None:
    async def session() -> None:
        part = tmp_path / "part.nsl"
        part.write_text("let near = 3 mm\nlet far = 3 mmm\n", "utf-8")
        uri = (tmp_path / "a.nsl").as_uri()
        async with editor() as client:
            await client.open(uri, 'include "part.nsl"\n' + PAPER)
            (mistake,) = await client.mistakes(part.as_uri())
            assert mistake.code == "N023"
            assert mistake.range.start == types.Position(1, 12)
            part.write_text("let near = 3 mm\n", "utf-8")
            await client.change(uri, 2, 'include "part.nsl"\n' + PAPER + "\n")
            assert await client.mistakes(part.as_uri()) == []

    asyncio.run(session())


def test_the_mistakes_of_a_text_that_is_typed_come_when_the_keys_rest(tmp_path: Path) -> None:
    async def session() -> None:
        uri = (tmp_path / "a.nsl").as_uri()
        async with editor() as client:
            assert await client.open(uri, PAPER) == []
            for version in range(2, 40):
                client.press(uri, version, PAPER + "}" * version)
            client.press(uri, 40, PAPER.replace("radius 10 mm", "raduis 10 mm"))
            found = await client.next(uri)
            assert (found.version, [one.code for one in found.diagnostics]) == (40, ["N015"])

    asyncio.run(session())


def test_a_long_check_holds_up_nothing(tmp_path: Path) -> None:
    """The grid is as fine as one may be: such a check takes many seconds."""
    points, faces = anatomy.box((0.0, 0.0, -50.0), (60.0, 60.0, 60.0))
    anatomy.write_stl(tmp_path / "box.stl", points, faces)
    text = (
        "environment e {\n"
        "  needle { tip (0, 0, 0) mm heading -z bevel +x radius 60 mm speed 1 mm/s length 90 mm }\n"
        f"  {anatomy.FRAME}\n"
        '  target T1 mesh "box.stl" in LPS mm grid 0.6 mm\n'
        "}\n"
    )

    async def session() -> None:
        uri = (tmp_path / "a.nsl").as_uri()
        async with editor() as client:
            client.show(uri, text)
            assert "bevel" in (await client.hover(uri, text, "bevel") or "")
            await asyncio.sleep(1)
            client.press(uri, 2, PAPER)
            found = await client.next(uri)
            assert (found.version, list(found.diagnostics)) == (2, [])

    asyncio.run(session())


def test_a_mistake_is_explained_where_it_stands(tmp_path: Path) -> None:
    async def session() -> None:
        uri = (tmp_path / "a.nsl").as_uri()
        wrong = PAPER.replace("radius 10 mm", "raduis 10 mm")
        async with editor() as client:
            await client.open(uri, wrong)
            told = await client.hover(uri, wrong, "raduis")
            assert told is not None
            assert told.startswith("**error[N015]: unexpected-word**")
            assert "Right:\n\n```nsl\n" in told
            assert "nsl wrong" not in told
            await client.change(uri, 2, PAPER)
            assert "N015" not in (await client.hover(uri, PAPER, "radius 10 mm") or "")

    asyncio.run(session())


def test_the_server_ends_with_its_client() -> None:
    with subprocess.Popen(
        [sys.executable, "-m", "ntagen", "lsp", "--stdio"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as process:
        assert process.stdin is not None
        process.stdin.close()
        process.wait(MOST_S)


def test_without_the_extra_the_way_out_is_named() -> None:
    code = (
        "import sys; sys.modules['pygls'] = None; sys.modules['lsprotocol'] = None\n"
        "from ntagen.cli import main; sys.exit(main(['lsp']))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "pip install 'ntagen[editor]'" in done.stderr
