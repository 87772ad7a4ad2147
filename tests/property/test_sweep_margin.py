"""The margin of the swept check holds what rounding does to positions between two pushes."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings

from ntagen.render.values import model_values
from ntagen.scene import Scene
from tests.oracles.declaration import TEMP_VEC_1, TIP_BASE, Instance, Needle
from tests.scenes import choices, scenes


def walk(needle: Needle, picks: list[int]) -> None:
    """Pushes and rolls as the picks say, whatever the Checker would think of it; ends with a push.

    A needle that has turned about far is not pushed on: the model would have given up the path.
    """
    for pick in picks:
        moves = 1 + len(needle.instance.angles) * needle.may_roll()
        if pick % moves:
            needle.roll(needle.instance.angles[pick % moves - 1])
        elif needle.vectors[3][1] <= 0:
            needle.push()
    needle.push()


def exact_tip(needle: Needle, yaw: int) -> list[float]:
    """Where the tip is on its circle, in units, if nothing is rounded after the circle is known."""
    scale = float(needle.instance.scale)
    probe = needle.copy()
    # The model's own axis: it is rounded before the circle begins.
    probe._matrix_vector(TIP_BASE, 1, TEMP_VEC_1)
    probe._normalise(TEMP_VEC_1)
    axis = [part / scale for part in probe.vectors[TEMP_VEC_1]]
    length = math.hypot(*axis)
    x, y, z = (part / length for part in axis)
    probe._matrix_vector(TIP_BASE, 2, TEMP_VEC_1)
    u, v, w = (part / scale for part in probe.vectors[TEMP_VEC_1])
    axial = x * u + y * v + z * w
    cosine, sine = math.cos(yaw / scale), math.sin(yaw / scale)
    crossed = (y * w - z * v, z * u - x * w, x * v - y * u)
    return [
        c + needle.instance.circle_r * (p * cosine + q * sine + a * axial * (1 - cosine))
        for c, p, q, a in zip(
            needle.motion_circle_center, (u, v, w), crossed, (x, y, z), strict=True
        )
    ]


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(scenes(), choices())
def test_rounded_positions_stay_within_the_margin_of_the_arc(
    scene: Scene, picks: list[int]
) -> None:
    needle = Needle.start(Instance.of_scene(scene))
    margin = model_values(scene).sweep_margin
    walk(needle, picks)
    for yaw in range(0, needle.motion_circle_yaw + 1, max(1, needle.motion_circle_yaw // 50)):
        needle.motion_circle_yaw = yaw
        needle._update_tip_pos()
        assert math.dist(needle.tip_pos, exact_tip(needle, yaw)) <= margin
