"""Regions of plain numbers on one line, read at once: files may have thousands of them.

The tree is the one that `ntagen.nsl.statements` makes, with the same places. What is not plain is
left to it: names in values, arithmetic, indices, block comments, lines that something unknown
follows, and every mistake.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator
from typing import Final, cast

from ntagen.nsl import tree
from ntagen.nsl.quantity import is_unit
from ntagen.nsl.source import Source, Span
from ntagen.nsl.statements import PlainRegion
from ntagen.nsl.tokens import REGIONS, RESERVED
from ntagen.scene import RegionKind
from ntagen.values import dataclass

_N: Final = r"([+-]?)[ \t]*(\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)"
_S: Final = r"[ \t]*"
_VALUE: Final = rf"{_N}{_S}([a-z]+)\b"
_VECTOR: Final = rf"(\(){_S}{_N}{_S},{_S}{_N}{_S},{_S}{_N}{_S}(\)){_S}([a-z]+)\b"
_SIDE: Final = r"([+-])([xyz])\b"
_TURNED: Final = rf"(?:[ \t]+turned[ \t]+{_VALUE}[ \t]+about[ \t]+{_SIDE})?"
_NAME: Final = r"([^\W\d]\w*)\b"
_NEXT: Final = rf"[ \t]*(?://[^\n]*)?\r?(?=\n\s*(?:\}}|\Z|(?:{'|'.join(sorted(REGIONS))})\b))"

_HEAD: Final = re.compile(
    rf"^[ \t]*({'|'.join(sorted(REGIONS))})[ \t]+{_NAME}[ \t]+"
    r"(sphere|around|box|capsule|cylinder|ellipsoid|halfspace)\b[ \t]*",
    re.MULTILINE,
)
_BODIES: Final = {
    "sphere": rf"{_VECTOR}[ \t]+radius[ \t]+{_VALUE}",
    "around": rf"{_NAME}[ \t]+margin[ \t]+{_VALUE}",
    "box": rf"{_VECTOR}[ \t]+size{_S}{_VECTOR}{_TURNED}",
    "capsule": (
        rf"{_VECTOR}[ \t]+to{_S}{_VECTOR}[ \t]+radius[ \t]+{_VALUE}(?:[ \t]+to[ \t]+{_VALUE})?"
    ),
    "cylinder": rf"{_VECTOR}[ \t]+to{_S}{_VECTOR}[ \t]+radius[ \t]+{_VALUE}",
    "ellipsoid": rf"{_VECTOR}[ \t]+radii{_S}{_VECTOR}{_TURNED}",
    "halfspace": rf"{_VECTOR}[ \t]+towards[ \t]+{_SIDE}",
}
_TAIL: Final = re.compile(_NEXT)
_VECTOR_GROUPS, _VALUE_GROUPS = 9, 3


@functools.cache
def _body(word: str) -> re.Pattern[str]:
    """The pattern of what follows the word of a shape; few files need all of them."""
    return re.compile(_BODIES[word])


def plain_regions(source: Source) -> Iterator[PlainRegion]:
    """The plain regions of a text, in their order."""
    text = source.text
    # In a block comment a region is none.
    if "/*" in text:
        return
    line, counted = 1, 0
    for head in _HEAD.finditer(text):
        body = _body(head[3]).match(text, head.end())
        if body is None or head[2] in RESERVED or _TAIL.match(text, body.end()) is None:
            continue
        shape = _Reader(source, body).shape(head[3], head.start(3))
        if shape is None:
            continue
        start = head.start(1)
        line += text.count("\n", counted, start)
        counted = start
        kind = cast(RegionKind, head[1])
        name = Span(source, head.start(2), head.end(2))
        node = tree.Region(
            Span(source, start, body.end()),
            kind,
            tree.RegionName(name, tree.Identifier(name, head[2]), ()),
            shape,
        )
        keyword = Span(source, start, head.end(1))
        yield PlainRegion("REGION_KIND", kind, keyword, line, start, body.end(), node)


@dataclass(frozen=True, slots=True)
class _Reader:
    """Makes the nodes of a shape from the groups of a match."""

    source: Source
    body: re.Match[str]

    def shape(self, word: str, start: int) -> tree.Sphere | tree.Solid | tree.Around | None:
        """The shape; None if a unit is none, which the usual way reports."""
        body = self.body
        span = Span(self.source, start, body.end())
        if word == "around":
            margin = self._value(2)
            name = Span(self.source, body.start(1), body.end(1))
            if margin is None or body[1] in RESERVED:
                return None
            region = tree.RegionName(name, tree.Identifier(name, body[1]), ())
            return tree.Around(span, region, margin)
        first = self._vector(1)
        if word == "sphere":
            radius = self._value(1 + _VECTOR_GROUPS)
            return None if first is None or radius is None else tree.Sphere(span, first, radius)
        form = cast(tree.SolidForm, word)
        if word == "halfspace":
            side = self._side(1 + _VECTOR_GROUPS)
            return None if first is None else tree.Solid(span, form, (first, side))
        measures: list[tree.Expression | None] = [first, self._vector(1 + _VECTOR_GROUPS)]
        turned: tuple[tree.Expression, tree.Expression] | None = None
        group = 1 + 2 * _VECTOR_GROUPS
        if word in ("box", "ellipsoid"):
            if body[group + 1] is not None:
                angle = self._value(group)
                if angle is None:
                    return None
                turned = (angle, self._side(group + _VALUE_GROUPS))
        else:
            measures.append(self._value(group))
            if word == "capsule" and body[group + _VALUE_GROUPS + 1] is not None:
                measures.append(self._value(group + _VALUE_GROUPS))
        known = tuple(one for one in measures if one is not None)
        return tree.Solid(span, form, known, turned) if len(known) == len(measures) else None

    def _number(self, group: int) -> tree.Expression:
        """A number with its sign."""
        body = self.body
        number = tree.Number(
            Span(self.source, body.start(group + 1), body.end(group + 1)), float(body[group + 1])
        )
        if not body[group]:
            return number
        return tree.Signed(
            Span(self.source, body.start(group), body.end(group + 1)), number, body[group] == "-"
        )

    def _value(self, group: int) -> tree.Expression | None:
        """A number with its unit."""
        body = self.body
        if not is_unit(body[group + 2]):
            return None
        unit = Span(self.source, body.start(group + 2), body.end(group + 2))
        # The unit belongs to the number, and the sign to both.
        digits = Span(self.source, body.start(group + 1), body.end(group + 1))
        measured = tree.Measured(
            Span(self.source, digits.start, unit.end),
            tree.Number(digits, float(body[group + 1])),
            tree.Identifier(unit, body[group + 2]),
        )
        if not body[group]:
            return measured
        whole = Span(self.source, body.start(group), unit.end)
        return tree.Signed(whole, measured, body[group] == "-")

    def _vector(self, group: int) -> tree.Expression | None:
        """Three numbers in parentheses with their unit."""
        body = self.body
        last = group + _VECTOR_GROUPS - 1
        if not is_unit(body[last]):
            return None
        start = body.start(group)
        numbers = tuple(self._number(group + 1 + 2 * i) for i in range(3))
        vector = tree.Vector(Span(self.source, start, body.end(last - 1)), numbers)
        unit = Span(self.source, body.start(last), body.end(last))
        whole = Span(self.source, start, unit.end)
        return tree.Measured(whole, vector, tree.Identifier(unit, body[last]))

    def _side(self, group: int) -> tree.Expression:
        """A direction along an axis."""
        body = self.body
        name = tree.Name(
            Span(self.source, body.start(group + 1), body.end(group + 1)), body[group + 1]
        )
        whole = Span(self.source, body.start(group), body.end(group + 1))
        return tree.Signed(whole, name, body[group] == "-")
