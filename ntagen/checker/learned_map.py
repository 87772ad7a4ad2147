"""What a learned strategy decides, as a map over two features, as curves over one, or as a tree.

The map has the cells of the strategy: rectangles whose sides are its cuts, and no samples.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import Final

from ntagen.checker.learned_trees import (
    WHOLE,
    Best,
    Decided,
    Range,
    Seen,
    Tree,
    Trees,
    boxes,
    cuts,
    depth,
    halves,
    number_text,
    only,
    within,
)
from ntagen.checker.picture.page import Svg, colors_of
from ntagen.checker.picture.patches import Axis, Curve, Panel, Patch, Text
from ntagen.errors import InputError

At = Mapping[str, float | str]
"""Values of features; that of a location is its name, or its number."""

MOST_PANELS: Final = 12
"""A picture has at most so many states."""

_MOST_DEPTH: Final = 200
"""A tree that is drawn has at most so many levels."""

_ROOM: Final = 0.15
"""The part of an axis beyond the greatest cut."""

_MOST_PLACES: Final = 200
"""An axis shows all integers between the least and the greatest one, if they are not more."""

_NAMED: Final = 10
"""A message names so many values."""


def decisions_chart(trees: Trees, query: str, axes: Sequence[str], at: At) -> Svg:
    """See `ntagen.checker.learned.LearnedStrategy.decisions`."""
    from ntagen.checker.picture.decisions import curves_picture, map_picture

    view = _View(trees, at)
    chosen = [view.axis(name) for name in view.chosen(axes)]
    names = {axis.feature for axis in chosen}
    groups = view.groups(names)
    if len(groups) > MOST_PANELS:
        raise InputError(
            f"there are {len(groups)} states to draw, and a picture has at most {MOST_PANELS}\n"
            f"hint: give features a value{view.example(groups, names)}{view.seen()}"
        )
    said = view.same(groups) if len(groups) > 1 else set()
    panels = [view.panel(group, chosen, said) for group in groups]
    notes = ["where the best move is not possible, the best of those that are possible is taken"]
    if len(groups) < len(view.groups(names, with_idle=True)):
        notes.append("states in which there is nothing to choose are left out")
    if shared := view.title(groups[0][0], names | set(trees.features) - said):
        notes.append(f"in all of them: {shared}")
    heading = f"Decisions of {query}"
    text, colors = Text(heading, tuple(notes)), colors_of(trees.labels.values())
    if len(chosen) == 1:
        return curves_picture(panels, chosen[0], colors, text)
    return map_picture(panels, (chosen[0], chosen[1]), colors, text)


def tree_chart(trees: Trees, query: str, at: At, limit: int) -> Svg:
    """See `ntagen.checker.learned.LearnedStrategy.tree`."""
    from ntagen.checker.picture.tree import Leaf, Question, tree_picture

    view = _View(trees, at)
    states = [group[0] for group in view.groups(set())]
    decided = [view.decided(state) for state in states]
    count = sum(sum(1 for _ in boxes(one, view.box)) for one in decided)
    if count > limit:
        whose = "tree has" if len(states) == 1 else f"trees of {len(states)} states have"
        raise InputError(
            f"the {whose} {count:,} leaves, and a picture has at most {limit}\n"
            f"hint: draw more leaves (--set 'limit {count}'), or give features a value"
            f"{view.example([[one] for one in states], set())}{view.seen()}"
        )
    if max(map(depth, decided)) > _MOST_DEPTH:
        raise InputError(
            f"a tree has more than {_MOST_DEPTH} levels, and cannot be drawn\n"
            f"hint: draw a map (--as decisions), or give features a value (--at){view.seen()}"
        )

    def node(part: Decided) -> Leaf | Question:
        if isinstance(part, Best):
            return Leaf(trees.labels[part.action], _worth(part))
        feature = trees.continuous[part.feature]
        text = f"{feature} <= {number_text(part.bound)}"
        return Question(text, f"{feature} <= {part.bound!r}", node(part.low), node(part.high))

    drawn = [
        (view.title(state, set()), node(one)) for state, one in zip(states, decided, strict=True)
    ]
    return tree_picture(drawn, f"Decisions of {query}", colors_of(trees.labels.values()))


def _worth(best: Best) -> str:
    """What is written of the values of a leaf."""
    ends = dict.fromkeys(map(number_text, (best.least, best.greatest)))
    return " to ".join(ends)


class _View:
    """The part of a strategy that is drawn: the states that fit what is given."""

    def __init__(self, trees: Trees, at: At) -> None:
        self.trees = trees
        given = {_feature(trees, name): name for name in at}
        self.given = {one: _value(trees, one, at[name]) for one, name in given.items()}
        self.box = tuple(
            only(self.given[one]) if one in self.given else WHOLE for one in trees.continuous
        )
        exact = [(n, self.given[one]) for n, one in enumerate(trees.discrete) if one in self.given]
        self.states = [
            one for one in trees.states if all(one.values[n] == value for n, value in exact)
        ]
        if not self.states:
            said = " ".join(trees.value_text(trees.discrete[n], value) for n, value in exact)
            raise InputError(
                f"{said or 'no state'} has {'never ' if said else ''}been seen\n"
                f"hint: choose other values{self.seen() or ', or learn longer'}"
            )
        self._decided: dict[tuple[float, ...], Decided] = {}

    def decided(self, state: Seen) -> Decided:
        """What is decided in a state, where it is as given."""
        if state.values not in self._decided:
            self._decided[state.values] = self.trees.decided(state, self.box)
        return self._decided[state.values]

    def example(self, groups: Sequence[Sequence[Seen]], axes: set[str]) -> str:
        """How the panel in which most is told apart is chosen."""

        def parts(group: Sequence[Seen]) -> int:
            return sum(sum(1 for _ in boxes(self.decided(one), self.box)) for one in group)

        return f", for example --at '{self.title(max(groups, key=parts)[0], axes)}'"

    def seen(self) -> str:
        """The end of a hint: which exact values have been seen."""
        trees = self.trees
        lines = []
        for place, feature in enumerate(trees.discrete):
            values = sorted({one.values[place] for one in trees.states})
            texts = [trees.value_text(feature, value) for value in values[:_NAMED]]
            more = f" and {len(values) - _NAMED} more" if len(values) > _NAMED else ""
            lines.append(f"  {', '.join(texts)}{more}")
        return "; seen are, though not all together:\n" + "\n".join(lines) if lines else ""

    def chosen(self, axes: Sequence[str]) -> list[str]:
        """The features of the axes; by default those on which decisions depend.

        Raises:
            InputError: They cannot be axes, or no feature can.
        """
        trees = self.trees
        if axes:
            names = [_feature(trees, one) for one in axes]
            if len(names) > 2:
                raise InputError(
                    f"{len(names)} features are given, and a picture has two axes\n"
                    "hint: choose two of them, and give the others a value (--at)"
                )
            if len(set(names)) < len(names):
                raise InputError(f"both axes are {names[0]}\nhint: choose two features, or one")
            if both := [one for one in names if one in self.given]:
                raise InputError(
                    f"{both[0]} has a value and is an axis\nhint: take it out of one of them"
                )
            return names
        used = {feature for state in self.states for feature in self._used(state)}
        free = [one for one in trees.features if one not in self.given]
        in_intervals = [one for one in free if one in trees.continuous]
        exact = [one for one in free if one in trees.discrete and len(self._values(one)) > 1]
        numbers = [one for one in exact if one not in trees.locations]
        order = [one for one in in_intervals if one in used] + numbers
        found = (order or in_intervals or exact)[:2]
        if not found:
            raise InputError(
                "there is no feature with several values, so there is nothing to draw over\n"
                "hint: draw the tree of the state (--as tree)"
            )
        return found if order else found[:1]

    def _used(self, state: Seen) -> Iterator[str]:
        """The features on which the decision of a state depends."""
        pending = [self.decided(state)]
        while pending:
            part = pending.pop()
            if not isinstance(part, Best):
                yield self.trees.continuous[part.feature]
                pending += [part.low, part.high]

    def _values(self, feature: str) -> list[float]:
        place = self.trees.discrete.index(feature)
        return sorted({one.values[place] for one in self.states})

    def axis(self, feature: str) -> Axis:
        """The axis of a feature: of one in intervals, all its cuts and a little more."""
        trees = self.trees
        if feature in trees.discrete:
            values = self._values(feature)
            first, last = values[0], values[-1]
            are_whole = all(one.is_integer() for one in values)
            if feature not in trees.locations and are_whole and last - first < _MOST_PLACES:
                values = [first + step for step in range(int(last - first) + 1)]
            names = [trees.value_text(feature, one).removeprefix(f"{feature}=") for one in values]
            return Axis(feature, (-0.5, len(values) - 0.5), tuple(names), tuple(values))
        place = trees.continuous.index(feature)
        roots = [tree for state in self.states for tree in state.trees.values()]
        bounds = [bound for root in roots for at, bound in cuts(root) if at == place] or [0.0, 1.0]
        least, most = min(bounds), max(bounds)
        room = _ROOM * ((most - min(least, 0.0)) or 1.0)
        start = 0.0 if least >= 0.0 else least - room
        return Axis(feature, (start, most + room))

    def groups(self, axes: set[str], *, with_idle: bool = False) -> list[list[Seen]]:
        """The states of each panel; those without a choice only if no other one has any.

        Raises:
            InputError: There are too many panels.
        """
        kept = [n for n, one in enumerate(self.trees.discrete) if one not in axes]

        def key(state: Seen) -> tuple[float, ...]:
            return tuple(state.values[n] for n in kept)

        found = [list(group) for _, group in groupby(sorted(self.states, key=key), key)]
        choosing = [one for one in found if any(len(state.trees) > 1 for state in one)]
        return found if with_idle else choosing or found

    def same(self, groups: Sequence[Sequence[Seen]]) -> set[str]:
        """The features that have one value in all panels."""
        first = groups[0][0].values
        states = [one for group in groups for one in group]
        exact = enumerate(self.trees.discrete)
        found = {one for n, one in exact if all(state.values[n] == first[n] for state in states)}
        return found | set(self.given)

    def panel(self, states: Sequence[Seen], axes: Sequence[Axis], said: set[str]) -> Panel:
        """What is drawn of states that differ only in the features of the axes.

        Args:
            states: The states.
            axes: The axes.
            said: Features that the title leaves out.
        """
        names = {axis.feature for axis in axes} | said
        patches = [one for state in states for one in self._patches(state, axes)]
        curves = self._curves(states, axes[0]) if len(axes) == 1 else []
        return Panel(self.title(states[0], names), tuple(patches), tuple(curves))

    def title(self, state: Seen, axes: set[str]) -> str:
        """What is the same in all of a panel."""
        trees = self.trees
        known = dict(zip(trees.discrete, state.values, strict=True)) | self.given
        texts = [trees.value_text(one, value) for one, value in known.items() if one not in axes]
        return " ".join(texts)

    def _patches(self, state: Seen, axes: Sequence[Axis]) -> Iterator[Patch]:
        trees = self.trees
        for box, best in boxes(self.decided(state), self.box):
            self._require_drawn(box, axes)
            ranges = [self._range(axis, state, box) for axis in axes]
            said = [self._said(axis, state, box) for axis in axes]
            note = f"{', '.join(filter(None, said))}: {trees.actions[best.action]}, {_worth(best)}"
            yield Patch(tuple(ranges), trees.labels[best.action], note.removeprefix(": "))

    def _require_drawn(self, box: Sequence[Range], axes: Sequence[Axis]) -> None:
        """Raises an error if a box ends at a value of a feature that is neither drawn nor given."""
        drawn = {axis.feature for axis in axes} | set(self.given)
        for feature, ends in zip(self.trees.continuous, box, strict=True):
            if feature not in drawn and ends != WHOLE:
                bound = next(one for one in ends if math.isfinite(one))
                raise InputError(
                    f"what is drawn depends on {feature} too, for example at {number_text(bound)}\n"
                    f"hint: give it a value (--at '{feature}=…'), or draw over it (--set 'features "
                    f"…')"
                )

    def _range(self, axis: Axis, state: Seen, box: Sequence[Range]) -> Range:
        """Where a box lies on an axis."""
        if axis.values:
            place = axis.values.index(state.values[self.trees.discrete.index(axis.feature)])
            return place - 0.5, place + 0.5
        low, high = box[self.trees.continuous.index(axis.feature)]
        return max(low, axis.ends[0]), min(high, axis.ends[1])

    def _said(self, axis: Axis, state: Seen, box: Sequence[Range]) -> str:
        """The same in words."""
        if axis.values:
            value = state.values[self.trees.discrete.index(axis.feature)]
            return self.trees.value_text(axis.feature, value)
        low, high = box[self.trees.continuous.index(axis.feature)]
        ends = (f"{low!r} < " if math.isfinite(low) else "", axis.feature)
        return "".join(ends) + (f" <= {high!r}" if math.isfinite(high) else "")

    def _curves(self, states: Sequence[Seen], axis: Axis) -> list[Curve]:
        """What each action is worth over an axis."""
        steps: dict[int, list[tuple[Range, float]]] = {}
        for state in states:
            for action, tree in state.trees.items():
                for box, worth in self._leaves(tree):
                    self._require_drawn(box, [axis])
                    place = self._range(axis, state, box)
                    steps.setdefault(action, []).append((place, worth))
        return [
            Curve(self.trees.labels[action], tuple(sorted(steps[action])))
            for action in sorted(steps)
        ]

    def _leaves(self, tree: Tree) -> Iterator[tuple[tuple[Range, ...], float]]:
        """What an action is worth, with where it is."""
        pending = [(tree, self.box)]
        while pending:
            part, box = pending.pop()
            part = within(part, box)
            if isinstance(part, dict):
                low, high = halves(box, part["var"], part["bound"])
                pending += [(part["high"], high), (part["low"], low)]
            else:
                yield box, part


def _feature(trees: Trees, name: str) -> str:
    """The feature with this name; of a location, its process is enough.

    Raises:
        InputError: There is none.
    """
    squeezed = "".join(name.split())
    for one in trees.features:
        if squeezed in ("".join(one.split()), one.removesuffix(".location")):
            return one
    known = ", ".join(trees.features) or "nothing"
    raise InputError(f"the strategy does not see {name}\nhint: it sees {known}")


def _value(trees: Trees, feature: str, given: float | str) -> float:
    """The value that is given for a feature.

    Raises:
        InputError: It is none.
    """
    places = trees.locations.get(feature, {})
    for number, name in places.items():
        if name == given:
            return float(number)
    try:
        return float(given)
    except ValueError:
        pass
    if places:
        process = feature.removesuffix(".location")
        known = ", ".join(places.values())
        raise InputError(f"process {process} has no location {given}\nhint: it has {known}")
    raise InputError(f"{feature}={given} is no number\nhint: write for example {feature}=1")
