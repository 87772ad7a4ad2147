"""Shapes agree with a brute force over their surfaces, in distances, bounds and volumes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ntagen.shapes import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Shape,
    Sphere,
    Vector,
    directions,
    is_in,
    outline_mm,
    overlap,
    thickness_mm,
    turning,
)
from tests.oracles import surfaces

AXES = turning((1.0, 2.0, -0.5), 0.7)
MATRIX = np.array(AXES)
MIDDLE: Vector = (1.0, -20.0, 5.0)
START: Vector = (0.0, -10.0, 0.0)
END: Vector = (5.0, -30.0, 2.0)
TOWARDS: Vector = (0.6, -0.8, 0.0)

_M, _S, _E = np.array(MIDDLE), np.array(START), np.array(END)
CASES: dict[str, tuple[Shape, surfaces.Solid]] = {
    "sphere": (Sphere(MIDDLE, 4.0), surfaces.ellipsoid(_M, np.full(3, 4.0), np.eye(3))),
    "box": (
        Box(MIDDLE, (10.0, 4.0, 6.0), AXES),
        surfaces.box(_M, np.array([10.0, 4.0, 6.0]), MATRIX),
    ),
    "capsule": (Capsule(START, END, 2.0, 2.0), surfaces.capsule(_S, _E, 2.0, 2.0)),
    "tapered": (Capsule(START, END, 5.0, 1.5), surfaces.capsule(_S, _E, 5.0, 1.5)),
    "widened": (Capsule(START, END, 0.5, 6.0), surfaces.capsule(_S, _E, 0.5, 6.0)),
    "cylinder": (Cylinder(START, END, 3.0), surfaces.cylinder(_S, _E, 3.0)),
    "disc": (
        Cylinder(START, (0.0, -11.0, 0.0), 6.0),
        surfaces.cylinder(_S, np.array([0.0, -11.0, 0.0]), 6.0),
    ),
    "ellipsoid": (
        Ellipsoid(MIDDLE, (3.0, 5.0, 2.0), AXES),
        surfaces.ellipsoid(_M, np.array([3.0, 5.0, 2.0]), MATRIX),
    ),
    "pancake": (
        Ellipsoid(MIDDLE, (6.0, 6.0, 0.5), AXES),
        surfaces.ellipsoid(_M, np.array([6.0, 6.0, 0.5]), MATRIX),
    ),
    "half-space": (HalfSpace(MIDDLE, TOWARDS), surfaces.half_space(_M, np.array(TOWARDS))),
}
BOUNDED = [name for name in CASES if name != "half-space"]


def points_around(shape: Shape, count: int, seed: int = 1) -> surfaces.Array:
    """Points in and around a shape: half of them near it, half of them as far as it is wide."""
    rng = np.random.default_rng(seed)
    low, high = map(np.array, shape.bounds_mm())
    low, high = np.maximum(low, -40.0), np.minimum(high, 40.0)
    width = high - low
    near = rng.uniform(low - 0.1 * width, high + 0.1 * width, (count // 2, 3))
    far = rng.uniform(low - width, high + width, (count - count // 2, 3))
    return np.concatenate([near, far])


def agree(name: str, count: int) -> None:
    shape, solid = CASES[name]
    points = points_around(shape, count)
    found, expected = shape.distance_mm(points), solid.distance_mm(points)
    # Within a micrometre of the surface, the many balls of a capsule leave the sign open.
    clear = np.abs(found) > 1e-3
    assert np.sign(found[clear]).tolist() == np.sign(expected[clear]).tolist()
    assert np.abs(np.abs(found) - np.abs(expected)).max() < 1e-5 + shape.error_mm
    assert 0.01 < (found < 0).mean() < 0.95


@pytest.mark.parametrize("name", CASES)
def test_distances_agree_with_the_surface(name: str) -> None:
    agree(name, 400)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_many_distances_agree_with_the_surface(name: str) -> None:
    agree(name, 5000)


@pytest.mark.parametrize("name", CASES)
def test_distances_change_no_more_than_the_place(name: str) -> None:
    shape, _ = CASES[name]
    one, two = points_around(shape, 2000, seed=2), points_around(shape, 2000, seed=3)
    two = one + 0.05 * (two - one)
    change = np.abs(shape.distance_mm(one) - shape.distance_mm(two))
    assert (change <= np.linalg.norm(one - two, axis=1) + 1e-9 + 2 * shape.error_mm).all()


@pytest.mark.parametrize("name", CASES)
def test_one_point_is_like_many(name: str) -> None:
    shape, _ = CASES[name]
    for point in points_around(shape, 20, seed=4):
        x, y, z = map(float, point)
        many = float(shape.distance_mm(np.array([point]))[0])
        assert shape.distance_at_mm((x, y, z)) == pytest.approx(many, abs=1e-12)


@pytest.mark.parametrize("name", BOUNDED)
@pytest.mark.parametrize("by_mm", [0.0, 1.5, -0.1])
def test_bounds_touch_and_volumes_count(name: str, by_mm: float) -> None:
    """The points of a fine grid: their bounds, and how many lie inside."""
    shape = CASES[name][0].grown(by_mm)
    low, high = map(np.array, shape.bounds_mm())
    count = 50
    sides = [np.linspace(a, b, count, endpoint=False) for a, b in zip(low, high, strict=True)]
    cell = (high - low) / count
    grid = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 3) + 0.5 * cell
    inside = grid[shape.distance_mm(grid) <= 0.0]
    volume = len(inside) * cell.prod()
    assert shape.volume_mm3() == pytest.approx(volume, rel=0.03)
    # A tip of an ellipsoid or a corner fills a cell only a few cells from its end.
    assert (inside.min(axis=0) - low < 4.0 * cell).all()
    assert (high - inside.max(axis=0) < 4.0 * cell).all()
    outside = points_around(shape, 4000)
    outside = outside[((outside < low) | (outside > high)).any(axis=1)]
    assert (shape.distance_mm(outside) > -1e-9).all()


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("by_mm", [2.0, -0.2])
def test_a_grown_shape_is_its_points_at_most_so_far(name: str, by_mm: float) -> None:
    shape, _ = CASES[name]
    points = points_around(shape, 2000)
    grown, distance = shape.grown(by_mm), shape.distance_mm(points)
    clear = np.abs(distance - by_mm) > 1e-6
    found = grown.distance_mm(points)
    assert ((found <= 0.0) == (distance <= by_mm))[clear].all()
    inside = np.minimum(found, distance) < 0.0 if by_mm > 0.0 else found < 0.0
    assert found[inside] == pytest.approx(distance[inside] - by_mm, abs=1e-6)
    assert (found >= distance - by_mm - 1e-6).all()
    if math.isfinite(shape.depth_mm):
        assert grown.depth_mm == pytest.approx(shape.depth_mm + by_mm)


@pytest.mark.parametrize("name", CASES)
def test_a_shape_moves_with_its_points(name: str) -> None:
    shape, _ = CASES[name]
    axes, shift = turning((0.0, 1.0, 1.0), -1.2), (3.0, -1.0, 7.0)
    points = points_around(shape, 500)
    moved = points @ np.array(axes) + np.array(shift)
    there = shape.placed(axes, shift)
    assert there.distance_mm(moved) == pytest.approx(shape.distance_mm(points), abs=1e-8)
    if name in BOUNDED:
        assert there.volume_mm3() == pytest.approx(shape.volume_mm3())


@pytest.mark.parametrize("name", BOUNDED)
def test_the_deepest_point_and_the_ball_around(name: str) -> None:
    shape, _ = CASES[name]
    points = points_around(shape, 40_000)
    distance = shape.distance_mm(points)
    assert -shape.depth_mm - 1e-9 <= distance.min() <= -0.75 * shape.depth_mm
    inside = points[distance < 0.0]
    away = np.linalg.norm(inside - np.array(shape.center_mm), axis=1).max()
    assert 0.6 * shape.reach_mm() < away <= shape.reach_mm() + 1e-9


def test_a_ball_in_a_ball_is_the_larger_one() -> None:
    capsule, ball = Capsule(START, (0.0, -11.0, 0.0), 4.0, 1.0), Sphere(START, 4.0)
    points = points_around(ball, 500)
    assert capsule.distance_mm(points) == pytest.approx(ball.distance_mm(points))
    assert capsule.volume_mm3() == pytest.approx(ball.volume_mm3())
    swapped = Capsule((0.0, -11.0, 0.0), START, 1.0, 4.0)
    assert swapped.distance_mm(points) == pytest.approx(ball.distance_mm(points))


def test_points_in_planes_of_symmetry_of_an_ellipsoid() -> None:
    """The centre, the axes and the flat of the middle have a nearest point too."""
    shape = Ellipsoid((0.0, 0.0, 0.0), (5.0, 3.0, 1.0))
    assert shape.distance_at_mm((0.0, 0.0, 0.0)) == pytest.approx(-1.0, abs=shape.error_mm)
    assert shape.distance_at_mm((7.0, 0.0, 0.0)) == pytest.approx(2.0, abs=shape.error_mm)
    assert shape.distance_at_mm((0.0, -4.5, 0.0)) == pytest.approx(1.5, abs=shape.error_mm)
    # From (4, 0, 0) the nearest point lies off the axis: x = a^2 p / (a^2 - c^2).
    x = 25.0 * 4.0 / 24.0
    z = math.sqrt(1.0 - x**2 / 25.0)
    away = math.hypot(x - 4.0, z)
    assert shape.distance_at_mm((4.0, 0.0, 0.0)) == pytest.approx(-away, abs=shape.error_mm)
    far = np.array([[1e5, 1e-9, -1e4]])
    assert shape.distance_mm(far)[0] == pytest.approx(np.linalg.norm(far), rel=1e-4)


def test_a_quarter_of_a_turn_is_exact() -> None:
    assert turning((0.0, 0.0, 2.0), math.pi / 2)[:2] == ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="no direction"):
        turning((0.0, 0.0, 0.0), 1.0)


def test_what_is_too_small_to_shrink_vanishes() -> None:
    for name in BOUNDED:
        shape = CASES[name][0]
        assert shape.grown(-shape.depth_mm - 0.5).depth_mm <= 0.0, name
    box = Box(MIDDLE, (2.0, 2.0, 2.0)).grown(1.0).grown(-1.5)
    assert box == replace(Box(MIDDLE, (2.0, 2.0, 2.0)), size_mm=(1.0, 1.0, 1.0))


PAIRS = [
    (Sphere(MIDDLE, 2.0), Box((4.5, -20.0, 5.0), (3.1, 4.0, 6.0)), True),
    (Sphere(MIDDLE, 2.0), Box((4.5, -20.0, 5.0), (2.9, 4.0, 6.0)), False),
    (Box(MIDDLE, (2.0, 2.0, 2.0)), Box(MIDDLE, (9.0, 9.0, 9.0), AXES), True),
    (Box(MIDDLE, (2.0, 2.0, 2.0)), Cylinder((5.0, -20.0, 5.0), (9.0, -20.0, 5.0), 1.0), False),
    (Ellipsoid(MIDDLE, (3.0, 1.0, 1.0)), Cylinder((3.9, -20, 5), (9.0, -20.0, 5.0), 1.0), True),
    (Ellipsoid(MIDDLE, (3.0, 1.0, 1.0)), Cylinder((4.1, -20, 5), (9.0, -20.0, 5.0), 1.0), False),
    (Box(MIDDLE, (4.0, 2.0, 2.0)), HalfSpace((2.9, 0.0, 0.0), (1.0, 0.0, 0.0)), True),
    (Box(MIDDLE, (4.0, 2.0, 2.0)), HalfSpace((3.1, 0.0, 0.0), (1.0, 0.0, 0.0)), False),
]


@pytest.mark.parametrize(("one", "two", "expected"), PAIRS)
def test_what_has_points_in_common_overlaps(one: Shape, two: Shape, *, expected: bool) -> None:
    assert overlap(one, two) is overlap(two, one) is expected


def test_how_deep_one_shape_lies_in_another() -> None:
    box = Box(MIDDLE, (10.0, 8.0, 6.0), AXES)
    assert thickness_mm(box, Sphere(MIDDLE, 1.0)) == pytest.approx(2.0)
    assert thickness_mm(box.grown(2.5), box) == pytest.approx(2.5, abs=1e-6)
    wall = HalfSpace((0.0, 9.0, 0.0), (0.0, 1.0, 0.0))
    assert thickness_mm(wall.grown(2.0), wall) == pytest.approx(2.0)
    assert thickness_mm(wall, wall.grown(2.0)) < 0.0
    assert thickness_mm(wall, box) < -25.0
    assert thickness_mm(box, wall) < 0.0
    assert thickness_mm(wall, Box((0.0, 15.0, 0.0), (4.0, 4.0, 4.0))) == pytest.approx(4.0)
    assert thickness_mm(Sphere(MIDDLE, 1.0), box) < 0.0
    assert is_in(box, MIDDLE)
    assert not is_in(box, (1.0, -20.0, 9.0))


@pytest.mark.parametrize("name", BOUNDED)
def test_an_outline_lies_on_the_surface_and_reaches_all_ends(name: str) -> None:
    shape, _ = CASES[name]
    points = outline_mm(shape, directions().reshape(-1, 3))
    assert np.abs(shape.distance_mm(points)).max() < 1e-7
    low, high = shape.bounds_mm()
    width = np.array(high) - np.array(low)
    assert (np.abs(points.min(axis=0) - low) < 0.05 * width).all()
    assert (np.abs(points.max(axis=0) - high) < 0.05 * width).all()
