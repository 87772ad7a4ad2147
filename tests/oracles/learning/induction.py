"""The best value of a small finite game, by backward induction in fractions.

A game is a table of actions, written by hand beside the model and not read from it. An action that
leads back to its own state is a loop of its own; there are no longer loops.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from fractions import Fraction

State = tuple[int, ...]


class Choice(Enum):
    """Who chooses among the actions."""

    LEAST = "least"
    GREATEST = "greatest"
    RANDOM = "random"


@dataclass(frozen=True)
class Leg:
    """One outcome of an action; `cost` is what it adds to the value."""

    chance: Fraction
    state: State
    cost: Fraction = Fraction(0)


@dataclass(frozen=True)
class Action:
    """What may be chosen.

    `edge` is the number of the controllable edge in the model's text, and none where the
    environment moves; `where` says which of its `select` values is meant.
    """

    legs: tuple[Leg, ...]
    edge: int | None = None
    where: str = ""


@dataclass(frozen=True)
class Game:
    """A finite game; a state without actions is an end.

    `conditions` say in the model's terms what each number of a state is, and are empty where the
    location says it.
    """

    start: State
    conditions: tuple[str, ...]
    actions: Callable[[State], list[Action]]
    worth: Callable[[State], Fraction] = lambda _: Fraction(0)

    def condition(self, state: State) -> str:
        """That the model is in this state."""
        pairs = zip(self.conditions, state, strict=True)
        return " && ".join(text.format(number) for text, number in pairs if text) or "true"


@dataclass
class Solution:
    """The value of each state that can be reached, and an action that has it."""

    game: Game
    choice: Choice
    values: dict[State, Fraction] = field(default_factory=dict)
    best: dict[State, Action] = field(default_factory=dict)

    @property
    def value(self) -> Fraction:
        """The value of the game."""
        return self.value_of(self.game.start)

    def value_of(self, state: State) -> Fraction:
        """The value from this state on."""
        if state not in self.values:
            self.values[state] = self._compute(state)
        return self.values[state]

    def _compute(self, state: State) -> Fraction:
        actions = self.game.actions(state)
        if not actions:
            return self.game.worth(state)
        if self.choice is Choice.RANDOM:
            share = Fraction(1, len(actions))
            legs = (leg for action in actions for leg in action.legs)
            mixed = [Leg(share * leg.chance, leg.state, leg.cost) for leg in legs]
            return self._value_of_legs(state, tuple(mixed))
        sign = 1 if self.choice is Choice.LEAST else -1
        values = [self._value_of_legs(state, action.legs) for action in actions]
        at = min(range(len(actions)), key=lambda k: sign * values[k])
        self.best[state] = actions[at]
        return values[at]

    def _value_of_legs(self, state: State, legs: tuple[Leg, ...]) -> Fraction:
        """Solves v = cost + back * v + rest, where `back` is the chance to stay."""
        assert sum(leg.chance for leg in legs) == 1
        back = sum((leg.chance for leg in legs if leg.state == state), Fraction(0))
        cost = sum((leg.chance * leg.cost for leg in legs), Fraction(0))
        others = (leg for leg in legs if leg.state != state)
        rest = sum((leg.chance * self.value_of(leg.state) for leg in others), Fraction(0))
        return (cost + rest) / (1 - back)

    def guards(self) -> dict[int, list[str]]:
        """For each controllable edge of the model, the states in which the best choice takes it."""
        self.value_of(self.game.start)
        when: dict[int, list[str]] = {}
        for state, action in self.best.items():
            if action.edge is not None:
                condition = self.game.condition(state)
                text = f"{condition} && {action.where}" if action.where else condition
                when.setdefault(action.edge, []).append(text)
        return when
