"""Resolves what a file says about the driver: settings, a device with its axes, a tracker."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from ntagen.nsl import tree
from ntagen.nsl.diagnostics import Reporter, SourceError, did_you_mean
from ntagen.nsl.draft import Draft, DraftDevice, Placed
from ntagen.nsl.evaluate import CONSTANTS, Evaluator, Scope
from ntagen.nsl.parser import parse
from ntagen.nsl.quantity import NUMBER, STEPS_PER_ANGLE, STEPS_PER_LENGTH, Dimension, quotient
from ntagen.nsl.source import Source
from ntagen.parameters import BY_WORDS, MEASURES, Given, Kind, Parameter, Value
from ntagen.units import RAD_PER

_DIMENSIONS: Final[dict[Kind, Dimension]] = {
    kind: quotient(tuple(measure.unit.split("/")))[1] if measure.unit else NUMBER
    for kind, measure in MEASURES.items()
    if measure.units and kind != "count"
}

CHOICES: Final = {
    "tissue": ("static", "adversarial", "stochastic"),
    "safety": ("sampled", "swept"),
    "device": ("grbl",),
    "tracker": ("openigtlink",),
}
"""The words that each property allows, the default first."""


def is_choice(word: tree.Identifier, keyword: str, reporter: Reporter) -> bool:
    """Whether a word is one of those that a property allows; if not, reports it."""
    message = f"there is no {keyword} `{word.text}`"
    return reporter.chooses(word.text, word.span, CHOICES[keyword], message)


def read_settings(texts: Sequence[str], origin: str) -> tuple[Given, ...]:
    """The settings in texts that could each stand in the braces of ``drive { … }``.

    Other than in a file, a plain number is in the usual unit of its setting.

    Args:
        texts: The texts; no setting may be in them twice. A message counts them as lines.
        origin: Where the texts come from.

    Raises:
        SourceError: The texts have mistakes; the error has all of them.
    """
    reporter = Reporter()
    resolver = DriverResolver(reporter, Evaluator(reporter), takes_plain_numbers=True)
    firsts: dict[str, tree.Parameter] = {}
    given: list[Given] = []
    file = parse(Source(origin, "\n".join(texts)), reporter, "drive")
    for statement in file.statements:
        if not isinstance(statement, tree.Parameter):
            continue
        first = firsts.setdefault(statement.keyword, statement)
        if first is not statement:
            note = f"the first is `{first.span.text}`"
            reporter.repeated(statement.span, statement.keyword, note)
        given += resolver.parameter(statement, Scope())
    if reporter.has_errors:
        raise SourceError(reporter.diagnostics)
    return tuple(Given(one.parameter, one.value, origin) for one in given)


class DriverResolver:
    """Resolves the statements about the driver; mistakes go to the reporter.

    Args:
        reporter: Collects the mistakes.
        evaluator: Evaluates the values.
        takes_plain_numbers: Whether a plain number is in the usual unit of its setting.
    """

    def __init__(
        self, reporter: Reporter, evaluator: Evaluator, *, takes_plain_numbers: bool = False
    ) -> None:
        self._reporter = reporter
        self._evaluator = evaluator
        self._takes_plain_numbers = takes_plain_numbers

    def add_parameter(self, statement: tree.Parameter, scope: Scope, draft: Draft) -> None:
        """Adds a setting of the driver."""
        draft.given += self.parameter(statement, scope)

    def parameter(self, statement: tree.Parameter, scope: Scope) -> list[Given]:
        """A setting of the driver; none after a mistake."""
        parameter = BY_WORDS[statement.keyword]
        if parameter.kind != "words" and len(statement.values) > 1:
            self._reporter.report(
                "unexpected-word",
                statement.values[1].span,
                f"`{parameter.words}` has one value",
                hint=f"write for example `{parameter.example}`",
            )
            return []
        value = None
        if not self._is_word(parameter, statement, scope):
            value = self._value(parameter, statement, scope)
        if value is None:
            return []
        span = statement.values[0].span
        if not self._reporter.obeys(parameter.breach(value), span):
            return []
        return [Given(parameter, value, span.place)]

    def _is_word(self, parameter: Parameter, statement: tree.Parameter, scope: Scope) -> bool:
        """Whether a word that means nothing stands in place of a quantity; if so, reports it.

        It may be a misspelt part of a longer setting: `force` is one, and so is `force sensing`.
        """
        value = statement.values[0]
        name = value.operand if isinstance(value, tree.Measured) else value
        if not parameter.is_quantity or not isinstance(name, tree.Name):
            return False
        longer = [words for words in BY_WORDS if words.startswith(f"{parameter.words} ")]
        hint = did_you_mean(f"{parameter.words} {name.text}", longer)
        if hint is None and self._takes_plain_numbers:
            hint = f"write for example `{parameter.example}`"
        if hint is None or name.text in CONSTANTS or name.text in scope:
            return False
        message = f"`{name.text}` is no value of `{parameter.words}`"
        self._reporter.report("unknown-name", name.span, message, hint=hint)
        return True

    def _value(self, parameter: Parameter, statement: tree.Parameter, scope: Scope) -> Value | None:
        """The value of a setting; None after a mistake."""
        first, role = statement.values[0], f"`{parameter.words}`"
        if self._takes_plain_numbers:
            first = _measured(first, MEASURES[parameter.kind].unit)
        if parameter.kind == "count":
            return self._evaluator.whole(first, scope, role).value
        if parameter.kind in _DIMENSIONS:
            return self._evaluator.number(first, scope, _DIMENSIONS[parameter.kind], role).value
        words = [self._word(expression, parameter) for expression in statement.values]
        if any(word is None for word in words):
            return None
        if parameter.kind == "switch":
            return words[0] == "on"
        return tuple(word for word in words if word is not None)

    def _word(self, expression: tree.Expression, parameter: Parameter) -> str | None:
        """A word that a setting allows; None after a mistake."""
        text = expression.text if isinstance(expression, tree.Name) else expression.span.text
        message = f"`{parameter.words}` cannot be `{text}`"
        is_known = self._reporter.chooses(text, expression.span, parameter.choices, message)
        return text if is_known else None

    def device(self, statement: tree.Device, draft: Draft) -> bool:
        """A device without its axes; returns whether there is such a device."""
        is_known = is_choice(statement.kind, "device", self._reporter)
        if is_known:
            port = Placed(statement.port.text, statement.port.span)
            draft.devices["device"] = DraftDevice(statement.kind.text, port)
        return is_known

    def axis(self, statement: tree.Axis, scope: Scope, draft: Draft) -> None:
        """An axis of the device."""
        dimension = STEPS_PER_LENGTH if statement.keyword == "insert" else STEPS_PER_ANGLE
        role = f"the steps of `{statement.keyword}`"
        steps = self._evaluator.number(statement.steps, scope, dimension, role)
        if steps.value is not None and statement.keyword == "roll":
            # Dimensions are computed per rad; controllers and people count per degree.
            steps = Placed(steps.value * RAD_PER["deg"], steps.span)
        letter = Placed(statement.letter.text, statement.letter.span)
        device = draft.devices.get("device")
        # Without one, the statement before the braces has a mistake, which was reported.
        if device is not None:
            device.axes[statement.keyword] = (letter, steps)

    def tracker(self, statement: tree.Tracker, _: Scope, draft: Draft) -> None:
        """A tracker."""
        if is_choice(statement.kind, "tracker", self._reporter):
            address = Placed(statement.address.text, statement.address.span)
            name = "" if statement.name is None else statement.name.text
            draft.devices["tracker"] = DraftDevice(statement.kind.text, address, name)


def _measured(expression: tree.Expression, unit: str) -> tree.Expression:
    """An expression with a unit, if it is a plain number and the unit is not empty."""
    number = expression.operand if isinstance(expression, tree.Signed) else expression
    if not unit or not isinstance(number, tree.Number):
        return expression
    return tree.Measured(expression.span, expression, tree.Identifier(expression.span, unit))
