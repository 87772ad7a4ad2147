"""Answers in Python: what they say of themselves, and queries of files as questions."""

from __future__ import annotations

import pytest

import ntagen
from ntagen.errors import InputError

LAMP = """
chan press;
process Lamp() {
    clock x;
    state Off, Low { x <= 9 }, Bright;
    init Off;
    trans
        Off -> Low { sync press?; assign x = 0; },
        Low -> Bright { guard x >= 1 && x < 5; sync press?; },
        Low -u-> Off { guard x >= 5; };
}
process User() {
    state Idle;
    init Idle;
    trans Idle -> Idle { sync press!; };
}
system Lamp, User;
"""

COUNTER = """
int n;
process P() { state A; init A; trans A -> A { guard n < 999; assign n = n + 1; }; }
system P;
"""

GATE = """<nta>
<declaration>int n = 3;</declaration>
<template><name>Gate</name><location id="a"><name>Open</name></location><init ref="a"/></template>
<system>system Gate;</system>
<queries>
<query><formula>E&lt;&gt; Gate.Open</formula><comment>Open once</comment></query>
</queries></nta>"""


def test_an_answer_has_no_truth_value_but_says_whether_the_query_is_satisfied() -> None:
    model = ntagen.load(LAMP)
    answer = model.check("A[] not Lamp.Bright")
    with pytest.raises(ValueError, match=r"'not satisfied'\nhint: ask for answer\.satisfied"):
        bool(answer)
    assert answer.satisfied is False
    assert model.check("E<> Lamp.Bright").satisfied is True
    stopped = ntagen.load(COUNTER).check("A[] n < 5000", states=5)
    assert stopped.satisfied is None
    assert "is unknown, stopped by the state limit; " in repr(stopped)
    assert repr(answer).startswith("<Answer: A[] not Lamp.Bright is not satisfied; ")
    assert "is satisfied, value 9" in repr(model.check("sup{Lamp.Low}: Lamp.x"))


def test_queries_of_a_file_can_be_asked_as_they_are() -> None:
    model = ntagen.load(GATE)
    answer = model.check(model.queries[0])
    assert (answer.query, answer.verdict) == ("E<> Gate.Open", "satisfied")
    assert (model.queries[0].line, model.queries[0].column) == (6, 17)


def test_a_simulation_can_follow_a_strategy() -> None:
    model = ntagen.load(LAMP)
    strategy = model.synthesize("control: A<> Lamp.Bright")
    for seed in range(10):
        run = model.simulate(strategy=strategy, seed=seed)
        assert run.states[-1].locations["Lamp"] == "Bright"
    assert len(model.simulate(1, strategy=strategy).steps) == 1
    with pytest.raises(InputError, match="does not belong to this model"):
        ntagen.load(GATE).simulate(strategy=strategy)
    with pytest.raises(ValueError, match="either choose or strategy"):
        model.simulate(strategy=strategy, choose=lambda *_: 0)


def test_a_clock_without_its_process_is_named_in_full() -> None:
    strategy = ntagen.load(LAMP).synthesize("control: A<> Lamp.Bright")
    whole = {"locations": {"Lamp": "Low", "User": "Idle"}, "clocks": {"x": 1}}
    for state in ({"Lamp": "Low", "User": "Idle", "x": 1}, whole):
        with pytest.raises(InputError, match=r"named together with it: Lamp\.x$"):
            strategy.action(state)
