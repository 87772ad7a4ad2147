"""No text of a picture stands on another one or on the legend, and regions carry their names."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from ntagen.nsl import load_task
from ntagen.plot.picture import Picture, draw
from ntagen.scene import Scene, Vector
from tests.steering import PAPER, scene, sphere

EXAMPLES = Path(__file__).parents[3] / "examples"
TASKS = sorted(
    path for path in EXAMPLES.rglob("*.nsl") if "\nenvironment " in "\n" + path.read_text("utf-8")
)
MANY_LINES = "\n".join(["best: push 16 mm, roll 180 deg, push 30 mm " * 4, "first: by clearance"])
TOUCHING = 0.5
"""In pixels: rounding of texts."""


def pretended(where: Scene) -> Picture:
    """A picture with a path through all regions, whose notes are long."""
    (x, y, z), end = where.needle.tip.position_mm, where.targets[-1].center_mm
    way: list[Vector] = []
    for number in range(60):
        share = number / 59
        bow = 3.0 * math.sin(math.pi * share)
        a, b, c = (p + share * (q - p) for p, q in zip((x, y, z), end, strict=True))
        way.append((a + bow, b, c + bow))
    return Picture(where, best=way, others=[way], caption=MANY_LINES)


def boxes(figure: Figure) -> dict[str, list[Bbox]]:
    """The places of all texts that are seen, by what they are."""
    figure.draw_without_rendering()
    found: dict[str, list[Bbox]] = {"legend": [one.get_window_extent() for one in figure.legends]}
    found["heading"] = [figure._suptitle.get_window_extent()]
    for axes in figure.axes:
        kind = "space" if axes.name == "3d" else "plane"
        scales = [axes.xaxis, axes.yaxis, *([axes.zaxis] if kind == "space" else [])]
        for scale in scales:
            found.setdefault(f"{kind} label", []).append(scale.label.get_window_extent())
            low, high = sorted(scale.get_view_interval())
            numbers = [
                tick.label1.get_window_extent()
                for tick in scale.get_major_ticks()
                if low <= tick.get_loc() <= high and tick.label1.get_text()
            ]
            found.setdefault(f"{kind} number", []).extend(numbers)
        if axes.get_title():
            found.setdefault("note", []).append(axes.title.get_window_extent())
        if kind == "plane":
            found.setdefault("name", []).extend(text.get_window_extent() for text in axes.texts)
    return found


def meets(one: Bbox, other: Bbox) -> bool:
    """Whether two places overlap by more than the rounding of texts."""
    width = min(one.x1, other.x1) - max(one.x0, other.x0)
    height = min(one.y1, other.y1) - max(one.y0, other.y0)
    return bool(width > TOUCHING and height > TOUCHING)


def check_apart(figure: Figure) -> None:
    """No text stands on another one, on the legend, or outside the figure."""
    placed = [(kind, box) for kind, found in boxes(figure).items() for box in found]
    for (kind, one), (other_kind, other) in itertools.combinations(placed, 2):
        assert not meets(one, other), (kind, one.bounds, other_kind, other.bounds)
    for kind, box in placed:
        assert figure.bbox.x0 - 1 <= box.x0, (kind, box)
        assert box.x1 <= figure.bbox.x1 + 1, (kind, box)
        assert figure.bbox.y0 - 1 <= box.y0, (kind, box)
        assert box.y1 <= figure.bbox.y1 + 1, (kind, box)


def names(figure: Figure) -> list[set[str]]:
    """The names in each projection."""
    planes = [axes for axes in figure.axes if axes.name != "3d"]
    return [{text.get_text() for text in axes.texts if isinstance(text, Text)} for axes in planes]


@pytest.mark.slow
@pytest.mark.parametrize("where", [PAPER, scene()], ids=["paper", "target"])
def test_texts_of_a_picture_stand_apart(where: Scene) -> None:
    check_apart(draw(Picture(where)))
    check_apart(draw(pretended(where)))


@pytest.mark.slow
@pytest.mark.parametrize("path", TASKS, ids=lambda path: path.stem)
def test_texts_of_an_example_stand_apart(path: Path) -> None:
    where = load_task(path).scene
    for picture in (Picture(where), pretended(where)):
        figure = draw(picture)
        check_apart(figure)
        shown = set().union(*names(figure))
        assert {target.name for target in where.targets} <= shown
        if len(where.regions) <= 5:
            assert shown == {region.name for region in where.regions}


def test_regions_carry_their_names_in_both_projections() -> None:
    expected = {"T1", "C1", "D1"}
    assert names(draw(Picture(PAPER))) == [expected, expected]


def test_a_name_stands_at_its_region_and_not_on_the_path() -> None:
    figure = draw(pretended(PAPER))
    for axes, shown in zip(figure.axes, ((0, 1), (2, 1)), strict=False):
        path = axes.transData.transform([[p[i] for i in shown] for p in pretended(PAPER).best])
        for text in axes.texts:
            box = text.get_window_extent()
            assert not any(box.contains(x, y) for x, y in path), text.get_text()
            region = next(one for one in PAPER.regions if one.name == text.get_text())
            center = axes.transData.transform([region.center_mm[i] for i in shown])
            away = max(abs(0.5 * (box.x0 + box.x1) - center[0]), 0.0)
            reach = axes.transData.transform((region.radius_mm, 0)) - axes.transData.transform(
                (0, 0)
            )
            assert away <= reach[0] + box.width + 4


@pytest.mark.slow
def test_of_many_regions_the_nearest_are_named() -> None:
    crowd = [
        sphere(f"C{i}_{j}", "critical", (4.0 * i, -3.0 * j - 5.0, 6.0), 1.0)
        for i in range(-5, 6)
        for j in range(9)
    ]
    figure = draw(pretended(scene(*crowd)))
    for shown in names(figure):
        assert 5 <= len(shown) <= 20
        assert "T1" in shown
    check_apart(figure)
