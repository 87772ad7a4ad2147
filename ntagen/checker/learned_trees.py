"""The trees of a learned strategy, and what they decide.

For each combination of exact values there is a tree for each action, whose leaves say what the
action is worth. Here the trees of all actions become one, whose leaves say which action is the
best. It has no cut on both sides of which the same is decided, but for some that are deep.

A value at a cut is one of the low side. Boxes are half-open like that, so none is empty.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

from ntagen.errors import InputError

Tree = float | dict[str, Any]
"""What an action is worth: a number, or a cut as the file has it (``var``, ``bound``, ``low`` and
``high``)."""

Range = tuple[float, float]
"""What is greater than the first number, and at most the second one."""

WHOLE: Final = (-math.inf, math.inf)

WAIT: Final = "WAIT"
"""The text of the action to wait."""

_LEVELS: Final = 20
"""Trees of so many levels are compared, to leave out cuts that make no difference."""

MOST_CELLS: Final = 100_000
"""So many cells are looked at, and no more."""


@dataclass(frozen=True, slots=True)
class Best:
    """Where one action is the best.

    Attributes:
        action: Its number.
        least: What it is worth at least.
        greatest: What it is worth at most.
    """

    action: int
    least: float
    greatest: float


@dataclass(frozen=True, slots=True)
class Cut:
    """Where the decision depends on a value.

    Attributes:
        feature: The place of the feature among those in intervals.
        bound: Up to which value `low` decides.
        low: What is decided there.
        high: What is decided beyond.
    """

    feature: int
    bound: float
    low: Decided
    high: Decided


Decided = Best | Cut
"""What is decided where the exact values are known."""


@dataclass(frozen=True, slots=True)
class Seen:
    """What is known where the exact values are these.

    Attributes:
        values: The exact values, in the order of the features.
        trees: By the numbers of the actions that were tried, ascending.
    """

    values: tuple[float, ...]
    trees: Mapping[int, Tree]


class Trees:
    """All trees of a learned strategy.

    Attributes:
        discrete: What is seen exactly.
        continuous: What is seen in intervals.
        actions: The texts of the actions that were tried, by their numbers.
        locations: By expressions such as ``P.location``, the names of locations by their numbers.
        states: What is known, by exact values, in the order of the file.
    """

    def __init__(self, text: str, *, maximises: bool) -> None:
        file = json.loads(text)
        self.maximises = maximises
        self.discrete: tuple[str, ...] = tuple(file["statevars"])
        self.continuous: tuple[str, ...] = tuple(file["pointvars"])
        self.actions = {int(number): one for number, one in file["actions"].items()}
        self.locations = {
            name: {int(number): place for number, place in given.items()}
            for name, given in file["locationnames"].items()
        }
        self.states = tuple(
            Seen(self._values(key), {int(at): tree for at, tree in one["regressor"].items()})
            for key, one in file["regressors"].items()
        )

    def _values(self, key: str) -> tuple[float, ...]:
        # Without exact values, the key is (1).
        return tuple(map(float, key.strip("()").split(","))) if self.discrete else ()

    @property
    def features(self) -> tuple[str, ...]:
        """All features."""
        return self.discrete + self.continuous

    @cached_property
    def labels(self) -> dict[int, str]:
        """The actions in few words: the labels of an edge only where another one goes there too."""
        ways = {number: one.partition(" {")[0] for number, one in self.actions.items()}
        several = {way for way in ways.values() if list(ways.values()).count(way) > 1}
        labels = {}
        for number, way in ways.items():
            label = "wait" if way == WAIT else way.replace("->", " -> ")
            if way in several:
                rest = self.actions[number].removeprefix(way).strip(" {}")
                label += f" {{ {rest.removeprefix('1, ').removeprefix('tau, ')} }}"
            labels[number] = label
        return labels

    def value_text(self, feature: str, value: float) -> str:
        """A feature with its value, as people write it: ``P.Open`` or ``n=2``."""
        place = self.locations.get(feature, {}).get(int(value))
        if place is not None:
            return f"{feature.removesuffix('.location')}.{place}"
        return f"{feature}={number_text(value)}"

    def decided(self, state: Seen, box: Sequence[Range]) -> Decided:
        """What is decided in a box, which has a range for each feature that is seen in intervals.

        Raises:
            InputError: There are too many cells.
        """
        nodes: list[Best | tuple[int, float, int]] = []
        pending: list[tuple[Mapping[int, Tree], tuple[Range, ...]]] = [(state.trees, tuple(box))]
        # The list grows meanwhile: the parts of a node stand behind it.
        for trees, ranges in pending:
            left = {number: within(tree, ranges) for number, tree in trees.items()}
            cut = next((tree for tree in left.values() if isinstance(tree, dict)), None)
            if cut is None:
                nodes.append(self._best({at: float(one) for at, one in left.items()}))  # type: ignore[arg-type]
                continue
            nodes.append((cut["var"], cut["bound"], len(pending)))
            pending += [(left, one) for one in halves(ranges, cut["var"], cut["bound"])]
            if len(pending) > MOST_CELLS:
                raise InputError(f"the strategy has more than {MOST_CELLS:,} cells in one state")
        built: list[Decided] = []
        for node in reversed(nodes):
            if isinstance(node, Best):
                built.append(node)
            else:
                feature, bound, low = node
                # The last node was built first.
                parts = built[len(nodes) - 1 - low], built[len(nodes) - 2 - low]
                built.append(_joined(feature, bound, *parts))
        return built[-1]

    def _best(self, worth: Mapping[int, float]) -> Best:
        """The best action; of several best ones the first."""
        choose = max if self.maximises else min
        action = choose(worth, key=worth.__getitem__)
        return Best(action, worth[action], worth[action])


def _joined(feature: int, bound: float, low: Decided, high: Decided) -> Decided:
    """What is decided on both sides of a cut, without cuts that make no difference."""
    both = _merged(low, high, _LEVELS)
    if both is not None:
        return both
    if isinstance(high, Cut) and high.feature == feature:
        below = _merged(low, high.low, _LEVELS)
        if below is not None:
            return Cut(feature, high.bound, below, high.high)
    if isinstance(low, Cut) and low.feature == feature:
        above = _merged(low.high, high, _LEVELS)
        if above is not None:
            return Cut(feature, low.bound, low.low, above)
    return Cut(feature, bound, low, high)


def _merged(one: Decided, other: Decided, levels: int) -> Decided | None:
    """What both decide, if that is the same; `None` also if they have more levels than this."""
    if isinstance(one, Best) and isinstance(other, Best) and one.action == other.action:
        least, greatest = min(one.least, other.least), max(one.greatest, other.greatest)
        return Best(one.action, least, greatest)
    if levels == 0 or not isinstance(one, Cut) or not isinstance(other, Cut):
        return None
    if (one.feature, one.bound) != (other.feature, other.bound):
        return None
    low = _merged(one.low, other.low, levels - 1)
    high = None if low is None else _merged(one.high, other.high, levels - 1)
    return None if low is None or high is None else Cut(one.feature, one.bound, low, high)


def within(tree: Tree, box: Sequence[Range]) -> Tree:
    """The part of a tree that counts in a box."""
    while isinstance(tree, dict):
        above, most = box[tree["var"]]
        if most <= tree["bound"]:
            tree = tree["low"]
        elif above >= tree["bound"]:
            tree = tree["high"]
        else:
            return tree
    return tree


def halves(box: tuple[Range, ...], feature: int, bound: float) -> tuple[tuple[Range, ...], ...]:
    """The parts of a box on both sides of a cut."""
    above, most = box[feature]
    sides = ((above, bound), (bound, most))
    return tuple((*box[:feature], side, *box[feature + 1 :]) for side in sides)


def only(value: float) -> Range:
    """The range that has one value."""
    return math.nextafter(value, -math.inf), value


def boxes(decided: Decided, box: Sequence[Range]) -> Iterator[tuple[tuple[Range, ...], Best]]:
    """The boxes in which one action is the best."""
    pending = [(decided, tuple(box))]
    while pending:
        part, ranges = pending.pop()
        if isinstance(part, Best):
            yield ranges, part
        else:
            low, high = halves(ranges, part.feature, part.bound)
            pending += [(part.high, high), (part.low, low)]


def depth(decided: Decided) -> int:
    """How many cuts are at most on a way through a tree."""
    deepest, pending = 0, [(decided, 0)]
    while pending:
        part, level = pending.pop()
        deepest = max(deepest, level)
        if isinstance(part, Cut):
            pending += [(part.low, level + 1), (part.high, level + 1)]
    return deepest


def cuts(tree: Tree) -> Iterator[tuple[int, float]]:
    """All cuts of a tree: the feature, and the bound."""
    pending = [tree]
    while pending:
        part = pending.pop()
        if isinstance(part, dict):
            yield part["var"], part["bound"]
            pending += [part["high"], part["low"]]


def number_text(value: float) -> str:
    """A number in few digits."""
    return f"{value:.6g}"
