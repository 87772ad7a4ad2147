"""Learned strategies in Python: what they decide, their files and their code."""

from __future__ import annotations

import json
import random
import runpy
from pathlib import Path
from typing import Any

import pytest

from ntagen import checker
from ntagen.checker import LearnedStrategy, RejectedError
from ntagen.errors import InputError
from tests.choices import ACTIONS

SHOP = """
int[0,2] parts = 2;
int[0,5] left = 5;
double cost;
process Shop() {
  state Choose, Done;
  branchpoint Slow, Fast;
  urgent Choose;
  init Choose;
  trans Choose -> Slow { guard parts > 0 && left > 0; assign left--, cost = cost + random(2.0); },
        Choose -> Fast { guard parts > 0 && left > 0; assign left--, cost = cost + 3; },
        Slow -> Choose { assign parts--; probability 1; },
        Slow -> Choose { probability 1; },
        Fast -> Choose { assign parts--; probability 4; },
        Fast -> Choose { probability 1; },
        Choose -u-> Done { guard parts == 0 || left == 0; assign cost = cost + 10 * parts; };
}
system Shop;
"""

QUERY = "strategy S = minE(cost)[<=1] {parts, left} -> {} : <> Shop.Done"

MOVES = """
clock x, y;
int[0,9] n;
double level;
process P() {
  state A, B;
  init A;
  trans A -> B { select i : int[0,4]; assign n = i; }, B -> A { };
}
system P;
"""


def learned(text: str = SHOP, query: str = QUERY, **options: Any) -> LearnedStrategy:  # noqa: ANN401
    small = {"good_runs": 500, "eval_runs": 200, "max_iterations": 3, "runs": 1000}
    answer = checker.load(text).check(query, **small | options)
    assert isinstance(answer.strategy, LearnedStrategy)
    return answer.strategy


def tree(draw: random.Random, depth: int) -> object:
    if depth == 0 or draw.random() < 0.3:
        return float(draw.randrange(8))
    low, high = tree(draw, depth - 1), tree(draw, depth - 1)
    return {"var": draw.randrange(2), "bound": draw.randrange(12) / 2, "low": low, "high": high}


def random_file(draw: random.Random, *, minimises: bool) -> dict[str, Any]:
    def regressor() -> dict[str, Any]:
        tried = [number for number in range(len(ACTIONS)) if draw.random() < 0.7]
        return {
            "type": "act->point->val",
            "representation": "simpletree",
            "minimize": int(minimises),
            "regressor": {str(number): tree(draw, 4) for number in tried},
        }

    return {
        "version": 1.0,
        "type": "state->regressor",
        "representation": "map",
        "actions": {str(number): text for number, text in enumerate(ACTIONS)},
        "statevars": ["P.location", "level"],
        "pointvars": ["x", "y"],
        "locationnames": {"P.location": {"0": "A", "1": "B"}},
        "regressors": {f"({p},{v})": regressor() for p in (0, 1) for v in (0.5, 2, -3e-7)},
    }


def loaded(tmp_path: Path, file: dict[str, Any], text: str = MOVES) -> LearnedStrategy:
    (tmp_path / "file.json").write_text(json.dumps(file))
    answer = checker.load(text).check('strategy S = loadStrategy("file.json")', folder=tmp_path)
    assert isinstance(answer.strategy, LearnedStrategy)
    return answer.strategy


def test_an_answer_has_the_strategy_and_says_how_it_was_found() -> None:
    model = checker.load(SHOP)
    answer = model.check(QUERY, good_runs=500, eval_runs=200, max_iterations=3, runs=1000)
    found, strategy = answer.optimised, answer.strategy
    assert found is not None
    assert isinstance(strategy, LearnedStrategy)
    assert (found.iterations, found.resets, found.runs) == (3, 0, 3 * 700)
    assert found.leaves == strategy.leaves
    assert found.comparison == "better"
    assert found.uniform is not None
    assert found.uniform.runs == 1000
    assert (strategy.discrete, strategy.continuous) == (("parts", "left"), ())
    assert strategy.actions[-1] == "WAIT"
    assert not strategy.maximises
    assert answer.machine is None
    assert model.check("E<> Shop.Done").optimised is None


