"""A needle that got exactly level circles for ever; its length ends that."""

from __future__ import annotations

from dataclasses import replace

from ntagen import checker
from ntagen.render import render
from ntagen.scene import Pose, Scene
from tests.scenes import paper

GAME = "control: A<> Checker.Final_TR_Reached"


def level(length_mm: float) -> Scene:
    """A needle whose heading lies in the plane of its bend, at right angles to -y."""
    scene = paper(criticals=(), detections=())
    tip = Pose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    needle = replace(scene.needle, tip=tip, length_mm=length_mm)
    limits = replace(scene.limits, max_rolls=0)
    return replace(scene, needle=needle, limits=limits)


def test_a_circle_in_the_plane_ends_with_the_needle() -> None:
    for length_mm in (10.0, 100.0):
        answer = checker.load(render(level(length_mm))).check(GAME)
        assert answer.verdict == "not satisfied"


def test_a_longer_needle_explores_more() -> None:
    answers = [checker.load(render(level(length))).check(GAME) for length in (10.0, 100.0)]
    assert answers[0].explored < answers[1].explored
