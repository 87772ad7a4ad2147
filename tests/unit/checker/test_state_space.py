"""The state space as a graph: states, all moves, pictures and limits."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from ntagen import checker
from ntagen.cli import main
from ntagen.errors import InputError, LimitError, ModelError

LAMP = """
clock x; chan press;
process Lamp() { state Off, Low, Bright; init Off;
  trans Off -> Low { sync press?; assign x = 0; },
    Low -> Bright { guard x < 5; sync press?; }, Low -> Off { guard x >= 5; sync press?; },
    Bright -> Off { sync press?; }; }
process User() { state Idle; init Idle; trans Idle -> Idle { sync press!; }; }
L = Lamp(); U = User();
system L, U;
"""

COUNTER = """
int[0,MOST] n; const int fixed = 1; int same = 4;
process P() { state A; init A; trans A -u-> A { guard n < MOST; assign n = n + 1; }; }
Q = P();
system Q;
"""

TWINS = """
int[0,2] n; clock x;
process P() { state A, B; init A;
  trans A -> B { guard x < 2; assign n = 1; }, A -> B { guard x >= 2; assign n = 2; },
    B -> A { assign n = 0, x = 0; }; }
Q = P();
system Q;
"""


def counter(most: int) -> checker.Model:
    return checker.load(COUNTER.replace("MOST", str(most)))


def test_the_graph_has_all_moves_of_all_states() -> None:
    space = checker.load(LAMP).state_space()
    assert [state.locations["L"] for state in space.states] == ["Off", "Low", "Bright"]
    # The second way back to Off is no part of the tree of a search, but it is a move.
    assert [(one.source, one.target) for one in space.moves] == [(0, 1), (1, 2), (1, 0), (2, 0)]
    assert all(one.controllable for one in space.moves)
    assert str(space) == "<StateSpace of 3 states and 4 moves>"


def test_edges_with_equal_ends_are_different_moves() -> None:
    space = checker.load(TWINS).state_space()
    ends = {(one.source, space.states[one.target].variables["n"]) for one in space.moves}
    assert {(0, 1), (0, 2)} <= ends


def test_the_states_are_those_of_the_list() -> None:
    model = checker.load(TWINS)
    assert list(model.state_space().states) == list(model.states())


def test_the_picture_shows_states_and_moves() -> None:
    space = checker.load(LAMP).state_space()
    svg = space.svg().text
    assert "<title>3 symbolic states, 4 arrows</title>" in svg
    for name in ("L.Off", "L.Low", "L.Bright"):
        assert f">{name}  U.Idle<" in svg
    assert svg.count("<polygon ") == 4
    assert ">U: press!<" in svg
    assert space._repr_svg_() == svg


def test_without_clocks_states_with_different_zones_are_one() -> None:
    model = checker.load(TWINS.replace("assign n = 0, x = 0", "assign n = 0"))
    space = model.state_space()
    assert "<title>3 discrete states, 4 arrows</title>" in space.svg(clocks=False).text
    assert "3 discrete" not in space.svg().text


def test_only_variables_that_change_are_shown() -> None:
    space = counter(3).state_space()
    svg = space.svg().text
    assert set(re.findall(r">n = (\d)<", svg)) == set("0123")
    assert "same" not in svg
    # The moves are the environment's.
    assert svg.count("stroke-dasharray") == 3


def test_dot_has_the_same_graph_in_any_size() -> None:
    dot = counter(300).state_space().dot()
    assert dot.startswith("digraph states {")
    assert len(re.findall(r"^  \d+ \[label=", dot, re.MULTILINE)) == 301
    assert '  299 -> 300 [label="Q", style=dashed];' in dot
    assert r'  0 [label="Q.A\nn = 0", peripheries=2];' in dot


def test_a_large_graph_has_no_picture() -> None:
    space = counter(100).state_space()
    assert space._repr_svg_() is None
    with pytest.raises(
        InputError, match=r"has 101 states, .* have 100\nhint: allow more \(--set 'limit"
    ):
        space.svg()
    assert "101 symbolic states" in space.svg(limit=101).text
    with pytest.raises(InputError, match="has 101 states, and the picture may have 7"):
        space.svg(limit=7)


def test_limits_are_errors() -> None:
    assert len(counter(99).state_space(100).states) == 100
    with pytest.raises(LimitError, match="more than 100 symbolic states\nhint: make constants"):
        counter(100).state_space(100)
    with pytest.raises(LimitError, match="time limit"):
        counter(2000).state_space(timeout_s=0)
    with pytest.raises(ValueError, match="negative"):
        counter(1).state_space(-1)
    with pytest.raises(ModelError):
        checker.load(COUNTER.replace("n < MOST", "true").replace("MOST", "3")).state_space()


def test_plot_draws_the_states(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    model, path = tmp_path / "lamp.xta", tmp_path / "states.svg"
    model.write_text(LAMP)
    arguments = ["plot", str(model), "--as"]
    assert main([*arguments, "states", "--query", "E<> L.Low", "-o", str(path)]) == 0
    assert "3 symbolic states" in path.read_text()
    assert "--query has no effect with --as states" in capsys.readouterr().err
    assert main([*arguments, "discrete", "-o", str(path)]) == 0
    ET.fromstring(path.read_text())
    assert "3 discrete states" in path.read_text()
    assert main([*arguments, "states", "-o", str(path.with_suffix(".dot"))]) == 0
    assert path.with_suffix(".dot").read_text().startswith("digraph")
    assert main([*arguments, "states", "-o", str(path.with_suffix(".gif"))]) == 2
    assert "endings: .svg, .png, .pdf, .dot" in capsys.readouterr().err


def test_a_limit_says_how_many_states_are_drawn(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    model, path = tmp_path / "counter.xta", tmp_path / "states.svg"
    model.write_text(COUNTER.replace("MOST", "150"))
    arguments = ["plot", str(model), "-o", str(path), "--as"]
    assert main([*arguments, "states"]) == 2
    assert "--set 'limit 151'" in capsys.readouterr().err
    assert not path.exists()
    for kind in ("states", "discrete"):
        assert main([*arguments, kind, "--set", "limit 150"]) == 2
        assert "has 151 states" in capsys.readouterr().err
        assert main([*arguments, kind, "--set", "limit 151"]) == 0
        assert path.read_text().count("<circle") == 152
    assert main([*arguments, "templates", "--set", "limit 7"]) == 0
    assert "--set 'limit …' has no effect" in capsys.readouterr().err


def test_a_greater_limit_searches_for_more_states(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    model, path = tmp_path / "counter.xta", tmp_path / "states.dot"
    model.write_text(COUNTER.replace("MOST", "10001"))
    arguments = ["plot", str(model), "-o", str(path), "--as", "states"]
    assert main(arguments) == LimitError.exit_code
    assert "more than 10000 symbolic states\nhint: search for more (--set 'limit …')" in (
        capsys.readouterr().err
    )
    assert main([*arguments, "--set", "limit 10002"]) == 0
    assert "10002 symbolic states" in path.read_text()
