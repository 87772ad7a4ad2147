"""The limits of a search, as options of the commands that search."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import click

from ntagen.cli.quantities import COUNT, SIZE, TIME
from ntagen.cli.rules import Decorator


def _whole(_ctx: click.Context, _param: click.Parameter, value: float | None) -> int | None:
    return None if value is None else int(value)


def limits(
    about: Callable[[str], str] = lambda text: text, default: str = "no limit"
) -> dict[str, Decorator]:
    """The options by their fields of `ntagen.checker.Options`.

    Args:
        about: Makes the help of an option from what it does.
        default: What holds without the option.
    """
    return {
        "states": click.option(
            "--states",
            metavar="N",
            type=COUNT,
            help=about(
                "Stop a search after this many stored states, for example 10k or 2M.  "
                f"[default: {default}]"
            ),
        ),
        "memory_bytes": click.option(
            "--memory",
            "memory_bytes",
            metavar="SIZE",
            type=SIZE,
            callback=_whole,
            help=about(
                "Stop a search that takes this much memory, for example 4GiB.  "
                f"[default: {default}]"
            ),
        ),
        "timeout_s": click.option(
            "--timeout",
            "timeout_s",
            metavar="TIME",
            type=TIME,
            help=about(
                "Stop a search after this time, for example 60s or 2min; a number without a unit "
                f"is in seconds.  [default: {default}]"
            ),
        ),
    }


LIMITS: Final = limits()
"""The options ``--states``, ``--memory`` and ``--timeout``."""


def limit_options(of: str) -> Decorator:
    """The same options where they limit one of several things; `of` says which one."""

    def decorate(command: Callable[..., int | None]) -> Callable[..., int | None]:
        options = limits(lambda text: f"For {of}: {text[0].lower()}{text[1:]}")
        for option in reversed(options.values()):
            command = option(command)
        return command

    return decorate
