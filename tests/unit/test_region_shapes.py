"""Regions that are no spheres, wherever a scene is used."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ntagen import nsl
from ntagen.drive.knowledge import Knowledge, told
from ntagen.drive.scene_json import scene_from_json, scene_to_json
from ntagen.drive.settings import Settings
from ntagen.drive.shells import sensing_margin_mm, shells_of
from ntagen.drive.supervisor import Guard
from ntagen.drive.viewing import show_scene
from ntagen.errors import InputError
from ntagen.needle.contact import Assumed, Contact
from ntagen.needle.kinematics import Arc
from ntagen.needle.measurement import Measurement
from ntagen.needle.nearest import TOLERANCE_MM, enters_at, nearest_to
from ntagen.needle.sweep import BOUND_MM, Sweep
from ntagen.needle.virtual import Errors, Obstacle, SimulatedClock, VirtualNeedle
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.plan.certify import certify
from ntagen.plan.stricter import stricter as narrower
from ntagen.plot.picture import Picture, draw
from ntagen.scene import Pose, Region
from ntagen.shapes import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Shape, Sphere, turning
from tests.scenes import PAPER, paper

AXES = turning((1.0, 0.4, 0.2), 0.6)
SHAPES: dict[str, Shape] = {
    "box": Box((3.0, -20.0, -4.0), (6.0, 5.0, 4.0), AXES),
    "capsule": Capsule((5.0, -10.0, -5.0), (2.0, -30.0, -9.0), 2.0, 1.0),
    "cylinder": Cylinder((5.0, -10.0, -5.0), (2.0, -30.0, -9.0), 2.0),
    "ellipsoid": Ellipsoid((3.0, -20.0, 4.0), (1.0, 6.0, 2.0), AXES),
    "half-space": HalfSpace((0.0, 0.0, -12.0), (0.0, 0.0, -1.0)),
}
PLAN = Plan((Push(16.0), Roll(math.radians(90)), Push(30.0)))
START = PAPER.needle.tip
ASSUMED = Assumed(margin_mm=3.0, clearance_mm=3.0, radius_mm=2.0)


def critical(shape: Shape) -> Region:
    return Region("C", "critical", shape)


def places(count: int = 40_001) -> np.ndarray:
    """Places along the plan, a micrometre or so apart."""
    arcs = PLAN.arcs(PAPER.needle)
    along = np.linspace(0.0, 1.0, count // 2)
    return np.array(
        [arc.pose_at(float(a * arc.length_mm)).position_mm for arc in arcs for a in along]
    )


@pytest.mark.parametrize("name", SHAPES)
def test_a_certificate_has_the_least_distance_of_the_path(name: str) -> None:
    shape = SHAPES[name]
    scene = paper(criticals=(critical(shape),), detections=())
    found = certify(PLAN, scene).clearances[0].distance_mm
    dense = float(shape.distance_mm(places()).min())
    assert dense - TOLERANCE_MM - 1e-6 <= found <= dense


@pytest.mark.parametrize("name", SHAPES)
def test_a_sweep_agrees_with_the_certificate(name: str) -> None:
    shape = SHAPES[name]
    region = critical(shape)
    sweep = Sweep([region], START.position_mm)
    arcs = PLAN.arcs(PAPER.needle)
    for arc in arcs:
        sweep.follow(arc.start, 1.0 / arc.radius_mm, 0.0, arc.length_mm)
    exact = nearest_to(arcs, START.position_mm, shape).distance_mm
    assert exact - 2.0 * BOUND_MM <= sweep.clearance_mm() <= exact + TOLERANCE_MM + 1e-6


@pytest.mark.parametrize("name", ["box", "capsule", "cylinder", "ellipsoid"])
def test_a_target_is_entered_where_the_path_first_touches_it(name: str) -> None:
    middle = PLAN.arcs(PAPER.needle)[-1].pose_at(25.0).position_mm
    shape = SHAPES[name]
    shift = np.array(middle) - np.array(shape.center_mm)
    there = shape.placed(((1, 0, 0), (0, 1, 0), (0, 0, 1)), tuple(map(float, shift)))
    scene = paper(targets=(Region("T", "target", there),), criticals=(), detections=())
    found = certify(PLAN, scene).arrivals[0]
    arc = PLAN.arcs(PAPER.needle)[-1]
    along = np.linspace(0.0, arc.length_mm, 30_001)
    inside = there.distance_mm(np.array([arc.pose_at(float(a)).position_mm for a in along])) <= 0.0
    assert found.entered_at_mm == pytest.approx(16.0 + along[inside.argmax()], abs=3e-3)
    assert found.depth_mm == pytest.approx(-there.distance_at_mm(arc.end.position_mm))


def test_a_path_that_ends_before_a_shape_does_not_enter_it() -> None:
    wall = HalfSpace((0.0, -10.0, 0.0), (0.0, -1.0, 0.0))
    assert enters_at(Arc(START, math.inf, 9.9), wall) is None
    assert enters_at(Arc(START, math.inf, 20.0), wall) == pytest.approx(10.0, abs=1e-3)
    assert nearest_to((Arc(START, math.inf, 9.0),), START.position_mm, wall).distance_mm == (
        pytest.approx(1.0, abs=2e-3)
    )


@pytest.mark.parametrize("name", SHAPES)
def test_a_needle_feels_the_margin_of_a_shape(name: str) -> None:
    region = critical(SHAPES[name])
    obstacle = Obstacle(region, 3.0)
    needle = VirtualNeedle(PAPER.needle, (obstacle,), Errors(), 1, SimulatedClock())
    needle.push(16.0)
    tip = needle.true_tip.position_mm
    away = region.distance_mm(tip)
    assert obstacle.depth_in_margin_mm(tip) == max(0.0, 3.0 - away)
    exact = nearest_to(needle.pierced, START.position_mm, region.shape).distance_mm
    assert needle.true_clearance_mm() == exact


@pytest.mark.parametrize("name", SHAPES)
def test_the_driver_knows_the_shell_of_a_shape(name: str) -> None:
    region = critical(SHAPES[name])
    shell = Region("D", "detection", region.shape.grown(3.0))
    scene = paper(criticals=(region,), detections=(shell,))
    assert shells_of(region, scene.detections) == (shell,)
    assert sensing_margin_mm(region, scene.detections, 9.0) == pytest.approx(3.0, abs=1e-6)
    hidden = told(scene, "none")
    assert hidden.criticals == hidden.detections == ()
    # A contact a little outside of the shell is explained by the region, and makes its shell wider.
    knowledge = Knowledge(scene)
    known = knowledge.with_contact(_felt_at(region, 3.5), ASSUMED)
    assert [(one.name, one.kind) for one in known.learned] == [("C felt", "detection")]
    assert known.learned[0].shape.depth_mm == pytest.approx(region.shape.depth_mm + 4.5)
    # One that is far away is a new region.
    new = knowledge.with_contact(_felt_at(region, 9.0), ASSUMED)
    assert [one.name for one in new.learned] == ["learned 1", "learned 1 shell"]
    # A shell in which the tip lies gets smaller.
    inside = knowledge.scene(_tip_at(region, 2.0), 30.0)
    assert inside.detections[0].distance_mm(_tip_at(region, 2.0).position_mm) > 0.0
    settings = Settings()
    assert knowledge.expected_force_n(_tip_at(region, 1.0).position_mm, settings) > 0.0
    assert knowledge.expected_force_n(_tip_at(region, 5.0).position_mm, settings) == 0.0


def _felt_at(region: Region, away_mm: float) -> Contact:
    tip = _tip_at(region, away_mm)
    return Contact(tip.position_mm, tip.heading, 3.0)


def _tip_at(region: Region, away_mm: float) -> Pose:
    """A pose this far from the surface, straight above the middle."""
    x, y, z = region.center_mm
    low, high = 0.0, 200.0
    for _ in range(80):
        half = 0.5 * (low + high)
        if region.distance_mm((x, y, z + half)) < away_mm:
            low = half
        else:
            high = half
    return replace(START, position_mm=(x, y, z + high))


def test_scenes_with_larger_regions_keep_their_shapes() -> None:
    target = Region("T", "target", Box((0.0, -50.0, 0.0), (20.0, 8.0, 12.0), AXES))
    scene = paper(targets=(target,), criticals=tuple(map(critical, SHAPES.values())))
    stricter = narrower(scene, 2.0, 1.0, 1.5)
    for one, other in zip(scene.criticals, stricter.criticals, strict=True):
        assert other.shape == one.shape.grown(2.0)
    assert stricter.targets[0].shape.depth_mm == pytest.approx(4.0 - 1.5 - 0.3)


def test_the_guard_of_a_push_sees_a_tip_in_any_shape() -> None:
    box = critical(Box((0.0, -5.0, 0.0), (4.0, 4.0, 4.0)))
    guard = Guard((0.0, 0.0, 0.0), (0.0, -9.0, 0.0), 50.0, math.inf, (box,), 0.5)
    assert "in the critical region 'C'" in (guard.breach(_measured(-5.0)) or "")
    assert guard.breach(_measured(-3.2)) is None


def _measured(y: float) -> Measurement:
    return Measurement(time_s=0.0, position_mm=(0.0, y, 0.0), force_n=0.0)


def test_a_scene_of_all_shapes_goes_through_the_log() -> None:
    regions = [critical(shape) for shape in SHAPES.values()]
    shells = [Region("D", "detection", one.shape.grown(0.1), "C") for one in regions]
    scene = paper(criticals=tuple(regions), detections=tuple(shells))
    assert scene_from_json(scene_to_json(scene)) == scene
    text = scene_to_json(scene)
    assert '"form": "half-space"' not in text
    with pytest.raises(InputError, match="cannot be read"):
        scene_from_json(text.replace('"form": "box"', '"form": "cone"'))
    with pytest.raises(InputError, match="must be greater than 0"):
        scene_from_json(text.replace('"size_mm": [\n      6.0', '"size_mm": [\n      -6.0', 1))


def test_all_shapes_can_be_drawn_and_viewed() -> None:
    scene = paper(criticals=tuple(map(critical, SHAPES.values())))
    figure = draw(Picture(scene, best=[START.position_mm, (0.0, -40.0, 0.0)]))
    assert len(figure.axes[0].patches) == len(scene.regions)
    ((topic, update),) = show_scene(scene)
    entities = {entity.id: entity for entity in update.entities}
    assert topic == "/scene"
    drawn = [entity for entity in update.entities if entity.triangles]
    assert len(drawn) == len(SHAPES)
    for entity, shape in zip(drawn, SHAPES.values(), strict=True):
        (mesh,) = entity.triangles
        points = np.array([[p.x, p.y, p.z] for p in mesh.points]) * 1e3
        near = points[np.linalg.norm(points - np.array(shape.center_mm), axis=1) < 99.0]
        assert np.abs(shape.distance_mm(near)).max() < 1e-6
        assert max(mesh.indices) == len(points) - 1
    assert entities["target T1"].spheres


def test_a_region_has_a_radius_only_if_it_is_a_sphere() -> None:
    with pytest.raises(TypeError, match="no sphere"):
        _ = critical(SHAPES["box"]).radius_mm
    assert critical(Sphere((0.0, 0.0, 0.0), 2.0)).radius_mm == 2.0
    with pytest.raises(InputError, match="the radii of `C` must be greater than 0"):
        critical(Ellipsoid((0.0, 0.0, 0.0), (1.0, 0.0, 1.0)))
    with pytest.raises(InputError, match="the size of `C` is nan"):
        critical(Box((0.0, 0.0, 0.0), (1.0, math.nan, 1.0)))


CORPUS = Path(__file__).parents[1] / "corpus" / "nsl" / "ok" / "shapes.nsl"


def test_shapes_in_a_file() -> None:
    scene = nsl.load(CORPUS)
    by_name = {region.name: region.shape for region in scene.regions}
    turn = turning((0.0, 0.0, 1.0), math.radians(30.0))
    box = Box((0.0, -20.0, 15.0), (10.0, 4.0, 6.0), turn)
    assert by_name["B1"] == box
    assert by_name["D1"] == box.grown(2.0)
    assert by_name["V1"] == Capsule((8.0, -10.0, 0.0), (15.0, -30.0, 2.0), 3.0, 3.0)
    assert by_name["V2"] == Capsule((-8.0, -10.0, 0.0), (-15.0, -30.0, 2.0), 2.0, 1.5)
    assert by_name["K1"] == Cylinder((0.0, -10.0, -9.0), (0.0, -30.0, -9.0), 3.0)
    tilt = turning((0.0, 0.5**0.5, 0.5**0.5), math.radians(20.0))
    ellipsoid = by_name["E1"]
    assert isinstance(ellipsoid, Ellipsoid)
    assert ellipsoid.radii_mm == (3.0, 5.0, 2.0)
    assert np.array(ellipsoid.axes) == pytest.approx(np.array(tilt))
    assert by_name["H"] == HalfSpace((0.0, -70.0, 0.0), (0.0, -1.0, 0.0))
    assert by_name["box[1]"] == Box((0.0, -2.0, 0.0), (1.0, 1.0, 1.0))
