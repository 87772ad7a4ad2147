"""Loads a model from a file or a text.

An environment (``.nsl``) is turned into a UPPAAL model first; the engine reads XML and XTA itself.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ntagen import checker
from ntagen.checker import Model, OverflowRule
from ntagen.errors import InputError
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.checker.strategy import Strategy
    from ntagen.nsl import Task
    from ntagen.scene import Scene


@dataclass(frozen=True, slots=True)
class Loaded:
    """A model, and the task from which it was made.

    Attributes:
        model: The model.
        task: What an environment describes; ``None`` for a UPPAAL model.
        warnings: The warnings about the environment; those about the model are `Model.warnings`.
    """

    model: Model
    task: Task | None = None
    warnings: tuple[str, ...] = ()


def load(
    source: str | Path | Scene | Task,
    *,
    include: Sequence[str | Path] = (),
    overflow: OverflowRule = "wrap",
    allow_external: Sequence[str | Path] = (),
) -> Model:
    """Loads a model.

    Args:
        source: A path to a file (UPPAAL XML or XTA, or an environment ``.nsl``), or the text of a
            UPPAAL model. A string is a text if it has a line break, a ``;`` or a ``<``. A scene or
            a task made in Python is checked as its text would be (`ntagen.Task.to_nsl`).
        include: Folders below which an environment may include files, besides its own folder.
        overflow: What happens if a result of integer arithmetic does not fit into 32 bits; see
            `Model.overflow`.
        allow_external: The libraries that a UPPAAL model may import: their files, or folders that
            hold them. Their code runs in this process, so allow only what you trust.

    Returns:
        The model: `Model.check` answers queries, and its attributes describe the model.

    Raises:
        InputError: The file or text is wrong. For a UPPAAL model the error is a
            `ntagen.checker.RejectedError`, which has the diagnostics.
        OSError: The file cannot be read.
    """
    if isinstance(source, str) and any(sign in source for sign in "\n;<"):
        model = checker.load(source, allow_external=allow_external)
    elif isinstance(source, str | os.PathLike):
        loaded = load_file(Path(source), include=include, allow_external=allow_external)
        model = loaded.model
    else:
        model = _load_value(source).model
    model.overflow = overflow
    return model


def load_strategy(path: str | Path, model: Model) -> Strategy:
    """Reads a strategy that was saved for this model: see `Model.load_strategy`.

    Raises:
        InputError: The file is not a strategy, or does not fit the model.
        OSError: The file cannot be read.
    """
    return model.load_strategy(path)


def load_file(
    path: Path,
    *,
    include: Sequence[str | Path] = (),
    allow_external: Sequence[str | Path] = (),
) -> Loaded:
    """Loads the model of a file, and the scene if it is an environment; the rest as in `load`.

    Raises:
        InputError: The file is wrong.
        OSError: The file cannot be read.
    """
    if path.suffix.lower() != ".nsl":
        try:
            return Loaded(checker.load_file(path, allow_external=allow_external))
        except checker.RejectedError as error:
            if message := _other_kind(path, error):
                raise InputError(message) from None
            raise
    from ntagen.nsl import load_task

    task = load_task(path, include=include)
    return _rendered(task, path)


def _load_value(value: object) -> Loaded:
    """Loads the model of a scene or a task that was made in Python."""
    from ntagen.nsl import Task
    from ntagen.scene import Scene

    if not isinstance(value, Scene | Task):
        raise InputError(
            f"a {type(value).__name__} is no model\nhint: give a path, a text, a scene or a task"
        )
    task = (value if isinstance(value, Task) else Task(value)).checked()
    return _rendered(task, Path(f"{task.scene.name}.nsl"))


def _rendered(task: Task, path: Path) -> Loaded:
    """The model of a task; `path` is the file of the environment, or what it might be called."""
    from ntagen.render import render

    text = render(task.scene, source=path.name)
    model = checker.load(text, path=str(path.with_suffix(".xml")))
    return Loaded(model, task, tuple(warning.render() for warning in task.warnings))


_MODEL_SUFFIXES = (".xml", ".xta", ".ta")

_NOT_A_MODEL = "error[E0121]: "
"""The diagnostic of a file that is no model at all."""


def _other_kind(path: Path, error: checker.RejectedError) -> str | None:
    """The message about a file of another kind, on one line; ``None`` if it may be a model.

    A file with another ending that is wrong from its first character on is none: its mistakes say
    nothing.
    """
    first = error.diagnostics[0].partition("\n")[0]
    suffix = path.suffix.lower()
    if suffix == ".q":
        return f"{path} is a list of queries; write the model before it: MODEL.xml {path}"
    _, is_other, reason = first.partition(_NOT_A_MODEL)
    if not is_other:
        if suffix in _MODEL_SUFFIXES or not first.startswith(f"{path}:1:1: "):
            return None
        reason = "this is no model"
    return f"{path}: {reason}; expected is a UPPAAL model (.xml, .xta) or an environment (.nsl)"
