"""The limits of a search, as options of the commands that search."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypedDict

import click

from ntagen.cli.quantities import SIZE, TIME
from ntagen.cli.rules import Decorator


class Limits(TypedDict):
    """When a search is to stop, as the engine is told; ``None`` is never."""

    states: int | None
    memory_bytes: int | None
    timeout_s: float | None


def limit_options(of: str = "") -> Decorator:
    """The options ``--states``, ``--memory`` and ``--timeout``; `of` is what they are limits of."""
    about = {
        "--states": "Stop after so many stored states.",
        "--memory": "Such as 4GiB.",
        "--timeout": "Such as 60s.",
    }
    if of:
        about = {name: f"Of {of}: {text[0].lower()}{text[1:]}" for name, text in about.items()}
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
    """What the options mean."""
    return Limits(
        states=states,
        memory_bytes=None if memory is None else int(memory),
        timeout_s=timeout,
    )
