"""Machines of games under partial observation as values and files."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import ntagen
from ntagen.checker.machine import Machine
from ntagen.errors import InputError, UndecidedError

BOXES = Path(__file__).parents[2] / "corpus" / "games" / "observed_boxes.xta"

QUERY = "{Belt.Tall, Belt.Flat, x >= 4} control: A[] not Belt.Wrong"


def follow(machine: Machine, observations: list[list[bool]]) -> str:
    """What is proposed after these observations."""
    state = 0
    for observation in observations:
        state = machine.after(state, observation)
    return str(machine[state])


def test_a_machine_remembers_what_it_has_seen() -> None:
    answer = ntagen.load(BOXES).check(QUERY, strategy=True, verify=True)
    assert answer.verified
    assert answer.strategy is None
    machine = answer.machine
    assert machine is not None
    assert machine.observations == ("Belt.Tall", "Belt.Flat", "x >= 4")
    here, later = [False, False, False], [False, False, True]
    assert follow(machine, [[True, False, False], here, here, later]) == "propose push"
    assert follow(machine, [[False, True, False], here, later]) == "wait"
    with pytest.raises(UndecidedError, match=r"\(true, true, false\)"):
        machine.after(0, [True, True, False])


def test_a_changed_machine_fails_its_check() -> None:
    model = ntagen.load(BOXES)
    text = model.check(QUERY, strategy=True).strategy_json()
    assert text is not None
    assert model.verify(text).holds
    file = json.loads(text)
    for state in file["states"]:
        if state["action"] is not None:
            state["action"] = None
    assert model.verify(json.dumps(file)).holds is False
    file["states"][0]["next"][0]["state"] = 99
    with pytest.raises(InputError, match=r"states\[0\].next\[0\].state"):
        model.verify(json.dumps(file))


def test_what_has_no_machine_says_so() -> None:
    model = ntagen.load(BOXES)
    answer = model.check("{x >= 4} control: A[] not Belt.Wrong", strategy=True)
    assert answer.machine is None
    assert "no single strategy of the environment" in (answer.message or "")
    with pytest.raises(InputError, match="machine"):
        model.synthesize(QUERY)
    assert answer.controller_c() is None


def test_a_machine_is_a_controller_in_c() -> None:
    text = ntagen.load(BOXES).check(QUERY, strategy=True).controller_c()
    assert text is not None
    assert "int controller_next(int state, const unsigned char *seen);" in text
    assert '"propose push"' in text
