"""Fields of meshes and of voxels agree with brute force within the error that they state."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from ntagen.imaging.grid import Wish, Workspace
from ntagen.imaging.meshes import Mesh, checked
from ntagen.imaging.segmentations import Mask
from ntagen.imaging.space import Rigid
from ntagen.imaging.surfaces import field_of_mesh
from ntagen.imaging.voxels import field_of_mask
from ntagen.shapes import Field, overlap, skin, thickness_mm, triangles, turning
from tests.oracles import solids

SPACE = Workspace((0.0, 0.0, 0.0), (0.0, -1.0, 0.0), 100.0)
WISH = Wish(SPACE, step_mm=1.0)
AXES = turning((1.0, 2.0, -0.5), 0.7)


def torus(rows: int, columns: int) -> Mesh:
    """A ring about the y-axis: hollow in the middle, and nowhere flat."""
    u, v = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    around, across = 2 * np.pi * u / rows, 2 * np.pi * v / columns
    far = 8.0 + 3.0 * np.cos(across)
    points = np.stack([far * np.cos(around), 3 * np.sin(across) - 30, far * np.sin(around)], -1)

    def at(i: np.ndarray, j: np.ndarray) -> np.ndarray:
        return np.asarray((i % rows) * columns + j % columns).ravel()

    a, b, c, d = at(u, v), at(u + 1, v), at(u + 1, v + 1), at(u, v + 1)
    faces = np.concatenate([np.stack([a, c, b], 1), np.stack([a, d, c], 1)])
    return checked(points.reshape(-1, 3), faces, "ring", None)


def block() -> Mesh:
    """A box of 12 long triangles, thinner than two steps of the grid, and turned."""
    corners = np.array([[x, y, z] for x in (-9, 9) for y in (-0.8, 0.8) for z in (-5, 5)])
    faces = np.array(
        [
            *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
            *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
        ]
    )
    return checked(corners @ np.array(AXES) + [1.0, -25.0, 2.0], faces, "block", None)


def ball(radius: float) -> np.ndarray:
    """Voxels of 1 x 1 x 2 whose centres lie in a ball with a hole."""
    x, y, z = np.meshgrid(*[np.arange(-n, n + 1) for n in (8, 8, 4)], indexing="ij")
    far = np.sqrt(x**2 + y**2 + (2.0 * z) ** 2)
    return np.asarray((far <= radius) & (far > 2.0))


@dataclass(frozen=True)
class Case:
    """A field, and the oracle's distances."""

    field: Field
    oracle: str

    def true_mm(self, points: np.ndarray) -> np.ndarray:
        if self.oracle == "voxels":
            own = (points - np.array([1.0, -30.0, 2.0])) @ np.array(AXES).T
            voxels, spacing = ball(7.0), np.array([1.0, 1.0, 2.0])
            return solids.voxel_distance(own + np.full(3, 8.0), voxels, spacing)
        mesh = torus(24, 12) if self.oracle == "ring" else block()
        return solids.mesh_distance(points, mesh.corners)


@cache
def case(name: str, is_inner: bool = False) -> Case:
    wish = replace(WISH, is_inner=is_inner)
    if name == "voxels":
        start = tuple(np.array([1.0, -30.0, 2.0]) - np.array([8, 8, 8]) @ np.array(AXES))
        frame = Rigid(AXES, start)  # type: ignore[arg-type]
        mask = Mask(ball(7.0), (1.0, 1.0, 2.0), frame, "LPS", 1.0)
        return Case(field_of_mask(mask, Rigid(), 1.0, wish), name)
    mesh = torus(24, 12) if name == "ring" else block()
    return Case(field_of_mesh(mesh, wish, name), name)


NAMES = ["ring", "block", "voxels"]


def points_in(field: Field, count: int, seed: int = 1) -> np.ndarray:
    """Points of the grid's box, in the world."""
    rng = np.random.default_rng(seed)
    own = rng.uniform(0.0, 1.0, (count, 3)) * np.array(field.extent_mm)
    return np.array(field.corner_mm) + own @ np.array(field.axes)


