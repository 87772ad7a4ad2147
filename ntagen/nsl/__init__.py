"""The environment language: the text of an ``.nsl`` file to a `Scene`.

::

    text ──parser──▶ tree ──resolve──▶ draft ──build──▶ Scene
             form            names, units,      rules on
                             loops, includes    the values

No phase stops at the first mistake, and a mistake in one statement does not hide one in another:
`load` raises one `SourceError` with all mistakes. The README.md of this folder describes the
language; its grammar is ``environment.lark``.

Invariants: only `ntagen.nsl.reading` touches the disk; nothing here prints; any text gives a scene
or a `SourceError`, nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ntagen.hardware import GrblDevice, OpenIGTLinkTracker
from ntagen.nsl.diagnostics import Diagnostic, Reporter, SourceError
from ntagen.nsl.source import Source
from ntagen.parameters import Given
from ntagen.scene import Scene
from ntagen.values import dataclass

__all__ = [
    "Diagnostic",
    "SourceError",
    "Task",
    "format_text",
    "load",
    "load_task",
    "load_with_warnings",
    "loads",
    "loads_task",
]


@dataclass(frozen=True, slots=True)
class Task:
    """All that an environment file describes.

    Attributes:
        scene: The scene.
        given: The settings of the driver that the file gives, in the order written.
        device: The device that moves the needle, if the file describes one.
        tracker: What measures the needle, if the file describes it.
        warnings: What is odd, but no error.
    """

    scene: Scene
    given: tuple[Given, ...] = ()
    device: GrblDevice | None = None
    tracker: OpenIGTLinkTracker | None = None
    warnings: tuple[Diagnostic, ...] = ()

    def to_nsl(self) -> str:
        """The text of an environment file that describes the task, in the standard layout.

        The text, loaded again, is the same scene, device, tracker and settings; turned shapes,
        slanted directions and slanted ways may differ in their last digits.

        Raises:
            SourceError: The task breaks the rules for environments; the error has all mistakes,
                each with the line of the text and the part of the task.
            InputError: The language cannot say something of the task, such as a shape whose file is
                not known or a name with a space.
        """
        from ntagen.nsl.writing import write

        return write(self)[0]

    def checked(self) -> Task:
        """The task after the rules for environments were applied, with its warnings.

        Raises:
            SourceError, InputError: As in `to_nsl`.
        """
        from ntagen.nsl.writing import write

        return write(self)[1]


def load(path: str | Path, *, include: Sequence[str | Path] = ()) -> Scene:
    """The scene that a file describes.

    Args:
        path: The file.
        include: Folders below which included files may lie, besides the folder of the file.

    Raises:
        SourceError: The file cannot be read, or has mistakes; the error has all of them.
    """
    return load_task(path, include=include).scene


def load_with_warnings(
    path: str | Path, *, include: Sequence[str | Path] = ()
) -> tuple[Scene, tuple[Diagnostic, ...]]:
    """The scene that a file describes, and the warnings; all else is as in `load`."""
    task = load_task(path, include=include)
    return task.scene, task.warnings


def load_task(path: str | Path, *, include: Sequence[str | Path] = ()) -> Task:
    """All that a file describes: scene, settings, devices; all else is as in `load`."""
    from ntagen.nsl.reading import read_source

    reporter = Reporter()
    source = read_source(str(path), reporter)
    if source is None:
        raise SourceError(reporter.diagnostics)
    return _task(source, reporter, include)


def loads(text: str, path: str = "<text>", *, include: Sequence[str | Path] = ()) -> Scene:
    """The scene that a text describes; `path` is its name, and its folder that of its includes.

    Raises:
        SourceError: The text has mistakes; the error has all of them.
    """
    return loads_task(text, path, include=include).scene


def loads_task(text: str, path: str = "<text>", *, include: Sequence[str | Path] = ()) -> Task:
    """All that a text describes: scene, settings, devices; all else is as in `loads`."""
    return _task(Source(path, text), Reporter(), include)


def format_text(text: str, path: str = "<text>") -> str:
    """The text in the standard layout. Comments and meaning stay; a second time changes nothing.

    Raises:
        SourceError: The text has syntax errors.
    """
    from ntagen.nsl.format import format_source

    return format_source(Source(path, text))


def _task(source: Source, reporter: Reporter, include: Sequence[str | Path]) -> Task:
    """Runs the phases, one after the other."""
    from ntagen.nsl.build import build
    from ntagen.nsl.resolve import resolve

    reporter.enter(source.path)
    draft = resolve(source, reporter, include)
    task = None if draft is None else build(draft, reporter)
    if task is None or reporter.has_errors:
        raise SourceError(reporter.diagnostics)
    return replace(task, warnings=reporter.diagnostics)
