"""Output to the terminal, without characters that the terminal would obey.

Names, queries, comments and messages come from files that anybody may have written. A terminal
obeys control characters in them: it moves the cursor, changes its title, or answers as if the user
typed. Characters that change the direction of writing make a line look like another one. So all
output of the commands goes through `echo`, which shows such characters by their numbers. Colours
come only from here. `tests/test_architecture.py` enforces that. Files are written unchanged.

Notes about the command line, such as options without effect, go to standard error (`say`).
"""

from __future__ import annotations

import re
import sys
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Final, NamedTuple

import click

_UNSAFE: Final = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]"
)
"""Control characters except line feeds and tabs, characters that change the direction of writing,
and the bytes of file names that are not text."""

_PLAIN: Final = bytes(range(0x20, 0x7F))
"""The characters of ASCII that are printed."""

_UNBOUNDED_WIDTH: Final = 10_000


class Styled(NamedTuple):
    """Text with a colour or in bold.

    Attributes:
        text: The text.
        fg: The name of its colour; ``None`` for the terminal's own colour.
        bold: Whether it is bold.
    """

    text: str
    fg: str | None = None
    bold: bool = False


def safe(text: str) -> str:
    r"""The text with unsafe characters written as ``\u001b``, which JSON reads as the same."""
    # Long texts are mostly of these, and looking at each character for others takes seconds.
    if text.isascii() and not text.encode("ascii").translate(None, _PLAIN):
        return text
    text = text.replace("\r\n", "\n")
    return _UNSAFE.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def print_table(
    headings: Sequence[str], rows: Iterable[Sequence[str]], numbers: Collection[str]
) -> None:
    """Prints a table; columns of numbers are at the right, and are not folded.

    Args:
        headings: The headings of the columns.
        rows: The rows; one may be shorter.
        numbers: Which columns have numbers.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1), show_edge=False)
    for name in headings:
        if name in numbers:
            table.add_column(name, justify="right", no_wrap=True)
        else:
            table.add_column(name, overflow="fold")
    for row in rows:
        table.add_row(*(Text(safe(cell)) for cell in row))
    # A pipe or file has no width, and text that is folded over two lines is hard to search.
    width = None if sys.stdout.isatty() else _UNBOUNDED_WIDTH
    console = Console(highlight=False, markup=False, width=width)
    console.print(table)


def aligned(rows: Sequence[Sequence[str]], right: Collection[int] = ()) -> list[str]:
    """Rows as lines with columns of equal widths; those with these numbers end at the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            f"{cell:>{width}}" if number in right else f"{cell:<{width}}"
            for number, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]


def echo(*parts: str | Styled, err: bool = False, nl: bool = True) -> None:
    """Prints text.

    Args:
        parts: The parts of the text, in order.
        err: Whether to print to standard error.
        nl: Whether to end the line.
    """
    texts = [
        click.style(safe(part.text), fg=part.fg, bold=part.bold or None)
        if isinstance(part, Styled)
        else safe(part)
        for part in parts
    ]
    click.echo("".join(texts), err=err, nl=nl)


_SEVERITY: Final = re.compile(r"\b(error|warning)(?:\[[A-Z]\d+\])?:|^ +(note|hint):|^hint:")
_COLOURS: Final = {"error": "red", "warning": "yellow"}


def echo_message(text: str) -> None:
    """Prints diagnostics or another message for the user to standard error.

    On a terminal the severity of each is coloured.
    """
    parts: list[str | Styled] = []
    for index, line in enumerate(text.splitlines()):
        parts += ["\n"] * (index > 0)
        found = None if line.startswith("  | ") else _SEVERITY.search(line)
        if found is None:
            parts.append(line)
            continue
        word = Styled(found[0], fg=_COLOURS.get(found[1], "cyan"), bold=True)
        parts += [line[: found.start()], word, line[found.end() :]]
    echo(*parts, err=True)


def echo_exactly(text: str, *, nl: bool = True) -> None:
    """Prints a document to standard output: unchanged, unless that is a terminal."""
    # Without `color`, click removes everything that looks like a colour from output to a file.
    click.echo(safe(text) if sys.stdout.isatty() else text, nl=nl, color=True)


def given_options() -> list[str]:
    """The names of the parameters and settings that stand on the command line."""
    context = click.get_current_context()
    source = click.core.ParameterSource.COMMANDLINE
    given = [name for name in context.params if context.get_parameter_source(name) is source]
    return [*given, *context.params.get("settings", ())]


def say_idle(options: Mapping[str, str], why: str) -> None:
    """Prints a note for each of these options that stands on the command line.

    Args:
        options: The options, by the name of their parameters.
        why: The reason, which follows the words "has no effect".
    """
    given = given_options()
    say([f"{option} has no effect {why}" for name, option in options.items() if name in given])


def say(notes: Sequence[str]) -> None:
    """Prints notes about the command line to standard error."""
    for note in notes:
        echo(f"note: {note}", err=True)
