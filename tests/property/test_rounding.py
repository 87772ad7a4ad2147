"""The bound of the model's rounding: no path of the model is farther from the exact one.

The model's path is that of the port of the declaration (`tests.oracles.declaration`), the exact one
that of `ntagen.needle.kinematics`. Plans, radii, poses, rolls and resolutions are drawn.

`NTAGEN_PLANS=5000 NTAGEN_SEED=1 pytest tests/property/test_rounding.py -s` follows so many plans,
and prints which part of its bound the largest error was.
"""

from __future__ import annotations

import math
import os
import random
from dataclasses import replace
from statistics import median

import pytest

from ntagen.needle.kinematics import push, roll
from ntagen.rounding import MOST_ERROR_MM, Precision, chosen, precision_of
from ntagen.scene import Limits, Needle, Pose, Region, Scene, Tissue, Vector
from tests.oracles import declaration
from tests.scenes import PAPER, paper

PLANS = int(os.environ.get("NTAGEN_PLANS", "60"))
SEED = int(os.environ.get("NTAGEN_SEED", "0"))
SCALES = (1000, 1000, 2000, 10_000, 100_000, 500_000, 1_000_000)


def drawn_pose(numbers: random.Random) -> Pose:
    """The pose of the paper, or any other whose heading leans at most 60 degrees."""
    if numbers.random() < 0.3:
        return PAPER.needle.tip
    lean, turn, spin = numbers.uniform(0.0, 1.0), numbers.uniform(0.0, 7.0), numbers.random() * 7.0
    side: Vector = (math.cos(turn), 0.0, math.sin(turn))
    heading = (math.sin(lean) * side[0], -math.cos(lean), math.sin(lean) * side[2])
    first = (math.cos(lean) * side[0], math.sin(lean), math.cos(lean) * side[2])
    x, y, z = (
        math.cos(spin) * a + math.sin(spin) * b
        for a, b in zip(first, (-side[2], 0.0, side[0]), strict=True)
    )
    return Pose((numbers.uniform(-9, 9), numbers.uniform(-9, 9), 1.0), heading, (x, y, z))


def drawn_scene(numbers: random.Random) -> Scene:
    """A task with a plan that is as long as its needle, as far as the model goes."""
    angles = numbers.choice(((90, 180, 270), (60, 120, 180, 240, 300), (37, 111, 222), (180,)))
    scale = numbers.choice(SCALES)
    needle = Needle(
        drawn_pose(numbers),
        numbers.choice((30.0, 100.0, numbers.uniform(20.0, 220.0))),
        numbers.choice((1.0, numbers.uniform(0.5, 2.0))),
        numbers.uniform(20.0, 200.0),
    )
    rolls = numbers.choice((0, 1, 2, 2, 3, 5))
    return Scene(
        name="drawn",
        needle=needle,
        axis=(0.0, -1.0, 0.0),
        limits=Limits(2.0, tuple(math.radians(one) for one in angles), rolls, 0.0),
        targets=(Region.ball("T", "target", (0.0, -numbers.uniform(40, 400), 0.0), 5.0),),
        resolution_per_mm=scale,
    )


def largest_error_mm(scene: Scene, numbers: random.Random, depth_mm: float) -> float:
    """The largest distance of the model's path from the exact one, on a plan that is drawn."""
    limits, radius_mm = scene.limits, scene.needle.radius_mm
    model = declaration.Needle.start(declaration.Instance.of_scene(scene))
    push_mm = scene.needle.speed_mm_per_s * limits.step_s
    pose, worst_mm = scene.needle.tip, 0.0
    pushes = int(depth_mm / push_mm + 1e-9)
    rolls = sorted(numbers.randint(0, pushes) for _ in range(limits.max_rolls))
    errors_rad, factors = scene.tissue.roll_errors_rad, scene.tissue.factors
    for number in range(pushes + 1):
        while rolls and rolls[0] == number:
            rolls.pop(0)
            angle_rad = numbers.choice(limits.roll_angles_rad)
            model.roll(round(math.degrees(angle_rad)))
            pose = roll(pose, angle_rad)
            if scene.tissue.is_adversarial:
                error_rad = numbers.choice(errors_rad)
                radius_mm = scene.needle.radius_mm / numbers.choice(factors)
                pick(model, radius_mm, error_rad)
                pose = roll(pose, error_rad)
        if number < pushes:
            model.push()
            pose = push(pose, radius_mm, push_mm)
            place = [part / model.instance.scale for part in model.tip_pos]
            worst_mm = max(worst_mm, math.dist(place, pose.position_mm))
    return worst_mm


