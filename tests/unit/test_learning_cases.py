"""The known values of learning queries, computed again, and met by random runs of closed models."""

from __future__ import annotations

from pathlib import Path

import pytest

from ntagen.checker import load, load_file
from tests.oracles.learning.cases import CASES, HELD_BACK, Case, closed
from tests.oracles.learning.induction import Choice, Solution

ALL = CASES + HELD_BACK
RUNS = 20_000
ROUNDING = 1e-6


def check_estimate(text: str, case: Case, exact: float) -> None:
    """The interval, which misses once in a million times, holds the exact value."""
    answer = load(text, str(case.path)).check(
        case.estimate.format(runs=RUNS), alpha=1e-6, seed=1, threads=1
    )
    assert answer.estimate is not None
    lower, upper = answer.estimate.lower, answer.estimate.upper
    assert lower is not None
    assert upper is not None
    assert lower - ROUNDING <= exact <= upper + ROUNDING


@pytest.mark.parametrize("case", ALL, ids=lambda case: case.name)
def test_the_value_is_found_again(case: Case) -> None:
    assert case.exact == case.oracle()


@pytest.mark.parametrize("case", ALL, ids=lambda case: case.name)
def test_the_best_policy_has_the_value(case: Case) -> None:
    check_estimate(closed(case), case, float(case.exact))


@pytest.mark.parametrize("case", [case for case in ALL if case.game], ids=lambda case: case.name)
def test_random_choice_has_its_value(case: Case) -> None:
    assert case.game is not None
    text = case.path.read_text(encoding="utf-8")
    check_estimate(text, case, float(Solution(case.game(), Choice.RANDOM).value))


@pytest.mark.parametrize("path", sorted({case.path for case in ALL}), ids=lambda path: path.stem)
def test_warnings_are_about_doubles_only(path: Path) -> None:
    assert all("[W0213]" in warning for warning in load_file(path).warnings)


def test_every_model_has_a_case() -> None:
    models = {path.stem for path in ALL[0].path.parent.glob("*.xta")}
    assert models == {case.model for case in ALL}
