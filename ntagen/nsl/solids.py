"""Shapes besides the sphere: their values with units, and the shapes that these make."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from ntagen import rules
from ntagen.nsl import tree
from ntagen.nsl.diagnostics import Reporter
from ntagen.nsl.draft import DraftRegion, DraftSolid, Placed
from ntagen.nsl.evaluate import Evaluator, Scope
from ntagen.nsl.quantity import ANGLE, LENGTH, NUMBER
from ntagen.nsl.vectors import unit
from ntagen.scene import Vector
from ntagen.shapes import (
    UPRIGHT,
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Shape,
    turning,
)

_VECTORS: Final[dict[tree.SolidForm, tuple[str, str]]] = {
    "box": ("centre", "size"),
    "capsule": ("start", "end"),
    "cylinder": ("start", "end"),
    "ellipsoid": ("centre", "radii"),
    "halfspace": ("point", "direction"),
}
"""By shape: what its first two values are. All others are radii."""

EXTENTS: Final[dict[tree.SolidForm, int]] = {
    "box": 1,
    "capsule": 2,
    "cylinder": 2,
    "ellipsoid": 1,
    "halfspace": 0,
}
"""By shape: the value that makes it wide; a half-space has none, so it is its place."""


class SolidResolver:
    """Resolves the values of shapes."""

    def __init__(self, evaluator: Evaluator) -> None:
        self._evaluator = evaluator

    def solid(self, shape: tree.Solid, name: str, scope: Scope) -> DraftSolid:
        """The values of a shape, each with its place."""
        vectors = []
        for role, expression in zip(_VECTORS[shape.form], shape.measures[:2], strict=True):
            dimension = NUMBER if role == "direction" else LENGTH
            what = f"the {role} of `{name}`"
            value = self._evaluator.vector(expression, scope, dimension, what)
            vectors.append(Placed(value, expression.span))
        numbers = []
        for expression in shape.measures[2:]:
            what = f"the radius of `{name}`"
            radius = self._evaluator.number(expression, scope, LENGTH, what)
            numbers.append(Placed(radius, expression.span))
        turn = None
        if shape.turned is not None:
            angle, axis = shape.turned
            turn = (
                Placed(
                    self._evaluator.number(angle, scope, ANGLE, f"the turn of `{name}`"), angle.span
                ),
                Placed(
                    self._evaluator.vector(axis, scope, NUMBER, f"the axis of `{name}`"), axis.span
                ),
            )
        return DraftSolid(shape.form, tuple(vectors), tuple(numbers), turn)


_Maker = Callable[[DraftRegion, DraftSolid, tuple[Vector, Vector], list[float]], Shape | None]


class SolidBuilder:
    """Makes shapes of values, and reports what breaks a rule."""

    def __init__(self, reporter: Reporter) -> None:
        self._reporter = reporter

    def shape(self, draft: DraftRegion, solid: DraftSolid) -> Shape | None:
        """The shape, or None after a mistake."""
        vectors = [one.value for one in solid.vectors if one.value is not None]
        numbers = [one.value for one in solid.numbers if one.value is not None]
        if len(vectors) < 2 or len(numbers) < len(solid.numbers):
            return None
        bad = [one for one in solid.numbers if not self._is_positive(draft, one, "radius")]
        if bad:
            return None
        makers: dict[tree.SolidForm, _Maker] = {
            "box": self._box,
            "capsule": self._capsule,
            "cylinder": self._cylinder,
            "ellipsoid": self._ellipsoid,
            "halfspace": self._halfspace,
        }
        return makers[solid.form](draft, solid, (vectors[0], vectors[1]), numbers)

    def _is_positive(self, draft: DraftRegion, placed: Placed[float], role: str) -> bool:
        value = 0.0 if placed.value is None else placed.value
        return self._reporter.obeys(
            rules.positive(value, f"the {role} of `{draft.name}`"), placed.span
        )

    def _turned(
        self, draft: DraftRegion, solid: DraftSolid, role: str
    ) -> tuple[tuple[Vector, Vector, Vector], Vector] | None:
        """The axes and the extents of a box or an ellipsoid."""
        extents = solid.vectors[1]
        least = Placed(min(extents.value or (0.0,)), extents.span)
        if not self._is_positive(draft, least, role) or extents.value is None:
            return None
        if solid.turn is None:
            return UPRIGHT, extents.value
        angle, axis = solid.turn
        if angle.value is None or axis.value is None:
            return None
        direction = self._direction(draft, axis, "turn")
        return None if direction is None else (turning(direction, angle.value), extents.value)

    def _direction(self, draft: DraftRegion, placed: Placed[Vector], role: str) -> Vector | None:
        """A direction of length 1."""
        if placed.value is None:
            return None
        if max(map(abs, placed.value)) == 0.0:
            self._reporter.report(
                "direction-zero",
                placed.span,
                f"the {role} of `{draft.name}` has no direction",
                hint="write for example `-y` or `(0, -1, 0)`",
            )
            return None
        return unit(placed.value)

    def _box(
        self, draft: DraftRegion, solid: DraftSolid, places: tuple[Vector, Vector], _: list[float]
    ) -> Shape | None:
        found = self._turned(draft, solid, "size")
        return None if found is None else Box(places[0], found[1], found[0])

    def _ellipsoid(
        self, draft: DraftRegion, solid: DraftSolid, places: tuple[Vector, Vector], _: list[float]
    ) -> Shape | None:
        found = self._turned(draft, solid, "least radius")
        return None if found is None else Ellipsoid(places[0], found[1], found[0])

    def _capsule(
        self, _: DraftRegion, __: DraftSolid, places: tuple[Vector, Vector], radii: list[float]
    ) -> Shape | None:
        return Capsule(*places, radii[0], radii[-1])

    def _cylinder(
        self,
        draft: DraftRegion,
        solid: DraftSolid,
        places: tuple[Vector, Vector],
        radii: list[float],
    ) -> Shape | None:
        if places[0] == places[1]:
            self._reporter.report(
                "direction-zero",
                solid.vectors[1].span,
                f"`{draft.name}` ends where it starts, so it has no direction",
                hint="move one of its ends",
            )
            return None
        return Cylinder(*places, radii[0])

    def _halfspace(
        self, draft: DraftRegion, solid: DraftSolid, places: tuple[Vector, Vector], _: list[float]
    ) -> Shape | None:
        if draft.kind == "target":
            self._reporter.report(
                "target-without-end",
                draft.name_span,
                f"`{draft.name}` is a half-space, which has no end",
                hint="give the target another shape, for example a box",
            )
            return None
        towards = self._direction(draft, solid.vectors[1], "side")
        return None if towards is None else HalfSpace(places[0], towards)
