"""Evaluates expressions, with names, units and dimensions.

An expression with a mistake has no value (None). An expression that contains it has no value
either, and no second report. The other operands are still evaluated, so that their mistakes are
reported too.
"""

from __future__ import annotations

import math
from collections import ChainMap
from collections.abc import Callable, Sequence
from typing import Final

from ntagen.nsl import tree
from ntagen.nsl.diagnostics import Reporter, did_you_mean
from ntagen.nsl.draft import Placed
from ntagen.nsl.quantity import (
    ALIASES,
    ANGLE,
    NUMBER,
    UNITS,
    USUAL_UNIT,
    Dimension,
    Quantity,
    is_unit,
    quotient,
    scalar,
)
from ntagen.nsl.source import Span
from ntagen.scene import Vector
from ntagen.values import dataclass

CONSTANTS: Final = {
    "pi": scalar(math.pi),
    "x": Quantity((1.0, 0.0, 0.0), NUMBER),
    "y": Quantity((0.0, 1.0, 0.0), NUMBER),
    "z": Quantity((0.0, 0.0, 1.0), NUMBER),
}
"""Names that are always defined: pi, and the directions of the axes."""

FUNCTIONS: Final = ("abs", "cos", "max", "min", "sin", "sqrt")
"""The functions."""


@dataclass(frozen=True, slots=True)
class Definition:
    """What a name means, and where that is said; there is no value if that has a mistake."""

    value: Quantity | None
    span: Span


Scope = ChainMap[str, Definition]
"""The names that are visible at a place: those of its braces, then those of the braces around."""