@cache
def seen(name: str, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points, and their true distances, which take long."""
    one = case(name)
    points = points_in(one.field, count)
    return points, one.true_mm(points)


def check_bound(name: str, is_inner: bool, count: int) -> None:
    """The distance is on the safe side of the true one, and not farther off than is said."""
    one = case(name, is_inner)
    points, true = seen(name, count)
    over = one.field.distance_mm(points) - true
    if is_inner:
        over = -over
    assert over.max() <= 1e-6
    assert over.min() >= -one.field.error_mm
    assert over.min() < -0.2 * one.field.error_mm, "the stated error is far too great"


@pytest.mark.slow
@pytest.mark.parametrize("is_inner", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_distances_are_safe_and_within_their_error(name: str, is_inner: bool) -> None:
    check_bound(name, is_inner, 2000)


@pytest.mark.slow
@pytest.mark.parametrize("is_inner", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_many_distances_are_safe_and_within_their_error(name: str, is_inner: bool) -> None:
    check_bound(name, is_inner, 8000)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_samples_are_right_to_their_doubt(name: str) -> None:
    one = case(name)
    places = np.stack(np.meshgrid(*map(np.arange, one.field.counts), indexing="ij"), -1)
    own = places.reshape(-1, 3) * np.array(one.field.steps_mm)
    every = np.random.default_rng(2).permutation(len(own))[:3000]
    world = np.array(one.field.corner_mm) + own[every] @ np.array(one.field.axes)
    samples = one.field.values().reshape(-1)[every] / 1000.0
    assert np.abs(samples - one.true_mm(world)).max() <= one.field.sample_doubt_mm


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_distances_far_away_are_sharp(name: str) -> None:
    """At three steps from a surface, the bound loses a third of a millimetre, not a diagonal."""
    one = case(name)
    points = points_in(one.field, 3000, seed=3)
    true = one.true_mm(points)
    far = true > 3.0
    lost = true[far] - one.field.distance_mm(points[far])
    assert far.sum() > 300
    assert lost.max() < 0.35


@pytest.mark.parametrize("name", NAMES)
def test_distances_beyond_the_grid_are_safe(name: str) -> None:
    one = case(name)
    points = points_in(one.field, 1500, seed=4)
    middle = points.mean(axis=0)
    points = middle + 4.0 * (points - middle)
    assert (one.field.distance_mm(points) <= one.true_mm(points) + 1e-6).all()


@pytest.mark.slow
def test_a_grid_that_the_needle_does_not_reach_is_safe() -> None:
    """The needle is so short that the grid has a part of the ring only."""
    space = replace(SPACE, length_mm=26.0)
    mesh = torus(24, 12)
    field = field_of_mesh(mesh, replace(WISH, workspace=space), "ring")
    assert field.counts[1] < case("ring").field.counts[1]
    points = points_in(case("ring").field, 3000)
    true = solids.mesh_distance(points, mesh.corners)
    assert (field.distance_mm(points) <= true + 1e-6).all()


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("by_mm", [1.5, -0.3])
def test_grown_fields_are_offsets(name: str, by_mm: float) -> None:
    one = case(name)
    points = points_in(one.field, 500)
    grown = one.field.grown(by_mm)
    assert np.allclose(grown.distance_mm(points), one.field.distance_mm(points) - by_mm)
    assert thickness_mm(grown, one.field) == pytest.approx(by_mm)


@pytest.mark.parametrize("name", NAMES)
def test_placed_fields_move_with_their_points(name: str) -> None:
    one = case(name)
    points = points_in(one.field, 500)
    moved = one.field.placed(AXES, (3.0, -2.0, 1.0))
    there = points @ np.array(AXES) + [3.0, -2.0, 1.0]
    assert np.allclose(moved.distance_mm(there), one.field.distance_mm(points), atol=1e-9)
    low, high = map(np.array, moved.bounds_mm())
    inside = one.true_mm(points) <= 0.0
    assert (there[inside] >= low).all()
    assert (there[inside] <= high).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_volumes_are_those_of_the_solid(name: str) -> None:
    """The share of random points that the oracle has inside."""
    one = case(name)
    points = points_in(one.field, 4000, seed=6)
    inside = one.true_mm(points) <= 0.0
    box_mm3 = np.prod(one.field.extent_mm)
    assert one.field.volume_mm3() == pytest.approx(inside.mean() * box_mm3, rel=0.12)
    assert np.linalg.norm(points[inside] - one.field.center_mm, axis=1).max() <= (
        one.field.reach_mm()
    )


@pytest.mark.parametrize("name", NAMES)
def test_the_skin_lies_on_the_surface_and_faces_outwards(name: str) -> None:
    one = case(name)
    points, rows = skin(one.field)
    assert np.abs(one.true_mm(points)).max() < one.field.error_mm
    a, b, c = np.moveaxis(points[rows] - points.mean(axis=0), 1, 0)
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0
    assert volume == pytest.approx(one.field.volume_mm3(), rel=0.2)
    assert len(triangles(one.field)[1]) == 3 * len(rows)


def test_overlaps_are_seen() -> None:
    ring = case("ring").field
    away = ring.placed(((1, 0, 0), (0, 1, 0), (0, 0, 1)), (0.0, 7.0, 0.0))
    near = ring.placed(((1, 0, 0), (0, 1, 0), (0, 0, 1)), (0.0, 3.0, 0.0))
    assert not overlap(ring, away)
    assert overlap(ring, near)