def pick(model: declaration.Needle, radius_mm: float, error_rad: float) -> None:
    """What a tissue that answers does to the model's needle; see ``pick()`` of the declaration."""
    scale = model.instance.scale
    model.instance = replace(model.instance, circle_r=round(radius_mm * scale))
    model.tip_roll = round(error_rad * scale)
    model.fold()


def test_no_path_of_the_model_errs_by_more_than_the_bound() -> None:
    ratios = []
    for number in range(PLANS):
        numbers = random.Random(1_000_003 * SEED + number)
        scene = drawn_scene(numbers)
        if numbers.random() < 0.2:
            scene = replace(scene, tissue=Tissue("adversarial", 0.1, math.radians(5.0)))
        found = precision_of(scene)
        if math.isinf(found.path_error_mm):
            continue
        error_mm = largest_error_mm(scene, numbers, found.depth_mm)
        assert error_mm <= found.path_error_mm, (number, scene)
        ratios.append(error_mm / found.path_error_mm)
    print(
        f"\n{len(ratios)} plans: the largest error is {max(ratios):.2f} of its bound, "
        f"the median {median(ratios):.3f}"
    )
    # The bound is of use: some plan takes a good part of it.
    assert len(ratios) > 0.6 * PLANS
    assert max(ratios) > 0.2


@pytest.mark.parametrize("radius_mm", [30.0, 100.0, 130.0, 200.0])
@pytest.mark.parametrize("rolls", [0, 2])
def test_what_is_chosen_errs_by_at_most_a_twentieth_of_a_millimetre(
    radius_mm: float, rolls: int
) -> None:
    needle = replace(PAPER.needle, radius_mm=radius_mm, length_mm=120.0)
    limits = replace(PAPER.limits, max_rolls=rolls)
    scene = paper(needle=needle, limits=limits, resolution_per_mm=None)
    found = chosen(scene)
    assert found.path_error_mm <= MOST_ERROR_MM
    assert precision_of(scene) == found
    # A coarser one of the series would not do.
    coarser = {1: 2, 2: 2, 5: 2.5}[int(str(found.per_mm)[0])]
    if found.per_mm > 1000:
        worse = precision_of(replace(scene, resolution_per_mm=int(found.per_mm / coarser)))
        assert worse.path_error_mm > MOST_ERROR_MM


def test_a_finer_resolution_errs_less_and_deeper_paths_err_more() -> None:
    def at(per_mm: int, length_mm: float) -> Precision:
        needle = replace(PAPER.needle, length_mm=length_mm)
        return precision_of(paper(needle=needle, resolution_per_mm=per_mm))

    errors = [at(per_mm, 120.0).path_error_mm for per_mm in (3000, 30_000, 300_000)]
    assert errors == sorted(errors, reverse=True)
    errors = [at(3000, length_mm).path_error_mm for length_mm in (20.0, 60.0, 120.0, 200.0)]
    assert errors == sorted(errors)


def test_no_path_goes_deeper_than_where_the_targets_end_behind_it() -> None:
    """A wide circle cannot turn the needle, so it has passed the target before its length ends."""
    needle = replace(PAPER.needle, radius_mm=200.0)
    scene = paper(needle=needle, resolution_per_mm=None)
    assert 60.0 < chosen(scene).depth_mm < 66.0
    assert chosen(paper(resolution_per_mm=None)).depth_mm == 200.0


def test_what_does_not_fit_is_never_chosen() -> None:
    far = replace(PAPER.needle, radius_mm=5000.0)
    found = chosen(paper(needle=far, resolution_per_mm=None))
    assert found.per_mm == 50_000
    assert found.path_error_mm > MOST_ERROR_MM


def test_too_coarse_a_resolution_has_no_bound() -> None:
    assert math.isinf(precision_of(paper(resolution_per_mm=50)).path_error_mm)
    assert math.isinf(precision_of(paper(resolution_per_mm=2**28)).path_error_mm)
