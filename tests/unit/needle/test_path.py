"""Distances of paths to many points at once are those to one after the other."""

from __future__ import annotations

import math
import random

import pytest

from ntagen.needle.path import Path, nearest_on, nearest_on_all
from ntagen.scene import Pose

ENTRY = Pose((1.0, 2.0, 3.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))


def some_path(draw: random.Random, pushes: int) -> Path:
    """A path of arcs and straight pieces, some of them longer than half a circle."""
    path = Path(ENTRY)
    for _ in range(pushes):
        path = path.roll(draw.uniform(-4.0, 4.0))
        path = path.push(draw.choice([math.inf, 12.0, 30.0, 77.0]), draw.uniform(0.0, 60.0))
    return path


@pytest.mark.parametrize("pushes", range(5))
@pytest.mark.parametrize("count", [0, 1, 7, 8, 60])
def test_many_points_have_the_distances_of_each(pushes: int, count: int) -> None:
    draw = random.Random(100 * pushes + count)
    path = some_path(draw, pushes)
    points = [tuple(draw.uniform(-80.0, 80.0) for _ in range(3)) for _ in range(count)]
    together = nearest_on_all(path.arcs, ENTRY.position_mm, points)  # type: ignore[arg-type]
    assert len(together) == count
    for found, point in zip(together, points, strict=True):
        alone = nearest_on(path.arcs, ENTRY.position_mm, point)  # type: ignore[arg-type]
        assert found.distance_mm == pytest.approx(alone.distance_mm, abs=1e-12)
        assert found.at_mm == pytest.approx(alone.at_mm, abs=1e-9)


def test_a_point_on_the_path_is_found_where_it_lies() -> None:
    path = Path(ENTRY).push(30.0, 20.0).roll(2.0).push(math.inf, 10.0)
    places = [2.5 * i for i in range(1, 12)]
    points = []
    for at_mm in places:
        first, second = path.arcs
        arc, along_mm = (first, at_mm) if at_mm <= 20.0 else (second, at_mm - 20.0)
        points.append(arc.pose_at(along_mm).position_mm)
    found = nearest_on_all(path.arcs, ENTRY.position_mm, points)
    assert [place.distance_mm for place in found] == pytest.approx([0.0] * 11, abs=1e-12)
    assert [place.at_mm for place in found] == pytest.approx(places)
