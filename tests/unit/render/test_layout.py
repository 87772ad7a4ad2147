"""How the automata look when they are opened in UPPAAL: nothing lies on top of anything else."""

from __future__ import annotations

import itertools
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass

import pytest

from ntagen.render import render
from ntagen.scene import Scene
from tests.scenes import PAPER, paper

# UPPAAL's default font, generously.
CHARACTER_WIDTH = 8
LINE_HEIGHT = 17
LOCATION_RADIUS = 10


@dataclass(frozen=True)
class Box:
    """A rectangle with what is in it."""

    what: str
    left: float
    top: float
    right: float
    bottom: float

    def overlaps(self, other: Box) -> bool:
        return (
            self.left < other.right
            and other.left < self.right
            and self.top < other.bottom
            and other.top < self.bottom
        )

    def is_crossed_by(self, start: tuple[int, int], end: tuple[int, int]) -> bool:
        """Whether a straight line passes through (clipping by Liang and Barsky)."""
        low, high = 0.0, 1.0
        for axis, least, most in ((0, self.left, self.right), (1, self.top, self.bottom)):
            offset, step = start[axis], end[axis] - start[axis]
            if step == 0:
                if not least < offset < most:
                    return False
                continue
            first, second = sorted(((least - offset) / step, (most - offset) / step))
            low, high = max(low, first), min(high, second)
        return low < high


def position(element: ElementTree.Element) -> tuple[int, int]:
    return int(element.attrib["x"]), int(element.attrib["y"])


def text_box(element: ElementTree.Element) -> Box:
    lines = (element.text or "").split("\n")
    x, y = position(element)
    width = CHARACTER_WIDTH * max(map(len, lines))
    return Box(lines[0], x, y, x + width, y + LINE_HEIGHT * len(lines))


def boxes(template: ElementTree.Element) -> list[Box]:
    """Of all locations and of all texts."""
    found = []
    for location in template.findall("location"):
        x, y = position(location)
        r = LOCATION_RADIUS
        found.append(Box(location.attrib["id"], x - r, y - r, x + r, y + r))
        found += [text_box(text) for text in location if text.tag in ("name", "label")]
    return found + [text_box(label) for label in template.findall("transition/label")]


def lines(template: ElementTree.Element) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """The straight pieces of all edges."""
    at = {location.attrib["id"]: position(location) for location in template.findall("location")}
    pieces = []
    for edge in template.findall("transition"):
        ends = [edge.find("source"), edge.find("target")]
        source, target = (at[end.attrib["ref"]] for end in ends if end is not None)
        points = [source, *(position(nail) for nail in edge.findall("nail")), target]
        pieces += list(itertools.pairwise(points))
    return pieces


def check_layout(template: ElementTree.Element) -> None:
    found = boxes(template)
    for one, other in itertools.combinations(found, 2):
        assert not one.overlaps(other), f"`{one.what}` lies on `{other.what}`"
    ids = {location.attrib["id"] for location in template.findall("location")}
    for box, (start, end) in itertools.product(found, lines(template)):
        if box.what not in ids:
            assert not box.is_crossed_by(start, end), f"an edge {start} {end} crosses `{box.what}`"


@pytest.mark.parametrize("name", ["User", "Needle", "Tissue", "Checker"])
@pytest.mark.parametrize("scene", [PAPER, paper(safety="swept")], ids=["sampled", "swept"])
def test_texts_locations_and_edges_keep_clear_of_each_other(scene: Scene, name: str) -> None:
    (template,) = (
        template
        for template in ElementTree.fromstring(render(scene)).findall("template")
        if template.findtext("name") == name
    )
    check_layout(template)
