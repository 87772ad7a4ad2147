"""Statistical queries: what their answers say, and the options that they take."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest

from ntagen.checker import Model, load_file
from ntagen.cli import main
from ntagen.errors import InputError

MODEL = """
clock x;
process P() { state A { ; 1:2 }, B; init A; trans A -> B { }; }
process Q() { state A { x <= 4 }, B; init A; trans A -> B { guard x >= 2; }; }
system P, Q;
"""
HALF = "Pr[<=3](<> Q.B)"


@pytest.fixture
def model(tmp_path: Path) -> Model:
    path = tmp_path / "model.xta"
    path.write_text(MODEL, "utf-8")
    return load_file(path)


def test_a_probability_has_an_interval(model: Model) -> None:
    answer = model.check("Pr[<=2](<> P.B)", runs=20_000)
    assert answer.satisfied
    estimate = answer.estimate
    assert estimate is not None
    assert estimate.runs == 20_000
    assert estimate.satisfied_runs is not None
    assert answer.value == estimate.value == estimate.satisfied_runs / 20_000
    assert estimate.lower is not None
    assert estimate.upper is not None
    assert estimate.lower < estimate.value < estimate.upper
    assert estimate.value == pytest.approx(1 - math.exp(-1), abs=0.02)
    assert estimate.confidence == 0.95
    assert estimate.method == "Clopper-Pearson"
    assert "20000 runs" in repr(answer)


def test_the_interval_is_as_narrow_as_wanted(model: Model) -> None:
    for epsilon in (0.05, 0.01):
        estimate = model.check(HALF, epsilon=epsilon).estimate
        assert estimate is not None
        assert estimate.lower is not None
        assert estimate.upper is not None
        assert estimate.value - epsilon <= estimate.lower <= 0.5 <= estimate.upper
        assert estimate.upper <= estimate.value + epsilon


def test_runs_depend_on_the_seed_and_not_on_threads(model: Model) -> None:
    counts = [
        model.check(HALF, seed=seed, threads=threads, runs=1000).estimate
        for seed, threads in ((1, 1), (1, 2), (1, 3), (2, 1))
    ]
    assert counts[0] == counts[1] == counts[2]
    assert counts[0] != counts[3]


def test_the_interpreter_makes_the_same_runs(model: Model) -> None:
    compiled = model.check(HALF, runs=200).estimate
    assert model.check(HALF, runs=200, engine="interpreter").estimate == compiled


def test_a_comparison_is_decided(model: Model) -> None:
    assert model.check(f"{HALF} >= 0.3").satisfied is True
    assert model.check(f"{HALF} >= 0.7").satisfied is False
    assert model.check(f"{HALF} <= 0.7").satisfied is True
    assert model.check(f"{HALF} <= 0.3").satisfied is False
    assert model.check(f"{HALF} >= 0.5", runs=3).verdict == "maybe"


def test_a_mean_has_an_interval(model: Model) -> None:
    answer = model.check("E[<=3; 100](max: x)")
    estimate = answer.estimate
    assert estimate is not None
    assert (estimate.value, estimate.runs, estimate.satisfied_runs) == (3.0, 100, None)
    assert (estimate.lower, estimate.upper) == (3.0, 3.0)
    assert estimate.method == "Student (asymptotic)"


def test_a_mean_without_a_number_of_runs_has_as_many_as_a_probability_of_one_half(
    model: Model,
) -> None:
    query = "E[<=3](max: Q.B ? 1 : 0)"
    answer = model.check(query, seed=2)
    assert answer.estimate is not None
    assert answer.estimate.runs == 402
    assert answer.message is not None
    assert "the query names no number of runs: 402" in answer.message
    assert answer.estimate == model.check(query.replace("3]", "3; 402]"), seed=2).estimate
    for options in ({"alpha": 0.01}, {"epsilon": 0.01}):
        found, near = (model.check(one, **options).estimate for one in (query, HALF))
        assert found is not None
        assert near is not None
        assert found.runs == pytest.approx(near.runs, rel=0.01)
    # What says how many there are counts.
    for options in ({"runs": 30}, {"relative": 0.5}):
        answer = model.check(query, **options)
        assert answer.estimate is not None
        assert answer.estimate.runs != 402
        assert "names no number of runs" not in (answer.message or "")
    assert model.check("E[<=3; 7](max: x)").message == (
        "the interval is Student's: asymptotic, for many runs"
    )


def test_a_run_without_result_is_refused_with_its_place(tmp_path: Path) -> None:
    path = tmp_path / "model.xta"
    path.write_text("process P() { state A, B; init A; trans A -> B { }; } system P;", "utf-8")
    with pytest.raises(InputError, match=r"model.xta:1:21: error\[E0806\]: P.A can be left at any"):
        load_file(path).check("Pr[<=1](<> P.B)")


@pytest.mark.parametrize("option", ["alpha", "beta", "epsilon", "delta"])
@pytest.mark.parametrize("value", [0.0, 1.0, -1.0, math.nan])
def test_risks_lie_between_0_and_1(option: str, value: float, model: Model) -> None:
    with pytest.raises(ValueError, match=f"{option} is"):
        model.check(HALF, **{option: value})


def test_deltas_may_differ(model: Model) -> None:
    # The farther apart the two hypotheses are, the fewer runs tell them apart.
    narrow = model.check(f"{HALF} >= 0.7").estimate
    wide = model.check(f"{HALF} >= 0.7", delta=(0.15, 0.01)).estimate
    assert narrow is not None
    assert wide is not None
    assert wide.runs < narrow.runs
    assert model.check(f"{HALF} >= 0.7", delta=(0.01, 0.01)).estimate == narrow
    for ratios in ((1.1, 1.2), (0.9, 1.0), (0.0, 2.0)):
        with pytest.raises(ValueError, match="odds_ratios are"):
            model.check(HALF, odds_ratios=ratios)
    with pytest.raises(ValueError, match="discretisation is"):
        model.check(HALF, discretisation=0.0)


def test_an_interval_may_hold_at_any_moment(model: Model) -> None:
    fixed = model.check(HALF, runs=1000).estimate
    anytime = model.check(HALF, runs=1000, anytime=True).estimate
    assert fixed is not None
    assert anytime is not None
    assert anytime.method == "confidence sequence"
    assert (anytime.value, anytime.runs) == (fixed.value, fixed.runs)
    assert anytime.lower is not None
    assert anytime.upper is not None
    assert fixed.lower is not None
    assert fixed.upper is not None
    assert anytime.lower < fixed.lower < fixed.upper < anytime.upper
    # Without a number of runs it becomes as narrow as epsilon says.
    narrow = model.check(HALF, anytime=True, epsilon=0.02).estimate
    assert narrow is not None
    assert narrow.lower is not None
    assert narrow.upper is not None
    assert narrow.value - 0.02 <= narrow.lower <= 0.5 <= narrow.upper <= narrow.value + 0.02


def test_the_width_may_be_a_part_of_the_estimate(model: Model) -> None:
    for query, probability in ((HALF, 0.5), ("Pr[<=0.2](<> P.B)", 1 - math.exp(-0.1))):
        estimate = model.check(query, relative=0.1, seed=2).estimate
        assert estimate is not None
        assert estimate.lower is not None
        assert estimate.upper is not None
        assert 0.9 * estimate.value <= estimate.lower <= probability
        assert probability <= estimate.upper <= 1.1 * estimate.value
    never = model.check("Pr[<=1](<> Q.B)", relative=0.1, runs=2000).estimate
    assert never is not None
    assert (never.value, never.runs) == (0.0, 2000)


@pytest.mark.parametrize(
    ("options", "method"),
    [
        ({}, "Student (asymptotic)"),
        ({"value_bounds": (0, 3)}, "empirical Bernstein"),
        ({"value_bounds": (0, 3), "anytime": True}, "empirical Bernstein confidence sequence"),
        ({"value_bounds": (0, 3), "mean_interval": "dkw"}, "Dvoretzky-Kiefer-Wolfowitz"),
        ({"value_bounds": (0, 3), "mean_interval": "student"}, "Student (asymptotic)"),
    ],
)
def test_a_mean_between_bounds_has_other_intervals(
    options: dict[str, object], method: str, model: Model
) -> None:
    estimate = model.check("E[<=3; 500](max: Q.B ? 3.0 - x : 0.0)", **options).estimate  # type: ignore[arg-type]
    assert estimate is not None
    assert estimate.method == method
    assert estimate.runs == 500
    assert estimate.lower is not None
    assert estimate.upper is not None
    assert estimate.lower <= 0.25 <= estimate.upper


def test_bounds_of_integers_are_known(model: Model) -> None:
    for value, method in (
        ("Q.B", "empirical Bernstein"),
        ("2 * Q.B + 0.5", "empirical Bernstein"),
        ("Q.B + x", "Student (asymptotic)"),
    ):
        estimate = model.check(f"E[<=3; 100](max: {value})").estimate
        assert estimate is not None
        assert estimate.method == method


def test_intervals_that_cannot_be_made_are_refused(model: Model) -> None:
    with pytest.raises(InputError, match="needs bounds of the value"):
        model.check("E[<=3; 100](max: x)", anytime=True)
    with pytest.raises(InputError, match="is for a fixed number of runs"):
        model.check("E[<=3; 100](max: Q.B)", anytime=True, mean_interval="dkw")
    with pytest.raises(InputError, match="the value is 3, which is not between the bounds"):
        model.check("E[<=3; 100](max: x)", value_bounds=(0, 2))
    with pytest.raises(ValueError, match="value_bounds are 2 and 1"):
        model.check(HALF, value_bounds=(2, 1))


def test_the_command_line_prints_the_interval(
    model: Model, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["check", str(tmp_path / "model.xta"), "--query", HALF, "--runs", "50"]
    assert main([*words, "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["runs"] == 50
    assert record["lower"] < record["value"] < record["upper"]
    assert record["value"] == record["satisfied_runs"] / 50
    assert main(words) == 0
    assert "of 50 runs satisfied" in capsys.readouterr().out


def test_options_without_effect_are_noted(
    model: Model, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(tmp_path / "model.xta")
    assert main(["check", path, "--query", "E<> P.B", "--runs", "5", "--alpha", "0.1"]) == 0
    err = capsys.readouterr().err
    assert "--runs has no effect here" in err
    assert "--alpha has no effect here" in err
    assert main(["check", path, "--query", HALF, "--epsilon", "2"]) == 2
    assert "'2' is not a number between 0 and 1" in capsys.readouterr().err


def test_verifyta_prints_the_lines_of_uppaal(
    model: Model, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    queries = tmp_path / "model.q"
    queries.write_text(f"{HALF}\n\nE[<=3; 10](max: x)\n", "utf-8")
    path = str(tmp_path / "model.xta")
    assert main(["verifyta", "-E", "0.1", "-a", "0.01", path, str(queries)]) == 0
    out = capsys.readouterr().out
    assert " runs) Pr(<> …) in [" in out
    assert "] (99% CI)" in out
    assert "(10 runs) E(max) = ≈ 3" in out
    assert main(["verifyta", "-E", "2", path, str(queries)]) == 1
    assert "must be a number between 0 and 1" in capsys.readouterr().err


def test_runs_are_shown(model: Model, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    answer = model.check("simulate[<=3; 5]{x, Q.B}")
    assert [one.run for one in answer.trajectories] == [0, 1, 2, 3, 4]
    points = answer.trajectories[0].points["x"]
    assert (points[0], points[-1]) == ((0.0, 0.0), (3.0, 3.0))
    assert answer.estimate is None
    assert "5 runs shown" in repr(answer)
    filtered = model.check("simulate[<=4; 100]{x} : 2 : Q.B && x <= 3")
    assert len(filtered.trajectories) == 2
    assert filtered.estimate is not None
    path = str(tmp_path / "model.xta")
    words = ["check", path, "--query", "simulate 5 [<=3] {x}"]
    assert main([*words, "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["trajectories"][4]["run"] == 4
    assert record["trajectories"][4]["points"]["x"][-1] == [3, 3]
    assert main(words) == 0
    out = capsys.readouterr().out
    assert "run 0: x from 0 to 3, at the end 3" in out
    assert "and 2 runs more" in out
    queries = tmp_path / "model.q"
    queries.write_text("simulate[<=3; 2]{x}", "utf-8")
    assert main(["verifyta", path, str(queries)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-3] == "x:"
    assert lines[-2].startswith("[0]: (0,0) ")
    assert lines[-1].endswith(" (3,3)")


def test_two_probabilities_are_compared(model: Model) -> None:
    query = "Pr[<=3](<> P.B) >= Pr[<=3](<> Q.B)"
    answer = model.check(query)
    assert answer.verdict == "satisfied"
    estimate = answer.estimate
    assert estimate is not None
    assert estimate.compared is not None
    assert estimate.value == pytest.approx(1 - math.exp(-1.5), abs=0.1)
    assert estimate.compared.value == pytest.approx(0.5, abs=0.1)
    assert estimate.compared.runs == estimate.runs
    assert model.check("Pr[<=3](<> P.B) <= Pr[<=3](<> Q.B)").verdict == "not satisfied"
    undecided = model.check("Pr[<=3](<> P.B) >= Pr[<=3](<> P.B)", runs=10)
    assert undecided.verdict == "maybe"
    assert undecided.message is not None


def test_formulas_over_time(model: Model) -> None:
    answer = model.check("Pr(!Q.B U[3,4] Q.B && (P.A || P.B))", runs=20_000)
    assert answer.value == pytest.approx(0.5, abs=0.02)
    # The run ends where the formula is decided, not at its horizon.
    assert model.check("Pr([][0,900000000](Q.A || P.A || P.B))", runs=10).value == 1.0


def test_mistakes_in_statistical_queries_have_a_place(model: Model) -> None:
    for query, says in (
        ("Pr[<=3](<> P.B", "expected `)` after what is asked of a run"),
        ("Pr(<> P.B)", "nothing says how long the runs are"),
        ("Pr(<>[3,1] P.B)", "no distance is at least 3 and at most 1"),
        ("Pr[<=x](<> P.B)", "must be known"),
        ("Pr[<=3](<> P.B) = 1", "a probability is not compared by `=`"),
    ):
        with pytest.raises(InputError, match=re.escape(says)):
            model.check(query)


GAME = """
clock x;
bool waiting = true;
process C() {
    state wait, done;
    init wait;
    trans wait -> done { guard x >= 2; assign waiting = false; };
}
process E() {
    state calm { ; 50 }, alarm;
    init calm;
    trans calm -u-> alarm { guard x > 5 && waiting; };
}
c = C(); e = E();
system c, e;
"""
SAFE = "strategy S = control: A[] not e.alarm"
EARLY = "Pr[<=2](<> c.done) under S"


def test_random_runs_follow_a_strategy(tmp_path: Path) -> None:
    path = tmp_path / "game.xta"
    path.write_text(GAME, "utf-8")
    game = load_file(path)
    with pytest.raises(InputError, match="there is no strategy 'S'"):
        game.check(EARLY)
    assert game.check(SAFE).satisfied
    assert game.check("Pr[<=20](<> e.alarm) under S", runs=500).value == 0
    assert game.check("Pr[<=3](<> c.done) under S", runs=5000).value == pytest.approx(
        1 - (2 / 3) ** 0.5, abs=0.05
    )
    assert game.check(EARLY, runs=100, under_choice="eager").value == 1
    assert game.check("Pr[<=4](<> c.done) under S", runs=100, under_choice="lazy").value == 0
    shown = game.check("simulate[<=9; 2]{c.done} under S", under_choice="lazy").trajectories
    assert [one.points["c.done"][-1] for one in shown] == [(9.0, 1.0)] * 2
    with pytest.raises(ValueError, match="choice under a strategy"):
        game.check(EARLY, under_choice="clever")


def test_the_command_line_and_verifyta_follow_strategies(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "game.xta"
    path.write_text(GAME, "utf-8")
    queries = tmp_path / "game.q"
    queries.write_text(f"{SAFE}\n{EARLY}\n", "utf-8")
    arguments = ["check", str(path), "--query", SAFE, "--query", EARLY, "--runs", "50"]
    assert main([*arguments, "--set", "under choice eager", "--json"]) == 0
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["value"] == 1
    assert main([*arguments[:4], "--set", "under choice eager"]) == 0
    assert "--set 'under choice …' has no effect here" in capsys.readouterr().err
    assert main([*arguments, "--set", "under choice clever"]) == 2
    assert "'clever' is not one of 'race', 'eager', 'lazy'" in capsys.readouterr().err
    assert main(["verifyta", str(path), str(queries), "-s"]) == 0
    out = capsys.readouterr().out
    assert "Verifying formula 2" in out
    assert " runs) Pr(<> …) in [0," in out
