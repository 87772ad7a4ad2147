"""Target and entry that a lab tells."""

from __future__ import annotations

from pathlib import Path

import pytest

from ntagen.errors import NtagenError
from ntagen.nsl import load
from ntagen.ros.subject import scene_for
from ntagen.ros.topics import Topics
from ntagen.scene import Vector

SCENE = load(Path(__file__).parents[3] / "examples" / "paper.nsl")
ENTRY = SCENE.needle.tip.position_mm
TARGET = SCENE.targets[-1].center_mm


def test_a_target_is_moved_where_it_is_told() -> None:
    moved = scene_for(SCENE, Topics(), ENTRY, (3.0, -52.0, 1.0))
    assert moved.targets[-1].center_mm == pytest.approx((3.0, -52.0, 1.0))
    assert moved.targets[-1].radius_mm == SCENE.targets[-1].radius_mm
    assert moved.criticals == SCENE.criticals


def test_nothing_changes_if_nobody_tells_or_the_same_is_told() -> None:
    assert scene_for(SCENE, Topics(), None, None) is SCENE
    assert scene_for(SCENE, Topics(), ENTRY, TARGET) is SCENE


@pytest.mark.parametrize(
    ("entry_mm", "target_mm", "says"),
    [
        ((0.0, -15.0, 0.0), None, "skin_entry is 15.0 mm from the entry of the task"),
        ((0.0, -2e4, 0.0), None, "skin_entry says that it is 20.0 m from the task: this is a unit"),
        (None, (0.0, -5e4, 0.0), "target says that it is 50.0 m from the task: this is a unit"),
        (None, (0.0, -0.05, 0.0), "target says that it is 50.0 mm from the task"),
        (None, (0.0, -25.5, 0.0), "is in the critical region 'C1'"),
    ],
)
def test_what_cannot_be_meant_is_refused(
    entry_mm: Vector | None, target_mm: Vector | None, says: str
) -> None:
    unit = "mm" if target_mm == (0.0, -0.05, 0.0) else "m"
    with pytest.raises(NtagenError) as caught:
        scene_for(SCENE, Topics(units=unit), entry_mm, target_mm)
    assert says in str(caught.value)
    assert "hint: " in str(caught.value)
