"""What the references among the parameters of a process stand for.

The engine gives the values of all other parameters; a reference is only another name of a variable,
a clock or a channel, and is found in the arguments of the instantiation.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from ntagen.convert.expression_reader import (
    UnknownExpression,
    parse_expression,
)
from ntagen.convert.expressions import (
    Call,
    Expr,
    Name,
    mapped,
)
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen import build
    from ntagen.checker.facts import Template

_INSTANCE: Final = re.compile(
    r"(?<![\w.])([A-Za-z_]\w*)\s*(?:\(([^()]*(?:\([^()]*\)[^()]*)*)\))?\s*:?=\s*"
    r"([A-Za-z_]\w*)\s*(\((?:[^()]|\((?:[^()]|\([^()]*\))*\))*\))\s*;"
)


@dataclass(frozen=True, slots=True)
class _Instance:
    """``NAME(PARAMETERS) = TEMPLATE(ARGUMENTS)``."""

    parameters: tuple[str, ...]
    template: str
    arguments: tuple[Expr, ...]


class Instances:
    """The instantiations of a model."""

    def __init__(self, model: build.Model) -> None:
        self._found: dict[str, _Instance] = {}
        text = re.sub(
            r"//[^\n]*|/\*.*?\*/", " ", f"{model.instantiations}\n{model.system}", flags=re.DOTALL
        )
        for name, parameters, template, arguments in _INSTANCE.findall(text):
            try:
                given = _arguments(f"f{arguments}")
            except UnknownExpression:
                continue  # the engine knows its values; no reference can be such an expression
            self._found[name] = _Instance(names_of_parameters(parameters), template, given)

    def references(self, process: str, template: Template) -> dict[str, Expr]:
        """The references of a process by the names of its template's parameters."""
        name, bracket, values = process.partition("(")
        arguments = self._arguments(name, _arguments(f"f({values}") if bracket else ())
        return {
            names_of_parameters(parameter)[0]: argument
            for parameter, argument in zip(template.parameters, arguments, strict=False)
            if "&" in parameter
        }

    def _arguments(self, name: str, given: tuple[Expr, ...]) -> tuple[Expr, ...]:
        """The arguments that the template gets for a process of this name with these values."""
        instance = self._found.get(name)
        if instance is None:
            return given
        values = dict(zip(instance.parameters, given, strict=False))

        def change(one: Expr) -> Expr | None:
            return values.get(one.text) if isinstance(one, Name) else None

        return self._arguments(
            instance.template, tuple(mapped(one, change) for one in instance.arguments)
        )


def _arguments(text: str) -> tuple[Expr, ...]:
    """The arguments of a call."""
    call = parse_expression(text)
    return call.arguments if isinstance(call, Call) else ()


def names_of_parameters(parameters: str) -> tuple[str, ...]:
    """The names of parameters: for each the last word of each, before the sizes of an array."""
    found = []
    for one in re.split(r",(?![^\[(]*[\])])", parameters):
        words = re.findall(r"[A-Za-z_]\w*", re.sub(r"(\[[^\]]*\]\s*)+$", "", one.strip()))
        if words:
            found.append(words[-1])
    return tuple(found)
