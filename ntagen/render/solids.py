"""The tables of the shapes that are no spheres: integers for the templates, by kind of shape.

Lengths are in units of 1 / scale mm, as everywhere; components of directions in `DIRECTION_UNITS`,
since a direction is multiplied by lengths that are much longer than a millimetre. Avoided shapes of
all kinds of regions come first, and then targets.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import field
from typing import Any, Final, cast

from ntagen.errors import InputError
from ntagen.render.fields import Samples, field_rows
from ntagen.render.fixed_point import fixed_point
from ntagen.render.frame import Matrix
from ntagen.rules import units_of
from ntagen.scene import Region, Vector
from ntagen.shapes import Box, Capsule, Cylinder, Ellipsoid, Field, HalfSpace, Shape, Sphere
from ntagen.values import dataclass

DIRECTION_UNITS: Final = 2**28
"""The units of a direction's components: at most half of one is lost, 2e-9."""

FORMS: Final[tuple[type[Shape], ...]] = (Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Field)
"""The kinds of shapes; their places in this list, from 1, are their numbers in the model."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One row of a table: its values, and the name of the region."""

    text: str
    note: str


@dataclass(frozen=True, slots=True)
class Column:
    """One table of a kind of shape: its name, its dimensions behind the first, and its rows."""

    name: str
    dimensions: str
    note: str
    rows: tuple[Entry, ...]


@dataclass(frozen=True, slots=True)
class Table:
    """All shapes of one kind."""

    kind: str
    form: int
    count: int
    avoided: int
    still: int
    columns: tuple[Column, ...]


@dataclass(frozen=True, slots=True)
class SolidTarget:
    """A target for the tables: the kind of its shape, its place in its table, and its lower end."""

    form: int
    place: int
    low: str
    note: str


@dataclass(frozen=True, slots=True)
class Solids:
    """The tables of all shapes that are no spheres.

    Attributes:
        tables: By kind of shape, those that occur.
        targets: All targets, if one of them is no sphere; else none.
        samples: The table of distances of shapes from files, if there are any.
        places: By region (`id`) its row in the tables of its kind.
    """

    tables: tuple[Table, ...] = ()
    targets: tuple[SolidTarget, ...] = ()
    samples: Samples | None = None
    places: dict[int, int] = field(default_factory=dict)

    @property
    def direction_units(self) -> int:
        """The units of a direction's components."""
        return DIRECTION_UNITS

    @property
    def is_avoided(self) -> bool:
        """Whether plans must avoid one of the shapes, and it keeps still."""
        return any(table.still for table in self.tables)


def solids(
    avoided: Sequence[Region], targets: Sequence[Region], scale: int, frame: Matrix
) -> Solids:
    """The tables for the shapes among these regions.

    Raises:
        InputError: A length does not fit into the model's numbers.
    """
    axes = _columns(frame)
    tables: list[Table] = []
    places: dict[int, int] = {}
    samples: Samples | None = None
    for number, form in enumerate(FORMS, start=1):
        all_mine = [region for region in avoided if isinstance(region.shape, form)]
        unmoved = [region for region in all_mine if region.motion is None]
        mine = unmoved + [region for region in all_mine if region.motion is not None]
        wanted = [region for region in targets if isinstance(region.shape, form)]
        if not mine and not wanted:
            continue
        places |= {id(region): place for place, region in enumerate([*mine, *wanted])}
        rows = [
            _Row(region, region.shape.placed(axes, (0, 0, 0)), scale) for region in (*mine, *wanted)
        ]
        values: Sequence[Any] = [row.shape for row in rows]
        if form is Field:
            values, samples = field_rows(
                [(row.region, cast(Field, row.shape)) for row in rows], scale
            )
        pairs = list(zip(rows, values, strict=True))
        columns = tuple(
            Column(name, dims, note, tuple(Entry(make(*one), one[0].note) for one in pairs))
            for name, dims, note, make in _COLUMNS[form]
        )
        kind = form.__name__.upper()
        tables.append(Table(kind, number, len(rows), len(mine), len(unmoved), columns))
    if all(isinstance(target.shape, Sphere) for target in targets):
        return Solids(tuple(tables), samples=samples, places=places)
    goals = tuple(_target(one, places, scale, axes) for one in targets)
    return Solids(tuple(tables), goals, samples, places)


def _target(
    region: Region,
    places: dict[int, int],
    scale: int,
    axes: tuple[Vector, Vector, Vector],
) -> SolidTarget:
    """A target's row; its lower end is rounded downwards."""
    if isinstance(region.shape, HalfSpace):
        raise InputError(
            f"the target `{region.name}` is a half-space, which has no end\n"
            "hint: give it another shape, for example a box"
        )
    low_mm = region.shape.placed(axes, (0, 0, 0)).bounds_mm()[0][1]
    low = fixed_point(low_mm, scale, f"the lower end of {region.name}")
    note = " ".join(region.name.split())
    if isinstance(region.shape, Sphere):
        return SolidTarget(0, 0, str(low), note)
    return SolidTarget(FORMS.index(type(region.shape)) + 1, places[id(region)], str(low - 1), note)


