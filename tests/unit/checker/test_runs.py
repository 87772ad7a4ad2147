"""Runs with exact times as Python values."""

from __future__ import annotations

from fractions import Fraction

import pytest

from ntagen import checker
from ntagen.checker.runs import Choice, State

LAMP = """
clock x, y;
process Lamp() {
  state Off, On { x < 2 };
  init Off;
  trans Off -> On { select k : int[1,2]; guard y >= 3; assign x = 0; },
        On -> Off { guard x > 1; assign y = 0; };
}
system Lamp;
"""


def test_trace_has_states_and_steps_with_exact_times() -> None:
    answer = checker.load(LAMP).check("E<> Lamp.Off and y < 1 and x > 1")
    assert answer.verified
    run = answer.trace
    assert run is not None
    assert run.end == "after"
    assert [step.delay for step in run.steps] == [3, Fraction(3, 2)]
    assert run.duration == Fraction(9, 2)
    assert run.states[-1].clocks == {"x": Fraction(3, 2), "y": 0}
    edge = run.steps[0].edges[0]
    assert (edge.process, edge.source, edge.target, edge.select) == ("Lamp", "Off", "On", {"k": 1})
    assert str(run) == (
        "0: ( Lamp.Off ) x=0 y=0\n"
        "   wait 3, then Lamp.Off -> Lamp.On\n"
        "1: ( Lamp.On ) x=0 y=3\n"
        "   wait 3/2, then Lamp.On -> Lamp.Off\n"
        "2: ( Lamp.Off ) x=3/2 y=0"
    )


def test_lasso_leads_back_to_a_state() -> None:
    run = checker.load(LAMP).check("E[] (Lamp.Off and y <= 3) or Lamp.On").trace
    assert run is not None
    assert run.end == "loop"
    assert run.loop is not None
    assert run.states[run.loop].locations == run.states[-1].locations
    assert str(run).endswith(f"as state {run.loop} from here on, for ever")


def test_values_have_a_run_each() -> None:
    answer = checker.load(LAMP).check("bounds{Lamp.On}: x")
    assert [run.title for run in answer.runs] == ["least x", "greatest x"]
    assert answer.runs[0].states[-1].clocks["x"] == 0


def test_verdict_without_witness_has_no_trace() -> None:
    answer = checker.load(LAMP).check("A[] Lamp.On imply x < 2")
    assert (answer.verdict, answer.trace, answer.runs) == ("satisfied", None, ())
    found = checker.load(LAMP).check("E<> Lamp.On", trace=False)
    assert (found.verdict, found.trace) == ("satisfied", None)


def test_simulated_runs_keep_to_the_model() -> None:
    model = checker.load(LAMP)
    for seed in range(5):
        run = model.simulate(steps=20, seed=seed)
        assert len(run.steps) == 20
        for state, step in zip(run.states, run.steps, strict=False):
            if state.locations["Lamp"] == "Off":
                assert state.clocks["y"] + step.delay >= 3
            else:
                assert 1 < state.clocks["x"] + step.delay < 2
    assert model.simulate(20, seed=1) == model.simulate(20, seed=1)
    assert model.simulate(20, seed=1) != model.simulate(20, seed=2)


def test_simulation_can_be_guided() -> None:
    def first_possible(_state: State, choices: tuple[Choice, ...]) -> tuple[int, Fraction]:
        return len(choices) - 1, choices[-1].windows[0][0]

    model = checker.load(LAMP)
    run = model.simulate(steps=2, choose=first_possible)
    assert [step.delay for step in run.steps] == [3, Fraction(1001, 1000)]
    assert run.steps[0].edges[0].select == {"k": 2}
    assert model.simulate(choose=lambda _state, _choices: None).steps == ()
    with pytest.raises(IndexError, match="not possible"):
        model.simulate(choose=lambda _state, _choices: (0, Fraction(1)))
    with pytest.raises(IndexError, match="there is no choice 7"):
        model.simulate(choose=lambda _state, _choices: 7)
    with pytest.raises(ValueError, match="too fine"):
        model.simulate(choose=lambda _state, _choices: (0, Fraction(1, 3**40)))


def test_simulation_takes_any_fraction_of_time() -> None:
    model = checker.load(LAMP)
    run = model.simulate(steps=1, choose=lambda _state, _choices: (0, Fraction(10, 3)))
    assert [step.delay for step in run.steps] == [Fraction(10, 3)]


def test_simulation_ends_where_nothing_is_possible() -> None:
    model = checker.load(
        "clock x; process P() { state A, B { x <= 4 }; init A; trans A -> B { }; } system P;"
    )
    run = model.simulate()
    assert (len(run.steps), run.end) == (1, "stuck")


def test_threads_share_a_check_and_a_wrong_number_of_them_is_refused() -> None:
    model, query = checker.load(LAMP), "E<> Lamp.Off and y < 1 and x > 1"
    expected = str(model.check(query).trace)
    assert str(model.check(query, threads=2).trace) == expected
    assert str(model.check(query, threads="all").trace) == expected
    for threads in (-1, 4000):
        with pytest.raises(ValueError, match=f"^{threads} threads: "):
            model.check(query, threads=threads)
