"""The limits of commands as options: of their searches, and of all that they do."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, Final

import click

from ntagen.cli.guard import Guard
from ntagen.cli.quantities import count, duration, size
from ntagen.cli.rules import Decorator


def limits(default: str = "no limit") -> dict[str, Decorator]:
    """The options by their fields of `ntagen.checker.Options`.

    Args:
        default: What holds without the option.
    """
    return {
        "states": click.option(
            "--states",
            metavar="N",
            type=count,
            help="Stop a search after this many stored states, for example 10k or 2M.  "
            f"[default: {default}]",
        ),
        "memory_bytes": click.option(
            "--memory",
            "memory_bytes",
            metavar="SIZE",
            type=size,
            help="Stop what takes this much memory, for example 4GiB: a search by its states, all "
            f"else by what the process takes.  [default: {default}]",
        ),
        "timeout_s": click.option(
            "--timeout",
            "timeout_s",
            metavar="TIME",
            type=duration,
            help="Stop after this time, with reading, writing and drawing, for example 60s or "
            f"2min; a number without a unit is in seconds.  [default: {default}]",
        ),
    }


LIMITS: Final = limits()
"""The options ``--states``, ``--memory`` and ``--timeout``."""


def bounded(command: Callable[..., int | None]) -> Callable[..., int | None]:
    """Adds ``--timeout`` and ``--memory`` to a command without a search: all it does ends then."""

    @functools.wraps(command)
    def within(**values: Any) -> int | None:  # noqa: ANN401  click's values
        with Guard(values.pop("timeout_s"), values.pop("memory_bytes")):
            return command(**values)

    decorated: Callable[..., int | None] = within
    for name in ("memory_bytes", "timeout_s"):
        decorated = LIMITS[name](decorated)
    return decorated
