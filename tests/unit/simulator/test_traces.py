"""Traces of the simulator: those that it loads, and those that it saves, which `verify` accepts."""

from __future__ import annotations

import json
from typing import Any

import pytest

from ntagen.errors import InputError
from tests.simulated import CROSSING, LAMP, MATCHES, Talk


@pytest.mark.parametrize("text", [LAMP, CROSSING, MATCHES])
@pytest.mark.parametrize("mode", ["symbolic", "exact"])
def test_a_saved_trace_holds(text: str, mode: str) -> None:
    talk = Talk(text)
    talk("mode", mode=mode)
    for _ in range(10):
        talk("random", seed=2)
    # The whole way is saved, whichever step is shown.
    view = talk("go", position=1)
    trace = talk("save")["text"]
    assert talk.model.verify(trace).holds is True
    assert shown(talk("go", position=1)) == shown(view)
    # Loaded again, it is the same way.
    again = Talk(text)
    steps = again("load", text=trace)["steps"]
    assert again("save")["text"] == trace
    assert steps
    # A trace that is not the model's own is one that `verify` refuses.
    spoiled = json.loads(trace)
    spoiled["run"]["states"][-1]["locations"] = spoiled["run"]["states"][0]["locations"]
    spoiled["run"]["steps"][0]["wait"] += 1000
    assert talk.model.verify(json.dumps(spoiled)).holds is not True


def shown(view: dict[str, Any]) -> dict[str, Any]:
    return {name: view[name] for name in ("mode", "position", "state", "moves")}


def test_a_play_is_saved_as_one() -> None:
    talk = Talk(MATCHES)
    talk("play", query="control: A<> Keeper.Lit")
    talk("take", move=0)
    talk("take", wait=True)
    trace = talk("save")["text"]
    assert json.loads(trace)["winner"] == "controller"
    assert talk.model.verify(trace).holds is True
    # It can be stepped through without the strategy, too.
    view = Talk(MATCHES)("load", text=trace)
    assert (view["mode"], view["position"], len(view["steps"])) == ("exact", 0, 4)


def test_a_witness_is_stepped_through() -> None:
    talk = Talk(CROSSING)
    answer = talk.model.check("E<> Cart(0).On and Cart(1).Halted", trace=True)
    text = answer.trace_json()
    assert text is not None
    view = talk("load", text=text)
    assert (view["mode"], view["position"]) == ("exact", 0)
    assert len(view["steps"]) == len(json.loads(text)["run"]["steps"])
    last = talk("go", position=len(view["steps"]))
    names = [one["name"] for one in talk("open")["model"]["templates"][0]["locations"]]
    assert [names[number] for number in last["state"]["locations"][:2]] == ["On", "Halted"]
    # Without its exact times it is symbolic.
    whole = json.loads(text)
    del whole["run"]
    view = talk("load", text=json.dumps(whole))
    assert (view["mode"], len(view["steps"])) == ("symbolic", len(whole["transitions"]))


def test_how_a_witness_goes_on_is_said_at_its_end() -> None:
    talk = Talk(LAMP)
    answer = talk.model.check("E[] not Lamp.Bright", trace=True)
    view = talk("load", text=answer.trace_json())
    last = talk("go", position=len(view["steps"]))
    assert "for ever" in last["note"] or "nothing is possible" in last["note"]
    failing = (
        "int[0, 1] n = 0; process P() { state A; init A; trans A -> A { assign n++; }; } system P;"
    )
    talk = Talk(failing)
    answer = talk.model.check("E<> n == 5", trace=True)
    view = talk("load", text=answer.trace_json())
    last = talk("go", position=9)
    assert last["note"] == "the model fails in the next step of the trace: P.A -> A"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("hello", "it is not JSON\nhint: give a file that `ntagen check --trace"),
        ("[" * 100_000, "it is not JSON"),
        ("[]", "its format is not ntagen-trace"),
        ('{"format": "ntagen-strategy"}', "its format is not ntagen-trace"),
        ('{"format": "ntagen-trace"}', "this trace is incomplete"),
        ('{"format": "ntagen-trace", "traces": []}', "this trace is incomplete"),
        ('{"format": "ntagen-trace", "run": {"ticks_per_unit": 0}}', "this trace is incomplete"),
        (
            '{"format": "ntagen-trace", "transitions": [[{"process": "Nobody"}]]}',
            "the model has no edge as one of Nobody",
        ),
        ('{"format": "ntagen-trace", "transitions": [[7]]}', "the model has no edge"),
    ],
)
def test_what_is_no_trace_is_refused(text: str, says: str) -> None:
    with pytest.raises(InputError, match=says.replace("[", "\\[")):
        Talk(LAMP)("load", text=text)


def test_a_trace_of_another_version_is_refused_at_its_step() -> None:
    talk = Talk(LAMP)
    talk.walk(0, 0)
    trace = talk("save")["text"]
    slower = Talk(LAMP.replace("rest >= 1", "rest >= 2"))
    with pytest.raises(InputError, match=r"step 1: after 1 this move is not possible"):
        slower("load", text=trace)
    other = Talk(LAMP.replace("pushes < 9", "pushes < 1"))
    with pytest.raises(InputError, match=r"step 2 is not possible in this model: Hand.Idle"):
        other("load", text=trace)
    # What was there before stays.
    assert other("go", position=0)["mode"] == "symbolic"
