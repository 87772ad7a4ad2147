"""JANI: which class a model becomes, its states and probabilities, and what is refused."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ntagen.convert import convert
from ntagen.errors import InputError
from tests.jani import Jani
from tests.systems import reached, source

DIE = """int[0,6] d;
process Die() {
  state S0, S1, S2, S3, S4, S5, S6, Done; branchpoint B0, B1, B2, B3, B4, B5, B6; init S0;
  trans S0 -> B0 { }, B0 -> S1 { probability 1; }, B0 -> S2 { probability 1; },
    S1 -> B1 { }, B1 -> S3 { probability 1; }, B1 -> S4 { probability 1; },
    S2 -> B2 { }, B2 -> S5 { probability 1; }, B2 -> S6 { probability 1; },
    S3 -> B3 { }, B3 -> S1 { probability 1; }, B3 -> Done { assign d = 1; probability 1; },
    S4 -> B4 { }, B4 -> Done { assign d = 2; probability 1; },
    B4 -> Done { assign d = 3; probability 1; },
    S5 -> B5 { }, B5 -> Done { assign d = 4; probability 1; },
    B5 -> Done { assign d = 5; probability 1; },
    S6 -> B6 { }, B6 -> S2 { probability 1; }, B6 -> Done { assign d = 6; probability 1; };
}
system Die;
query { E<> d == 6 } query { A[] Die.Done imply d > 0 } query { Pr[#<=3](<> Die.Done) }
query { Pr[#<=90](<> d == 1) } query { Pr[<=3](<> Die.Done) } query { A<> Die.Done }
"""

GAMBLER = """int[0,6] money = 2;
process Gambler() { state Play, Won; branchpoint Safe, Bold; init Play;
  trans Play -> Safe { guard money > 0 && money < 6; },
    Safe -> Play { assign money++; probability 2; },
    Safe -> Play { assign money--; probability 3; },
    Play -> Bold { guard money > 1 && money < 5; },
    Bold -> Play { assign money += 2; probability 1; },
    Bold -> Play { assign money -= 2; probability 2; },
    Play -> Won { guard money == 6; }; }
system Gambler;
query { maxPr[#<=2000]: <> Gambler.Won } query { minPr[#<=2000]: <> Gambler.Won }
query { Pr[#<=2000](<> Gambler.Won) }
"""


def written(text: str) -> Jani:
    return Jani(convert(source(text), "jani").text)


def states(jani: Jani) -> int:
    """How many combinations of locations and variables are reached, clocks aside."""
    clocks = {one["name"] for one in jani.json["variables"] if one["type"] == "clock"}
    return len(
        {
            (places, tuple(pair for pair in values if pair[0] not in clocks))
            for places, values in jani.reached()
        }
    )


def test_a_die_is_a_markov_chain() -> None:
    jani = written(DIE)
    assert jani.json["type"] == "dtmc"
    assert states(jani) == len(reached(source(DIE).model)) == 13
    assert jani.probability("query1") == pytest.approx(1 / 6)
    assert jani.probability("query2") == 0
    assert jani.probability("query3") == pytest.approx(3 / 4)
    assert jani.probability("query4") == pytest.approx(1 / 6)


def test_what_jani_cannot_ask_is_named() -> None:
    assert convert(source(DIE), "jani").notes == (
        "query 5 is left out, for JANI cannot ask it: Pr[<=3](<> Die.Done)",
        "query 6 is left out, for JANI cannot ask it: A<> Die.Done",
    )


def test_choices_make_a_decision_process() -> None:
    jani = written(GAMBLER)
    assert jani.json["type"] == "mdp"
    names = [one["name"] for one in jani.json["properties"]]
    assert names == ["query1", "query2", "query3_least", "query3_greatest"]
    # By hand: the safe game alone gives ((3/2)^2 - 1) / ((3/2)^6 - 1).
    safe = (1.5**2 - 1) / (1.5**6 - 1)
    least, greatest = jani.probability("query2"), jani.probability("query1")
    assert least < greatest
    assert least <= safe + 1e-9 <= greatest + 1e-9
    assert jani.probability("query3_least") == pytest.approx(least)
    assert jani.probability("query3_greatest") == pytest.approx(greatest)


def test_rates_make_a_chain_in_continuous_time() -> None:
    jani = written(
        """broadcast chan go; int[0,3] n;
        process P() { state A { ; 3 : 2 }, B { ; 4 }; init A;
          trans A -> A { guard n < 3; sync go!; assign n++; }, A -> B { guard n > 1; },
            B -> A { }, B -> B { }; }
        process Q() { state A { ; 5 }, B; init A; trans A -> B { guard n > 0; sync go?; }; }
        system P, Q; query { Pr[<=2](<> n == 3) } query { E<> n == 3 }"""
    )
    assert jani.json["type"] == "ctmc"
    rates = {}
    for state in jani.reached():
        values = dict(state[1])
        key = state[0][0], values["n"]
        rates[key] = sorted(rate for rate, _ in jani.transitions(state))
    assert rates["A", 0] == rates["A", 1] == [1.5]
    assert rates["A", 2] == [0.75, 0.75]
    assert rates["A", 3] == [1.5]
    assert rates["B", 2] == [2, 2]
    assert [one["name"] for one in jani.json["properties"]] == ["query1"]


def test_clocks_make_a_timed_automaton() -> None:
    text = """chan msg; clock y; int[0,3] lost;
        process Sender() { clock x; state Start { x <= 2 }, Wait { x <= 3 }, Ok, Lost; urgent Lost;
          branchpoint B; init Start;
          trans Start -> B { guard x >= 1 && lost < 3; sync msg!; assign x = 0; },
            B -> Wait { probability 9; }, B -> Lost { probability 1; },
            Wait -> Ok { guard x >= 2; }, Lost -> Start { assign x = 0, lost++; }; }
        process Other() { state A, B; commit B; init A;
          trans A -> B { sync msg?; assign y = 0; }, B -> A { guard y >= 1; }, B -> A { }; }
        system Sender, Other;
        query { Pr[<=5](<> Sender.Ok) } query { E<> Sender.Ok && lost == 2 }"""
    jani = written(text)
    assert jani.json["type"] == "pta"
    assert states(jani) == len(reached(source(text).model))
    properties = {one["name"]: one for one in jani.json["properties"]}
    assert set(properties) == {"query1_least", "query1_greatest", "query2"}
    path = properties["query1_least"]["expression"]["values"]["exp"]
    assert path["time-bounds"] == {"upper": 5}


def test_nobody_enters_a_location_whose_invariant_is_broken() -> None:
    text = """process P() { clock x; state A, B { x <= 2 }; init A;
        trans A -> B { guard x >= 3; }, A -> A { guard x >= 1 && x <= 1; assign x = 5; }; }
        system P;"""
    assert {places for places, _ in written(text).reached()} == {("A",)}


GUARDS = st.sampled_from(["", "x >= 2", "n < 3", "n == 1 && x <= 5", "n > 0 || m == 0"])
SYNCS = st.sampled_from(["", "c!", "c?", "d[0]!", "d[n % 2]?", "all!", "all?"])
UPDATES = st.sampled_from(["", "x = 0", "n = (n + 1) % 4", "m = n, n = 0, x = 1", "a[n] = m"])


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(st.data(), st.booleans())
def test_random_networks_have_the_same_states(data: st.DataObject, is_timed: bool) -> None:
    text = "int[0,3] n; int[0,3] m; int[0,3] a[4]; chan c, d[2]; broadcast chan all;\n"
    clocks = []
    for name in "PQR":
        kinds = data.draw(st.sampled_from(["", "urgent B;", "commit B;"]))
        edges = []
        for _ in range(data.draw(st.integers(1, 4))):
            source_, target = (data.draw(st.sampled_from("AB")) for _ in "12")
            sync, guard, update = data.draw(SYNCS), data.draw(GUARDS), data.draw(UPDATES)
            if sync == "all?" and "commit" in kinds:
                source_ = "A"
            labels = [
                f"{word} {label};"
                for word, label in (("guard", guard), ("sync", sync), ("assign", update))
                if label
            ]
            edges.append(f"{source_} -> {target} {{ {' '.join(labels)} }}")
        invariant = data.draw(st.sampled_from(["", " { x <= 6 }"]))
        clocks.append("clock x;" if is_timed else "int[0,9] x = 2;")
        text += (
            f"process {name}() {{ {clocks[-1]} state A{invariant}, B; {kinds} init A; "
            f"trans {', '.join(edges)}; }}\n"
        )
    text += "system P, Q, R;"
    assert states(written(text)) == len(reached(source(text).model))


REFUSED = {
    "clock x, y; process P() { state A; init A; trans A -> A { assign x = y + 1; }; } system P;": (
        "model.xta: template P, edge A → A, update: JANI cannot set a clock to `y + 1`",
        "set it to an integer",
    ),
    "urgent chan c; process P() { state A; init A; } system P;": (
        "model.xta: channel c: JANI has no urgent channels",
        "use an urgent location",
    ),
    "clock x; process P() { state A { ; 2 }; init A; } system P;": (
        "model.xta: process P, location A: a model with clocks is exported without random delays",
        "delete the rates, or the clocks",
    ),
    "chan c; process P() { state A { ; 2 }; init A; } system P;": (
        "model.xta: channel c: with exponential rates, only broadcast channels",
        "broadcast chan",
    ),
    "process P() { state A { ; 2 }, B; commit B; init A; } system P;": (
        "model.xta: process P, location B: it is committed",
        "join its edges",
    ),
    "process P() { state A { ; 2 }, B; init A; trans A -> B { }, B -> A { }; } system P;": (
        "model.xta: process P, location B: it has no rate, and others have",
        "write a number",
    ),
    "int n; process P() { state A { n < 3; 2 }; init A; } system P;": (
        "model.xta: process P, location A: a Markov chain in continuous time has no invariants",
        "as a guard",
    ),
    "clock x; process P() { state A { x <= 3 }; init A; } process Q() { state A; init A;"
    " trans A -> A { assign x = 9; }; } system P, Q;": (
        "model.xta: process P, location A, invariant: it has x, which Q changes",
        "only this process changes",
    ),
    "int[-5,5] n; process P() { state A; init A; trans A -> A { assign n = n / 2; }; } system P;": (
        "model.xta: template P, edge A → A, update: `n / 2` may divide negative numbers",
        "ranges from 0",
    ),
    "int n; process P() { state A; init A; trans A -> A { assign n = n ^ 1; }; } system P;": (
        "model.xta: template P, edge A → A, update: JANI has no counterpart of `n ^ 1`",
        "+ - * / %",
    ),
    "process P() { state A; init A; trans A -u-> A { }; } system P;": (
        "model.xta: template P, edge A → A: JANI has no games",
        "write -> for -u->",
    ),
    "clock x; process P() { state A, B { x <= 2 }; branchpoint F; init A; trans A -> F { },"
    " F -> A { }, F -> B { }; } system P;": (
        "model.xta: template P, edge A → F: a leg of a branch point enters a location whose",
        "reset the clocks",
    ),
    "broadcast chan c; process P() { state A; commit A; init A; trans A -> A { sync c?; }; }"
    " process Q() { state A; init A; trans A -> A { sync c!; }; } system P, Q;": (
        "model.xta: template P, edge A → A: it hears a broadcast in a committed location",
        "do without the committed",
    ),
}


@pytest.mark.parametrize("text", REFUSED, ids=[message for message, _ in REFUSED.values()])
def test_what_jani_cannot_hold_is_refused(text: str) -> None:
    message, hint = REFUSED[text]
    with pytest.raises(InputError) as caught:
        convert(source(text), "jani")
    first, second = str(caught.value).split("\n")
    assert first.startswith(message)
    assert hint in second
