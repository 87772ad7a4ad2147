"""`ntagen verifyta`: in place of UPPAAL's command-line checker, for scripts that call it."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli.guard import taken_bytes
from ntagen.cli.progress import progress_of, say_interrupted
from ntagen.cli.signals import INTERRUPTED
from ntagen.cli.terminal import echo, echo_exactly
from ntagen.errors import InputError, ModelError, NtagenError
from ntagen.files import require_apart, write_files
from ntagen.version import VERSION

if TYPE_CHECKING:
    from ntagen.checker import Answer, Model
    from ntagen.checker.facts import Query
    from ntagen.verifyta.options import CommandLine

FAILED: Final = 1
"""The exit code of every mistake; verdicts have none of their own."""

COMPILE_ONLY: Final = "UPPAAL_COMPILE_ONLY"
"""If it is set and not empty, the compiled form of the model is printed and nothing is checked."""

_LICENCES: Final = ("--lease-request", "--lease-install")
_ENDLESS: Final = ("E[]", "A<>", "-->")
"""Queries whose traces may never end, so that none is the fastest."""

_SEARCH: Final[dict[str, Any]] = {"1": "dfs", "2": "random"}
_TRACE: Final[dict[str, Any]] = {"1": "shortest", "2": "fastest"}
_MOST_FILES: Final = 2
_KIB: Final = 1024


@click.command(
    "verifyta",
    add_help_option=False,
    context_settings={"ignore_unknown_options": True, "allow_interspersed_args": False},
)
@click.argument("words", nargs=-1, type=click.UNPROCESSED)
def command(words: tuple[str, ...]) -> int:
    """Stand in for UPPAAL's verifyta; -h lists the options."""
    from ntagen.verifyta.options import parse
    from ntagen.verifyta.output import help_text, version_text

    try:
        line = parse(words)
        if line.has("--help"):
            echo(help_text())
            return 0
        if line.has("--version"):
            echo(version_text(VERSION))
            return 0
        if any(line.has(name) for name in _LICENCES) and not line.files:
            echo("ntagen needs no licence")
            return 0
        if not 1 <= len(line.files) <= _MOST_FILES:
            given = "no MODEL" if not line.files else f"too many files: {', '.join(line.files)}"
            raise InputError(f"{given}; usage: verifyta [OPTION]... MODEL [QUERY]")
    except InputError as error:
        echo(f"verifyta: [error] {error}.", err=True)
        return FAILED
    path = Path(line.files[0])
    try:
        return _checked(line, path)
    except NtagenError as error:
        return _failed(str(error), path)
    except BrokenPipeError:
        raise
    except OSError as error:
        named = Path(os.fsdecode(error.filename)) if error.filename else path
        return _failed((error.strerror or str(error)).lower(), named)


def _failed(message: str, path: Path) -> int:
    """Reports a mistake; returns the exit code."""
    from ntagen.verifyta.places import reported

    sys.stdout.flush()
    for text in reported(message, path):
        echo(text, err=True)
    return FAILED


def _checked(line: CommandLine, path: Path) -> int:
    """Answers all queries, or prints the compiled form; returns the exit code."""
    from ntagen.checker import Interrupted, RejectedError
    from ntagen.loading import load_file
    from ntagen.verifyta.options import idle_in_learning
    from ntagen.verifyta.output import header, without_effect
    from ntagen.verifyta.places import places_of_queries

    allowed = (
        line.value("--allow-external").split(os.pathsep) if line.has("--allow-external") else []
    )
    model = load_file(path, allow_external=allowed).model
    if os.environ.get(COMPILE_ONLY):
        from ntagen.verifyta.compiled import compiled_text

        echo_exactly(compiled_text(model), nl=False)
        return 0
    query_path = Path(line.files[1]) if len(line.files) == _MOST_FILES else None
    queries = model.read_queries(query_path) if query_path else model.queries
    if not queries:
        raise InputError("there are no queries; give a file of queries after the model")
    texts = [query.text for query in queries]
    places = places_of_queries(texts, query_path or path, in_model=query_path is None)
    if not line.has("-q"):
        echo(header(line))
        in_model = (name for query in queries for name in query.options)
        if idle := idle_in_learning({*line.given, *in_model}):
            echo(without_effect(idle))
    code = 0
    for number, (query, place) in enumerate(zip(queries, places, strict=True), start=1):
        _progress(line, "\n")
        echo(f"Verifying formula {number} at {place}")
        try:
            _answer(line, model, query, number, [p for p in (path, query_path) if p])
        except Interrupted as interrupted:
            _show_runs_so_far(line, interrupted.answer)
            say_interrupted(query.text, len(queries) - number)
            return INTERRUPTED
        except RejectedError as error:
            # The other queries may be right. A model that fails ends everything.
            code = _failed(str(error), query_path or path)
    return code


