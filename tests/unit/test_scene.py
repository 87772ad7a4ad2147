"""Scenes made in Python obey the rules of those that are written in files."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from ntagen.drive.scene_json import scene_from_json, scene_to_json
from ntagen.errors import InputError
from ntagen.scene import Needle, Pose, Region
from ntagen.shapes import Sphere
from tests.scenes import PAPER, paper, with_limits

NAN, INF = math.nan, math.inf
TIP = PAPER.needle.tip
C1 = PAPER.criticals[0]


def needle(**changes: object) -> Callable[[], Needle]:
    return lambda: replace(PAPER.needle, **changes)  # type: ignore[arg-type]


def tip(**changes: object) -> Callable[[], Needle]:
    return lambda: Needle(replace(TIP, **changes), 30.0, 1.0)  # type: ignore[arg-type]


BREACHES: list[tuple[Callable[[], object], str]] = [
    (tip(heading=(0.0, -2.0, 0.0)), "the heading must be a vector of length 1, .* is 2"),
    (tip(heading=(0.0, 0.0, 0.0)), "the heading must be a vector of length 1"),
    (tip(bevel=(0.0, 0.0, 1.1)), "the bevel must be a vector of length 1"),
    (tip(bevel=(0.0, 1.0, 0.0)), "at right angles, but the angle is 180 deg"),
    (tip(position_mm=(NAN, 0.0, 0.0)), "the tip's position is nan"),
    (tip(heading=(NAN, -1.0, 0.0)), "the heading is nan"),
    (needle(radius_mm=-30.0), "the radius of the motion circle must be greater than 0"),
    (needle(radius_mm=0.0), "the radius of the motion circle must be greater than 0"),
    (needle(radius_mm=INF), "the radius of the motion circle is inf"),
    (needle(speed_mm_per_s=0.0), "the insertion speed must be greater than 0"),
    (needle(length_mm=-1.0), "the needle's length cannot be negative"),
    (
        lambda: replace(C1, shape=Sphere(C1.center_mm, -2.0)),
        "the radius of `C1` must be greater than 0",
    ),
    (lambda: replace(C1, shape=Sphere(C1.center_mm, NAN)), "the radius of `C1` is nan"),
    (lambda: replace(C1, shape=Sphere((0.0, INF, 0.0), 2.0)), "the centre of `C1` is inf"),
    (lambda: replace(C1, kind="soft"), "`C1` is a soft region"),
    (lambda: replace(C1, around="C2"), "only a detection region has `around`"),
    (lambda: with_limits(PAPER, step_s=0.0), "the step must be greater than 0"),
    (lambda: with_limits(PAPER, roll_angles_rad=(1.0,)), "whole number of degrees"),
    (lambda: with_limits(PAPER, roll_angles_rad=(7.0,)), "less than 360 deg"),
    (lambda: with_limits(PAPER, max_rolls=101), "from 0 to 100"),
    (lambda: with_limits(PAPER, min_roll_distance_mm=-1.0), "cannot be negative"),
    (lambda: paper(axis=(0.0, -3.0, 0.0)), "the axis must be a vector of length 1"),
    (lambda: paper(resolution_per_mm=0), "the resolution must be a whole number"),
    (lambda: paper(resolution_per_mm=2**40), "the resolution does not fit"),
    (lambda: paper(safety="none"), "there is no safety"),
    (lambda: paper(targets=(C1,)), "`C1` is a critical region among the target regions"),
]


@pytest.mark.parametrize(("make", "says"), BREACHES)
def test_a_value_that_breaks_a_rule_is_refused(make: Callable[[], object], says: str) -> None:
    with pytest.raises(InputError, match=says):
        make()


def test_all_that_is_wrong_with_a_value_is_said() -> None:
    with pytest.raises(InputError, match=r"(?s)radius.*\n.*speed"):
        Needle(TIP, -1.0, 0.0)


def test_what_a_driver_makes_is_accepted() -> None:
    scene = paper().with_needle(Pose((0.0, -9.0, 0.0), TIP.heading, TIP.bevel), 31.0, 1000.0)
    assert scene.needle.length_mm == 0.0
    inside = Region.ball("learned 1", "critical", (0.0, -9.0, 0.0), 2.0)
    assert scene.with_regions(inside).with_targets(()).criticals[-1] == inside


@pytest.mark.parametrize("wrong", ["-30.0", "NaN", '"wide"', "[]", "1e999"])
def test_a_scene_of_a_log_obeys_the_rules_too(wrong: str) -> None:
    text = scene_to_json(PAPER).replace('"radius_mm": 30.0', f'"radius_mm": {wrong}')
    with pytest.raises(InputError):
        scene_from_json(text)
