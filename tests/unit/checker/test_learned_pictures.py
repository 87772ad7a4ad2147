"""Pictures of learned strategies: what is where, and what is refused."""

from __future__ import annotations

import json
import math
import random
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest
from matplotlib.container import ErrorbarContainer

from ntagen import checker
from ntagen.checker import LearnedStrategy
from ntagen.checker.learned_map import decisions_chart
from ntagen.checker.learned_trees import WHOLE, Best, Cut, Decided, Trees, boxes
from ntagen.checker.picture.page import Svg, colors_of
from ntagen.checker.picture.patches import Axis, Panel
from ntagen.cli import main
from ntagen.errors import InputError
from tests.choices import ACTIONS

MODEL = """
clock x, y;
int[0,9] n;
process P() {
  state A, B;
  init A;
  trans A -> B { select i : int[0,4]; assign n = i; }, B -> A { };
}
system P;
"""
LOAD = 'strategy S = loadStrategy("S.json")'

LEAVE = """
double cost;
clock x;
process Guest() {
  state Inside { x <= 5 }, Done;
  init Inside;
  trans Inside -> Done { assign cost = x + 4 * exp(-x); };
}
system Guest;
"""
QUERY = "strategy S = minE(cost)[<=6] {} -> {x}: <> Guest.Done"
COIN = """
int cost;
process P() {
  state A, Done;
  urgent A;
  init A;
  trans A -> Done { assign cost = 1; }, A -> Done { assign cost = 2; };
}
system P;
"""
EXACT = "strategy S = minE(cost)[<=1]: <> P.Done"
SMALL = {"good_runs": 400, "eval_runs": 100, "max_iterations": 3, "runs": 200}

SVG = "{http://www.w3.org/2000/svg}"


def cut(var: int, bound: float, low: object, high: object) -> dict[str, object]:
    return {"var": var, "bound": bound, "low": low, "high": high}


def tree(draw: random.Random, depth: int) -> object:
    if depth == 0 or draw.random() < 0.3:
        return float(draw.randrange(8))
    low, high = tree(draw, depth - 1), tree(draw, depth - 1)
    return cut(draw.randrange(2), draw.randrange(1, 12) / 2, low, high)


def file_of(regressors: dict[str, dict[int, object]], *, minimises: bool = True) -> dict[str, Any]:
    return {
        "version": 1.0,
        "type": "state->regressor",
        "representation": "map",
        "actions": {str(number): text for number, text in enumerate(ACTIONS)},
        "statevars": ["P.location", "n"],
        "pointvars": ["x", "y"],
        "locationnames": {"P.location": {"0": "A", "1": "B"}},
        "regressors": {
            key: {
                "type": "act->point->val",
                "representation": "simpletree",
                "minimize": int(minimises),
                "regressor": {str(number): one for number, one in trees.items()},
            }
            for key, trees in regressors.items()
        },
    }


def loaded(folder: Path, regressors: dict[str, dict[int, object]], **how: bool) -> LearnedStrategy:
    (folder / "S.json").write_text(json.dumps(file_of(regressors, **how)))
    strategy = checker.load(MODEL).check(LOAD, folder=folder).strategy
    assert isinstance(strategy, LearnedStrategy)
    return strategy


@pytest.fixture
def simple(tmp_path: Path) -> LearnedStrategy:
    """Two states; in one the decision depends on both clocks."""
    quick = cut(0, 1.5, 5.0, cut(1, 2.0, 1.0, 4.0))
    return loaded(tmp_path, {"(0,2)": {0: quick, 6: 3.0}, "(0,4)": {1: 1.0, 6: 2.0}})


def texts(picture: Svg) -> list[str]:
    return [one.text or "" for one in ET.fromstring(picture.text).iter(f"{SVG}text")]


def best_at(decided: Decided, point: tuple[float, float]) -> Best:
    """The decision by walking down the tree."""
    while isinstance(decided, Cut):
        is_low = point[decided.feature] <= decided.bound
        decided = decided.low if is_low else decided.high
    return decided


