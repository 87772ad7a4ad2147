"""Probabilities of rare events by importance splitting."""

from __future__ import annotations

from pathlib import Path

import pytest

from ntagen.checker import Model, load_file
from ntagen.cli import main
from ntagen.errors import InputError

MODEL = """
int[0, 20] n = 1;
process P() {
  state A { ; 1 };
  branchpoint step;
  init A;
  trans
    A -> step { guard n > 0 && n < 20; },
    step -> A { probability 3; assign n++; },
    step -> A { probability 7; assign n--; };
}
system P;
"""
RUIN = "Pr[<=100000](n > 0 U n >= 20)"
RATIO = 7 / 3
EXACT = (RATIO - 1) / (RATIO**20 - 1)


@pytest.fixture
def model(tmp_path: Path) -> Model:
    path = tmp_path / "model.xta"
    path.write_text(MODEL, "utf-8")
    return load_file(path)


@pytest.mark.slow
def test_a_rare_event_has_an_interval(model: Model) -> None:
    answer = model.check(RUIN, levels="n", effort=200, repetitions=30, seed=1)
    estimate = answer.estimate
    assert estimate is not None
    assert estimate.method == "importance splitting, Student (asymptotic)"
    assert estimate.lower is not None
    assert estimate.upper is not None
    assert estimate.lower <= EXACT <= estimate.upper < 2 * estimate.lower
    assert estimate.satisfied_runs is None
    assert "thresholds of levels: " in (answer.message or "")
    assert "plain runs would say as much" in (answer.message or "")
    again = model.check(RUIN, levels="n", effort=200, repetitions=30, seed=1, threads=2)
    assert again.estimate == estimate
    # Any expression of numbers is a level, also one that is not an integer.
    other = model.check(RUIN, levels="n * 0.5", effort=200, repetitions=30, seed=1)
    assert other.estimate == estimate


def test_an_event_that_is_not_reached_says_so(model: Model) -> None:
    answer = model.check("Pr[#<=5](<> n >= 20)", levels="n", effort=50, repetitions=5)
    estimate = answer.estimate
    assert estimate is not None
    assert (estimate.value, estimate.lower, estimate.upper) == (0.0, 0.0, 1.0)
    assert "no repetition reached the event" in (answer.message or "")
    plain = model.check("Pr[#<=5](<> n >= 20)", levels="7", effort=50, repetitions=5)
    assert "these are plain runs" in (plain.message or "")


def test_what_has_no_levels_is_refused(model: Model) -> None:
    with pytest.raises(InputError, match="levels lead to an event"):
        model.check("Pr[<=5]([] n < 20)", levels="n")
    for level in ("m", "n +", "n) + (n"):
        with pytest.raises(InputError, match="is no level"):
            model.check(RUIN, levels=level)
    with pytest.raises(ValueError, match="effort is 0"):
        model.check(RUIN, levels="n", effort=0)
    with pytest.raises(ValueError, match="repetitions is 1"):
        model.check(RUIN, levels="n", repetitions=1)
    # Others are answered as without levels.
    assert model.check("E[<=5; 10](max: n)", levels="n").estimate is not None
    assert model.check("Pr[<=5](<> n >= 3) >= 0.5", levels="n").satisfied is False


def test_the_command_line_splits(
    model: Model, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["check", str(tmp_path / "model.xta"), "--query", RUIN, "--set", "effort 100"]
    assert main([*words, "--set", "levels n"]) == 0
    assert "interval: importance splitting" in capsys.readouterr().out
    assert main([*words, "--runs", "10"]) == 0
    assert "--set 'effort …' has no effect without --set 'levels …'" in capsys.readouterr().err
