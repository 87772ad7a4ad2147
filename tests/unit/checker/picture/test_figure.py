"""Pictures as PNG and PDF: they show what the SVG shows, and an unknown ending is refused."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from matplotlib.patches import PathPatch

from ntagen import checker
from ntagen.checker.picture.figure import converted, figure_of
from ntagen.checker.picture.page import Svg, page
from ntagen.checker.picture.svg import draw_all
from ntagen.errors import InputError

MODEL = """
clock x; chan go;
process P() { state A { x <= 2 }, B; commit B; init A;
  trans A -> B { guard x >= 1; sync go!; assign x = 0; }, B -> A { }; }
process Q() { state C; init C; trans C -> C { sync go?; }; }
R = P(); S = Q();
system R, S;
"""


def drawn(*parts: str) -> np.ndarray:
    """The dots of a page of 100 by 100 pixels, each three colours from 0 to 1."""
    diagram = Svg(page((0.0, 0.0, 100.0, 100.0), "", parts, 12))
    dots = imread(io.BytesIO(converted(diagram.text, diagram.figure, "png")), format="png")[..., :3]
    assert dots.shape == (200, 200, 3)
    return dots


def colour_at(dots: np.ndarray, x: int, y: int) -> list[int]:
    return [round(255 * float(part)) for part in dots[2 * y, 2 * x]]


def test_shapes_stand_where_the_svg_has_them() -> None:
    dots = drawn(
        '<rect x="10" y="20" width="30" height="20" fill="#ff0000"/>',
        '<circle cx="70" cy="30" r="10" fill="#00ff00"/>',
        '<polygon points="10,60 40,60 40,90" fill="#0000ff"/>',
        '<line x1="60" y1="80" x2="90" y2="80" stroke="#000000" stroke-width="4"/>',
    )
    assert colour_at(dots, 25, 30) == [255, 0, 0]
    assert colour_at(dots, 25, 45) == [255, 255, 255]
    assert colour_at(dots, 70, 30) == [0, 255, 0]
    assert colour_at(dots, 79, 39) == [255, 255, 255]
    assert colour_at(dots, 35, 65) == [0, 0, 255]
    assert colour_at(dots, 15, 85) == [255, 255, 255]
    assert colour_at(dots, 75, 80) == [0, 0, 0]


def test_later_shapes_cover_earlier_ones() -> None:
    red = '<rect x="10" y="10" width="50" height="50" fill="#ff0000"/>'
    text = '<text x="20" y="40" font-size="30" fill="#0000ff">$x$</text>'
    assert colour_at(drawn(text, red), 30, 33) == [255, 0, 0]
    assert (drawn(red, text)[40:90, 40:100, 2] > 0.9).any()


@pytest.mark.parametrize("kind", ["png", "pdf"])
def test_equal_pictures_are_equal_files(tmp_path: Path, kind: str) -> None:
    picture = draw_all(checker.load(MODEL).templates)
    paths = [tmp_path / f"{name}.{kind}" for name in "ab"]
    for path in paths:
        picture.save(path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert paths[0].read_bytes().startswith(b"\x89PNG" if kind == "png" else b"%PDF")


def test_all_that_is_in_templates_is_drawn() -> None:
    picture = draw_all(checker.load(MODEL).templates)
    axes = figure_of(picture.text).axes[0]
    texts = {text.get_text() for text in axes.texts}
    assert {"A", "B", "C", "x <= 2", "x >= 1", "go!", "go?", "x = 0"} <= texts
    shapes = picture.text.count("<circle") + picture.text.count("<path")
    shapes += picture.text.count("<polygon") + picture.text.count("<rect")
    assert sum(isinstance(one, PathPatch) for one in axes.patches) == shapes


def test_what_is_not_known_is_an_error() -> None:
    with pytest.raises(ValueError, match="no <image>"):
        figure_of(page((0.0, 0.0, 9.0, 9.0), "", ['<image href="x"/>'], 12))


@pytest.mark.parametrize("name", ["a.jpg", "a", "a.svg.gz"])
def test_another_ending_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match=r"endings: \.svg, \.png, \.pdf"):
        Svg("<svg/>").save(tmp_path / name)
    assert list(tmp_path.iterdir()) == []
