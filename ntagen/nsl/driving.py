"""Resolves what a file says about the driver: settings, a device with its axes, a tracker."""

from __future__ import annotations

from typing import Final

from ntagen.nsl import tree
from ntagen.nsl.diagnostics import Reporter, did_you_mean
from ntagen.nsl.draft import Draft, DraftDevice, Placed
from ntagen.nsl.evaluate import Evaluator, Scope
from ntagen.nsl.quantity import (
    ANGLE,
    DATA,
    FORCE,
    FORCE_PER_LENGTH,
    LENGTH,
    NUMBER,
    STEPS_PER_ANGLE,
    STEPS_PER_LENGTH,
    TIME,
    TURNING,
    Dimension,
)
from ntagen.parameters import BY_WORDS, Given, Kind, Parameter, Value
from ntagen.units import RAD_PER

_DIMENSIONS: Final[dict[Kind, Dimension]] = {
    "length": LENGTH,
    "angle": ANGLE,
    "time": TIME,
    "force": FORCE,
    "force per length": FORCE_PER_LENGTH,
    "angle per time": TURNING,
    "data": DATA,
    "ratio": NUMBER,
    "percentage": NUMBER,
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
    known = CHOICES[keyword]
    if word.text in known:
        return True
    reporter.report(
        "unknown-choice",
        word.span,
        f"there is no {keyword} `{word.text}`",
        hint=did_you_mean(word.text, known) or f"write {' or '.join(f'`{w}`' for w in known)}",
    )
    return False


class DriverResolver:
    """Resolves the statements about the driver; mistakes go to the reporter."""

    def __init__(self, reporter: Reporter, evaluator: Evaluator) -> None:
        self._reporter = reporter
        self._evaluator = evaluator

    def parameter(self, statement: tree.Parameter, scope: Scope, draft: Draft) -> None:
        """A setting of the driver."""
        parameter = BY_WORDS[statement.keyword]
        if parameter.kind != "words" and len(statement.values) > 1:
            self._reporter.report(
                "unexpected-word",
                statement.values[1].span,
                f"`{parameter.words}` has one value",
                hint=f"write for example `{parameter.example}`",
            )
            return
        value = self._value(parameter, statement, scope)
        if value is None:
            return
        breach = parameter.breach(value)
        span = statement.values[0].span
        if breach is not None:
            self._reporter.report(breach.rule, span, breach.message, hint=breach.hint)
        else:
            draft.given.append(Given(parameter, value, span.place))

    def _value(self, parameter: Parameter, statement: tree.Parameter, scope: Scope) -> Value | None:
        """The value of a setting; None after a mistake."""
        first, role = statement.values[0], f"`{parameter.words}`"
        if parameter.kind == "count":
            return self._evaluator.whole(first, scope, role)
        if parameter.kind in _DIMENSIONS:
            return self._evaluator.number(first, scope, _DIMENSIONS[parameter.kind], role)
        words = [self._word(expression, parameter) for expression in statement.values]
        if any(word is None for word in words):
            return None
        if parameter.kind == "switch":
            return words[0] == "on"
        return tuple(word for word in words if word is not None)

    def _word(self, expression: tree.Expression, parameter: Parameter) -> str | None:
        """A word that a setting allows; None after a mistake."""
        text = expression.text if isinstance(expression, tree.Name) else expression.span.text
        if text in parameter.choices:
            return text
        self._reporter.report(
            "unknown-choice",
            expression.span,
            f"`{parameter.words}` cannot be `{text}`",
            hint=did_you_mean(text, parameter.choices)
            or f"write {' or '.join(f'`{word}`' for word in parameter.choices)}",
        )
        return None

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
        if steps is not None and statement.keyword == "roll":
            # Dimensions are computed per rad; controllers and people count per degree.
            steps *= RAD_PER["deg"]
        letter = Placed(statement.letter.text, statement.letter.span)
        device = draft.devices.get("device")
        # Without one, the statement before the braces has a mistake, which was reported.
        if device is not None:
            device.axes[statement.keyword] = (letter, Placed(steps, statement.steps.span))

    def tracker(self, statement: tree.Tracker, draft: Draft) -> None:
        """A tracker."""
        if is_choice(statement.kind, "tracker", self._reporter):
            address = Placed(statement.address.text, statement.address.span)
            name = "" if statement.name is None else statement.name.text
            draft.devices["tracker"] = DraftDevice(statement.kind.text, address, name)
