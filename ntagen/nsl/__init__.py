"""The environment language: the text of an ``.nsl`` file to a `Scene`.

::

    text ──parser──▶ tree ──resolve──▶ draft ──build──▶ Scene
             form            names, units,      rules on
                             loops, includes    the values

No phase stops at the first mistake, and a mistake in one statement hides none in another: `load`
raises one `SourceError` that holds everything that is wrong. The language is described in this
folder's README.md; its grammar is ``grammar.lark``.

Invariants: only `ntagen.nsl.reading` touches the disk; nothing here prints; any text at all gives a
scene or a `SourceError`, nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ntagen.nsl.diagnostics import Diagnostic, Reporter, SourceError
from ntagen.nsl.source import Source
from ntagen.scene import Scene

__all__ = [
    "Diagnostic",
    "SourceError",
    "format_text",
    "load",
    "load_with_warnings",
    "loads",
    "loads_with_warnings",
]


def load(path: str | Path, *, include: Sequence[str | Path] = ()) -> Scene:
    """The scene that a file describes.

    Args:
        path: The file.
        include: Folders below which included files may lie, beside that of the file.

    Raises:
        SourceError: The file cannot be read or has mistakes; all of them are in it.
    """
    return load_with_warnings(path, include=include)[0]


def load_with_warnings(
    path: str | Path, *, include: Sequence[str | Path] = ()
) -> tuple[Scene, tuple[Diagnostic, ...]]:
    """The scene that a file describes, and what is doubtful in it; all else as of `load`."""
    from ntagen.nsl.reading import read_source

    reporter = Reporter()
    source = read_source(str(path), reporter)
    if source is None:
        raise SourceError(reporter.diagnostics)
    return _scene(source, reporter, include)


def loads(text: str, path: str = "<text>", *, include: Sequence[str | Path] = ()) -> Scene:
    """The scene that a text describes; `path` is its name and where its includes are looked for.

    Raises:
        SourceError: The text has mistakes; all of them are in it.
    """
    return loads_with_warnings(text, path, include=include)[0]


def loads_with_warnings(
    text: str, path: str = "<text>", *, include: Sequence[str | Path] = ()
) -> tuple[Scene, tuple[Diagnostic, ...]]:
    """The scene that a text describes, and what is doubtful in it; as `loads`."""
    return _scene(Source(path, text), Reporter(), include)


def format_text(text: str, path: str = "<text>") -> str:
    """The text in its canonical layout: comments kept, meaning unchanged, a second time the same.

    Raises:
        SourceError: The text has mistakes of form.
    """
    from ntagen.nsl.format import format_source

    return format_source(Source(path, text))


def _scene(
    source: Source, reporter: Reporter, include: Sequence[str | Path]
) -> tuple[Scene, tuple[Diagnostic, ...]]:
    """The phases, one after the other."""
    from ntagen.nsl.build import build
    from ntagen.nsl.resolve import resolve

    reporter.enter(source.path)
    draft = resolve(source, reporter, include)
    scene = None if draft is None else build(draft, reporter)
    if scene is None or reporter.has_errors:
        raise SourceError(reporter.diagnostics)
    return scene, reporter.diagnostics
