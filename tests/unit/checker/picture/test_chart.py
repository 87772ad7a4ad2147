"""What all charts have: a heading, a legend, tooltips, and texts as they were given."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from matplotlib.image import imread

from ntagen.checker.picture.chart import add_bars, panels, picture
from ntagen.checker.picture.page import Svg

SVG = "{http://www.w3.org/2000/svg}"


def chart(heading: str, label: str, note: str = "") -> Svg:
    """A panel with one line, which may have a tooltip."""
    figure, (axes,) = panels(heading, "what was found", "time [s]", ("value",))
    (line,) = axes.plot([0.0, 1.0], [0.0, 1.0])
    return picture(figure, [(line, note)] if note else (), [(line, label)])


def said(svg: str, element: str) -> list[str]:
    return [one.text or "" for one in ET.fromstring(svg).iter(f"{SVG}{element}")]


@pytest.mark.parametrize("text", ["_x -> $y$", "a < b && c > d", "$z_1$"])
def test_texts_stand_as_they_are(text: str) -> None:
    svg = chart(text, f"_{text}", f"tip {text}").text
    assert {text, f"_{text}", "what was found", "time [s]", "value"} <= set(said(svg, "text"))
    assert said(svg, "title") == [text, f"tip {text}"]


def test_a_heading_is_one_line_of_characters_that_xml_has() -> None:
    assert said(chart("E<>\n  p\x01", "p").text, "title") == ["E<> p\ufffd"]


def test_a_legend_has_each_label_once() -> None:
    figure, made = panels("h", "c", "x", ("a", "b"))
    for axes in made:
        axes.plot([0, 1], [0, 1], label="both")
    assert said(picture(figure).text, "text").count("both") == 1


@pytest.mark.parametrize(("count", "tips"), [(3, 3), (1000, 0)])
def test_bars_have_tooltips_if_one_can_point_at_them(count: int, tips: int) -> None:
    figure, (axes,) = panels("h", "c", "x", ("y",))
    notes = add_bars(axes, [(i, i + 1.0, 2.0) for i in range(count)], "bars")
    svg = picture(figure, notes).text
    assert len(said(svg, "title")) == 1 + tips
    assert axes.get_xlim() == (0, count)
    assert "bars" in said(svg, "text")


@pytest.mark.parametrize("kind", ["png", "pdf", "svg"])
def test_equal_charts_are_equal_files(tmp_path: Path, kind: str) -> None:
    paths = [tmp_path / f"{name}.{kind}" for name in "ab"]
    for path in paths:
        chart("h", "l", "n").save(path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert chart("h", "l", "n") == chart("h", "l", "n")


def test_what_stands_around_the_axes_is_in_the_picture(tmp_path: Path) -> None:
    chart("h", "a legend that is wider than the axes of the picture " * 2).save(tmp_path / "a.png")
    height, width, _ = imread(tmp_path / "a.png").shape
    # The axes have 640 by 190 pixels, drawn with two dots for each.
    assert width > 2 * 640
    assert height > 2 * 190
