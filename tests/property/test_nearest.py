"""The least distance of any arc to any convex shape agrees with dense samples of the arc."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from ntagen.needle.kinematics import Arc
from ntagen.needle.nearest import TOLERANCE_MM, nearest_to
from ntagen.scene import Pose
from ntagen.shapes import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Shape, Vector, turning
from tests.examples import examples
from tests.scenes import lengths

SAMPLES = 4001
ENTRY = Pose((0.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))


def points() -> st.SearchStrategy[Vector]:
    return st.tuples(lengths(-30.0, 30.0), lengths(-50.0, 10.0), lengths(-30.0, 30.0))


@st.composite
def shapes(draw: st.DrawFn) -> Shape:
    here, there = draw(points()), draw(points())
    axes = turning((1.0, 2.0, -0.5), draw(lengths(0.0, 6.0)))
    one, two, three = (draw(lengths(0.1, 15.0)) for _ in range(3))
    kinds: list[Shape] = [
        Box(here, (one, two, three), axes),
        Ellipsoid(here, (one, two, three), axes),
        HalfSpace(here, axes[0]),
    ]
    if math.dist(here, there) > 0.1:
        # One ball of a capsule may contain the other.
        kinds += [Capsule(here, there, one, two), Cylinder(here, there, three)]
    return draw(st.sampled_from(kinds))


@settings(max_examples=examples(200), deadline=None)
@given(shapes(), lengths(2.0, 200.0), lengths(0.1, 100.0))
def test_the_least_distance_of_an_arc(shape: Shape, radius_mm: float, length_mm: float) -> None:
    arc = Arc(ENTRY, radius_mm, length_mm)
    along = np.linspace(0.0, length_mm, SAMPLES)
    places = np.array([arc.position_at(float(one)) for one in along])
    dense_mm = float(shape.distance_mm(places).min())
    found_mm = nearest_to((arc,), ENTRY.position_mm, shape).distance_mm
    between_mm = 0.5 * length_mm / (SAMPLES - 1)
    assert dense_mm - between_mm - TOLERANCE_MM - 1e-6 <= found_mm + shape.excess_mm
    assert found_mm <= dense_mm + 1e-9