@pytest.mark.parametrize("seed", range(20))
def test_cells_decide_as_the_strategy_does(tmp_path: Path, seed: int) -> None:
    draw = random.Random(seed)
    trees = {number: tree(draw, 4) for number in (0, 1, 2, 6)}
    strategy = loaded(tmp_path, {"(0,2)": trees}, minimises=bool(seed % 2))
    parsed = Trees(strategy.json(), maximises=strategy.maximises)
    decided = parsed.decided(parsed.states[0], (WHOLE, WHOLE))
    cells = list(boxes(decided, (WHOLE, WHOLE)))
    enabled = [number in trees for number in range(len(ACTIONS))]
    for _ in range(200):
        # Half of them lie on cuts.
        point = (draw.randrange(28) / 4, draw.randrange(28) / 4)
        (found,) = (
            best
            for box, best in cells
            if all(low < value <= high for value, (low, high) in zip(point, box, strict=True))
        )
        assert found.action == strategy.decide([0, 2], point, enabled)
        assert found == best_at(decided, point)


def same(one: Decided, other: Decided) -> bool:
    if isinstance(one, Best) and isinstance(other, Best):
        return one.action == other.action
    if isinstance(one, Cut) and isinstance(other, Cut):
        is_alike = (one.feature, one.bound) == (other.feature, other.bound)
        return is_alike and same(one.low, other.low) and same(one.high, other.high)
    return False


@pytest.mark.parametrize("seed", range(20))
def test_no_cut_has_the_same_on_both_sides(tmp_path: Path, seed: int) -> None:
    draw = random.Random(seed)
    trees = {number: tree(draw, 5) for number in (0, 6)}
    strategy = loaded(tmp_path, {"(0,2)": trees})
    parsed = Trees(strategy.json(), maximises=False)
    pending = [parsed.decided(parsed.states[0], (WHOLE, WHOLE))]
    while pending:
        part = pending.pop()
        if isinstance(part, Cut):
            assert not same(part.low, part.high)
            pending += [part.low, part.high]


def drawn(
    trees: LearnedStrategy, monkeypatch: pytest.MonkeyPatch, *axes: str, **at: float | str
) -> tuple[list[Panel], list[Axis]]:
    """What a picture is made of."""
    found: list[Any] = []

    def keep(panels: list[Panel], drawn_axes: Any, *_: object) -> Svg:  # noqa: ANN401
        found.extend([panels, [drawn_axes] if isinstance(drawn_axes, Axis) else drawn_axes])
        return Svg("")

    for name in ("map_picture", "curves_picture"):
        monkeypatch.setattr(f"ntagen.checker.picture.decisions.{name}", keep)
    parsed = Trees(trees.json(), maximises=trees.maximises)
    decisions_chart(parsed, "query", axes, at)
    return found[0], list(found[1])


def test_a_map_ends_at_the_cuts(simple: LearnedStrategy, monkeypatch: pytest.MonkeyPatch) -> None:
    panels, axes = drawn(simple, monkeypatch, n=2)
    (panel,) = panels
    assert panel.title == "P.A n=2"
    assert [axis.feature for axis in axes] == ["x", "y"]
    assert {(one.sides, one.action) for one in panel.patches} == {
        (((0.0, 1.5), axes[1].ends), "wait"),
        (((1.5, axes[0].ends[1]), (0.0, 2.0)), "P.A -> P.B { n = 0 }"),
        (((1.5, axes[0].ends[1]), (2.0, axes[1].ends[1])), "wait"),
    }
    assert axes[0].ends[1] > 1.5
    assert "1.5 < x, y <= 2.0: P.A->P.B { 1, tau, n = 0 }, 1" in [one.note for one in panel.patches]


