"""What goes to the terminal: text in which nothing is a command to it.

Names, queries, comments and messages come from files that may be anybody's. A terminal obeys
control characters in them (it moves the cursor, changes its title, answers as if the user typed),
and characters that turn the direction of writing make a line look like another one. So all output
of the commands goes through `echo`, which shows such characters by their numbers; colours come from
here only. `tests/test_architecture.py` enforces that. Files are written as they are.
"""

from __future__ import annotations

import re
import sys
from typing import Final, NamedTuple

import click

_UNSAFE: Final = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]"
)
"""Control characters except for line feeds and tabs, what changes the direction of writing, and
the bytes of file names that are no text."""


class Styled(NamedTuple):
    """Text in a style of ours.

    Attributes:
        text: The text.
        fg: The name of its colour; ``None`` for that of the other text.
        bold: Whether it is bold.
    """

    text: str
    fg: str | None = None
    bold: bool = False


def safe(text: str) -> str:
    r"""The text with what a terminal would obey as ``\u001b``, which JSON reads as the same."""
    text = text.replace("\r\n", "\n")
    return _UNSAFE.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def echo(*parts: str | Styled, err: bool = False, nl: bool = True) -> None:
    """Prints text.

    Args:
        parts: What is printed, one part behind the other.
        err: Whether it goes to standard error.
        nl: Whether a line ends with it.
    """
    texts = [
        click.style(safe(part.text), fg=part.fg, bold=part.bold or None)
        if isinstance(part, Styled)
        else safe(part)
        for part in parts
    ]
    click.echo("".join(texts), err=err, nl=nl)


def echo_exactly(text: str, *, nl: bool = True) -> None:
    """Prints a document to standard output: exactly, unless that is a terminal."""
    # Without a colour, click takes sequences that look like one out of what goes to a file.
    click.echo(safe(text) if sys.stdout.isatty() else text, nl=nl, color=True)
