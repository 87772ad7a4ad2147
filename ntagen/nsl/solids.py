"""Shapes besides the sphere: their values with units, and the shapes that these make."""

from __future__ import annotations

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
    Axes,
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
            vectors.append(self._evaluator.vector(expression, scope, dimension, what))
        numbers = tuple(
            self._evaluator.number(one, scope, LENGTH, f"the radius of `{name}`")
            for one in shape.measures[2:]
        )
        turn = None
        if shape.turned is not None:
            angle, axis = shape.turned
            turn = (
                self._evaluator.number(angle, scope, ANGLE, f"the turn of `{name}`"),
                self._evaluator.vector(axis, scope, NUMBER, f"the axis of `{name}`"),
            )
        return DraftSolid(shape.form, tuple(vectors), numbers, turn)


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
        if [one for one in solid.numbers if not self._is_positive(draft, one, "radius")]:
            return None
        first, second = vectors
        match solid.form:
            case "box":
                axes = self._axes(draft, solid, "size")
                return None if axes is None else Box(first, second, axes)
            case "ellipsoid":
                axes = self._axes(draft, solid, "least radius")
                return None if axes is None else Ellipsoid(first, second, axes)
            case "capsule":
                return Capsule(first, second, numbers[0], numbers[-1])
            case "cylinder":
                return self._cylinder(draft, solid, first, second, numbers[0])
            case "halfspace":
                return self._halfspace(draft, solid, first)

    def _is_positive(self, draft: DraftRegion, placed: Placed[float], role: str) -> bool:
        what = f"the {role} of `{draft.name}`"
        return placed.obeying(self._reporter, rules.positive, what) is not None

    def _axes(self, draft: DraftRegion, solid: DraftSolid, role: str) -> Axes | None:
        """The axes of a box or an ellipsoid, whose extents are checked, too."""
        extents = solid.vectors[1]
        least = Placed(min(extents.value or (0.0,)), extents.span)
        if not self._is_positive(draft, least, role):
            return None
        if solid.turn is None:
            return UPRIGHT
        angle, axis = solid.turn
        if angle.value is None:
            return None
        direction = self._direction(draft, axis, "turn")
        return None if direction is None else turning(direction, angle.value)

    def _direction(self, draft: DraftRegion, placed: Placed[Vector], role: str) -> Vector | None:
        """A direction of length 1."""
        what, hint = f"the {role} of `{draft.name}`", "write for example `-y` or `(0, -1, 0)`"
        value = placed.obeying(self._reporter, rules.direction, what, hint)
        return None if value is None else unit(value)

    def _cylinder(
        self,
        draft: DraftRegion,
        solid: DraftSolid,
        start_mm: Vector,
        end_mm: Vector,
        radius_mm: float,
    ) -> Shape | None:
        if start_mm == end_mm:
            self._reporter.report(
                "direction-zero",
                solid.vectors[1].span,
                f"`{draft.name}` ends where it starts, so it has no direction",
                hint="move one of its ends",
            )
            return None
        return Cylinder(start_mm, end_mm, radius_mm)

    def _halfspace(self, draft: DraftRegion, solid: DraftSolid, point_mm: Vector) -> Shape | None:
        if draft.kind == "target":
            self._reporter.report(
                "target-without-end",
                draft.name_span,
                f"`{draft.name}` is a half-space, which has no end",
                hint="give the target another shape, for example a box",
            )
            return None
        towards = self._direction(draft, solid.vectors[1], "side")
        return None if towards is None else HalfSpace(point_mm, towards)
