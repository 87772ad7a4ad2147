"""Games in the simulator: the strategy moves by itself, and shows what it allows."""

from __future__ import annotations

import pytest

from ntagen.errors import InputError
from tests.simulated import MATCHES, Talk

QUERY = "control: A<> Keeper.Lit"


def test_the_strategy_moves_by_itself() -> None:
    talk = Talk(MATCHES)
    view = talk("play", query=QUERY)
    # Nobody else can move at the start, so that the strategy has moved already.
    assert [one["who"] for one in view["steps"]] == ["strategy"]
    assert view["game"]["rival"] == "environment"
    assert (
        view["game"]["forecast"] == "the controller waits, and after 1 takes Keeper.Striking -> Lit"
    )
    assert view["moves"][0]["windows"] == ["within 1"]
    view = talk("take", move=0, delay="1/2")
    assert [one["who"] for one in view["steps"]] == ["you", "strategy"]
    view = talk("take", wait=True, delay="1/4")
    assert [(one["who"], one["delay"]) for one in view["steps"]] == [("time", "1/4")]
    view = talk("take", wait=True)
    assert (view["time"], view["game"]["is_over"]) == ("3/2", True)
    assert view["end"] == "the goal holds: the controller has won"
    # One can go back, and play otherwise.
    view = talk("go", position=1)
    assert view["game"]["is_over"] is False
    assert talk("take", wait=True)["end"] == "the goal holds: the controller has won"


def test_a_loser_plays_against_the_environment() -> None:
    # The wind blows out each match, at any time.
    talk = Talk(MATCHES.replace("x < 2 && tries < 3", "x < 3"))
    view = talk("play", query=QUERY)
    assert (view["game"]["owner"], view["game"]["rival"]) == ("environment", "controller")
    assert view["moves"]


def test_a_strategy_says_what_it_allows() -> None:
    talk = Talk(MATCHES)
    view = talk("advise", query=QUERY)
    assert view["mode"] == "exact"
    assert view["advice"]["text"] == "take Keeper.Dark -> Striking"
    assert view["advice"]["moves"] == ["now"]
    view = talk("take", move=0, delay="1")
    assert view["advice"]["text"] == "wait 1, then take Keeper.Striking -> Lit"
    edges = [one["parts"][0][1] for one in view["moves"]]
    marks = dict(zip(edges, view["advice"]["moves"], strict=True))
    assert marks == {1: "after 1", 2: ""}
    assert talk("advise", query="")["advice"] is None


def test_a_play_at_random_ends() -> None:
    talk = Talk(MATCHES)
    talk("play", query=QUERY)
    for _ in range(30):
        view = talk("random", seed=6)
    assert view["end"] == "the goal holds: the controller has won"
    assert talk.model.verify(talk("save")["text"]).holds is True


@pytest.mark.parametrize(
    ("query", "says"),
    [
        ("E<> Keeper.Lit", "is no game\nhint: give a query such as control: A<>"),
        ("", "this is no game"),
        ("control: A<> Keeper.Nowhere", "Nowhere"),
        ("control A", "error"),
    ],
)
def test_what_is_no_game_is_refused(query: str, says: str) -> None:
    talk = Talk(MATCHES)
    talk.walk(0)
    for do in ("play", "advise"):
        if query or do == "play":
            with pytest.raises(InputError, match=says):
                talk(do, query=query)
    assert talk("go", position=1)["mode"] == "symbolic"
