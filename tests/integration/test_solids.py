"""Shapes besides spheres in the generated model: the same plans as an independent enumeration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ntagen import checker
from ntagen.render import render
from ntagen.scene import Region, Scene, Vector
from ntagen.shapes import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Shape, turning
from tests.oracles import surfaces
from tests.oracles.declaration import Contains, End, Instance, Needle, enumerate_paths
from tests.scenes import PAPER, paper, with_limits

AXES = turning((0.2, 1.0, -0.4), 0.8)
MATRIX = np.array(AXES)


def at(*place: float) -> surfaces.Array:
    return np.array(place)


Maker = Callable[[Vector, float], tuple[Shape, surfaces.Solid]]


def box(middle: Vector, by: float) -> tuple[Shape, surfaces.Solid]:
    size = (5.0 * by, 3.0 * by, 4.0 * by)
    return Box(middle, size, AXES), surfaces.box(at(*middle), at(*size), MATRIX)


def ellipsoid(middle: Vector, by: float) -> tuple[Shape, surfaces.Solid]:
    radii = (3.0 * by, 1.2 * by, 2.0 * by)
    return Ellipsoid(middle, radii, AXES), surfaces.ellipsoid(at(*middle), at(*radii), MATRIX)


def ends(middle: Vector, by: float) -> tuple[Vector, Vector]:
    x, y, z = middle
    return (x - by, y + 2.0 * by, z), (x + 2.0 * by, y - by, z + by)


def capsule(middle: Vector, by: float) -> tuple[Shape, surfaces.Solid]:
    start, end = ends(middle, by)
    found = surfaces.capsule(at(*start), at(*end), 2.0 * by, by)
    return Capsule(start, end, 2.0 * by, by), found


def cylinder(middle: Vector, by: float) -> tuple[Shape, surfaces.Solid]:
    start, end = ends(middle, by)
    return Cylinder(start, end, 1.6 * by), surfaces.cylinder(at(*start), at(*end), 1.6 * by)


def half_space(middle: Vector, by: float) -> tuple[Shape, surfaces.Solid]:
    towards: Vector = (0.0, -0.6, 0.8)
    point = at(*middle) + 1.5 * by * at(*towards)
    x, y, z = map(float, point)
    return HalfSpace((x, y, z), towards), surfaces.half_space(point, at(*towards))


MAKERS: dict[str, Maker] = {
    "box": box,
    "capsule": capsule,
    "cylinder": cylinder,
    "ellipsoid": ellipsoid,
    "half-space": half_space,
}
BOUNDED = [name for name in MAKERS if name != "half-space"]
ONE_ROLL = with_limits(paper(criticals=(), detections=()), max_rolls=1)


def contains(solid: surfaces.Solid) -> Contains:
    return lambda point: bool(solid.contains(np.array([point]))[0])


def plans_of(scene: Scene) -> int:
    model = checker.load(render(scene))
    return len(model.check(model.queries[1].text, plans="all").plans)


@pytest.mark.parametrize("kind", ["critical", "detection", "unexplored"])
def test_all_kinds_of_avoided_regions_may_have_any_shape(kind: str) -> None:
    shape, solid = box((0.0, -25.0, 0.0), 1.0)
    scene = ONE_ROLL.with_regions(Region("R", kind, shape))  # type: ignore[arg-type]
    instance = replace(Instance.of_scene(ONE_ROLL), solids=(contains(solid),))
    assert plans_of(scene) == enumerate_paths(instance).plans


@pytest.mark.parametrize("name", MAKERS)
def test_plans_around_a_shape_agree_with_the_enumeration(name: str) -> None:
    shape, solid = MAKERS[name]((0.0, -30.0, -4.0), 1.5)
    scene = ONE_ROLL.with_regions(Region("C", "critical", shape))
    instance = replace(Instance.of_scene(ONE_ROLL), solids=(contains(solid),))
    free, found = enumerate_paths(Instance.of_scene(ONE_ROLL)), enumerate_paths(instance)
    assert plans_of(scene) == found.plans
    assert found.ends != free.ends, "the shape is not in the way"


@pytest.mark.parametrize("name", BOUNDED)
def test_plans_to_a_shape_agree_with_the_enumeration(name: str) -> None:
    shape, solid = MAKERS[name]((0.0, -50.0, 0.0), 5.0)
    target = Region("T", "target", shape)
    scene = replace(ONE_ROLL, targets=(target,))
    reach = Region.ball("T", "target", target.center_mm, shape.reach_mm())
    goal = (contains(solid), shape.bounds_mm()[0][1])
    instance = replace(Instance.of_scene(replace(ONE_ROLL, targets=(reach,))), goals=(goal,))
    plans = enumerate_paths(instance).plans
    assert plans_of(scene) == plans > 0


def test_shapes_of_all_kinds_together() -> None:
    places = [(6.0, -20.0, 0.0), (-6.0, -30.0, 2.0), (0.0, -30.0, -6.0), (4.0, -35.0, 4.0)]
    made = [MAKERS[name](place, 1.0) for name, place in zip(BOUNDED, places, strict=True)]
    regions = [Region(f"C{i}", "critical", shape) for i, (shape, _) in enumerate(made)]
    scene = replace(ONE_ROLL, criticals=PAPER.criticals).with_regions(*regions)
    instance = Instance.of_scene(replace(ONE_ROLL, criticals=PAPER.criticals))
    instance = replace(instance, solids=tuple(contains(solid) for _, solid in made))
    assert plans_of(scene) == enumerate_paths(instance).plans > 0


@pytest.mark.parametrize("name", MAKERS)
def test_the_swept_check_sees_what_lies_between_two_pushes(name: str) -> None:
    """The first push goes from (0, 0, 0) to (0, -1.95, -0.09); the shape lies half way."""
    shape, _ = MAKERS[name]((0.0, -1.0, 0.0), 0.08)
    if name == "half-space":
        shape = Box((0.0, -1.0, 0.0), (9.0, 0.1, 9.0))
    grain = Region("C1", "critical", shape)
    scene = paper(criticals=(grain,), detections=())
    answer = checker.load(render(scene)).check("E<> Checker.Final_TR_Reached")
    assert answer.verdict == "satisfied"
    swept = checker.load(render(replace(scene, safety="swept")))
    assert swept.check("E<> Checker.Final_TR_Reached").verdict == "not satisfied"
    # The margin of the swept check is a third of a millimetre here.
    beside, _ = MAKERS[name]((0.0, 5.0, 0.8) if name == "half-space" else (0.8, -1.0, 0.0), 0.08)
    if name == "half-space":
        beside = HalfSpace((0.0, 0.5, 0.0), (0.0, 1.0, 0.0))
    free = replace(scene, safety="swept", criticals=(replace(grain, shape=beside),))
    model = checker.load(render(free))
    assert model.check("E<> Checker.Final_TR_Reached").verdict == "satisfied"


@pytest.mark.parametrize("resolution_per_mm", [1, 100_000])
def test_no_size_overflows(resolution_per_mm: int) -> None:
    """Shapes as large and as far away as the numbers of the model allow."""
    largest = 0.45 * 2**28 / resolution_per_mm
    far: Vector = (largest, -largest, largest)
    sizes = (largest, largest, largest)
    shapes: list[Shape] = [
        Box(far, sizes, AXES),
        Capsule(far, (largest, -largest, 0.0), 0.4 * largest, 0.1 * largest),
        Cylinder(far, (largest, -largest, 0.0), 0.4 * largest),
        Ellipsoid(far, (0.4 * largest, 0.2 * largest, 0.1 * largest), AXES),
        HalfSpace((0.0, -largest, 0.0), (0.0, -1.0, 0.0)),
    ]
    regions = [Region(f"C{i}", "critical", shape) for i, shape in enumerate(shapes)]
    scene = replace(ONE_ROLL, resolution_per_mm=resolution_per_mm).with_regions(*regions)
    scene = replace(scene, needle=replace(scene.needle, radius_mm=30.0))
    model = checker.load(render(replace(scene, limits=replace(scene.limits, step_s=40.0))))
    for query in model.queries:
        assert model.check(query.text).verdict in ("satisfied", "not satisfied")


def swept_plans(scene: Scene, shape: Shape, by_mm: float) -> int:
    """Paths to the target that keep farther than this from a shape, also between two pushes."""
    scale = scene.resolution_per_mm
    waiting = [(Needle.start(Instance.of_scene(scene)), np.zeros((1, 3)))]
    plans = 0
    while waiting:
        needle, arc = waiting.pop()
        if (shape.distance_mm(arc) <= by_mm).any():
            continue
        end = needle.check()
        if end is not None:
            plans += end is End.FINAL_TR_REACHED
            continue
        here = np.array([needle.tip_pos]) / scale
        for angle in needle.instance.angles if needle.may_roll() else ():
            rolled = needle.copy()
            rolled.roll(angle)
            waiting.append((rolled, here))
        middle = np.array(needle.motion_circle_center) / scale
        needle.push()
        waiting.append((needle, between(here[0], np.array(needle.tip_pos) / scale, middle)))
    return plans


def between(start: surfaces.Array, end: surfaces.Array, middle: surfaces.Array) -> surfaces.Array:
    """Points on the short arc about a middle from one place to another, both ends included."""
    first, last = start - middle, end - middle
    angle = np.arccos(first @ last / np.linalg.norm(first) / np.linalg.norm(last))
    shares = np.linspace(0.0, 1.0, 60)[:, None]
    along = np.sin((1.0 - shares) * angle) * first + np.sin(shares * angle) * last
    return np.asarray(middle + along / np.sin(angle))


@pytest.mark.parametrize("name", MAKERS)
def test_the_swept_check_is_sound_and_not_too_strict(name: str) -> None:
    """The needle keeps off the shape itself, and the shape counts as larger by the margins only.

    These are 11 units of a direction times the radius, and a 64th of a push.
    """
    shape, _ = MAKERS[name]((0.0, -28.0, -3.0), 1.2)
    swept = replace(ONE_ROLL, safety="swept")
    found = plans_of(swept.with_regions(Region("C", "critical", shape)))
    margin_mm = 0.001 * (11 * 30 + 2) + 2.0 / 64.0
    assert swept_plans(ONE_ROLL, shape, margin_mm + 0.01) <= found
    assert found <= swept_plans(ONE_ROLL, shape, 0.0)
    assert found < swept_plans(ONE_ROLL, shape, -99.0), "the shape is not in the way"
