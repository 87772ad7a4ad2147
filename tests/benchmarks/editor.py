"""How soon an editor sees the mistakes of a model after a keystroke.

    python -m tests.benchmarks.editor [--folder DIR] [--models 20] [--edits 1000] [--seed 1]

A real server answers a client over its pipes. Each edit inserts, removes or replaces a few
characters at a random place, as people and slips do; after a while the text is that of the file
again. Time counts from sending the new text until the mistakes of this version have come. Every
50th edit also asks for everything else at a random place: hover, completion, definition, and so on.
The largest models are taken that have at most 2,000 lines, one of each folder; ``--folder`` adds
folders to those of the corpus.
"""

from __future__ import annotations

import argparse
import asyncio
import random
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from lsprotocol import types

from tests.integration.test_lsp import MOST_S, Editor, editor, identified

OWN = Path(__file__).parents[1] / "corpus"
MOST_LINES = 2000
AFRESH = 100
"""After so many edits the text is that of the file again."""
ASKED = 50
PIECES = [
    "x",
    ";",
    "{",
    "}",
    "(",
    " && ",
    "&lt;",
    "<",
    "int ",
    "\n",
    "/*",
    '"',
    "ö",
    "\N{ROCKET}",
    ".",
]


def models(folders: Sequence[Path], number: int) -> list[Path]:
    """The largest models that are not too long, one of each folder: others are much like it."""
    largest: dict[Path, tuple[int, Path]] = {}
    for path in (one for folder in folders for one in sorted(folder.rglob("*"))):
        if path.suffix in (".xml", ".xta", ".ta"):
            lines = path.read_bytes().count(b"\n")
            if lines <= MOST_LINES:
                largest[path.parent] = max(largest.get(path.parent, (0, path)), (lines, path))
    return [path for _, path in sorted(largest.values(), reverse=True)[:number]]


def edits(text: str, draw: random.Random) -> Iterator[tuple[int, int, str]]:
    """Edits of a text, each as its place, how many characters go, and what comes."""
    now = text
    for number in range(1, 1 << 30):
        if number % AFRESH == 0:
            yield 0, len(now), text
            now = text
            continue
        start = draw.randrange(len(now) + 1)
        gone = min(draw.choice([0, 0, 0, 1, 1, 5, 40]), len(now) - start)
        come = draw.choice(PIECES) if draw.random() < 0.7 else ""
        yield start, gone, come
        now = now[:start] + come + now[start + gone :]


def place_in(text: str, offset: int) -> types.Position:
    """The place of a character, counted in UTF-16."""
    start = text.rfind("\n", 0, offset) + 1
    units = len(text[start:offset].encode("utf-16-le")) // 2
    return types.Position(text.count("\n", 0, offset), units)


async def typed(client: Editor, path: Path, count: int, draw: random.Random) -> list[float]:
    """Edits a model, and returns after what time the mistakes of each text came, in seconds."""
    text = path.read_text("utf-8", "replace").replace("\r\n", "\n")
    uri = path.as_uri()
    client.show(uri, text)
    await client.next(uri)
    taken = []
    for version, (start, gone, come) in zip(range(2, count + 2), edits(text, draw), strict=False):
        area = types.Range(place_in(text, start), place_in(text, start + gone))
        change = types.TextDocumentContentChangePartial(area, come)
        text = text[:start] + come + text[start + gone :]
        named = types.VersionedTextDocumentIdentifier(version, uri)
        begun = time.perf_counter()
        client.text_document_did_change(types.DidChangeTextDocumentParams(named, [change]))
        while (await client.next(uri)).version != version:
            pass
        taken.append(time.perf_counter() - begun)
        if version % ASKED == 0:
            await everything(client, uri, place_in(text, draw.randrange(len(text) + 1)))
    client.text_document_did_close(types.DidCloseTextDocumentParams(identified(uri)))
    return taken


async def everything(client: Editor, uri: str, place: types.Position) -> None:
    """Asks for all that may be asked at a place."""
    one = identified(uri)
    await asyncio.wait_for(
        asyncio.gather(
            client.text_document_hover_async(types.HoverParams(one, place)),
            client.text_document_completion_async(types.CompletionParams(one, place)),
            client.text_document_definition_async(types.DefinitionParams(one, place)),
            client.text_document_references_async(
                types.ReferenceParams(types.ReferenceContext(True), one, place)
            ),
            client.text_document_document_highlight_async(
                types.DocumentHighlightParams(one, place)
            ),
            client.text_document_document_symbol_async(types.DocumentSymbolParams(one)),
            client.text_document_code_lens_async(types.CodeLensParams(one)),
            client.text_document_inlay_hint_async(
                types.InlayHintParams(one, types.Range(types.Position(0, 0), place))
            ),
            client.text_document_formatting_async(
                types.DocumentFormattingParams(one, types.FormattingOptions(2, True))
            ),
        ),
        MOST_S,
    )


def percentile(values: Sequence[float], part: float) -> float:
    """The value that a part of them does not exceed."""
    return sorted(values)[min(len(values) - 1, int(part * len(values)))]


async def main() -> None:
    """Prints a line for each model, and one for all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, action="append", default=[])
    parser.add_argument("--models", type=int, default=20)
    parser.add_argument("--edits", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    draw = random.Random(options.seed)
    every: list[float] = []
    async with editor() as client:
        for path in models([OWN, *options.folder], options.models):
            taken = await typed(client, path.absolute(), options.edits, draw)
            every += taken
            lines = path.read_bytes().count(b"\n")
            told = [f"{1000 * percentile(taken, part):.0f} ms" for part in (0.5, 0.95, 1.0)]
            print(f"{path.name}: {lines} lines, median {told[0]}, p95 {told[1]}, most {told[2]}")
    print(f"all {len(every)} edits: p95 {1000 * percentile(every, 0.95):.0f} ms")


if __name__ == "__main__":
    asyncio.run(main())
