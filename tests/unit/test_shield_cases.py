"""The published cases of shields: safe runs under them, and an independent fixed point."""

from __future__ import annotations

import json

import numpy as np
import pytest

from ntagen.checker import Answer, Model, load
from tests.oracles.learning.shields.cases import CASES, WALK, Shielding
from tests.oracles.learning.shields.fixed_point import Cells, Walk

CELLS = 100
NEARLY = 0.02
"""By so much the shares of cells differ at most where errors are drawn."""


def shielded(case: Shielding) -> tuple[Model, Answer]:
    """The model with its shield S, and the answer that made it."""
    model = load(case.text)
    return model, model.check(case.query, threads=2, **case.options)


def check_safe(case: Shielding, model: Model, answer: Answer) -> None:
    """There is a shield, and no run under it is unsafe."""
    assert answer.verdict == "satisfied"
    under = model.check(f"{case.broken} under S", threads=2).estimate
    assert under is not None
    assert under.satisfied_runs == 0


@pytest.fixture(scope="module")
def walk() -> tuple[Model, Answer]:
    return shielded(WALK)


def steps(answer: Answer) -> dict[str, Cells]:
    """The cells of a walk in which each step is allowed."""
    text = answer.strategy_json()
    assert text is not None
    file = json.loads(text)
    runs = zip(file["cells"][::2], file["cells"][1::2], strict=True)
    sets = [set(file["sets"][number]) for number, count in runs for _ in range(count)]
    actions = [action.lower() for action in file["actions"]]
    places = {name: [name in one for one in actions].index(True) for name in ("fast", "slow")}
    found = {name: [place in one for one in sets] for name, place in places.items()}
    return {name: np.array(cells).reshape(CELLS, CELLS) for name, cells in found.items()}


def test_without_errors_the_walk_has_the_cells_of_an_independent_fixed_point() -> None:
    text = WALK.text.replace("ERROR = 0.04", "ERROR = 0.0")
    answer = load(text).check(WALK.query, shield_samples=4)
    wanted = Walk(CELLS, samples=4, error=0.0, errors=1).solve()
    found = steps(answer)
    for name in wanted:
        assert (found[name] == wanted[name]).all()
        assert 0.1 < wanted[name].mean() < 0.9


@pytest.mark.slow
def test_with_errors_the_walk_has_nearly_the_cells_for_the_worst_ones(
    walk: tuple[Model, Answer],
) -> None:
    _, answer = walk
    wanted = Walk(CELLS, samples=4, error=0.04, errors=9).solve()
    found = steps(answer)
    for name in wanted:
        # What is safe for the worst errors is so for those that are drawn.
        assert (wanted[name] & ~found[name]).mean() < NEARLY / 10
        assert (found[name] & ~wanted[name]).mean() < NEARLY
        assert 0.1 < wanted[name].mean() < 0.9


@pytest.mark.slow
def test_no_run_under_the_shield_of_the_walk_is_unsafe(walk: tuple[Model, Answer]) -> None:
    check_safe(WALK, *walk)


@pytest.mark.slow
@pytest.mark.parametrize(
    "case", [case for case in CASES if case != WALK], ids=lambda case: case.model
)
def test_no_run_under_a_published_shield_is_unsafe(case: Shielding) -> None:
    check_safe(case, *shielded(case))


@pytest.mark.slow
def test_what_is_learned_under_a_shield_is_safe_and_cheaper(walk: tuple[Model, Answer]) -> None:
    model, _ = walk
    cheap = "strategy Cheap = minE(cost)[#<=100] {} -> {x, t}: <> Walker.End"
    free = model.check(cheap, threads=2, max_iterations=6)
    assert model.check(f"{WALK.broken} under Cheap").value > 0.1
    fenced = model.check(f"{cheap} under S", threads=2, max_iterations=6)
    under = model.check(f"{WALK.broken} under Cheap").estimate
    assert under is not None
    assert under.satisfied_runs == 0
    uniform = fenced.optimised and fenced.optimised.uniform
    assert uniform is not None
    assert free.value < fenced.value < uniform.value
