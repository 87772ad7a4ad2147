"""`ntagen convert`: turns a model into the format of another tool."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from ntagen.cli.guard import doing
from ntagen.cli.loading import load_model, pointing_to_explanations
from ntagen.cli.options import bounded, include_option, output_option, path_argument
from ntagen.cli.terminal import echo, echo_exactly, say_idle
from ntagen.convert import SOURCES, TARGETS, convert, source_of, source_of_tck
from ntagen.errors import InputError
from ntagen.files import MODEL_BYTES, read_file, require_apart, write_files

if TYPE_CHECKING:
    from ntagen.convert import Source

_OF_ENDINGS: Final = {"gv": "dot"}
"""Other endings of formats."""


@click.command(
    "convert",
    epilog="Exit codes: 0 written, 2 the input is wrong or the format cannot hold it, 3 stopped "
    "by a limit.",
)
@path_argument("path", metavar="MODEL")
@output_option("FILE", "The file to write; - prints it.", required=True)
@click.option(
    "--from",
    "source_format",
    type=click.Choice(SOURCES),
    help="The format of MODEL.  [default: by its ending]",
)
@click.option(
    "--to",
    "target_format",
    type=click.Choice(TARGETS),
    help="The format to write.  [default: by the ending of FILE]",
)
@include_option()
@bounded
def command(
    path: Path,
    output: Path,
    source_format: str | None,
    target_format: str | None,
    include: tuple[Path, ...],
) -> None:
    """Turn a model into the format of another tool.

    \b
    MODEL is read as         FILE is written as
      .xml  UPPAAL's XML       .xml   UPPAAL's XML
      .xta  UPPAAL's XTA       .xta   UPPAAL's XTA
      .tck  TChecker           .tck   TChecker
      .nsl  an environment     .jani  JANI, for Storm, the Modest Toolset and others
                               .dot   Graphviz: the templates as a graph

    \b
    Examples:
      ntagen convert model.xml -o model.xta
      ntagen convert fischer.tck -o fischer.xml
      ntagen convert model.xta -o - --to tck | tck-reach -a covreach -l query1
      ntagen convert dice.xml -o dice.jani

    What the other format cannot hold is refused, with its place and a way out. Queries come along:
    a file with the ending .q beside an XTA model is read, and written beside one. What a format
    cannot ask is said on standard error.
    """  # noqa: D301  click wants the control character
    source_format = source_format or _format_of(path, SOURCES, "MODEL", "--from")
    is_printed = str(output) == "-"
    if target_format is None:
        if is_printed:
            raise InputError(f"-o - has no ending\nhint: say the format: --to {'|'.join(TARGETS)}")
        target_format = _format_of(output, TARGETS, "-o", "--to")
    require_apart({"-o": output}, {"model": path})
    with pointing_to_explanations(True), doing("loading the model"):
        source = _source(path, source_format, include)
    with doing("converting the model"):
        converted = convert(source, target_format)
    for note in converted.notes:
        echo(f"note: {note}", err=True)
    if is_printed:
        if converted.queries is not None:
            count = len(source.written.queries)
            echo(f"note: {_queries(count)} left out; -o FILE writes them beside it", err=True)
        echo_exactly(converted.text, nl=False)
        return
    contents = {output: converted.text}
    beside = output.with_suffix(".q")
    if converted.queries is not None:
        _require_replaceable(beside)
        contents[beside] = converted.queries
    write_files(contents)
    echo(f"wrote {' and '.join(str(one) for one in contents)}")


def _format_of(path: Path, formats: tuple[str, ...], what: str, option: str) -> str:
    """The format that the ending of a file names.

    Raises:
        InputError: It names none.
    """
    ending = path.suffix.lower().removeprefix(".")
    ending = _OF_ENDINGS.get(ending, ending)
    if ending not in formats:
        raise InputError(
            f"the ending of {what} {path} names no format\n"
            f"hint: say it with {option}: {', '.join(formats)}"
        )
    return ending


def _source(path: Path, source_format: str, include: tuple[Path, ...]) -> Source:
    if source_format == "tck":
        say_idle({"include": "--include"}, "here: only environments (.nsl) include files")
        text = read_file(path, MODEL_BYTES).decode("utf-8", errors="replace")
        return source_of_tck(text, str(path))
    if source_format != "nsl" and path.suffix.lower() == ".nsl":
        raise InputError(f"{path} is an environment\nhint: leave --from {source_format} out")
    if source_format == "nsl" and path.suffix.lower() != ".nsl":
        raise InputError(f"{path} is no environment\nhint: call it {path.stem}.nsl")
    model = load_model(path, include).model
    beside = path.with_suffix(".q")
    if source_format in ("xta", "ta") and beside.is_file():
        queries = model.read_queries(beside)
        echo(f"note: read {_queries(len(queries))} of {beside}", err=True)
        return source_of(model, str(path), queries)
    return source_of(model, str(path), model.queries if source_format != "xml" else ())


def _require_replaceable(path: Path) -> None:
    """Refuses to write queries over a file that somebody else has written.

    Raises:
        InputError: It is such a file.
    """
    from ntagen.convert.queries import MARK

    if path.exists() and not path.read_bytes().endswith(MARK.encode()):
        raise InputError(
            f"the queries would replace {path}, which ntagen convert has not written\n"
            "hint: choose another name for FILE, or move that file"
        )


def _queries(count: int) -> str:
    return f"{count} quer{'y' if count == 1 else 'ies'}"