@dataclass(frozen=True, slots=True)
class _Row:
    """A region and its shape in the model's frame."""

    region: Region
    shape: Shape
    scale: int

    @property
    def note(self) -> str:
        return " ".join(self.region.name.split())

    def length(self, value_mm: float, least: int | None = None) -> int:
        units = fixed_point(value_mm, self.scale, f"the size of {self.region.name}")
        return units if least is None else max(least, units)

    def lengths(self, values: Vector, least: int | None = None) -> str:
        return _braced(str(self.length(value, least)) for value in values)

    def direction(self, values: Vector) -> str:
        return _braced(str(units_of(value, DIRECTION_UNITS)) for value in values)


def _braced(parts: Iterable[str]) -> str:
    return "{" + ", ".join(parts) + "}"


def _columns(frame: Matrix) -> tuple[Vector, Vector, Vector]:
    """What the frame makes of the three axes."""
    x, y, z = (tuple(row[i] for row in frame) for i in range(3))
    return (x[0], x[1], x[2]), (y[0], y[1], y[2]), (z[0], z[1], z[2])


def _axes(row: _Row, axes: tuple[Vector, Vector, Vector]) -> str:
    return _braced(row.direction(axis) for axis in axes)


def _way(start: Vector, end: Vector) -> Vector:
    length = math.dist(start, end)
    x, y, z = ((b - a) / length if length > 0.0 else 0.0 for a, b in zip(start, end, strict=True))
    return (x, y, z)


def _round_ends(row: _Row, shape: Capsule) -> tuple[Vector, Vector, int, int, int]:
    """The start, the direction, the length and the radii of a capsule, in units.

    If one ball contains the other, also after rounding, there is only this one, of length 0.
    """
    start, end = row.length(shape.start_radius_mm), row.length(shape.end_radius_mm)
    length = row.length(shape.length_mm)
    if abs(start - end) < length:
        return shape.start_mm, _way(shape.start_mm, shape.end_mm), length, start, end
    middle = shape.start_mm if start >= end else shape.end_mm
    return middle, (0.0, 0.0, 0.0), 0, max(start, end), max(start, end)


_Make = Callable[[_Row, Any], str]
"""A column's function of a row and its shape, or the `FieldRow` of a field."""

_ROUNDING: Final = "All points at most this far away belong to it as well."
_COLUMNS: Final[dict[type[Shape], tuple[tuple[str, str, str, _Make], ...]]] = {
    Box: (
        ("center", "[3]", "Its centre.", lambda r, s: r.lengths(s.middle_mm)),
        (
            "half",
            "[3]",
            "Half of its edges.",
            lambda r, s: r.lengths((s.size_mm[0] / 2, s.size_mm[1] / 2, s.size_mm[2] / 2)),
        ),
        ("axes", "[3][3]", "Its own axes.", lambda r, s: _axes(r, s.axes)),
        ("rounding", "", _ROUNDING, lambda r, s: str(r.length(s.rounding_mm))),
    ),
    Capsule: (
        ("start", "[3]", "The first centre.", lambda r, s: r.lengths(_round_ends(r, s)[0])),
        ("way", "[3]", "From there to the other.", lambda r, s: r.direction(_round_ends(r, s)[1])),
        ("length", "", "How far that is.", lambda r, s: str(_round_ends(r, s)[2])),
        ("radius", "", "The radius at the first centre.", lambda r, s: str(_round_ends(r, s)[3])),
        ("end_radius", "", "The radius at the other.", lambda r, s: str(_round_ends(r, s)[4])),
    ),
    Cylinder: (
        ("center", "[3]", "Its middle.", lambda r, s: r.lengths(s.center_mm)),
        ("way", "[3]", "Its axis.", lambda r, s: r.direction(_way(s.start_mm, s.end_mm))),
        ("half", "", "Half of its length.", lambda r, s: str(r.length(s.length_mm / 2))),
        ("radius", "", "Its radius.", lambda r, s: str(r.length(s.radius_mm))),
        ("rounding", "", _ROUNDING, lambda r, s: str(r.length(s.rounding_mm))),
    ),
    Ellipsoid: (
        ("center", "[3]", "Its centre.", lambda r, s: r.lengths(s.middle_mm)),
        ("radius", "[3]", "Its radii.", lambda r, s: r.lengths(s.radii_mm, 1)),
        ("axes", "[3][3]", "Its own axes.", lambda r, s: _axes(r, s.axes)),
        ("rounding", "", _ROUNDING, lambda r, s: str(r.length(s.rounding_mm))),
    ),
    HalfSpace: (
        ("point", "[3]", "A point of its plane.", lambda r, s: r.lengths(s.point_mm)),
        ("towards", "[3]", "From there into it.", lambda r, s: r.direction(s.towards)),
    ),
    Field: (
        ("corner", "[3]", "The first point.", lambda r, f: r.lengths(f.field.corner_mm)),
        ("axes", "[3][3]", "Its own axes.", lambda r, f: _axes(r, f.field.axes)),
        ("extent", "[3]", "From there to the last.", lambda r, f: r.lengths(f.field.extent_mm)),
        ("count", "[3]", "How many points.", lambda _, f: _braced(map(str, f.field.counts))),
        ("first", "", "Where its samples begin.", lambda _, f: str(f.first)),
        ("low", "[3]", "Where the solid begins.", lambda _, f: _braced(map(str, f.low))),
        ("high", "[3]", "Where it ends.", lambda _, f: _braced(map(str, f.high))),
        ("side", "", "-1: samples are depths.", lambda _, f: "-1" if f.field.is_inner else "1"),
        ("rounding", "", _ROUNDING, lambda _, f: str(f.rounding)),
    ),
}
"""By kind of shape: the tables' names, their dimensions, what they are, and how a row is made."""
