"""Shared by the commands on models: loading with warnings, and pointing to `ntagen explain`."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ntagen.cli.terminal import echo, echo_message, say_idle
from ntagen.errors import InputError

if TYPE_CHECKING:
    from ntagen.checker import OverflowRule
    from ntagen.loading import Loaded
    from ntagen.nsl import Task

WARNINGS_SHOWN: Final = 10
"""At most this many warnings are printed: a model may have the same one in many templates."""


def load_model(
    path: Path,
    include: Sequence[Path],
    overflow: OverflowRule = "wrap",
    constants: Mapping[str, str] | None = None,
    allow_external: Sequence[Path] = (),
) -> Loaded:
    """Loads the model of a file. Prints warnings to standard error.

    Args:
        path: The file.
        include: The folders below which an environment may include files, besides its own.
        overflow: What happens if a result of integer arithmetic does not fit into 32 bits.
        constants: Other values for constants of the model.
        allow_external: The libraries that the model may import, or their folders.

    Raises:
        InputError: The file or a value is wrong.
        OSError: The file cannot be read.
    """
    from ntagen.loading import load_file

    loaded = load_file(path, include=include, allow_external=allow_external)
    if loaded.task is None:
        say_idle({"include": "--include"}, "here: only environments (.nsl) include files")
    else:
        say_idle({"allow_external": "--allow-external"}, "here: environments import no libraries")
    if constants:
        if loaded.task is not None:
            raise InputError(
                "--constant is for UPPAAL models, and an environment has none\n"
                "hint: change the values in the environment itself"
            )
        loaded = replace(loaded, model=loaded.model.with_constants(constants))
    loaded.model.overflow = overflow
    found = loaded.model.warnings
    if loaded.task is not None:
        # The true tip in a tissue with chance is meant to be known to random runs only.
        found = tuple(warning for warning in found if _LEFT_OUT not in warning)
    show_warnings((*loaded.warnings, *found))
    return loaded


def load_task(path: Path, include: Sequence[Path] = ()) -> Task:
    """Loads a task. Prints warnings to standard error.

    Raises:
        InputError: The file is wrong.
        OSError: The file cannot be read.
    """
    from ntagen import nsl

    task = nsl.load_task(path, include=include)
    show_warnings([warning.render() for warning in task.warnings])
    return task


_LEFT_OUT: Final = "warning[W0213]"
"""The warning that a double is left out of symbolic queries."""


def show_warnings(warnings: Sequence[str]) -> None:
    """Prints warnings to standard error."""
    for warning in warnings[:WARNINGS_SHOWN]:
        echo_message(warning.rstrip())
    if len(warnings) > WARNINGS_SHOWN:
        rest = len(warnings) - WARNINGS_SHOWN
        echo(f"… and {rest} more warning{'s' * (rest > 1)}", err=True)


@contextlib.contextmanager
def pointing_to_explanations(wanted: bool) -> Iterator[None]:
    """Adds to a rejection the command that explains its first diagnostic, if `wanted`."""
    try:
        yield
    except InputError as error:
        if not wanted:
            raise
        pointer = pointer_to_page(str(error))
        raise InputError(f"{error}\n{pointer}" if pointer else str(error)) from error


def pointer_to_page(rejection: str) -> str:
    """The command that explains the first diagnostic of a text; empty if it has none."""
    code = re.search(r"\berror\[([A-Z]\d+)\]", rejection)
    return f"for an example and how to fix it: ntagen explain {code[1]}" if code else ""
