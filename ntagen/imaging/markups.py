"""Markups of Slicer (.mrk.json): points, lines, curves and boxes, as shapes.

The format is that of the schema "markups-schema-v1.0.3" of Slicer. Each list of points says its
coordinate system; units are mm unless it says something else.
"""

from __future__ import annotations

import difflib
import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from ntagen.files import json_of
from ntagen.imaging.mistakes import ImageError, malformed
from ntagen.imaging.reading import bytes_of
from ntagen.imaging.space import Space, rigid
from ntagen.shapes import Box, Capsule, Shape, Sphere, Vector

_MOST_BYTES: Final = 16 * 2**20
_MOST_SHAPES: Final = 10_000
_UNITS_MM: Final = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 0.001}


@dataclass(frozen=True, slots=True)
class Mark:
    """A shape of a file, in mm.

    Attributes:
        label: The name of its point; empty for other shapes.
        shape: The shape.
        space: The space that the file says for it.
    """

    label: str
    shape: Shape
    space: Space | None


def read_marks(path: str, radius_mm: float | None, point: str | None = None) -> list[Mark]:
    """The shapes of a file of markups.

    Args:
        path: The file.
        radius_mm: How thick points and lines are.
        point: The name of the only point that is meant.

    Raises:
        ImageError: The file cannot be read, or has no such point, or the radius is missing.
    """
    data = bytes_of(path, _MOST_BYTES)
    try:
        document = json_of(data)
        lists = list(document["markups"])
        marks = [mark for one in lists for mark in _marks(path, one, radius_mm, point)]
    except ImageError:
        raise
    except (
        *(ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError),
    ) as error:
        raise malformed(
            f"`{path}` is no file of markups: {type(error).__name__} {error}"[:160],
            "save the markups once more, as .mrk.json",
        ) from None
    if point is not None:
        labels = [mark.label for mark in marks if mark.label]
        marks = [mark for mark in marks if mark.label == point]
        if len(marks) != 1:
            near = difflib.get_close_matches(point, labels, n=1)
            shown = ", ".join(f"`{label}`" for label in labels[:8]) or "no points"
            count = f"has {len(marks)} points" if marks else "has no point"
            raise ImageError(
                "part-missing",
                f"`{path}` {count} `{point}`",
                f"did you mean `{near[0]}`?" if near and not marks else f"it has {shown}",
            )
    if not marks:
        raise ImageError(
            "part-missing", f"`{path}` has no points", "place the points before you save it"
        )
    if len(marks) > _MOST_SHAPES:
        raise ImageError(
            "image-too-large", f"`{path}` has more than {_MOST_SHAPES:,} shapes", "save fewer"
        )
    return marks


def _marks(
    path: str, entry: Mapping[str, Any], radius_mm: float | None, point: str | None
) -> Iterator[Mark]:
    """The shapes of one list of points."""
    kind = str(entry["type"])
    said = entry.get("coordinateSystem")
    space: Space | None = "LPS" if said == "LPS" else "RAS" if said == "RAS" else None
    unit = entry.get("coordinateUnits", "mm")
    if unit not in _UNITS_MM:
        raise ImageError(
            "unit-unknown", f"`{path}` is in {unit!r}, which is no length", "save it in mm"
        )
    unit_mm = _UNITS_MM[str(unit)]
    if kind == "ROI":
        if point is None:
            yield Mark("", _box(path, entry, unit_mm), space)
        return
    named = [
        (str(control.get("label", "")), _vector(path, control["position"], unit_mm))
        for control in entry["controlPoints"]
        if control.get("positionStatus", "defined") == "defined"
    ]
    if radius_mm is None:
        raise ImageError(
            "part-missing",
            f"the points and lines of `{path}` have no thickness",
            "say it, for example `radius 2 mm`",
        )
    if kind == "Fiducial" or point is not None:
        for label, place in named:
            yield Mark(label, Sphere(place, radius_mm), space)
        return
    if kind not in ("Line", "Curve", "ClosedCurve"):
        raise malformed(
            f"`{path}` has markups of the kind {kind}, which have no shape here",
            "use points, lines, curves or boxes (ROI)",
        )
    places = [place for _, place in named]
    if kind == "ClosedCurve":
        places.append(places[0])
    for one, two in itertools.pairwise(places):
        yield Mark("", Capsule(one, two, radius_mm, radius_mm), space)


def _box(path: str, entry: Mapping[str, Any], unit_mm: float) -> Box:
    """A box of any turn."""
    size = _vector(path, entry["size"], unit_mm)
    if min(size) <= 0.0:
        raise malformed(f"a box of `{path}` has the size {size}", "draw it once more")
    turn = [float(number) for number in entry.get("orientation", (1, 0, 0, 0, 1, 0, 0, 0, 1))]
    center = _vector(path, entry["center"], unit_mm)
    rows = [[*turn[3 * i : 3 * i + 3], center[i]] for i in range(3)]
    motion = rigid(rows, f"the orientation of a box in `{path}`")
    return Box(motion.shift_mm, size, motion.axes)


def _vector(path: str, numbers: Any, unit_mm: float) -> Vector:  # noqa: ANN401  any JSON
    x, y, z = (float(number) * unit_mm for number in numbers)
    if not all(map(math.isfinite, (x, y, z))):
        raise malformed(f"`{path}` has a point that is not finite")
    return (x, y, z)
