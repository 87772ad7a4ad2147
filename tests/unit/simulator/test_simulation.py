"""Walks of the simulator: steps, delays, the way back, other modes, and what cannot be done."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from typing import Any

import pytest

from ntagen.errors import InputError
from tests.simulated import CROSSING, LAMP, MATCHES, Talk

LATE = """
// The second move needs y >= 5 while x <= 1: the first one, which resets x, must not come at once.
clock x, y;
process P() { state A, B, C; init A;
  trans A -> B { assign x = 0; }, B -> C { guard y >= 5 && x <= 1; }; }
system P;
"""

SAME_STATE = ("mode", "position", "state", "time", "moves", "end")


def shown(view: dict[str, Any]) -> dict[str, Any]:
    return {name: view[name] for name in SAME_STATE}


def words(view: dict[str, Any]) -> list[list[int]]:
    return [[part[0] for part in one["parts"]] for one in view["moves"]]


def test_a_simulation_opens_with_processes_and_moves() -> None:
    opened = Talk(CROSSING)("open")
    model, view = opened["model"], opened["view"]
    assert [one["name"] for one in model["processes"]] == ["Cart(0)", "Cart(1)", "Bridge"]
    assert [one["name"] for one in model["templates"]] == ["Cart", "Bridge"]
    assert model["clocks"] == ["Cart(0).x", "Cart(1).x"]
    assert model["queries"][0]["text"].startswith("simulate")
    assert view["mode"] == "symbolic"
    assert words(view) == [[0, 2], [1, 2]]
    assert '<g class="edge" data-number="3">' in model["templates"][0]["svg"]


def test_a_symbolic_walk_goes_back_and_branches() -> None:
    talk = Talk(CROSSING)
    view = talk.walk(0, 0)
    # The first move of each is the same as in the engine's own walk.
    walk = talk.model.walk()
    walk.take(0)
    walk.take(0)
    assert view["state"]["zone"] == list(walk.zone)
    assert view["state"]["variables"] == walk.variables
    assert (view["position"], view["known"]) == (2, 1)
    back = talk("go", position=1)
    assert (back["position"], back["steps"]) == (1, [])
    forward = talk("go", position=2)
    assert shown(forward) == shown(view)
    talk("go", position=0)
    other = talk("take", move=1)
    # The steps that came after the one that was shown are dropped.
    assert (other["position"], other["known"], len(other["steps"])) == (1, 0, 1)
    assert talk("go", position=99)["position"] == 1
    assert other["state"]["locations"] == [0, 1, 0]


def test_delays_are_exact() -> None:
    talk = Talk(LAMP)
    view = talk("mode", mode="exact")
    assert view["moves"][0]["windows"] == ["after 1 or later"]
    view = talk("take", move=0, delay="3/2")
    assert (view["time"], view["state"]["clocks"]) == ("3/2", {"Lamp.since": "0", "Hand.rest": "0"})
    # Bright before 3, and off from 3 on: the bound itself shows to be left out.
    spans = sorted(one["spans"] for one in view["moves"])
    assert spans == [[["1", False, "3", True]], [["3", False, None, True]]]
    for delay, says in (
        ("1/2", "after 1/2 this move is not possible: it is possible after 1 and less than 3"),
        ("-1", "a delay cannot be negative"),
        ("soon", "soon is not a delay: write a number"),
        ("1e9999", "is not a delay"),
        ("1/0", "is not a delay"),
        ("1.00000000001", "too long or too fine a fraction"),
        ("1e-40", "after 1/1000000000000"),
    ):
        with pytest.raises(InputError, match=says):
            talk("take", move=0, delay=delay)
    assert talk("take", move=0, delay="2.25")["time"] == "15/4"


def test_a_refused_step_changes_nothing() -> None:
    talk = Talk(LAMP)
    view = talk.walk(0)
    for request in ({"move": 7}, {"move": -1}, {"move": None}, {"move": True}, {}):
        with pytest.raises(InputError, match=r"there is no move|no move is chosen"):
            talk("take", **request)
    assert shown(talk("go", position=1)) == shown(view)


def test_modes_keep_the_moves() -> None:
    talk = Talk(CROSSING)
    talk("random", seed=4)
    for _ in range(9):
        symbolic = talk("random", seed=4)
    exact = talk("mode", mode="exact")
    assert exact["state"]["locations"] == symbolic["state"]["locations"]
    assert len(exact["steps"]) == 10
    # The exact clock values are within the zone of the same state.
    again = talk("mode", mode="symbolic")
    assert shown(again) == shown(symbolic)


def test_times_are_found_where_an_early_move_is_in_the_way() -> None:
    talk = Talk(LATE)
    talk.walk(0, 0)
    exact = talk("mode", mode="exact")
    first, second = (Fraction(one["delay"]) for one in exact["steps"])
    assert first >= 4
    assert first + second >= 5
    assert second <= 1


def test_a_random_walk_is_the_same_for_the_same_seed() -> None:
    ways = []
    for seed in (1, 1, 2):
        talk = Talk(CROSSING)
        talk("mode", mode="exact")
        steps = [talk("random", seed=seed)["steps"][0] for _ in range(12)]
        ways.append(steps)
    assert ways[0] == ways[1] != ways[2]
    assert any("/" in one["delay"] for one in ways[0])


def test_the_end_of_a_walk_is_said() -> None:
    talk = Talk(MATCHES)
    view = talk.walk(0, 0)
    assert (view["moves"], view["end"][:8]) == ([], "deadlock")
    # A random walk stays there.
    assert talk("random", seed=1)["position"] == 2
    exact = talk("mode", mode="exact")
    assert exact["end"] == "time passes for ever, and nothing can happen any more"
    stuck = Talk("clock x; process P() { state A { x <= 4 }; init A; } system P;")
    assert "time stops after 4 (a timelock)" in stuck("mode", mode="exact")["end"]


def test_a_failing_step_is_said_with_its_place() -> None:
    text = (
        "int[0, 1] n = 0; process P() { state A; init A; trans A -> A { assign n = n + 1; }; } "
        "system P;"
    )
    for mode in ("symbolic", "exact"):
        talk = Talk(text)
        talk("mode", mode=mode)
        view = talk.walk(0)
        assert view["moves"] == []
        assert ":1:75: n + 1" in view["problem"]
        assert "hint: step back" in view["problem"]
        # The way back is open.
        assert talk("go", position=0)["moves"]


def test_what_is_kept_restores_a_simulation() -> None:
    for text, first in (
        (CROSSING, {"do": "mode", "mode": "symbolic"}),
        (CROSSING, {"do": "mode", "mode": "exact"}),
        (MATCHES, {"do": "play", "query": "control: A<> Keeper.Lit"}),
    ):
        talk, kept, choices = Talk(text), {}, []
        requests = [first, *({"do": "random", "seed": 3} for _ in range(8))]
        for request in [*requests, {"do": "go", "position": 2}, {"do": "random", "seed": 8}]:
            view = talk(**request)
            kept = view["keep"]
            choices = choices[: kept["known"]] + kept["choices"]
        other = Talk(text)
        restored = other("restore", **(kept | {"choices": choices}))
        assert shown(restored) == shown(view)
        assert len(restored["steps"]) == view["known"] + len(view["steps"])


def test_requests_that_no_page_sends_are_refused() -> None:
    talk = Talk(LAMP)
    for request in (
        {"do": "drive"},
        {"do": None},
        {"do": "mode", "mode": "other"},
        {"do": "go", "position": "x"},
        {"do": "series", "names": "x"},
        {"do": "runs"},
        {"do": "zone", "x": "nowhere", "y": "Hand.rest"},
        {"do": "play", "query": ""},
        {"do": "advise", "query": "E<> Lamp.Low"},
    ):
        with pytest.raises(InputError):
            talk(**request)


def test_time_only_grows() -> None:
    talk = Talk(CROSSING)
    talk("mode", mode="exact")
    times = [Fraction(talk("random", seed=5)["time"]) for _ in range(15)]
    assert all(before <= after for before, after in pairwise(times))
