"""How the documentation site is built: `make docs`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click
from pygments.lexer import RegexLexer, words
from pygments.lexers.c_cpp import CLexer
from pygments.lexers.special import TextLexer
from pygments.token import Comment, Keyword, Name, Number, Punctuation, String, Text

from ntagen.cli import _ntagen
from ntagen.nsl.tokens import RESERVED
from ntagen.version import VERSION

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sphinx.application import Sphinx

project = "ntagen"
author = "the ntagen contributors"
copyright = author
release = VERSION

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinxcontrib.mermaid",
]
html_theme = "furo"
html_title = "ntagen"
# The pages are read as files, too: links lead to headings as they do there.
myst_heading_anchors = 4
myst_fence_as_directive = ["mermaid"]
autodoc_typehints = "description"
autodoc_member_order = "bysource"
# The reference can be made without what is optional.
autodoc_mock_imports = ["gymnasium"]
suppress_warnings = ["myst.header"]

_ARCHITECTURE = "checker/ARCHITECTURE.md"


class EnvironmentLexer(RegexLexer):
    """Colours tasks (`.nsl`)."""

    name = "nsl"
    aliases = ("nsl",)
    tokens = {  # noqa: RUF012  as Pygments wants it
        "root": [
            (r"//.*?$|/\*[\s\S]*?\*/", Comment),
            (r'"[^"\n]*"', String),
            (words(sorted(RESERVED), prefix=r"\b", suffix=r"\b"), Keyword),
            (r"\d+(\.\d+)?", Number),
            (r"\w+", Name),
            (r"[{}()\[\],;=+\-*/%.<>&|!?:^]", Punctuation),
            (r"\s+", Text),
        ]
    }


def _help_of(command: click.Command, parent: click.Context | None, name: str) -> Iterator[str]:
    """The help of a command and of those in it, a section each."""
    # Terminals have 80 columns.
    context = click.Context(command, parent, name, max_content_width=80, terminal_width=80)
    yield f"## {context.command_path}\n\n```text\n{command.get_help(context)}\n```"
    if isinstance(command, click.Group):
        for inner in command.list_commands(context):
            found = command.get_command(context, inner)
            if found is not None and not found.hidden:
                yield from _help_of(found, context, inner)


def _complete(_app: Sphinx, page: str, source: list[str]) -> None:
    """Adds what a page takes from the program; lets links to the architecture lead to its page."""
    if page == "reference/command-line":
        source[0] += "\n\n".join(_help_of(_ntagen, None, "ntagen"))
    up = "../" * page.count("/")
    source[0] = source[0].replace(f"](../{up}{_ARCHITECTURE}", f"]({up}reference/architecture.md")


def setup(app: Sphinx) -> dict[str, Any]:
    """Adds the languages of our examples."""
    app.add_lexer("nsl", EnvironmentLexer)
    app.add_lexer("xta", CLexer)
    # Examples of what stands in a block of a task.
    for name in ("needle", "motion", "body", "files", "top", "include"):
        app.add_lexer(f"nsl-{name}", EnvironmentLexer)
    # Tables of states, and answers: the tests compare them with what the engine says.
    for name in ("states", "answers", "decisions"):
        app.add_lexer(name, TextLexer)
    app.connect("source-read", _complete)
    return {"parallel_read_safe": True}
