"""Markers and poses of a run, as plain values."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from ntagen.drive.records import Foreseen, Forgotten, Learned
from ntagen.drive.viewing import show_record, show_scene
from ntagen.needle.vectors import distance
from ntagen.nsl import load
from ntagen.ros.shown import Board, Marker, markers_of, tube_of

ROOT = Path(__file__).parents[3]


def test_the_regions_of_a_scene_are_markers_in_mm() -> None:
    scene = load(ROOT / "examples" / "paper.nsl")
    ((_, update),) = show_scene(scene)
    markers = {marker.name: marker for marker in markers_of(update)}
    target = markers["target T1"]
    assert target.shape == "sphere"
    assert target.center_mm == pytest.approx(scene.targets[0].center_mm)
    assert target.size_mm == pytest.approx(2.0 * scene.targets[0].radius_mm)
    assert 0.0 < target.colour[3] < 1.0


def test_other_shapes_are_triangles() -> None:
    scene = load(ROOT / "examples" / "ribs" / "ribs.nsl")
    ((_, update),) = show_scene(scene)
    meshes = [marker for marker in markers_of(update) if marker.shape == "triangles"]
    assert meshes
    assert all(len(marker.points_mm) % 3 == 0 and marker.points_mm for marker in meshes)


def test_a_later_marker_takes_the_place_of_one_with_its_name() -> None:
    board = Board()
    learned = Learned(1.0, "L1", "critical", (1.0, 2.0, 3.0), 2.0)
    for record in (learned, Learned(2.0, "L1", "critical", (1.0, 2.0, 3.0), 4.0)):
        for topic, update in show_record(record):
            if topic == "/scene":
                board.put(markers_of(update))
    (one,) = board.standing()
    assert one.size_mm == pytest.approx(8.0)
    ((_, update),) = (
        shown for shown in show_record(Forgotten(3.0, "L1", "critical")) if shown[0] == "/scene"
    )
    assert board.put(markers_of(update)) == (Marker("critical L1", "nothing"),)
    assert board.standing() == ()


@pytest.mark.parametrize("way", [(0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.6, 0.0, 0.8)])
def test_the_tube_lies_around_the_plan(way: tuple[float, float, float]) -> None:
    depths = (0.0, 2.0, 4.0, 6.0)
    places = [tuple(depth * part for part in way) for depth in depths]
    x, y, z = zip(*places, strict=True)
    record = Foreseen(0.0, 0.0, depths, (0.1, 0.2, 0.3, 0.4), x, y, z, 0.99)
    tube = tube_of(record, 0.98)
    assert (tube.shape, len(tube.points_mm)) == ("triangles", 3 * 2 * 16 * 3)
    sigmas = 2.0537
    for point in tube.points_mm:
        along = sum(a * b for a, b in zip(point, way, strict=True))
        on_axis = tuple(along * part for part in way)
        assert distance(point, on_axis) == pytest.approx(  # type: ignore[arg-type]
            sigmas * (0.1 + 0.05 * along), abs=1e-3
        )
    assert not any(math.isnan(number) for point in tube.points_mm for number in point)


def test_a_tube_without_length_removes_the_one_before() -> None:
    record = Foreseen(0.0, 0.0, (0.0,), (0.1,), (0.0,), (0.0,), (0.0,), 0.99)
    assert tube_of(record, 0.98).shape == "nothing"
