"""`python -m ntagen.cli.mistakes FILE...`: the mistakes of files, for pre-commit.

What an editor shows while somebody types, for any number of files at once; queries are checked for
mistakes and not answered, so that a commit waits for nothing long. It is no command of `ntagen`:
`.pre-commit-hooks.yaml` names it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ntagen.checker.survey import MODEL, Texts, survey
from ntagen.cli.terminal import echo
from ntagen.editor.pairs import kind_of, pair_of, says_it_is_a_model
from ntagen.files import MODEL_BYTES, read_file

if TYPE_CHECKING:
    from ntagen.nsl import Diagnostic


def mistakes_of(texts: Texts) -> list[Diagnostic]:
    """What is wrong with a model and its queries, as it is shown of environments."""
    from ntagen.nsl import Diagnostic
    from ntagen.nsl.source import Source

    found = []
    for one in survey(texts).mistakes:
        file, start, end = one.at or (MODEL, 0, 0)
        text = texts.of(file)
        path = texts.path if file == MODEL else texts.queries_path or ""
        line, column = text.count("\n", 0, start) + 1, start - text.rfind("\n", 0, start)
        where = (path, line, column, max(1, end - start), one.message)
        shown = Source(path, text).line(line)
        found.append(
            Diagnostic(one.code, one.severity, *where, shown, notes=one.notes, hint=one.hint)
        )
    return found


def main(paths: Sequence[str]) -> int:
    """Prints the mistakes of files; 1 if there is an error, 2 if a file cannot be read, else 0."""
    try:
        found = dict.fromkeys(one for path in paths for one in _in_file(path))
    except OSError as error:
        echo(f"{error.filename}: {error.strerror}", err=True)
        return 2
    for one in found:
        echo(one.render())
    return int(any(one.severity == "error" for one in found))


def _in_file(path: str) -> Iterator[Diagnostic]:
    """The mistakes of a file; none of a file of another kind."""
    if kind_of(path) == "environment":
        from ntagen.editor import language

        yield from language.mistakes(_text(path), path)
        return
    if path.lower().endswith(".xml") and not says_it_is_a_model(_text(path)):
        return
    pair = pair_of(path, os.path.isfile)
    model = "" if pair.model is None else _text(pair.model)
    queries = "" if pair.queries is None else _text(pair.queries)
    for one in mistakes_of(Texts(pair.model or "", model, pair.queries, queries)):
        if one.path:
            yield one


def _text(path: str) -> str:
    data = read_file(path, MODEL_BYTES)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
