"""`ntagen fmt`: brings environment files and textual models into their standard layouts."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from ntagen.cli.terminal import echo, echo_exactly
from ntagen.errors import InputError
from ntagen.files import write_files

_STDIN = "-"
_TEXTUAL = (".xta", ".ta")
_OTHERS = (".xml", ".q")


@click.command(name="fmt")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@click.option("--check", is_flag=True, help="Change nothing; exit with 1 if a file would change.")
@click.pass_context
def command(ctx: click.Context, files: tuple[str, ...], check: bool) -> None:
    """Bring environments (.nsl) and textual models (.xta, .ta) into the standard layout, in place.

    Comments stay, and the meaning does not change. A file with syntax errors is left unchanged. A
    single - reads an environment from standard input and writes to standard output.

    \b
    Example:
      ntagen fmt examples/*.nsl
      ntagen fmt model.xta
      ntagen fmt --check env.nsl
    """  # noqa: D301
    from ntagen.nsl import Diagnostic, SourceError

    changed: list[str] = []
    mistakes: list[Diagnostic] = []
    for name in files:
        try:
            before, after = _formatted(name)
        except SourceError as error:
            mistakes.extend(error.diagnostics)
            continue
        if before != after:
            changed.append(name)
        if name == _STDIN and not check:
            echo_exactly(after, nl=False)
        elif before != after and not check:
            write_files({Path(name): after})
    for name in changed:
        if name != _STDIN or check:
            echo(f"{'would reformat' if check else 'reformatted'} {name}", err=True)
    if mistakes:
        raise SourceError(mistakes)
    if check and changed:
        ctx.exit(1)


def _formatted(name: str) -> tuple[str, str]:
    """The text of a file before and after.

    Raises:
        InputError: The file has no standard layout, cannot be read, or has syntax errors.
    """
    from ntagen.nsl import SourceError, format_text
    from ntagen.nsl.diagnostics import Reporter
    from ntagen.nsl.reading import decode_source, read_source
    from ntagen.nsl.source import MAX_SOURCE_BYTES

    ending = Path(name).suffix.lower()
    if ending in _OTHERS:
        raise InputError(
            f"{name} has no standard layout\n"
            "hint: environments (.nsl) and textual models (.xta, .ta) have one"
        )
    reporter = Reporter()
    if name == _STDIN:
        data = sys.stdin.buffer.read(MAX_SOURCE_BYTES + 1)
        source = decode_source("<stdin>", data, reporter)
    else:
        source = read_source(name, reporter)
    if source is None:
        raise SourceError(reporter.diagnostics)
    if ending in _TEXTUAL:
        return source.text, _format_model(source.text, source.path)
    return source.text, format_text(source.text, source.path)


def _format_model(text: str, path: str) -> str:
    """The text of a model in the standard layout.

    Raises:
        SourceError: It has syntax errors.
    """
    from ntagen.checker.survey import OF_FORM, Texts
    from ntagen.cli.mistakes import mistakes_of
    from ntagen.nsl import SourceError
    from ntagen.xta import format_model

    mistakes = [one for one in mistakes_of(Texts(path, text)) if one.code.startswith(OF_FORM)]
    if mistakes:
        raise SourceError(mistakes)
    return format_model(text)
