"""Options that several commands have, and options that reach a command as one value."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeAlias

import click

from ntagen.cli.guard import Guard
from ntagen.cli.quantities import count, duration, size

Decorator: TypeAlias = Callable[[Callable[..., int | None]], Callable[..., int | None]]


path_option = functools.partial(click.option, type=click.Path(path_type=Path))
"""An option that is the path of a file or folder; the arguments are those of `click.option`."""

path_argument = functools.partial(click.argument, type=click.Path(path_type=Path))
"""An argument that is the path of a file or folder; it takes those of `click.argument`."""


def output_option(metavar: str, about: str, name: str = "output", **more: Any) -> Decorator:  # noqa: ANN401
    """The option ``-o``: a file or folder that is written.

    Args:
        metavar: How the value is shown.
        about: Its text in ``--help``.
        name: The name of the value.
        more: What else `click.option` takes.
    """
    return path_option("-o", "--output", name, metavar=metavar, help=about, **more)


def gathered(keyword: str, options: dict[str, Decorator], make: Callable[..., object]) -> Decorator:
    """Adds options to a command, in order.

    Args:
        keyword: The argument of the command that gets what is made of their values.
        options: The options by the names of their values.
        make: Takes the values by these names.
    """

    def decorate(command: Callable[..., int | None]) -> Callable[..., int | None]:
        @functools.wraps(command)
        def with_gathered(**values: Any) -> int | None:  # noqa: ANN401  click's values
            found = make(**{name: values.pop(name) for name in options})
            return command(**{keyword: found}, **values)

        decorated: Callable[..., int | None] = with_gathered
        for option in reversed(options.values()):
            decorated = option(decorated)
        return decorated

    return decorate


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


def include_option() -> Decorator:
    """The option ``--include``."""
    return path_option(
        "--include",
        metavar="DIR",
        multiple=True,
        help="Allow an environment to include files below this folder too, not only below its own. "
        "You can give this option several times.",
    )


def external_option() -> Decorator:
    """The option ``--allow-external``."""
    return path_option(
        "--allow-external",
        metavar="PATH",
        multiple=True,
        help="Allow a UPPAAL model to import this library, or those of this folder, in statistical "
        "queries. Their code runs with your rights, so allow only what you trust. You can give "
        "this option several times.",
    )


def constant_option() -> Decorator:
    """The option ``--constant``: pairs of a name and a value."""

    def pairs(_: click.Context, __: click.Parameter, given: tuple[str, ...]) -> dict[str, str]:
        values = {}
        for one in given:
            name, sign, value = one.partition("=")
            if not (name.strip() and sign and value.strip()):
                raise click.BadParameter(f"{one!r} is not NAME=VALUE, such as N=4")
            values[name.strip()] = value.strip()
        return values

    return click.option(
        "--constant",
        "constants",
        metavar="NAME=VALUE",
        multiple=True,
        callback=pairs,
        help="Give a constant of the model another value, such as N=4; that of a template is "
        "TEMPLATE.NAME=VALUE. You can give this option several times.",
    )


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
