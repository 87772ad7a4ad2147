"""Makes the nodes of `ntagen.nsl.tree` while lark parses a statement.

lark calls the method that has the name of a rule of the grammar, or the name behind its arrow, with
all tokens and nodes of that rule. `_placed` makes of the first and the last of them the place of
the node, and passes on only those with a meaning: nodes, names, texts, numbers and operators.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

from lark import Transformer, v_args

from ntagen.nsl import tree
from ntagen.nsl.source import Span
from ntagen.nsl.tokens import Token

_Part = Any
"""A node or a word: the grammar says which, and lark has no types for rules."""

_WORDS: Final = frozenset({"NUMBER", "SIGN", "SCALE", "REGION_KIND", "PARAMETER", "AXIS"})
_NAMES: Final = frozenset({"NAME", "RATIO", "PERCENT", "TISSUE_PART", "STRING"})


class _Parenthesised(NamedTuple):
    """An expression in parentheses, which belong to the place of what is around, not to its own."""

    span: Span
    operand: tree.Expression


class _Clause(NamedTuple):
    """A part of a statement that is no node of its own: ``at most 2 times``."""

    span: Span
    keyword: str
    values: tuple[tree.Expression, ...]


def _parts(children: Sequence[Any]) -> list[Any]:
    """What a node consists of: nodes, names with their places, and other words."""
    parts: list[Any] = []
    for child in children:
        if not isinstance(child, Token):
            parts.append(child.operand if isinstance(child, _Parenthesised) else child)
        elif child.type in _WORDS:
            parts.append(child.text)
        elif child.type in _NAMES:
            text = child.text[1:-1] if child.type == "STRING" else child.text
            parts.append(tree.Identifier(child.span, text))
    return parts


def _placed(make: Callable[..., object], _rule: str, children: list[Any], _meta: object) -> object:
    """The node of a rule: it is made of its place and of what it consists of."""
    return make(children[0].span.to(children[-1].span), *_parts(children))


def _placed_word(
    make: Callable[..., object], _rule: str, children: list[Any], _meta: object
) -> object:
    """The node of a rule whose first word tells what it is."""
    span = children[0].span.to(children[-1].span)
    return make(span, children[0].text, *_parts(children[1:]))


_with_word = v_args(wrapper=_placed_word)


def _listed(make: Callable[..., object], single: int = 0) -> Callable[..., object]:
    """Makes a node whose last field is a tuple: of all parts after so many single ones."""
    return staticmethod(lambda span, *parts: make(span, *parts[:single], parts[single:]))


@v_args(wrapper=_placed)
class TreeBuilder(Transformer[Any, tree.Statement]):
    """Makes the node of each rule."""

    # -------------------------------------------------------------------------------- statements

    let = tree.Let
    include = tree.Include
    resolution = tree.Resolution
    axis = tree.Axis
    gate = tree.Gate
    environment = tree.Environment
    loop = tree.Loop
    device = tree.Device
    tracker = tree.Tracker
    wait = tree.Wait
    section = _with_word(tree.Section)
    setting = _with_word(tree.Setting)
    safety = _with_word(tree.Choice)
    spin = _listed(tree.Spin)
    parameter = _listed(tree.Parameter, 1)

    def tissue(self, span: Span, word: tree.Identifier, *bounds: _Part) -> tree.Tissue:
        """``tissue adversarial curvature 10 % roll 5 deg``."""
        pairs = zip(bounds[::2], bounds[1::2], strict=True)
        return tree.Tissue(span, word, tuple(tree.TissueBound(*pair) for pair in pairs))

    def imaging(
        self, span: Span, direction: tree.Identifier, space: tree.Identifier, *rows: _Part
    ) -> tree.Transform:
        """``transform from LPS "ct.tfm"``, or with rows in place of the file."""
        if isinstance(rows[0], tree.Identifier):
            return tree.Transform(span, direction, space, rows[0], ())
        return tree.Transform(span, direction, space, None, rows)

    def roll(self, span: Span, *parts: tree.Expression | _Clause) -> tree.Roll:
        """``roll by 90, 180 deg at most 2 times at least 2 mm apart``."""
        clauses = [part for part in parts if isinstance(part, _Clause)]
        angles = tuple(part for part in parts if not isinstance(part, _Clause))
        at_most = tuple(one.values[0] for one in clauses if one.keyword == "most")
        at_least = tuple(one.values[0] for one in clauses if one.keyword == "least")
        return tree.Roll(span, angles, at_most, at_least)

    def at_most(self, span: Span, value: tree.Expression) -> _Clause:
        """``at most 2 times``."""
        return _Clause(span, "most", (value,))

    def at_least(self, span: Span, value: tree.Expression) -> _Clause:
        """``at least 2 mm apart``."""
        return _Clause(span, "least", (value,))

    # ----------------------------------------------------------------------------------- regions

    region = tree.Region
    sphere = tree.Sphere
    around = tree.Around
    region_name = _listed(tree.RegionName, 1)

    @_with_word
    def image(self, span: Span, form: _Part, path: _Part, *clauses: _Part) -> tree.Image:
        """``mesh "ribs.stl" in LPS``."""
        return tree.Image(span, form, path, clauses)

    @_with_word
    def words(self, span: Span, keyword: _Part, *words: _Part) -> tree.Clause:
        """``in LPS``."""
        return tree.Clause(span, keyword, words)

    @_with_word
    def solid(self, span: Span, form: tree.SolidForm, *parts: _Part) -> tree.Solid:
        """``box (0, -20, 5) mm size (10, 4, 6) mm turned 30 deg about +z``."""
        if isinstance(parts[-1], _Clause):
            angle, axis = parts[-1].values
            return tree.Solid(span, form, parts[:-1], (angle, axis))
        return tree.Solid(span, form, parts)

    def turned(self, span: Span, angle: tree.Expression, axis: tree.Expression) -> _Clause:
        """``turned 30 deg about +z``."""
        return _Clause(span, "turned", (angle, axis))

    @_with_word
    def value(self, span: Span, keyword: _Part, value: tree.Expression) -> tree.Clause:
        """``grid 1 mm``."""
        return tree.Clause(span, keyword, (), value)

    def moves_along(
        self,
        span: Span,
        way: tree.Expression,
        towards: tree.Expression,
        period: tree.Expression,
        phase: tree.Expression | None = None,
    ) -> tree.Moves:
        """``moves 12 mm along +z every 4 s phase 90 deg``."""
        return tree.Moves(span, period, (way, towards), phase)

    def moves_through(self, span: Span, *values: tree.Expression) -> tree.Moves:
        """``moves through (0, 0, 0) mm after 0 s, (0, 0, 5) mm after 2 s every 4 s``."""
        *places, period = values
        pairs = zip(places[::2], places[1::2], strict=True)
        return tree.Moves(span, period, places=tuple(pairs))

    def moves_as(self, span: Span, path: tree.Identifier, period: tree.Expression) -> tree.Moves:
        """``moves as "breath.csv" every 4 s``."""
        return tree.Moves(span, period, path=path)

    # ------------------------------------------------------------------------------- expressions

    parenthesised = _Parenthesised
    measured = tree.Measured
    vector = _listed(tree.Vector)
    call = _listed(tree.Call, 1)

    def number(self, span: Span, text: str) -> tree.Number:
        """``1.5``."""
        return tree.Number(span, float(text))

    def name(self, span: Span, name: tree.Identifier) -> tree.Name:
        """``depth``."""
        return tree.Name(span, name.text)

    def signed(self, span: Span, *parts: _Part) -> tree.Signed:
        """``-x``."""
        *signs, operand = parts
        return tree.Signed(span, operand, signs.count("-") % 2 == 1)

    def chain(self, span: Span, first: tree.Expression, *rest: _Part) -> tree.Chain:
        """``a - b + c`` or ``a * b / c``."""
        return tree.Chain(span, first, tuple(zip(rest[::2], rest[1::2], strict=True)))