def test_each_state_has_a_panel_unless_it_is_on_an_axis(
    simple: LearnedStrategy, monkeypatch: pytest.MonkeyPatch
) -> None:
    panels, _ = drawn(simple, monkeypatch)
    assert [one.title for one in panels] == ["n=2", "n=4"]
    panels, axes = drawn(simple, monkeypatch, "x", "n", y=1)
    assert [one.title for one in panels] == ["P.A y=1"]
    # 3 has never been seen: its place is empty.
    assert (axes[1].names, axes[1].ends) == (("2", "3", "4"), (-0.5, 2.5))
    assert {one.sides[1] for one in panels[0].patches} == {(-0.5, 0.5), (1.5, 2.5)}


def test_what_panels_share_is_said_once(simple: LearnedStrategy) -> None:
    said = texts(simple.decisions())
    assert "in all of them: P.A" in said
    assert {"n=2", "n=4"} <= set(said)
    assert "P.A n=2" in texts(simple.decisions(at={"n": 2}))


def test_over_one_feature_each_move_has_a_curve(
    simple: LearnedStrategy, monkeypatch: pytest.MonkeyPatch
) -> None:
    (panel,), (axis,) = drawn(simple, monkeypatch, "x", n=2, y=1)
    end = axis.ends[1]
    curves = {one.action: one.steps for one in panel.curves}
    assert curves == {
        "P.A -> P.B { n = 0 }": (((0.0, 1.5), 5.0), ((1.5, end), 1.0)),
        "wait": (((0.0, end), 3.0),),
    }


def test_what_was_never_seen_is_striped(simple: LearnedStrategy) -> None:
    unseen = "never seen: all that is possible has the same chance"
    assert unseen in texts(simple.decisions("x", "n", at={"y": 1}))
    assert unseen not in texts(simple.decisions("x", "y", at={"P": "A", "n": 4}))


@pytest.mark.parametrize("kind", ["svg", "png", "pdf"])
def test_all_pictures_can_be_saved(simple: LearnedStrategy, tmp_path: Path, kind: str) -> None:
    for number, one in enumerate(
        (simple.decisions(), simple.tree(), simple.decisions("x", at={"y": 0}))
    ):
        path = tmp_path / f"{number}.{kind}"
        one.save(path)
        assert path.stat().st_size > 1000


def test_a_tree_asks_and_answers(simple: LearnedStrategy) -> None:
    said = texts(simple.tree())
    assert [one for one in said if "<=" in one] == ["x <= 1.5", "y <= 2"]
    assert said.count("wait: 3") == 2
    assert "P.A -> P.B { n = 0 }: 1" in said
    assert "P.A -> P.B { n = 1 }: 1" in said
    assert {"P.A n=2", "P.A n=4"} <= set(said)
    assert said.count("yes") == said.count("no") == 2


def test_leaves_that_do_the_same_are_one(tmp_path: Path) -> None:
    strategy = loaded(tmp_path, {"(0,2)": {0: cut(0, 1.5, 5.0, 4.0), 6: 9.0}})
    assert "P.A -> P.B: 4 to 5" in [one.replace(" { n = 0 }", "") for one in texts(strategy.tree())]
    assert "yes" not in texts(strategy.tree())


def test_colours_of_many_actions_differ() -> None:
    colors = colors_of([*(f"move {number}" for number in range(30)), "wait"])
    assert len(set(colors.values())) == 31


@pytest.mark.parametrize(
    ("axes", "at", "message"),
    [
        (["z"], {}, "does not see z\nhint: it sees P.location, n, x, y"),
        (["x", "x"], {}, "both axes are x"),
        (["x"], {"x": 1, "y": 1}, "x has a value and is an axis"),
        ([], {"Q": "A"}, "does not see Q"),
        ([], {"P": "C"}, "process P has no location C\nhint: it has A, B"),
        ([], {"n": "two"}, "n=two is no number"),
        ([], {"n": 7}, "n=7 has never been seen\nhint: choose other values; seen are"),
        ([], {"P": "B"}, "P.B has never been seen"),
        (["x"], {}, "depends on y too, for example at 2\nhint: give it a value"),
        ([], {"P": "A", "n": 2, "x": 1, "y": 1}, "no feature with several values"),
    ],
)
def test_wrong_wishes_have_a_way_out(
    simple: LearnedStrategy, axes: list[str], at: dict[str, float | str], message: str
) -> None:
    with pytest.raises(InputError) as raised:
        simple.decisions(*axes, at=at)
    assert message in str(raised.value)
    assert "hint: " in str(raised.value)