class Evaluator:
    """Evaluates expressions and reports mistakes in them."""

    def __init__(self, reporter: Reporter) -> None:
        self._report = reporter.report

    # ------------------------------------------------------------------------- what a place needs

    def number(
        self, expression: tree.Expression, scope: Scope, dimension: Dimension, role: str
    ) -> Placed[float]:
        """One number of a dimension, in mm, rad and s, with its place.

        Args:
            expression: The expression.
            scope: The names that it may use.
            dimension: The dimension that its place needs.
            role: The place in words, as the subject of a message: ``the radius``.

        Returns:
            The number; it is None after a mistake.
        """
        found = self._numbers(expression, scope, dimension, role, is_vector=False)
        return Placed(found[0] if found else None, expression.span)

    def vector(
        self, expression: tree.Expression, scope: Scope, dimension: Dimension, role: str
    ) -> Placed[Vector]:
        """Three numbers of a dimension, in mm, rad and s; arguments and result as in `number`."""
        found = self._numbers(expression, scope, dimension, role, is_vector=True)
        return Placed((found[0], found[1], found[2]) if found else None, expression.span)

    def _numbers(
        self,
        expression: tree.Expression,
        scope: Scope,
        dimension: Dimension,
        role: str,
        *,
        is_vector: bool,
    ) -> Sequence[float] | None:
        """The numbers of a vector, or the only one of a single value; None after a mistake."""
        plain = _plain_numbers(expression, dimension)
        if plain is not None and len(plain) == (3 if is_vector else 1):
            return plain
        value = self.evaluate(expression, scope)
        if value is None:
            return None
        if value.is_vector != is_vector:
            wanted, found = "a single value", "a vector"
            example = _example(dimension)
            if is_vector:
                wanted, found = found, wanted
                example = f"(0, -25, 0) {USUAL_UNIT.get(dimension, '')}".rstrip()
            self._report(
                "vector-misused",
                expression.span,
                f"{role} is {wanted}, but this is {found}",
                hint=f"write for example `{example}`",
            )
            return None
        return value.numbers if self._has(value, dimension, expression, role) else None

    def whole(self, expression: tree.Expression, scope: Scope, role: str) -> Placed[int]:
        """A whole number; arguments and result as in `number`."""
        value = self.number(expression, scope, NUMBER, role).value
        rounded = None if value is None else round(value)
        # The result of a division may differ from a whole number by rounding.
        if value is not None and abs(value - round(value)) > 1e-9 * max(1.0, abs(value)):
            self._report(
                "not-whole",
                expression.span,
                f"{role} must be a whole number, but this is {value:g}",
                hint=f"write {rounded}" if isinstance(expression, tree.Number) else None,
            )
            rounded = None
        return Placed(rounded, expression.span)

    def list_of(
        self, expressions: Sequence[tree.Expression], scope: Scope, dimension: Dimension, role: str
    ) -> list[Placed[float]]:
        """Numbers of a dimension; one without a unit takes that of the last: ``90, 180 deg``."""
        last = expressions[-1]
        unit = last.unit if isinstance(last, tree.Measured) else None
        values: list[Placed[float]] = []
        for expression in expressions:
            written = self.evaluate(expression, scope)
            if unit is not None and written is not None and written.dimension == NUMBER:
                expression = tree.Measured(expression.span, expression, unit)
            values.append(self.number(expression, scope, dimension, role))
        return values

    def _has(
        self, value: Quantity, dimension: Dimension, expression: tree.Expression, role: str
    ) -> bool:
        """Whether a value has the dimension that its place needs; if not, reports it."""
        if value.dimension == dimension:
            return True
        if value.dimension == NUMBER:
            unit = USUAL_UNIT[dimension]
            self._report(
                "missing-unit",
                expression.span,
                f"{role} needs a unit: it is {dimension}",
                hint=f"write `{_shortened(expression.span.text)} {unit}`",
            )
        else:
            hint = f"write for example `{_example(dimension)}`"
            if dimension == NUMBER:
                hint = "leave the unit out"
            elif value.dimension == NUMBER / dimension:
                hint = "a unit belongs to the value right before it: write `(…) unit`"
            self._report(
                "wrong-dimension",
                expression.span,
                f"{role} is {dimension}, but this is {value.dimension}",
                hint=hint,
            )
        return False

    # -------------------------------------------------------------------------------- expressions

    def evaluate(self, expression: tree.Expression, scope: Scope) -> Quantity | None:
        """The value of an expression, or None after a mistake."""
        value = self._evaluate(expression, scope)
        if value is not None and not value.is_finite:
            self._report("not-a-number", expression.span, "the result is too large for a number")
            return None
        return value

    def _evaluate(self, expression: tree.Expression, scope: Scope) -> Quantity | None:
        """The value of an expression, finite or not."""
        match expression:
            case tree.Number(value=number):
                digits = expression.span.text.lower().partition("e")[0]
                if number == 0.0 and digits.strip("0."):
                    return self._vanished(expression.span)
                return scalar(number)
            case tree.Name():
                return self._name(expression, scope)
            case tree.Call():
                return self._call(expression, scope)
            case tree.Vector():
                return self._vector(expression, scope)
            case tree.Measured():
                return self._measured(expression, scope)
            case tree.Signed(operand=operand, is_negative=is_negative):
                value = self.evaluate(operand, scope)
                if value is None or not is_negative:
                    return value
                # 0.0 - n instead of -n avoids a negative zero.
                return value.map(lambda n: 0.0 - n, value.dimension)
            case tree.Chain():
                return self._chain(expression, scope)

    def _name(self, expression: tree.Name, scope: Scope) -> Quantity | None:
        """The value of a name."""
        name = expression.text
        if name in CONSTANTS:
            return CONSTANTS[name]
        if name in scope:
            return scope[name].value
        hint = did_you_mean(name, [*scope, *CONSTANTS])
        if is_unit(name) or name in ALIASES:
            hint = f"write a unit after a number: `1 {ALIASES.get(name, name)}`"
        elif name in FUNCTIONS:
            hint = f"a function has its argument in parentheses: `{name}(…)`"
        self._report(
            "unknown-name",
            expression.span,
            f"`{name}` is not defined here",
            hint=hint or f"define it above: `let {name} = …`",
        )
        return None

    def _measured(self, expression: tree.Measured, scope: Scope) -> Quantity | None:
        """A value with its unit."""
        value = self.evaluate(expression.operand, scope)
        unit = self.unit(expression.unit)
        if value is None or unit is None:
            return None
        if value.dimension != NUMBER:
            self._report(
                "unit-repeated",
                expression.unit.span,
                f"this is {value.dimension} already and takes no unit",
                hint="remove the unit",
            )
            return None
        factor, dimension = unit
        result = value.map(lambda n: n * factor, dimension)
        return self._vanished(expression.span) if _vanishes(value, result) else result

    def _vanished(self, span: Span) -> Quantity | None:
        """Reports a result that is not 0, but too small for a floating-point number."""
        self._report("not-a-number", span, "the result is too small for a number")
        return None

    def unit(self, unit: tree.Identifier) -> tuple[float, Dimension] | None:
        """The factor of a unit to mm, rad or s, and its dimension; None after a mistake."""
        names = tuple(part.strip() for part in unit.text.split("/"))
        for name in names:
            if name not in UNITS:
                near = ALIASES.get(name.lower())
                known = ", ".join(UNITS)
                self._report(
                    "unknown-unit",
                    unit.span,
                    f"there is no unit `{name}`",
                    hint=(f"write `{near}`" if near else did_you_mean(name, UNITS))
                    or f"units are {known}, and speeds such as mm/s",
                )
                return None
        return quotient(names)

    def _vector(self, expression: tree.Vector, scope: Scope) -> Quantity | None:
        """Three components of one dimension."""
        values = [self.evaluate(component, scope) for component in expression.components]
        if len(values) != 3:
            self._report(
                "vector-size",
                expression.span,
                f"a vector has three components, but this has {len(values)}",
                hint="write for example `(0, -25, 0) mm`",
            )
            return None
        known = [value for value in values if value is not None]
        if len(known) < 3:
            return None
        for component, value in zip(expression.components, known, strict=True):
            if value.is_vector:
                self._report(
                    "vector-misused",
                    component.span,
                    "a component must be a single value, not a vector",
                )
                return None
            if value.dimension != known[0].dimension:
                self._report(
                    "dimensions-differ",
                    component.span,
                    f"the first component is {known[0].dimension}, but this is {value.dimension}",
                    hint="give each component its unit, or write one after the parentheses",
                )
                return None
        return Quantity(tuple(value.number for value in known), known[0].dimension)

    def _chain(self, chain: tree.Chain, scope: Scope) -> Quantity | None:
        """Operands from left to right."""
        result = self.evaluate(chain.first, scope)
        for operator, operand in chain.rest:
            right = self.evaluate(operand, scope)
            if result is None or right is None:
                result = None
                continue
            span = chain.span.source.span(chain.first.span.start, operand.span.end)
            if operator in "+-":
                result = self._add(result, right, 1.0 if operator == "+" else -1.0, span)
            else:
                result = self._scale(result, right, operator, operand.span, span)
        return result

    def _add(self, left: Quantity, right: Quantity, sign: float, span: Span) -> Quantity | None:
        """A sum or a difference."""
        verb = "added" if sign > 0 else "subtracted"
        if left.is_vector != right.is_vector:
            self._report("vector-misused", span, f"a vector and a single value cannot be {verb}")
            return None
        if left.dimension != right.dimension:
            self._report(
                "dimensions-differ",
                span,
                f"{left.dimension} and {right.dimension} cannot be {verb}",
                hint=_unit_hint(left.dimension, right.dimension),
            )
            return None
        numbers = zip(left.numbers, right.numbers, strict=True)
        return Quantity(tuple(a + sign * b for a, b in numbers), left.dimension)

    def _scale(
        self, left: Quantity, right: Quantity, operator: str, right_span: Span, span: Span
    ) -> Quantity | None:
        """A product or a quotient; one factor, or the dividend, may be a vector."""
        if right.is_vector and (operator == "/" or left.is_vector):
            what = "divided by a vector" if operator == "/" else "multiplied: both are vectors"
            self._report("vector-misused", right_span, f"these values cannot be {what}")
            return None
        if operator == "*":
            vector, factor = (right, left.number) if right.is_vector else (left, right.number)
            product = vector.map(lambda n: n * factor, left.dimension * right.dimension)
            vanishes = factor != 0.0 and _vanishes(vector, product)
            return self._vanished(span) if vanishes else product
        divisor = right.number
        if divisor == 0.0:
            self._report("division-by-zero", right_span, "division by zero")
            return None
        quotient = left.map(lambda n: n / divisor, left.dimension / right.dimension)
        return self._vanished(span) if _vanishes(left, quotient) else quotient

    # ---------------------------------------------------------------------------------- functions

    def _call(self, call: tree.Call, scope: Scope) -> Quantity | None:
        """The value of a function."""
        values = [self.evaluate(argument, scope) for argument in call.arguments]
        name = call.function.text
        if name not in FUNCTIONS:
            known = ", ".join(FUNCTIONS)
            self._report(
                "unknown-function",
                call.function.span,
                f"there is no function `{name}`",
                hint=did_you_mean(name, FUNCTIONS) or f"functions are {known}",
            )
            return None
        is_count_right = len(values) >= 2 if name in ("min", "max") else len(values) == 1
        if not is_count_right:
            needed = "two or more arguments" if name in ("min", "max") else "one argument"
            self._report(
                "wrong-argument-count", call.span, f"`{name}` takes {needed}, not {len(values)}"
            )
            return None
        known_values = [value for value in values if value is not None]
        if len(known_values) < len(values):
            return None
        for argument, value in zip(call.arguments, known_values, strict=True):
            if value.is_vector:
                self._report("vector-misused", argument.span, f"`{name}` cannot take a vector")
                return None
        return self._apply(call, name, known_values)

    def _apply(self, call: tree.Call, name: str, values: list[Quantity]) -> Quantity | None:
        """A function of single values."""
        first = values[0]
        match name:
            case "sin" | "cos":
                if not self._has(first, ANGLE, call.arguments[0], f"the argument of `{name}`"):
                    return None
                return scalar(math.sin(first.number) if name == "sin" else math.cos(first.number))
            case "sqrt":
                return self._sqrt(call, first)
            case "abs":
                return scalar(abs(first.number), first.dimension)
            case _:
                return self._extreme(call, min if name == "min" else max, values)

    def _sqrt(self, call: tree.Call, value: Quantity) -> Quantity | None:
        """A square root."""
        dimension = value.dimension.root()
        if dimension is None:
            self._report(
                "wrong-dimension", call.arguments[0].span, f"{value.dimension} has no square root"
            )
            return None
        if value.number < 0:
            self._report(
                "not-a-number", call.arguments[0].span, "a negative value has no square root"
            )
            return None
        return scalar(math.sqrt(value.number), dimension)

    def _extreme(
        self, call: tree.Call, choose: Callable[..., float], values: list[Quantity]
    ) -> Quantity | None:
        """The least or the greatest of some values."""
        dimension = values[0].dimension
        for argument, value in zip(call.arguments, values, strict=True):
            if value.dimension != dimension:
                self._report(
                    "dimensions-differ",
                    argument.span,
                    f"{dimension} and {value.dimension} cannot be compared",
                    hint=_unit_hint(dimension, value.dimension),
                )
                return None
        return scalar(choose(value.number for value in values), dimension)


