"""`ntagen explain`: what a diagnostic means, with an example and how to fix it."""

from __future__ import annotations

import difflib
import re
from typing import Final

import click

from ntagen.cli.terminal import Styled, echo
from ntagen.errors import InputError
from ntagen.nsl.diagnostics import CAPTIONS

_LONGEST_LINE: Final = 400
"""Longer lines of examples are shortened: these examples show that something is too long."""


@click.command("explain", epilog="Exit codes: 0 done, 2 there is no such code.")
@click.argument("code", required=False)
def command(code: str | None) -> None:
    """Explain a diagnostic: what it means, an example of the mistake, and how to fix it.

    A diagnostic shows its CODE in brackets, as in error[E0201]. Without CODE, all codes are listed.

    \b
    Examples:
      ntagen explain E0201
      ntagen explain
    """  # noqa: D301  click wants the control character
    from ntagen.explanations import explanations

    pages = explanations()
    if code is None:
        for explanation in pages.values():
            echo(f"{explanation.code}  {explanation.severity:<8} {explanation.name}")
        return
    wanted = code.strip().strip("[]")
    by_name = {explanation.name: explanation for explanation in pages.values()}
    found = pages.get(wanted.upper()) or by_name.get(wanted.lower())
    if found is None:
        close = difflib.get_close_matches(wanted.upper(), pages, 1)
        close += difflib.get_close_matches(wanted.lower(), by_name, 1)
        hint = f"did you mean {close[0]}?" if close else "`ntagen explain` lists all codes"
        raise InputError(f"there is no diagnostic with the code {wanted}\nhint: {hint}")
    echo(Styled(f"{found.severity}[{found.code}]: {found.name}", bold=True))
    echo("")
    echo(_shown(found.page))


def _shown(page: str) -> str:
    """A page for the terminal: paragraphs wrapped, examples indented below a caption."""
    # Splitting by fences with a group: prose, heading, example, prose, …
    parts = re.split(r"```[a-z]+ ([a-z]+)\n(.*?)\n```", page, flags=re.DOTALL)
    blocks = []
    for index in range(0, len(parts), 3):
        if parts[index].strip():
            text = click.wrap_text(parts[index].strip(), 80, preserve_paragraphs=True)
            blocks.append(text)
        if index + 2 < len(parts):
            blocks.append(f"{CAPTIONS[parts[index + 1]]}\n\n{_indented(parts[index + 2])}")
    return "\n\n".join(blocks)


def _indented(example: str) -> str:
    lines = (
        line if len(line) <= _LONGEST_LINE else f"{line[:60]} … {line[-20:]}"
        for line in example.split("\n")
    )
    return "\n".join(f"    {line}".rstrip() for line in lines)
