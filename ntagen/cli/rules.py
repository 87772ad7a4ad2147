"""The rules by which a game is played, as options of the commands that solve, check or play one."""

from collections.abc import Callable
from typing import TypeAlias

import click

Decorator: TypeAlias = Callable[[Callable[..., int | None]], Callable[..., int | None]]


def forced_rule(
    about: str = "When the environment must move at a moment at which time cannot pass. tiga: if "
    "the process that stops time has no controllable move; product: if no process has one; "
    "neutral: always.  [default: tiga]",
) -> Decorator:
    """The option ``--forced``; ``about`` is its text in ``--help``."""
    rules = click.Choice(["tiga", "product", "neutral"])
    return click.option("--forced", type=rules, default="tiga", help=about)


def overflow_rule() -> Decorator:
    """The option ``--overflow``."""
    return click.option(
        "--overflow",
        type=click.Choice(["wrap", "error"]),
        default="wrap",
        help="What happens if a result of integer arithmetic does not fit into 32 bits: it wraps "
        "round, as in UPPAAL, or it is a run-time error.  [default: wrap]",
    )


def priority_rule(about: str) -> Decorator:
    """The option ``--priorities``; ``about`` is its text in ``--help``."""
    rules = click.Choice(["ignore", "keep"])
    return click.option("--priorities", type=rules, default="ignore", help=about)
