"""Shapes from files in the generated model: safe, and no stricter than the field itself."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ntagen import checker
from ntagen.drive.scene_json import samples_in, scene_from_json, scene_to_json
from ntagen.errors import InputError
from ntagen.imaging.grid import Wish, Workspace
from ntagen.imaging.meshes import checked
from ntagen.imaging.surfaces import field_of_mesh
from ntagen.motion import Motion
from ntagen.needle.timeline import Timeline
from ntagen.plan.synthesise import EngineSynthesiser
from ntagen.render import fields, render
from ntagen.render.frame import model_frame
from ntagen.scene import Region, Scene
from ntagen.shapes import Field, turning
from tests import anatomy
from tests.oracles import solids
from tests.oracles.declaration import Contains, Instance, enumerate_paths
from tests.scenes import paper, with_limits

ONE_ROLL = with_limits(paper(criticals=(), detections=()), max_rolls=1)
AXES = turning((0.2, 1.0, -0.4), 0.8)


@cache
def block(middle: tuple[float, float, float], size: float, is_inner: bool = False) -> Field:
    """A turned cube, with a coarse grid."""
    corners, faces = anatomy.box((0.0, 0.0, 0.0), (size, size, size))
    mesh = checked(corners @ np.array(AXES) + np.array(middle), faces, "block", None)
    space = Workspace((0.0, 0.0, 0.0), (0.0, -1.0, 0.0), 200.0)
    return field_of_mesh(mesh, Wish(space, 4.0, 0.8, is_inner), "block")


def closer_than(field: Field, by_mm: float) -> Contains:
    return lambda point: bool(field.distance_mm(np.array([point]))[0] <= by_mm)


def plans_of(scene: Scene) -> int:
    model = checker.load(render(scene))
    return len(model.check(model.queries[1].text, plans="all").plans)


def around(scene: Scene, field: Field, by_mm: float) -> int:
    """The plans that keep farther than this from a field."""
    instance = replace(Instance.of_scene(scene), solids=(closer_than(field, by_mm),))
    return enumerate_paths(instance).plans


@pytest.mark.parametrize("grown_mm", [0.0, 1.5, -0.6])
@pytest.mark.parametrize("resolution_per_mm", [100, 1000])
def test_plans_around_a_field_agree_with_the_enumeration(
    grown_mm: float, resolution_per_mm: int
) -> None:
    """The model rounds a distance down by four units at most."""
    field = block((0.0, -28.0, -3.0), 5.0).grown(grown_mm)
    scene = replace(ONE_ROLL, resolution_per_mm=resolution_per_mm)
    found = plans_of(scene.with_regions(Region("C", "critical", field)))
    assert around(scene, field, 5.0 / resolution_per_mm) <= found <= around(scene, field, 0.0)
    assert found < enumerate_paths(Instance.of_scene(scene)).plans, "it is not in the way"


def test_no_plan_of_the_model_enters_the_mesh_itself() -> None:
    corners, faces = anatomy.box((0.0, 0.0, 0.0), (5.0, 5.0, 5.0))
    triangles = (corners @ np.array(AXES) + np.array([0.0, -28.0, -3.0]))[faces]
    field = block((0.0, -28.0, -3.0), 5.0)
    true = replace(
        Instance.of_scene(ONE_ROLL),
        solids=(lambda p: bool(solids.mesh_distance(np.array([p]), triangles)[0] <= 0.0),),
    )
    found = plans_of(ONE_ROLL.with_regions(Region("C", "critical", field)))
    assert 0 < found <= enumerate_paths(true).plans


def test_plans_to_a_field_end_in_it() -> None:
    field = block((0.0, -50.0, 0.0), 20.0, is_inner=True)
    target = Region("T", "target", field)
    scene = replace(ONE_ROLL, targets=(target,))
    reach = Region.ball("T", "target", target.center_mm, field.reach_mm())

    def ends(by_mm: float) -> int:
        goal = (closer_than(field, by_mm), field.bounds_mm()[0][1])
        one = replace(Instance.of_scene(replace(ONE_ROLL, targets=(reach,))), goals=(goal,))
        return enumerate_paths(one).plans

    assert 0 < ends(-0.005) <= plans_of(scene) <= ends(0.0)
    for candidate in EngineSynthesiser()(scene).candidates:
        if candidate.certificate.holds():
            assert field.distance_at_mm(candidate.certificate.end_mm) <= 0.0


def test_the_swept_check_keeps_off_a_field() -> None:
    grain = block((0.0, -1.0, 0.0), 0.3)
    scene = paper(criticals=(Region("C", "critical", grain),), detections=())
    model = checker.load(render(replace(scene, safety="swept")))
    assert model.check("E<> Checker.Final_TR_Reached").verdict == "not satisfied"


def test_shapes_of_the_same_file_share_their_table() -> None:
    field = block((0.0, -28.0, -3.0), 5.0)
    one = render(ONE_ROLL.with_regions(Region("C", "critical", field)))
    shell = Region("D", "detection", field.grown(2.0), "C")
    two = render(ONE_ROLL.with_regions(Region("C", "critical", field), shell))
    assert len(two) < len(one) + 2000
    assert "a distance is at most" in one


def test_tables_that_are_too_large_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ntagen.rules.MOST_ENTRIES", 1000)
    field = block((0.0, -28.0, -3.0), 5.0)
    with pytest.raises(InputError, match="more than the 1,000 that a model can have\nhint"):
        render(ONE_ROLL.with_regions(Region("C", "critical", field)))


@pytest.mark.parametrize("axis", [(0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.6, 0.0, -0.8)])
def test_a_turned_scene_has_the_same_plans(axis: tuple[float, float, float]) -> None:
    """The grid has an axis of its own in a scene that is turned as a whole."""
    scene = ONE_ROLL.with_regions(Region("C", "critical", block((0.0, -28.0, -3.0), 5.0)))
    rows = model_frame(axis)
    back = tuple(zip(*zip(*rows, strict=True), strict=True))
    tip = scene.needle.tip

    def turned(v: tuple[float, float, float]) -> tuple[float, float, float]:
        x, y, z = (sum(rows[i][j] * v[i] for i in range(3)) for j in range(3))
        return (x, y, z)

    pose = replace(tip, heading=turned(tip.heading), bevel=turned(tip.bevel))
    moved = replace(
        scene,
        axis=turned(scene.axis),
        needle=replace(scene.needle, tip=pose),
        targets=tuple(
            Region(t.name, "target", t.shape.placed(back, (0, 0, 0)))  # type: ignore[arg-type]
            for t in scene.targets
        ),
        criticals=tuple(
            replace(c, shape=c.shape.placed(back, (0, 0, 0)))  # type: ignore[arg-type]
            for c in scene.criticals
        ),
    )
    assert plans_of(moved) == pytest.approx(plans_of(scene), abs=2)


def test_logs_have_fields_exactly() -> None:
    scene = ONE_ROLL.with_regions(Region("C", "critical", block((0.0, -28.0, -3.0), 5.0)))
    assert scene_from_json(scene_to_json(scene)) == scene
    shell = scene.with_regions(Region("D", "detection", scene.criticals[0].shape.grown(1.0)))
    text = scene_to_json(scene)
    assert len(scene_to_json(shell)) < len(text) + 3000, "the samples are there twice"
    rest = scene_to_json(shell, samples_in(text))
    assert len(rest) < 10_000
    assert scene_from_json(rest, samples_in(text)) == shell
    for broken in (rest, text.replace(': "eJ', ': "eJAA')):
        with pytest.raises(InputError):
            scene_from_json(broken)


def test_lines_of_samples_are_made_once() -> None:
    fields._lines.cache_clear()
    scene = ONE_ROLL.with_regions(Region("C", "critical", block((0.0, -28.0, -3.0), 5.0)))
    render(scene)
    render(scene)
    assert fields._lines.cache_info().misses == 1


def test_a_tip_enters_a_field_that_moves_when_dense_samples_say_so() -> None:
    """A distance that is a bound may change faster than the place; no entry is passed over."""
    field = block((0.0, -30.0, -10.0), 12.0, is_inner=True)
    motion = Motion(4.0, (0.0, 0.0, 8.0))
    tip = ONE_ROLL.needle.tip
    line = Timeline(tip, 30.0, 1.0, 0.0)
    line.push(tip, 40.0)
    times = np.linspace(0.0, 40.0, 40_001)
    angles = times / 30.0
    tips = np.stack([0.0 * angles, -30.0 * np.sin(angles), -30.0 * (1.0 - np.cos(angles))], axis=1)
    moved = 4.0 * (1.0 - np.cos(2.0 * np.pi * times / 4.0))
    inside = field.distance_mm(tips - moved[:, None] * np.array([0.0, 0.0, 1.0])) <= 0.0
    expected = float(times[np.argmax(inside)])
    assert inside.any()
    assert line.tip_enters(field, motion, 0.0) == pytest.approx(expected, abs=0.02)
