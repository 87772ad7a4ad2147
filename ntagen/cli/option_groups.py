"""Options that belong together, and reach a command as one value."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

from ntagen.cli.rules import Decorator


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
