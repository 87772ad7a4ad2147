"""What projections say of regions that a plan only seems to cross."""

from __future__ import annotations

from typing import Any

import pytest
from matplotlib.patches import Circle

from ntagen.plot.picture import Picture, draw
from ntagen.plot.seeming import Seeming, note_of, seeming
from ntagen.scene import Vector
from tests.steering import PAPER, scene, sphere

PAST = [(0.0, -float(depth), 6.0) for depth in range(50)]
"""A path that passes 6 mm in front of the middle of `REGION`, and seems to cross it from there."""

REGION = sphere("C", "critical", (0.0, -25.0, 0.0), 2.0)


def seen(curve: list[Vector], shown: tuple[int, int] = (0, 1)) -> Seeming | None:
    center = (REGION.center_mm[shown[0]], REGION.center_mm[shown[1]])
    return seeming(curve, REGION, Circle(center, 2.0), shown)


def notes(picture: Picture) -> list[str]:
    """The notes above the projections."""
    panels: list[Any] = list(draw(picture).axes)[:2]
    return [panel.get_title() for panel in panels]


def test_a_path_in_front_is_noted_with_its_true_distance() -> None:
    assert seen(PAST) == Seeming("C", pytest.approx(4.0), "+z")
    assert seen([(x, y, -z) for x, y, z in PAST]) == Seeming("C", pytest.approx(4.0), "-z")


def test_from_the_side_the_same_path_is_beside_the_region() -> None:
    assert seen(PAST, (2, 1)) is None


def test_a_path_that_truly_enters_does_not_only_seem_to() -> None:
    assert seen([(x, y, 0.5) for x, y, _ in PAST]) is None


def test_a_target_is_to_be_entered() -> None:
    target = sphere("T", "target", (0.0, -25.0, 0.0), 2.0)
    assert seeming(PAST, target, Circle((0.0, -25.0), 2.0), (0, 1)) is None


def test_the_note_stands_where_it_seems_so_and_only_there() -> None:
    task = scene(REGION)
    first, second = notes(Picture(scene=task, best=PAST))
    assert first == "best plan: not through, but past\nC 4.00 mm away, on its +z side"
    assert second == ""
    assert notes(Picture(scene=PAPER)) == ["", ""]


def test_a_note_is_short_and_names_the_nearest() -> None:
    found = [Seeming(f"C{number}", float(number), "+x") for number in (4, 2, 3, 1)]
    assert note_of(found, "last plan").splitlines() == [
        *("last plan: not through, but past", "C1 1.00 mm away, on its +x side"),
        *("C2 2.00 mm away, on its +x side", "and past 2 more, farther away"),
    ]