def test_it_decides_by_what_is_seen_and_possible() -> None:
    strategy = learned()
    both, slow, nothing = [True, True, False], [True, False, False], [False] * 3
    assert strategy.decide([2, 5], [], both) == 0
    assert strategy.decide([1, 1], [], both) == 1
    assert strategy.decide([1, 1], [], slow) == 0
    assert strategy.decide([1, 1], [], nothing) is None
    assert strategy.decide([7, 7], [], both) is None
    assert strategy.decide([float("nan"), 1], [], both) is None
    with pytest.raises(ValueError, match="discrete has 1 values, but there must be 2"):
        strategy.decide([1], [], both)
    with pytest.raises(ValueError, match="enabled has 1 values, but there must be 3"):
        strategy.decide([1, 1], [], [True])


def test_files_have_the_same_bytes_again(tmp_path: Path) -> None:
    model = checker.load(SHOP)
    learned(threads=2).save(tmp_path / "a.json")
    learned().save(tmp_path / "b.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    loading = model.check('strategy T = loadStrategy("a.json")', folder=tmp_path)
    assert isinstance(loading.strategy, LearnedStrategy)
    loading.strategy.save(tmp_path / "c.json")
    assert (tmp_path / "c.json").read_bytes() == (tmp_path / "a.json").read_bytes()
    assert loading.strategy_json() == loading.strategy.json()
    means = [learned(), loading.strategy]
    for number, one in enumerate(means):
        one.keep(f"S{number}")
    assert model.check("E[<=1; 200](max: cost) under S1").value is not None


def test_a_file_is_json_without_what_was_never_tried() -> None:
    file = json.loads(learned().json())
    assert [*file] == [
        *("version", "type", "representation", "actions", "statevars", "pointvars"),
        *("locationnames", "regressors"),
    ]
    assert isinstance(file["version"], float)
    assert [*file["actions"]] == ["0", "1"]
    assert file["locationnames"] == {"Shop.location": {"0": "Choose", "1": "Done"}}
    assert [*file["regressors"]] == sorted(file["regressors"])
    assert all(one["minimize"] == 1 for one in file["regressors"].values())


@pytest.mark.parametrize("minimises", [True, False])
def test_the_module_decides_as_the_strategy_does(tmp_path: Path, minimises: bool) -> None:
    draw = random.Random(5)
    strategy = loaded(tmp_path, random_file(draw, minimises=minimises))
    assert strategy.actions == tuple(ACTIONS)
    strategy.save(tmp_path / "module.py")
    module = runpy.run_path(str(tmp_path / "module.py"))
    names = (module["DISCRETE"], module["CONTINUOUS"], module["ACTIONS"])
    assert names == (["P.location", "level"], ["x", "y"], ACTIONS)
    unseen = 0
    for _ in range(50_000):
        discrete = [draw.randrange(3), draw.choice([0.5, 2.0, -3e-7, 1.0])]
        continuous = [draw.randrange(-2, 30) / 4, draw.uniform(0, 6)]
        enabled = [draw.random() < 0.5 for _ in ACTIONS]
        decided = strategy.decide(discrete, continuous, enabled)
        unseen += decided is None
        assert module["decide"](discrete, continuous, enabled) == (
            -1 if decided is None else decided
        )
    assert 0 < unseen < 50_000


def test_code_has_a_name_of_c() -> None:
    strategy = learned()
    code = strategy.code("c", "pump")
    assert "int pump_decide(const double discrete[]" in code
    assert code.startswith("/* A learned strategy for\n *     minE(cost)[<=1] {parts, left}")
    with pytest.raises(InputError, match="is no name in C"):
        strategy.code("c", "a b")


def test_a_learned_file_is_no_strategy_in_zones(tmp_path: Path) -> None:
    learned().save(tmp_path / "s.json")
    model = checker.load(SHOP)
    with pytest.raises(RejectedError, match="this is a learned strategy") as refused:
        model.load_strategy(tmp_path / "s.json")
    assert "loadStrategy" in str(refused.value)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"good_runs": 0}, "good_runs is 0, but must be at least 1"),
        ({"max_reset_learning": -1}, "max_reset_learning is -1, but must be at least 0"),
        ({"discount": 0.0}, "discount is 0.0, but must lie between 0 and 1"),
        ({"qlearning_alpha": 0.5}, "qlearning_alpha is 0.5, but must be at least 1"),
        ({"learning_method": "x"}, "unknown method of learning"),
    ],
)
def test_options_without_a_meaning_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        learned(**options)


def test_options_of_learning_count() -> None:
    model = checker.load(SHOP)
    found = model.check(QUERY, good_runs=100, eval_runs=1, max_iterations=1, runs=100).optimised
    assert found is not None
    assert (found.runs, found.iterations, found.iterations_in_last_reset) == (101, 1, 1)
    by_q = learned(learning_method="q", qlearning_alpha=2.0, discount=0.9)
    assert by_q.json() != learned().json()