def _show_runs_so_far(line: CommandLine, answer: Answer) -> None:
    """Prints what random runs say that the user has ended: it has no verdict."""
    from ntagen.verifyta.output import INTERRUPTED_RUNS, estimate, histogram

    _progress(line, f"{INTERRUPTED_RUNS}\n")
    for value in [*estimate(answer), *histogram(answer)]:
        echo(value)


def _progress(line: CommandLine, after: str) -> None:
    """Marks what follows as the end of a line of progress, unless that is switched off."""
    from ntagen.verifyta.output import ERASE_LINE

    shown = not line.has("--silence-progress") and not sys.stdout.isatty()
    echo_exactly(f"{ERASE_LINE if shown else ''}{after}", nl=False)


def _answer(line: CommandLine, model: Model, query: Query, number: int, inputs: list[Path]) -> None:
    """Answers a query, prints the verdict and what belongs to it, and writes its files."""
    from ntagen.checker import Options, form_of
    from ntagen.verifyta.options import of_model, statistical
    from ntagen.verifyta.output import estimate, histogram, summary, values, verdict

    text = query.text
    form = form_of(text)
    wants_trace = line.has("--diagnostic")
    wanted = _TRACE.get(line.value("--diagnostic"), "any")
    if wanted == "fastest" and form is not None and form.kind in _ENDLESS:
        wanted = "any"
    before = os.times().user
    options = Options(
        search=_SEARCH.get(line.value("--search-order"), "bfs"),
        **of_model(query.options) | statistical(line.given),
        trace=wants_trace,
        wanted_trace=wanted if wants_trace else "any",
        strategy=form is not None and (form.defines is not None or (wants_trace and form.is_game)),
        folder=inputs[-1].parent,
    )
    with progress_of(text, form, quiet=True) as reports:
        answer = model.answer(text, replace(options, **reports))
    if answer.verdict == "error":
        raise ModelError(answer.message or "the model has a run-time error")
    shown = verdict(answer)
    _progress(line, f"{shown}\n")
    for value in [*values(answer), *estimate(answer), *histogram(answer)]:
        echo(value)
    if wants_trace:
        _write_trace(line, model, answer, number, inputs)
    folder = line.value("--print-strategies")
    strategy = answer.strategy_text() if folder or wants_trace else None
    if strategy is not None and wants_trace:
        echo(strategy, nl=False)
    if strategy is not None and folder and form is not None and form.defines is not None:
        write_files({Path(folder) / form.defines: strategy})
    if line.has("--summary") and not line.has("--nosummary"):
        used_ms = round(1000 * (os.times().user - before))
        for fact in summary(answer, used_ms, _memory_kib()):
            echo(fact)


def _write_trace(
    line: CommandLine, model: Model, answer: Answer, number: int, inputs: list[Path]
) -> None:
    """Writes the trace of an answer to the files that are asked for, or shows it."""
    from ntagen.verifyta.trace_text import trace_text
    from ntagen.verifyta.trace_xml import trace_xml_text
    from ntagen.verifyta.xtr import xtr_text

    wanted = {
        Path(f"{line.value('-f')}-{number}"): ("-f", xtr_text, " -- Writing witness trace to"),
        Path(f"{line.value('-X')}{number}.xml"): ("-X", trace_xml_text, "XMLTrace outputted to:"),
    }
    files = {
        file: text
        for file, (option, written, _) in wanted.items()
        if line.has(option) and (text := written(model, answer)) is not None
    }
    read = {"queries" if index else "model": one for index, one in enumerate(inputs)}
    for file in files:
        require_apart({"the trace": file}, read)
    write_files(files)
    for file in files:
        echo(f"{wanted[file][-1]} {file}")
    if line.has("-f") or line.has("-X"):
        return
    shown = trace_text(
        answer,
        symbolic=line.has("-y") or line.has("-Y"),
        has_stopwatches="stopwatches" in model.features,
    )
    if shown is not None:
        echo(" -- Showing witness trace:")
        sys.stdout.flush()
        echo(shown, err=True, nl=False)


def _memory_kib() -> tuple[int, int] | None:
    """The virtual and the resident memory of this process in KiB, where the system says it."""
    virtual, resident = taken_bytes(0), taken_bytes(1)
    return None if virtual is None or resident is None else (virtual // _KIB, resident // _KIB)
