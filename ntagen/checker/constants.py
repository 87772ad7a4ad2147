"""Values of Python as the language of models writes them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from numbers import Integral, Real
from typing import Protocol, TypeAlias, runtime_checkable


@runtime_checkable
class Array(Protocol):
    """An array or a number of NumPy."""

    def tolist(self) -> object:
        """The same of lists and numbers of Python."""


Value: TypeAlias = "bool | int | float | str | Iterable[Value] | Mapping[str, Value] | Array"
"""A number, an expression as text, or lists and fields of them."""


def written(value: object) -> str:
    """A value as it stands in a declaration: ``3``, ``{1, 2}``, ``{ x: 1, y: 2 }``.

    Raises:
        ValueError: A number is not finite.
        TypeError: The value is of another kind.
    """
    match value:
        case str():
            return value
        case Array():
            return written(value.tolist())
        case bool():
            return "true" if value else "false"
        case Integral():
            return str(int(value))
        case Real():
            if not math.isfinite(value):
                raise ValueError(f"{value} cannot be the value of a constant: it is not finite")
            return repr(float(value))
        case Mapping():
            return "{ " + ", ".join(f"{name}: {written(one)}" for name, one in value.items()) + " }"
        case Iterable():
            return "{" + ", ".join(written(one) for one in value) + "}"
    raise TypeError(
        f"{value!r} cannot be the value of a constant; give numbers, an expression as text, or "
        "lists and mappings of them"
    )
