"""What pictures of decisions show: the patches of actions, and what the actions are worth."""

from __future__ import annotations

from dataclasses import dataclass

Range = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Axis:
    """A feature that is drawn.

    Attributes:
        feature: Its text.
        ends: What is drawn of it.
        names: Of a feature that is seen exactly, what is written at the places 0, 1 and so on.
        values: Its values at these places.
    """

    feature: str
    ends: Range
    names: tuple[str, ...] = ()
    values: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Patch:
    """Where one action is the best.

    Attributes:
        sides: What it takes of each axis.
        action: The action.
        note: What a tooltip says.
    """

    sides: tuple[Range, ...]
    action: str
    note: str


@dataclass(frozen=True, slots=True)
class Curve:
    """What an action is worth.

    Attributes:
        action: The action.
        steps: Its values, each with where it is so, in this order.
    """

    action: str
    steps: tuple[tuple[Range, float], ...]


@dataclass(frozen=True, slots=True)
class Panel:
    """What is drawn of a state.

    Attributes:
        title: The state.
        patches: What is decided; where there is none, nothing is known.
        curves: What each action is worth, if there is one axis.
    """

    title: str
    patches: tuple[Patch, ...]
    curves: tuple[Curve, ...] = ()


@dataclass(frozen=True, slots=True)
class Text:
    """What is written around a picture.

    Attributes:
        heading: The heading.
        notes: Lines below the legend.
    """

    heading: str
    notes: tuple[str, ...]
