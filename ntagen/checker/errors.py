"""Turns the engine's errors into those of `ntagen.errors`."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import ntagen._checker as _checker
from ntagen.errors import InputError, ModelError


class RejectedError(InputError):
    """The engine does not accept a model or a query; `diagnostics` say what is wrong and where."""

    def __init__(self, diagnostics: list[str]) -> None:
        super().__init__("\n".join(text.rstrip() for text in diagnostics))
        self.diagnostics = tuple(diagnostics)


@contextlib.contextmanager
def rejecting() -> Iterator[None]:
    """Turns the engine's rejection of an input into a `RejectedError`."""
    try:
        yield
    except _checker.RejectedError as error:
        raise RejectedError(error.args[0]) from None


@contextlib.contextmanager
def failing() -> Iterator[None]:
    """Turns the engine's error about a failing model into a `ModelError`."""
    try:
        yield
    except _checker.FailedError as error:
        raise ModelError(error.args[0]) from None
