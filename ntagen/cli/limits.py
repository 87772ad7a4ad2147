"""The limits of a search, as options of the commands that search."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypedDict

import click

from ntagen.cli.quantities import SIZE, TIME
from ntagen.cli.rules import Decorator


class Limits(TypedDict):
    """The limits of a search as the engine takes them; ``None`` is no limit."""

    states: int | None
    memory_bytes: int | None
    timeout_s: float | None


def limit_options(of: str = "") -> Decorator:
    """The options ``--states``, ``--memory`` and ``--timeout``; `of` is what they are limits of."""
    about = {
        "--states": "Stop a search after this many stored states.  [default: no limit]",
        "--memory": "Stop a search that takes this much memory, for example 4GiB; a number without "
        "a unit is in bytes.  [default: no limit]",
        "--timeout": "Stop a search after this time, for example 60s or 2min; a number without a "
        "unit is in seconds.  [default: no limit]",
    }
    if of:
        about = {name: f"For {of}: {text[0].lower()}{text[1:]}" for name, text in about.items()}
    options = (
        click.option("--states", type=click.IntRange(1), help=about["--states"]),
        click.option("--memory", metavar="SIZE", type=SIZE, help=about["--memory"]),
        click.option("--timeout", metavar="TIME", type=TIME, help=about["--timeout"]),
    )

    def decorate(command: Callable[..., int | None]) -> Callable[..., int | None]:
        for option in reversed(options):
            command = option(command)
        return command

    return decorate


def limits(states: int | None, memory: float | None, timeout: float | None) -> Limits:
    """The values of the options as limits."""
    return Limits(
        states=states,
        memory_bytes=None if memory is None else int(memory),
        timeout_s=timeout,
    )
