"""Pictures of templates: what is drawn, where, and that automatic places keep things apart."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from itertools import combinations, pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ntagen.checker import load
from ntagen.checker.facts import Template
from ntagen.checker.picture.diagram import BranchPoint, Edge, Location
from ntagen.checker.picture.layout import (
    LOCATION_RADIUS,
    drawn_labels,
    placed,
    positions_of,
    text_height,
    text_width,
)
from ntagen.cli import main

ROOT = Path(__file__).parents[4]
SVG = "{http://www.w3.org/2000/svg}"

XTA = """
clock x; chan a; int n;
process P(int[0,3] id) {
  state A, B { x <= 4 }, C, D;
  commit C; urgent D;
  init A;
  trans A -> B { select i : int[0,1]; guard n < 9; sync a!; assign n = n + i; },
        B -> A { guard x >= 1; }, B -> C { }, C -u-> D { }, D -> A { assign x = 0; },
        A -> A { guard n == 3; assign n = 0; }, A -> D { };
}
system P;
"""


def check_drawn(template: Template) -> ET.Element:
    """The picture is XML of which everything lies within its frame; the picture."""
    picture = ET.fromstring(template.svg())
    left, top, width, height = (float(number) for number in picture.attrib["viewBox"].split())
    for circle in picture.iter(f"{SVG}circle"):
        x, y, radius = (float(circle.attrib[name]) for name in ("cx", "cy", "r"))
        assert left <= x - radius
        assert x + radius <= left + width
        assert top <= y - radius
        assert y + radius <= top + height
    return picture


def texts(picture: ET.Element) -> list[str]:
    return ["".join(text.itertext()) for text in picture.iter(f"{SVG}text")]


def test_the_picture_shows_all_labels_and_marks() -> None:
    template = load(XTA).template("P")
    picture = check_drawn(template)
    shown = texts(picture)
    for text in ("A", "x <= 4", "i : int[0,1]", "n < 9", "a!", "n = n + i", "x = 0"):
        assert text in shown
    assert shown.count("C") == 3  # its name, the ground below that, and the mark
    assert shown.count("U") == 1
    assert shown[0] == "P(int[0, 3] id)"
    # Four locations, and the second circle of the initial one.
    assert len(list(picture.iter(f"{SVG}circle"))) == 5
    dashed = [path for path in picture.iter(f"{SVG}path") if "stroke-dasharray" in path.attrib]
    assert len(dashed) == 1
    assert template._repr_svg_() == template.svg()


def test_places_of_the_file_are_kept() -> None:
    template = Template(
        "P",
        (),
        (
            Location("a", "A", initial=True, position=(0, 0), labels={"name": (-50, 7)}),
            Location("b", invariant="x <= 3", position=(100, 50), color="#123456"),
        ),
        (BranchPoint("c", (40, 90)),),
        (
            Edge("a", "b", guard="g", nails=((70, -30),), labels={"guard": (60, -60)}),
            Edge("c", "b"),
        ),
    )
    drawn = placed(template)
    assert positions_of(drawn) == {"a": (0, 0), "b": (100, 50), "c": (40, 90)}
    assert drawn.edges[0] == template.edges[0]
    assert drawn.locations[0] == template.locations[0]
    # The file says nothing of the invariant's place, so it stands beside its location.
    x, y = drawn.locations[1].labels["invariant"]
    assert 100 + LOCATION_RADIUS < x < 150
    assert 30 < y < 60
    svg = template.svg()
    assert 'fill="#123456"' in svg
    check_drawn(template)


def test_texts_are_escaped() -> None:
    guard = "a < b && c > d\x01"
    template = Template("P", (), (Location("a"),), (), (Edge("a", "a", guard=guard),))
    assert "a < b && c > d\ufffd" in texts(check_drawn(template))


def test_a_template_without_locations_has_a_picture() -> None:
    check_drawn(Template("Empty", (), (), (), ()))


def test_a_loop_without_nails_gets_some() -> None:
    template = Template("P", (), (Location("a", position=(5, 5)),), (), (Edge("a", "a"),))
    assert len(placed(template).edges[0].nails) == 2


@st.composite
def templates(draw: st.DrawFn) -> Template:
    """Templates without places, of any graph, with labels of several lengths."""
    count = draw(st.integers(1, 8))
    words = st.sampled_from(["", "x", "x <= 10 && y >= 3", "a_long_name[i] == other\nand_more()"])
    locations = [
        Location(f"id{i}", draw(words), initial=i == 0, invariant=draw(words)) for i in range(count)
    ]
    points = [BranchPoint(f"b{i}") for i in range(draw(st.integers(0, 2)))]
    ids = st.sampled_from([node.id for node in (*locations, *points)])
    # A leg of a branch point ends in a location, so there are no loops at branch points.
    edge = st.builds(Edge, ids, ids, guard=words, update=words).filter(
        lambda edge: not (edge.source == edge.target and edge.source.startswith("b"))
    )
    edges = draw(st.lists(edge, max_size=14))
    return Template("T", (), tuple(locations), tuple(points), tuple(edges))


@given(templates())
def test_automatic_places_keep_locations_and_labels_apart(template: Template) -> None:
    drawn = placed(template)
    positions = positions_of(drawn)
    assert len(positions) == len(template.nodes)
    for (x1, y1), (x2, y2) in combinations(positions.values(), 2):
        # A branch point's circle is smaller than a location's.
        assert abs(x1 - x2) > LOCATION_RADIUS or abs(y1 - y2) > 2 * LOCATION_RADIUS
    boxes = [
        (x, y, x + text_width(text), y + text_height(text))
        for (x, y), _, text in drawn_labels(drawn)
    ]
    for first, second in combinations(boxes, 2):
        overlap_x = min(first[2], second[2]) - max(first[0], second[0])
        overlap_y = min(first[3], second[3]) - max(first[1], second[1])
        # Rounded places may touch.
        assert overlap_x <= 2 or overlap_y <= 2, (first, second)
    for edge in drawn.edges:
        path = [positions[edge.source], *edge.nails, positions[edge.target]]
        assert all(before != after for before, after in pairwise(path)) or not edge.nails
    check_drawn(template)


@given(templates())
def test_pictures_do_not_change_from_time_to_time(template: Template) -> None:
    assert template.svg() == template.svg()


def test_templates_stand_below_each_other(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, path = ROOT / "examples" / "models" / "train_gate.xta", tmp_path / "templates.svg"
    assert main(["plot", str(model), "--as", "templates", "-o", str(path), "--set", "limit 3"]) == 0
    assert "--set 'limit …' has no effect" in capsys.readouterr().err
    whole = ET.fromstring(path.read_text("utf-8"))
    inner = whole.findall(f"{SVG}svg")
    titles = [one.findtext(f"{SVG}title") for one in inner]
    assert titles == ["Train(const train id)", "Gate"]
    first, second = inner
    assert float(second.attrib["y"]) == float(first.attrib["height"])
    total = sum(float(one.attrib["height"]) for one in inner)
    assert float(whole.attrib["height"]) == total
    assert float(whole.attrib["width"]) == max(float(one.attrib["width"]) for one in inner)


def test_very_many_long_edges_are_drawn_in_rows() -> None:
    count = 300
    states = ", ".join(f"L{number}" for number in range(count))
    edges = ", ".join(
        f"L{number} -> L{(number * step + 1) % count} {{ }}"
        for number in range(count)
        for step in (1, 7)
    )
    model = load(f"process P() {{ state {states}; init L0; trans {edges}; }} system P;")
    template = model.template("P")
    check_drawn(template)
    drawn = placed(template)
    places = set(positions_of(drawn).values())
    assert len(places) == count
    assert len({y for _, y in places}) == 17
    # The start is at the upper left.
    assert positions_of(drawn)["L0"] == (0, 0)
