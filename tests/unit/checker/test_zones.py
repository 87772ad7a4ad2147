"""The zones of a strategy as a picture: what is where, and what is refused."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from fractions import Fraction
from itertools import product
from pathlib import Path

import pytest
from matplotlib.patches import Patch

from ntagen import checker
from ntagen.checker.picture.halves import Axes, Half, clipped
from ntagen.checker.picture.page import WAIT, Svg
from ntagen.checker.picture.zones import Area, zones_picture
from ntagen.checker.strategy import Strategy
from ntagen.checker.winning import zones_chart
from ntagen.cli import main
from ntagen.errors import InputError, UndecidedError

GAME = """
clock x, y;
process P() { state A { x <= 2 }, B { x <= 6 && y <= 5 }, Won, Lost, Far; init A;
  trans A -u-> B { guard x >= 1; assign x = 0; },
    B -> Won { guard x >= 2 && y < 5; },
    B -u-> Lost { guard y > 4; }; }
system P;
"""

ONE = """
clock x;
process P() { state A, Won; init A; trans A -> Won { guard x > 1; }; }
system P;
"""

SVG = "{http://www.w3.org/2000/svg}"


def strategy(text: str = GAME, query: str = "control: A<> P.Won") -> Strategy:
    return checker.load(text).synthesize(query)


def texts(svg: str) -> list[str]:
    return [one.text or "" for one in ET.fromstring(svg).iter(f"{SVG}text")]


def areas_of(picture: Svg) -> list[Patch]:
    """What is drawn of zones with an inside."""
    assert picture.figure is not None
    return list(picture.figure.axes[0].patches)


def number(value: int | str) -> Fraction:
    return Fraction(value)


class State:
    """Decisions as a strategy gives them."""

    locations = {"P": "A"}  # noqa: RUF012
    variables = {"n": 1}  # noqa: RUF012
    is_goal = False

    def __init__(self, *zones: list[list[str]]) -> None:
        self.decisions = [Said(one) for one in zones]


class Said:
    """A decision."""

    def __init__(self, zones: list[list[str]], edges: tuple[object, ...] = ()) -> None:
        self.zones, self.edges, self.rank = zones, edges, 0


def test_the_picture_says_what_is_done() -> None:
    picture = strategy().zones({"P": "B"})
    said = texts(picture.text)
    assert "What the controller does in ( P.B )" in said
    assert "P.B -> P.Won" in said
    assert "wait" in said
    assert "x [units of the model's time]" in said
    assert "y [units of the model's time]" in said
    assert len(areas_of(picture)) >= 2


def test_axes_can_be_chosen() -> None:
    figure = strategy().zones({"P": "B"}, x="y").figure
    assert figure is not None
    (plane,) = figure.axes
    labels = (plane.get_xlabel(), plane.get_ylabel())
    assert labels == ("y [units of the model's time]", "x [units of the model's time]")


def test_one_clock_is_a_strip() -> None:
    figure = strategy(ONE).zones().figure
    assert figure is not None
    (plane,) = figure.axes
    assert plane.get_window_extent().height == 56
    assert plane.get_ylabel() == ""
    # x <= 1 is waited for, and the bound of the action is strict.
    assert sorted(line.get_linestyle() for line in plane.lines) == ["-", "--"]


@pytest.mark.parametrize(
    "zone",
    [
        ["x <= 3", "y > 1"],
        ["x-y <= 1", "y-x < 2", "x >= 1"],
        ["x == 2", "y-z >= -1"],
        ["x-y <= -1", "z-x < 1", "y <= 4", "z >= 1"],
        ["z == 2", "x-z <= 0", "y-z < 1"],
    ],
)
@pytest.mark.parametrize("z", [None, "0", "3/2", "2"])
def test_points_are_in_the_picture_where_the_constraints_hold(
    zone: list[str], z: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Area] = []
    monkeypatch.setattr(
        "ntagen.checker.winning.zones_picture", lambda areas, *_, **__: drawn.extend(areas)
    )
    values = {} if z is None else {"z": Fraction(z)}
    zones_chart(
        State([zone]), ("x", "y", "z"), ("x", "y"), values, owner="controller", is_permissive=False
    )
    grid = [Fraction(step, 4) for step in range(22)]
    for x, y in product(grid, grid):
        expected = any(
            # The steps are fine enough to find a value of z if there is one.
            all(eval(text, {}, {"x": x, "y": y, "z": one}) for text in zone)
            for one in ([Fraction(z)] if z else [Fraction(step, 16) for step in range(120)])
        )
        inside = any(
            all(half.excess((x, y)) < (0 if half.strict else Fraction(1, 10**9)) for half in found)
            for found in drawn[0].zones
        )
        assert inside == expected, (x, y)


def test_clipping_keeps_lines_and_points() -> None:
    square = [(number(x), number(y)) for x, y in ((0, 0), (4, 0), (4, 4), (0, 4))]
    line = clipped(square, [Half(1, -1, number(0)), Half(-1, 1, number(0))])
    assert set(line) == {(0, 0), (4, 4)}
    assert clipped(square, [Half(1, 0, number(2)), Half(-1, 0, number(-3))]) == []
    low = [Half(1, 0, number(0)), Half(0, 1, number(0))]
    assert clipped(square, low) == [(0, 0)]


def test_an_earlier_zone_hides_a_later_one_within_it() -> None:
    wide = (Half(1, 0, number(3)), Half(0, 1, number(3)))
    small = (Half(1, 0, number(2)), Half(0, 1, number(2)))
    axes = Axes("x", "y", number(5), number(5))
    areas = [Area("go", (wide,), "first"), Area(WAIT, (small,), "second")]
    assert len(areas_of(zones_picture(areas, axes, "h", (), striped=False))) == 1
    assert len(areas_of(zones_picture(areas[::-1], axes, "h", (), striped=False))) == 2
    both = areas_of(zones_picture(areas, axes, "h", (), striped=True))
    assert len({area.get_hatch() for area in both} - {None}) == 2


def test_what_the_picture_leaves_open_is_said() -> None:
    state = State([["x <= 3", "z-x <= 0"]])
    names, drawn = ("x", "y", "z"), ("x", "y")
    free = zones_chart(state, names, drawn, {}, owner="controller", is_permissive=False).text
    assert "for some value of z; give values to see a plane" in texts(free)
    at = {"z": number("3/2")}
    fixed = zones_chart(state, names, drawn, at, owner="controller", is_permissive=True).text
    assert "where z = 3/2" in texts(fixed)
    assert "where areas overlap, the strategy allows all of them" in texts(fixed)
    nothing = {"z": number(4)}
    empty = zones_chart(state, names, drawn, nothing, owner="environment", is_permissive=False)
    assert "there is no decision here" in texts(empty.text)


def test_a_goal_is_won_everywhere() -> None:
    picture = strategy().zones({"P": "Won"})
    assert "nothing: play is over, and won" in texts(picture.text)
    assert len(areas_of(picture)) == 1


def test_wrong_clocks_and_states_are_refused() -> None:
    one = strategy()
    with pytest.raises(InputError, match="no clock z\nhint: the clocks are x, y"):
        one.zones(x="z")
    with pytest.raises(InputError, match="both axes are the clock y"):
        one.zones(x="y", y="y")
    with pytest.raises(UndecidedError, match="has no state"):
        one.zones({"P": "Far"})
    with pytest.raises(InputError, match="has no clocks"):
        strategy("process P() { state A; init A; } system P;", "control: A[] P.A").zones()


def test_plot_draws_zones(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model, path = tmp_path / "game.xta", tmp_path / "zones.svg"
    model.write_text(GAME)
    arguments = ["plot", str(model), "--as", "zones", "-o", str(path)]
    query = ["--query", "control: A<> P.Won"]
    assert main([*arguments, *query, "--at", "P.B y=1/2", "--set", "clocks x"]) == 0
    assert "What the controller does in ( P.B )" in path.read_text()
    for given, says in (
        (["--at", "P.C"], 'has no location "C"'),
        (["--at", "Q.B"], "'Q.B' is neither a location nor a value\nhint: write Process.Location"),
        (["--at", "x=b"], "'b' of clock x is not an exact number"),
        (["--set", "clocks x,,y"], "'x,,y' is not one clock or two"),
    ):
        assert main([*arguments, *query, *given]) == 2
        assert says in capsys.readouterr().err
    assert main(arguments) == 2
    assert capsys.readouterr().err.endswith("hint: give one with --query\n")
    assert main([*arguments, "--query", "E<> P.Won"]) == 2
    assert "is not a control query" in capsys.readouterr().err


@pytest.mark.parametrize("asked", [["--query", "E<> P.Won"], ["--query", "control: A<> P.Won"]])
def test_the_search_of_plot_has_limits(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], asked: list[str]
) -> None:
    model = tmp_path / "game.xta"
    model.write_text(GAME)
    kind = "gantt" if "E<>" in asked[1] else "zones"
    limited = ["plot", str(model), "--as", kind, *asked, "--timeout", "0.0000001s"]
    assert main(limited) == 3
    assert "stopped by the time limit" in capsys.readouterr().err