def test_too_much_is_not_drawn(tmp_path: Path) -> None:
    states: dict[str, dict[int, object]] = {
        f"({p},{n})": {0: cut(0, 2.0, 1.0, 3.0), 6: 2.0} for p in (0, 1) for n in range(8)
    }
    strategy = loaded(tmp_path, states)
    with pytest.raises(
        InputError, match="there are 16 states to draw, and a picture has at most 12"
    ):
        strategy.decisions("x")
    with pytest.raises(InputError, match=r"16 states have 32 leaves, .* at most 31\nhint: .*--at"):
        strategy.tree(limit=31)
    assert texts(strategy.tree(limit=32)).count("wait: 2") == 16
    # Without axes, the integer is one of them.
    assert len(strategy.decisions().figure.axes) == 2  # type: ignore[union-attr]


def test_a_tree_of_many_levels_is_refused_and_its_map_drawn(tmp_path: Path) -> None:
    chain: object = 0.0
    for level in range(400):
        chain = cut(level % 2, float(400 - level), float(level % 3), chain)
    strategy = loaded(tmp_path, {"(0,2)": {0: chain, 6: 1.5}})
    with pytest.raises(InputError, match="more than 200 levels, and cannot be drawn\nhint: "):
        strategy.tree(limit=1000)
    assert strategy.decisions().text


def test_states_without_a_choice_are_left_out(tmp_path: Path) -> None:
    strategy = loaded(tmp_path, {"(0,2)": {0: 1.0, 6: 2.0}, "(1,2)": {5: 4.0}})
    said = texts(strategy.decisions("x"))
    assert "P.A n=2" in said
    assert "P.B n=2" not in said
    assert "states in which there is nothing to choose are left out" in said
    assert "P.B n=2" in texts(strategy.decisions("x", at={"P": "B"}))


def test_learning_is_told_iteration_by_iteration() -> None:
    answer = checker.load(LEAVE).check(QUERY, **SMALL)
    found = answer.optimised
    assert found is not None
    assert len(found.history) == found.iterations == 3
    assert [one.runs for one in found.history] == [500, 1000, 1500]
    assert found.history[-1].runs == found.runs
    assert min(one.value for one in found.history) == found.judged
    assert all(one.error >= 0.0 and one.judging_runs == 100 for one in found.history)
    assert {one.resets for one in found.history} == {0}
    chart = answer.chart()
    assert chart is not None
    assert chart.figure is not None
    (plane,) = chart.figure.axes
    (bars,) = (one for one in plane.containers if isinstance(one, ErrorbarContainer))
    points, _, _ = bars
    assert points is not None
    assert list(points.get_ydata()) == [one.value for one in found.history]
    said = texts(chart)
    assert "3 iterations, 1,500 runs" in said
    assert "the uniform choice" in said


def test_resets_are_told() -> None:
    options = SMALL | {"max_iterations": 6, "reset_no_better": 1, "max_reset_learning": 2}
    answer = checker.load(LEAVE).check(QUERY, **options)
    found = answer.optimised
    assert found is not None
    resets = [one.resets for one in found.history]
    assert resets == sorted(resets)
    assert max(resets) == found.resets > 0
    chart = answer.chart()
    assert chart is not None
    assert "all was forgotten" in texts(chart)