def _plain_numbers(expression: tree.Expression, dimension: Dimension) -> list[float] | None:
    """The values of literals with a unit of this dimension, without the general way.

    Most values of a large file are such: this takes a third of the time. None is anything else,
    also a mistake; and a value that is so large, small or long that it needs a closer look.
    """
    is_negative = False
    if isinstance(expression, tree.Signed):
        is_negative, expression = expression.is_negative, expression.operand
    if not isinstance(expression, tree.Measured):
        return None
    unit, operand = UNITS.get(expression.unit.text), expression.operand
    if unit is None or unit[1] != dimension:
        return None
    parts = operand.components if isinstance(operand, tree.Vector) else (operand,)
    values = []
    for part in parts:
        is_less = is_negative
        if isinstance(part, tree.Signed):
            is_less, part = is_less != part.is_negative, part.operand
        if not isinstance(part, tree.Number):
            return None
        value = part.value * unit[0]
        if not (_LEAST_PLAIN < value < _MOST_PLAIN or part.span.end - part.span.start == 1):
            return None
        # 0.0 - n instead of -n avoids a negative zero.
        values.append(0.0 - value if is_less else value)
    return values


_LEAST_PLAIN, _MOST_PLAIN = 1e-100, 1e100


def _vanishes(before: Quantity, after: Quantity) -> bool:
    """Whether a product is 0 although neither factor is 0."""
    pairs = zip(before.numbers, after.numbers, strict=True)
    return any(old != 0.0 and new == 0.0 for old, new in pairs)


def _example(dimension: Dimension) -> str:
    """An example of a value of a dimension."""
    return f"2 {USUAL_UNIT[dimension]}" if dimension in USUAL_UNIT else "2"


def _unit_hint(left: Dimension, right: Dimension) -> str | None:
    """A hint for two dimensions that differ because a unit is missing."""
    for one, other in ((left, right), (right, left)):
        if one == NUMBER and other in USUAL_UNIT:
            return f"give the plain number a unit, for example `{USUAL_UNIT[other]}`"
    return None


def _shortened(text: str) -> str:
    """The text of an expression, if it is short enough for a hint."""
    return text if len(text) <= 30 and "\n" not in text else "…"
