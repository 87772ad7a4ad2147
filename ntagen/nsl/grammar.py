"""The grammar of the language, `grammar.lark`, as lark's lexer and parser.

Computing the tables of a parser takes longer than all other work on a file (some 100 ms). So lark
stores them in the user's cache folder; it computes them again if the grammar or lark has changed,
or if the folder cannot be used. Each grammar has a file of its own, so that two versions of this
program do not compute them again and again.
"""

from __future__ import annotations

import functools
import sys
import zlib
from pathlib import Path
from typing import Final

from lark import Lark

from ntagen.cache import cache_folder
from ntagen.nsl.convert import TreeBuilder

FILE: Final = Path(__file__).with_name("grammar.lark")


@functools.cache
def grammar() -> Lark:
    """The lexer of whole texts, and the parser of single statements."""
    text = FILE.read_text("utf-8")
    return Lark(
        text,
        parser="lalr",
        lexer="basic",
        start=["statement", "outside"],
        keep_all_tokens=True,
        maybe_placeholders=False,
        transformer=TreeBuilder(),
        cache=_tables(text) or False,
    )


def _tables(text: str) -> str | None:
    """The file with the tables of a grammar; None if there is no cache folder."""
    folder = cache_folder()
    version = f"{sys.version_info[0]}.{sys.version_info[1]}"
    name = f"nsl-grammar-{version}-{zlib.crc32(text.encode()):08x}.tables"
    return None if folder is None else str(folder / name)