def test_an_exact_answer_has_a_strategy_and_no_chart() -> None:
    answer = checker.load(COIN).check(EXACT)
    assert isinstance(answer.strategy, LearnedStrategy)
    assert answer.chart() is None
    assert answer.strategy.decide([0], [0.0], [True, True, False]) == 0


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, simple: LearnedStrategy) -> Path:
    """A folder with the models, and the file of the simple strategy."""
    simple.save(tmp_path / "S.json")
    for name, text in (("moves", MODEL), ("leave", LEAVE), ("coin", COIN)):
        (tmp_path / f"{name}.xta").write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


FAST = ["--set", "good-runs 400", "--set", "eval-runs 100", "--set", "max-iterations 2"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["moves.xta", "--query", LOAD],
        ["moves.xta", "--query", LOAD, "--at", "P.A n=2", "--set", "features y,x"],
        ["moves.xta", "--query", LOAD, "--as", "tree", "--at", "n=4"],
        ["leave.xta", "--query", QUERY, "--as", "learning", *FAST],
        ["coin.xta", "--query", EXACT, "--as", "tree"],
    ],
)
def test_plot_draws_them(folder: Path, arguments: list[str]) -> None:
    assert main(["plot", *arguments, "-o", "a.svg"]) == 0
    assert (folder / "a.svg").read_text().startswith("<svg")


def test_the_strategy_of_an_exact_answer_is_written(folder: Path) -> None:
    assert main(["check", "coin.xta", "--query", EXACT, "--strategy", "best.c"]) == 0
    assert "int S_decide(" in (folder / "best.c").read_text()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--query", "E<> P.B", "--as", "decisions"], "has no learned strategy to draw"),
        (["--as", "tree"], "no queries"),
        (["--query", LOAD, "--set", "features x,y,n"], "3 features are given"),
        (["--query", LOAD, "--set", "features x,,"], "is not one feature or two"),
        (["--query", LOAD, "--set", "features z"], "does not see z"),
        (["--query", LOAD, "--at", "A"], "'A' is neither a location nor a value"),
        (["--query", LOAD, "--at", "n=8"], "n=8 has never been seen"),
        (["--query", LOAD, "--as", "learning"], "does not say how it was learned"),
        (["--query", LOAD, "--as", "tree", "--set", "limit 1"], "at most 1\n"),
    ],
)
def test_plot_refuses_with_a_way_out(
    folder: Path, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plot", "moves.xta", *arguments, "-o", "a.svg"]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert "hint: " in said
    assert not (folder / "a.svg").exists()


def test_learning_of_an_exact_answer_is_refused(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plot", str(folder / "coin.xta"), "--query", EXACT, "--as", "learning"]) == 2
    said = capsys.readouterr().err
    assert "was computed exactly, without learning" in said
    assert "--as decisions" in said


def test_settings_without_effect_are_named(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["plot", str(folder / "moves.xta"), "--query", LOAD, "-o", "a.svg"]
    assert main([*asked, "--set", "clocks x", "--set", "buckets 3"]) == 0
    said = capsys.readouterr().err
    assert "--set 'clocks …' has no effect without --as zones" in said
    assert "--set 'buckets …' has no effect" in said
    assert main([*asked[:-2], "-o", "b.svg", "--as", "templates", "--at", "P.A", *FAST]) == 0
    said = capsys.readouterr().err
    assert "--at has no effect without --as zones, decisions or tree" in said
    assert "--set 'good-runs …' has no effect here: no learned strategy is drawn" in said


def test_a_value_at_a_cut_is_of_the_low_side(tmp_path: Path) -> None:
    strategy = loaded(tmp_path, {"(0,2)": {0: cut(0, 2.0, 1.0, 9.0), 6: 5.0}})
    for value, action in ((2.0, 0), (math.nextafter(2.0, 3.0), 6)):
        assert strategy.decide([0, 2], [value, 0.0], [True] * 7) == action
        said = texts(strategy.tree(at={"x": value}))
        assert ("wait: 5" in said) == (action == 6)
