"""What a run shows on topics, as plain values: markers, and poses along a plan.

The scene, the plan and the needle are those that viewers see in the log (`ntagen.drive.viewing`);
here they become markers of RViz. `ntagen.ros.messages` makes messages of them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Final, Literal

from ntagen.drive.records import Foreseen
from ntagen.needle.path import sample_poses
from ntagen.needle.vectors import add, combine, dot, norm, rotate, scale, subtract, unit
from ntagen.plan.synthesise import Synthesis
from ntagen.ros.frames import NeedleFrame
from ntagen.scene import Pose, Vector
from ntagen.values import dataclass

Rgba = tuple[float, float, float, float]
Shape = Literal["sphere", "line", "triangles", "nothing"]

_MM_PER_M: Final = 1000.0
_MM_PER_PIXEL: Final = 0.25
"""Viewers of the log draw lines in pixels; the needle of a lab is about 1 mm thick."""

_TUBE: Final = "tube"
_TUBE_COLOUR: Final = (0.12, 0.37, 0.75, 0.25)
_SIDES: Final = 16
_ACROSS: Final = 0.1
_PLAN_SPACING_MM: Final = 1.0


@dataclass(frozen=True, slots=True)
class Marker:
    """Something to be drawn, in mm and in the frame of the stage.

    Attributes:
        name: A later marker of this name takes its place.
        shape: What it is; ``nothing`` removes it.
        center_mm: The middle of a sphere.
        size_mm: The diameter of a sphere, or the width of a line.
        colour: Red, green, blue and alpha, from 0 to 1.
        points_mm: The places of a line, or three for each triangle.
    """

    name: str
    shape: Shape
    center_mm: Vector = (0.0, 0.0, 0.0)
    size_mm: float = 0.0
    colour: Rgba = (0.0, 0.0, 0.0, 0.0)
    points_mm: tuple[Vector, ...] = ()


def markers_of(update: Any) -> Iterator[Marker]:  # noqa: ANN401  the generated class has no fields
    """The markers of a ``SceneUpdate`` of Foxglove, which is in metres."""
    for deletion in update.deletions:
        yield Marker(deletion.id, "nothing")
    for entity in update.entities:
        for sphere in entity.spheres:
            size_mm = sphere.size.x * _MM_PER_M
            yield Marker(
                entity.id, "sphere", _mm(sphere.pose.position), size_mm, _rgba(sphere.color)
            )
        for line in entity.lines:
            if len(line.points) > 1:
                points_mm = tuple(map(_mm, line.points))
                width_mm = line.thickness * _MM_PER_PIXEL
                yield Marker(
                    entity.id,
                    "line",
                    size_mm=width_mm,
                    colour=_rgba(line.color),
                    points_mm=points_mm,
                )
        for faces in entity.triangles:
            corners = [_mm(point) for point in faces.points]
            points_mm = tuple(corners[index] for index in faces.indices)
            yield Marker(entity.id, "triangles", colour=_rgba(faces.color), points_mm=points_mm)


def _mm(point: Any) -> Vector:  # noqa: ANN401  as above
    return (point.x * _MM_PER_M, point.y * _MM_PER_M, point.z * _MM_PER_M)


def _rgba(colour: Any) -> Rgba:  # noqa: ANN401  as above
    return (colour.r, colour.g, colour.b, colour.a)


def tube_of(record: Foreseen, accept: float) -> Marker:
    """The tube of a plan: where the tip is with the confidence that is asked for.

    Args:
        record: Where it is expected, and how well that is known.
        accept: The confidence.
    """
    tube = record.tube(accept)
    if len(tube) < 2:
        return Marker(_TUBE, "nothing")
    places, radii = zip(*tube, strict=True)
    points_mm = tuple(_mantle(list(_rings(places, radii))))
    return Marker(_TUBE, "triangles", colour=_TUBE_COLOUR, points_mm=points_mm)


def _rings(places: Sequence[Vector], radii: Sequence[float]) -> Iterator[list[Vector]]:
    """A ring of points around each place, across the way."""
    across: Vector = (0.0, 0.0, 0.0)
    for index, (place, radius_mm) in enumerate(zip(places, radii, strict=True)):
        before, after = places[max(0, index - 1)], places[min(len(places) - 1, index + 1)]
        way = subtract(after, before)
        if norm(way) == 0.0:
            continue
        ahead = unit(way)
        across = _across(across, ahead)
        spoke = scale(radius_mm, across)
        turns = (2.0 * math.pi * side / _SIDES for side in range(_SIDES))
        yield [add(place, rotate(spoke, ahead, turn_rad)) for turn_rad in turns]


def _across(last: Vector, ahead: Vector) -> Vector:
    """A direction across the way that is near to the last one, so that the mantle is not twisted.

    Where there is no last one, it is any.
    """
    axes: tuple[Vector, ...] = (last, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    sides = (combine(1.0, axis, -dot(axis, ahead), ahead) for axis in axes)
    return unit(next(side for side in sides if norm(side) > _ACROSS))


def _mantle(rings: Sequence[Sequence[Vector]]) -> Iterator[Vector]:
    """The triangles between rings, three points each."""
    for one, other in itertools.pairwise(rings):
        for side in range(_SIDES):
            following = (side + 1) % _SIDES
            yield from (one[side], other[side], one[following])
            yield from (one[following], other[side], other[following])


def plan_poses(synthesis: Synthesis, needle: NeedleFrame) -> tuple[Pose, ...]:
    """Poses along the best plan, in the frame of the needle; empty if there is no plan."""
    if synthesis.best is None:
        return ()
    poses = sample_poses(synthesis.best.plan.arcs(synthesis.scene.needle), _PLAN_SPACING_MM)
    return tuple(map(needle.pose_to_needle, poses))


class Board:
    """All markers that stand now, for whoever comes later."""

    def __init__(self) -> None:
        self._standing: dict[str, Marker] = {}

    def put(self, markers: Iterable[Marker]) -> tuple[Marker, ...]:
        """Puts markers up, or takes them down; returns them."""
        changed = tuple(markers)
        for marker in changed:
            if marker.shape == "nothing":
                self._standing.pop(marker.name, None)
            else:
                self._standing[marker.name] = marker
        return changed

    def standing(self) -> tuple[Marker, ...]:
        """All that stand."""
        return tuple(self._standing.values())
