"""TChecker's format both ways: what is read, what it becomes, what is refused."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ntagen.checker import Model
from ntagen.convert import convert, source_of_tck
from ntagen.convert.tck_import import model_of_tck
from ntagen.convert.tck_reading import parse_tck
from ntagen.errors import InputError
from tests.systems import reached, source, through_tck

HEAD = "system:s\nint:1:0:9:0:i\nint:1:0:9:0:j\nclock:1:x\nevent:a\nevent:b\n"


def process(name: str, edges: str, places: str = "l m", marks: str = "") -> str:
    """A process whose first location is initial; `marks` are attributes of the others."""
    first, *others = places.split()
    lines = [f"process:{name}", f"location:{name}:{first}{{initial:}}"]
    lines += [f"location:{name}:{one}{{{marks}}}" for one in others]
    lines += [f"edge:{name}:{one.strip()}" for one in edges.split("\n") if one.strip()]
    return "\n".join(lines) + "\n"


def loaded(text: str) -> Model:
    return source_of_tck(HEAD + text, "s.tck").model


def values(text: str) -> set[tuple[float, ...]]:
    """The values of i and j that are reached."""
    return {found[:2] for _, found in reached(loaded(text))}


def test_a_process_moves_alone() -> None:
    text = process("P", "l:m:a{provided: x >= 2 : do: i = 3; x = 0}", marks="invariant: x <= 4")
    model = loaded(text)
    assert reached(model) == {(("l",), (0, 0)), (("m",), (3, 0))}
    assert model.check("sup{P.m}: x").value == 4


def test_statements_run_in_the_order_of_the_synchronisation() -> None:
    both = process("P", "l:m:a{do: i = 1}") + process("Q", "l:m:a{do: j = i}")
    assert values(f"{both}sync:P@a:Q@a") == {(0, 0), (1, 1)}
    assert values(f"{both}sync:Q@a:P@a") == {(0, 0), (1, 0)}


def test_an_event_in_several_synchronisations() -> None:
    text = (
        process("P", "l:m:a")
        + process("Q", "l:m:a{do: i = 1}")
        + process("R", "l:m:b{do: i = 2}")
        + "sync:P@a:Q@a\nsync:P@a:R@b"
    )
    assert values(text) == {(0, 0), (1, 0), (2, 0)}


def test_three_processes_must_all_take_part() -> None:
    text = (
        process("P", "l:m:a{do: i = i + 1}")
        + process("Q", "l:m:a{provided: j == 1 : do: i = i + 2}")
        + process("R", "l:m:a{do: i = i + 4}\nm:l:b{do: j = 1}\nl:m:b")
        + "sync:P@a:Q@a:R@a"
    )
    states = reached(loaded(text))
    assert {found[0] for _, found in states} == {0, 7}
    assert {places for places, found in states if found[0] == 7} == {
        ("m", "m", "m"),
        ("m", "m", "l"),
    }


def test_a_weak_part_takes_part_where_it_has_an_edge() -> None:
    text = (
        process("P", "l:l:a{do: i = (if i < 5 then i + 1 else 5)}", places="l")
        + process("Q", "l:m:b{do: j = 1}")
        + "sync:P@a:Q@b?"
    )
    # Q cannot stay behind with the first a.
    assert values(text) == {(0, 0), *((number, 1) for number in range(1, 6))}


def test_weak_parts_alone() -> None:
    text = process("P", "l:m:a{do: i = 1}") + process("Q", "l:m:b{do: j = 1}\nm:l:b")
    assert reached(loaded(f"{text}sync:P@a?:Q@b?")) == {
        (("l", "l"), (0, 0)),
        (("m", "m"), (1, 1)),
        (("m", "l"), (1, 1)),
    }


def test_no_edge_leaves_the_bounds_of_a_variable() -> None:
    model = loaded(process("P", "l:l:a{do: i = i + 4; j = i}", places="l"))
    assert reached(model) == {(("l",), (0, 0)), (("l",), (4, 4)), (("l",), (8, 8))}
    assert not model.check("E<> i > 8").satisfied


def test_committed_and_urgent_locations() -> None:
    committed = process("P", "l:m:a\nm:l:a{do: i = 1}", marks="committed:")
    model = loaded(committed + process("Q", "l:m:b{do: j = i}"))
    assert ("m", "m") in {places for places, _ in reached(model)}
    assert not model.check("E<> P.m and x > x and true").satisfied
    urgent = loaded(process("P", "l:m:a{do: x = 0}", marks="urgent:"))
    assert urgent.check("A[] P.m imply x == 0").satisfied


def test_labels_become_queries() -> None:
    text = process("P", "l:m:a", marks="labels: bad,end") + process(
        "Q", "l:m:a", marks="labels: bad"
    )
    written = model_of_tck(parse_tck(HEAD + text))
    assert [(one.formula, one.comment) for one in written.queries] == [
        ("E<> P.m or Q.m", "label bad"),
        ("E<> P.m", "label end"),
    ]


def test_names_that_uppaal_has_taken() -> None:
    text = (
        "system:s\nint:1:0:1:0:urgent\nint:1:0:1:0:A.n\nevent:chan\n"
        "process:state\nlocation:state:urgent{initial:}\nlocation:state:A_n{}\n"
        "edge:state:urgent:A_n:chan{provided: A.n == 0 : do: urgent = 1}\n"
    )
    assert reached(source_of_tck(text, "s.tck").model) == {
        (("urgent_3",), (0, 0)),
        (("A_n_2",), (1, 0)),
    }


BAD = {
    "event:a": ("1: the file does not begin with the system", "write system:NAME first"),
    "system:s\nprocess:": ("2: `process:` has another form", "write process:NAME"),
    "system:s\nsystem:t": ("2: the system is declared twice", "delete this line"),
    "system:s\nplace:P": ("2: `place` is no declaration of TChecker", "known are system, process"),
    "system:s": ("1: the file has no process", "write system:NAME, then process:NAME"),
    "system:s\nprocess:P": ("2: process P has no initial location", "write {initial:}"),
    "system:s\nclock:0:x": ("2: an array of 0 has no parts", "write a size of at least 1"),
    "system:s\nclock:n:x": ("2: `n` is no integer", "write a number"),
    "system:s\nint:1:0:1:2:i": ("2: i begins with 2, which is not in 0 to 1", "its bounds"),
    "system:s\nint:1:0:9999999999:2:i": ("2: 9999999999 has more than 32 bits", "smaller"),
    "system:s\nclock:1:x\nint:1:0:1:0:x": ("3: the variable x is declared twice", "another name"),
    "system:s\nprocess:P\nlocation:P:l{initial:\n": ("3: the attributes are not closed", "write }"),
    "system:s\nprocess:P\nlocation:Q:l": ("3: no process is called `Q`", "known: P"),
    "system:s\nprocess:P\nlocation:P:l{start:}": ("3: the attribute start has no", "known are"),
    "system:s\nprocess:P\nlocation:P:l{urgent: : committed:}": ("3: l is committed and", "delete"),
    "system:s\nprocess:P\nlocation:P:l{initial:}\nlocation:P:m{initial:}": (
        "4: process P has 2 initial locations",
        "convert a copy of the file for each",
    ),
    "system:s\nprocess:P\nlocation:P:l\nedge:P:l:l:a": ("4: no event is called `a`", "declare it"),
    f"{HEAD}process:P\nlocation:P:l{{initial:}}\nedge:P:l:l:a{{do: if i == 0 then i = 1 end}}": (
        "9: cannot convert the statement `if`",
        "a choice is x = (if c then a else b)",
    ),
    f"{HEAD}process:P\nlocation:P:l{{initial:}}\nedge:P:l:l:a{{provided: k == 0}}": (
        "9: `k` in the guard is not declared",
        "declare it: int:1:0:1:0:k",
    ),
    f"{HEAD}process:P\nlocation:P:l{{initial: : invariant: x <= 99999999999}}": (
        "8: cannot convert the number 99999999999, which has more than 32 bits",
        "see file-format.md",
    ),
    f"{HEAD}process:P\nsync:P@a": ("8: a synchronisation has at least two parts", "write sync:"),
    f"{HEAD}process:P\nsync:P@a:P@b": ("8: process P takes part twice", "name each process once"),
    f"{HEAD}process:P\nsync:P@a:Pb": ("8: `Pb` is no part of a synchronisation", "write sync:"),
}


@pytest.mark.parametrize("text", BAD, ids=[message for message, _ in BAD.values()])
def test_mistakes_have_a_place_and_a_way_out(text: str) -> None:
    message, hint = BAD[text]
    with pytest.raises(InputError) as caught:
        source_of_tck(text, "s.tck")
    first, second = str(caught.value).split("\n")
    assert first.startswith(f"s.tck:{message}")
    assert hint in second


ROUND_TRIPS = {
    "binary": "chan c; int[0,3] n; process P() { state A, B; init A; trans A -> B { sync c!;"
    " assign n = 1; }; } process Q() { state A, B; init A; trans A -> B { sync c?;"
    " assign n = n + 1; }; } system P, Q;",
    "both ways": "chan c; process P() { state A, B, C; init A; trans A -> B { sync c!; },"
    " A -> C { sync c?; }; } Q = P(); R = P(); system Q, R;",
    "parameters": "const int N = 3; typedef int[0,N-1] id_t; chan go[N]; int[0,N] at;"
    " process P(const id_t id, int[0,N] &w) { int[0,5] own = id; state A, B; init A;"
    " trans A -> B { guard own == id; sync go[(id + 1) % N]!; assign w = id, own = 2 * id; },"
    " A -> B { sync go[id]?; }; } X = P(0, at); Y = P(1, at); Z = P(2, at); system X, Y, Z;",
    "process sets": "const int N = 2; chan c[N]; int[0,9] last;"
    " process P(const int[0,N-1] id) { const int two[2] = { 5, 6 }; state A, B; init A;"
    " trans A -> B { sync c[id]!; assign last = two[id]; }; }"
    " process Q() { state A; init A; trans A -> A { select i : int[0,N-1]; sync c[i]?; }; }"
    " system P, Q;",
    "arrays": "int[0,2] at = 0; int[0,9] a[3] = { 1, 2, 3 }, b[3], m[2][3];"
    " process P() { state A; init A; trans A -> A { guard at < 2 && a[at] < 4 && b[at] == 0;"
    " assign a[at] = a[at] + 1, b[at]++, at++, m[1][at] = 7; }; } system P;",
    "channel by index": "chan c[2]; int[0,1] i; process P() { state A; init A;"
    " trans A -> A { sync c[i]!; assign i = 1 - i; }; } process Q() { state A, B; init A;"
    " trans A -> B { sync c[0]?; }, B -> A { sync c[1]?; }; } system P, Q;",
    "broadcast": "broadcast chan c; int[0,9] n; process P() { state A; init A; trans A -> A {"
    " guard n < 7; sync c!; assign n++; }; } process Q() { state A, B; init A; trans A -> B {"
    " sync c?; assign n++; }; } R = Q(); S = Q(); system P, R, S;",
    "broadcast under guards": "broadcast chan c; int[0,9] n; process P() { state A; init A;"
    " trans A -> A { guard n < 7; sync c!; assign n++; }; } process Q() { state A, B; init A;"
    " trans A -> B { guard n > 2 || n == 1; sync c?; }, A -> B { guard n == 2; sync c?; }; }"
    " system P, Q;",
    "booleans": "bool a = true, b; int[0,3] n; process P() { state A; init A; trans A -> A {"
    " guard (a || b) && !(a && b) && (n < 2 imply a); assign b = a, a = !a,"
    " n = a ? n : n + 1 <? 3; }; } system P;",
    "quantifiers": "int[0,2] a[3]; process P() { state A; init A; trans A -> A { select i :"
    " int[0,2]; guard forall (k : int[0,2]) a[k] >= 0 && (sum (k : int[0,2]) a[k]) < 4;"
    " assign a[i] = (a[i] + 1) % 3; }; } system P;",
    "clocks": "clock x, y[2]; int[0,9] n; process P() { state A { x <= 3 + n }, B; urgent B;"
    " init A; trans A -> B { guard 2 <= x && y[1] > n; assign x = 0, y[0] = n; },"
    " B -> A { guard n < 3; assign n++; }; } system P;",
    "structs": "struct { int[0,5] a; bool b; } s = { 2, false }; process P() { state A; init A;"
    " trans A -> A { guard !s.b; assign s.a--, s.b = s.a == 0; }; } system P;",
    "hidden names": "int[0,9] k = 7; int[0,9] n; process P() { const int k = 4; state A, B; init A;"
    " trans A -> B { assign n = k; }; } system P;",
}


@pytest.mark.parametrize("text", ROUND_TRIPS.values(), ids=ROUND_TRIPS.keys())
def test_models_come_back_from_tchecker(text: str) -> None:
    model, back = through_tck(text)
    assert renamed(reached(back)) == renamed(reached(model))
    assert len(list(back.states())) == len(list(model.states()))


def renamed(
    states: set[tuple[tuple[str, ...], tuple[float, ...]]],
) -> set[tuple[tuple[str, ...], tuple[float, ...]]]:
    """Without the numbers that keep names of locations and variables apart, and in any order."""
    return {
        (tuple(re.sub(r"_\d$", "", place) for place in places), tuple(sorted(found)))
        for places, found in states
    }


GUARDS = st.sampled_from(["", "x >= 2", "n < 3", "n == 1 && x < 5", "n > 0 || m == 0"])
SYNCS = st.sampled_from(["", "c!", "c?", "d[0]!", "d[n % 2]?", "all!", "all?"])
UPDATES = st.sampled_from(["", "x = 0", "n = (n + 1) % 4", "m = n, n = 0, x = 1"])


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(st.data())
def test_random_networks_come_back(data: st.DataObject) -> None:
    text = "int[0,3] n; int[0,3] m; clock x; chan c, d[2]; broadcast chan all;\n"
    for name in "PQR":
        kinds = data.draw(st.sampled_from(["", "urgent B;", "commit B;"]))
        edges = []
        for _ in range(data.draw(st.integers(1, 4))):
            source_, target = (data.draw(st.sampled_from("AB")) for _ in "12")
            sync, guard = data.draw(SYNCS), data.draw(GUARDS)
            if sync == "all?":
                # Where a broadcast is heard, no guard may have clocks, nor any in committed places.
                guard = guard if "x" not in guard and "commit" not in kinds else ""
            labels = [
                f"{word} {label};"
                for word, label in (
                    ("guard", guard),
                    ("sync", sync),
                    ("assign", data.draw(UPDATES)),
                )
                if label
            ]
            edges.append(f"{source_} -> {target} {{ {' '.join(labels)} }}")
        invariant = data.draw(st.sampled_from(["", " { x <= 6 }"]))
        text += (
            f"process {name}() {{ state A{invariant}, B; {kinds} init A; "
            f"trans {', '.join(edges)}; }}\n"
        )
    model, back = through_tck(f"{text}system P, Q, R;")
    assert reached(back) == reached(model)


REFUSED = {
    "urgent chan c; process P() { state A; init A; } system P;": (
        "model.xta: channel c: TChecker has no urgent channels",
        "use an urgent location",
    ),
    "chan c; chan priority c < default; process P() { state A; init A; } system P;": (
        "model.xta: TChecker has no priorities",
        "write them as guards",
    ),
    "clock x; process P() { state A { x' == 0 }; init A; } system P;": (
        "model.xta: TChecker has no stopwatches",
        "clocks that always run",
    ),
    "hybrid clock x; process P() { state A { x' == 2 }; init A; } system P;": (
        "model.xta: clock x: TChecker has no hybrid clocks",
        "use integers",
    ),
    "int n; before_update { n = 0 } process P() { state A; init A; } system P;": (
        "model.xta: TChecker has no before update",
        "write into each update",
    ),
    "process P() { clock y, x = 3; state A; init A; } system P;": (
        "model.xta: template P, clock x: clocks of TChecker begin with 0",
        "set it",
    ),
    "int[0,2] i; int[0,2] t[3] = { 0, 1, 2 }; process P() { state A; init A; trans A -> A {"
    " assign t[t[i]] = 1; }; } system P;": (
        "model.xta: template P, edge A → A, update: the index of `t[t[i]]` has the array itself",
        "keep the index in a variable",
    ),
    "meta int n; process P() { state A; init A; } system P;": (
        "model.xta: variable n: TChecker has no meta variables",
        "delete `meta`",
    ),
    "typedef scalar[3] s_t; s_t s; process P() { state A; init A; } system P;": (
        "model.xta: variable s: TChecker has no scalars",
        "int[0,N-1]",
    ),
    "process P() { state A, B; init A; trans A -u-> B { }; } system P;": (
        "model.xta: template P, edge A → B: TChecker has no games",
        "write -> for -u->",
    ),
    "process P() { state A { ; 2 }; init A; } system P;": (
        "model.xta: process P, location A: TChecker has no exponential rates",
        "delete the rate",
    ),
    "process P() { state A, B; branchpoint C; init A; trans A -> C { }, C -> A { }, C -> B { }; }"
    " system P;": (
        "model.xta: template P, edge A → C: TChecker has no branch points",
        "convert to JANI",
    ),
    "int n; int f() { return 1; } process P() { state A; init A; trans A -> A { guard n == f(); };"
    " } system P;": (
        "model.xta: template P, edge A → A, guard: the function `f` in `n == f()`",
        "into the label",
    ),
    "int n; void f() { n = 1; } process P() { state A; init A; trans A -> A { assign f(); }; }"
    " system P;": (
        "model.xta: template P, edge A → A, update: cannot convert the function `f`",
        "assignments",
    ),
    "const int t[2] = { 1, 2 }; int[0,1] i; process P() { state A; init A; trans A -> A { guard"
    " t[i] == 1; }; } system P;": (
        "model.xta: template P, edge A → A, guard: `t` in `t[i] == 1` is a table of constants",
        "without `const`",
    ),
    "int n; process P() { state A; init A; trans A -> A { assign n = n << 1; }; } system P;": (
        "model.xta: template P, edge A → A, update: TChecker has no counterpart of `n << 1`",
        "+ - * / %",
    ),
    "clock x, y; process P() { state A; init A; trans A -> A { guard x + 1 < y + 3; }; }"
    " system P;": (
        "model.xta: template P, edge A → A, guard: TChecker cannot compare clocks as in",
        "the difference of two",
    ),
    "clock x; broadcast chan c; process P() { state A; init A; trans A -> A { sync c!; }; }"
    " process Q() { state A; init A; trans A -> A { guard x > 1; sync c?; }; } system P, Q;": (
        "model.xta: template Q, edge A → A, guard: TChecker allows no guard where a broadcast",
        "split the location",
    ),
    "int n; process P() { state A; init A; trans A -> A { select i : int[0,999999]; assign n = i;"
    " }; } system P;": (
        "model.xta: template P, edge A → A, select: `i : int[0,999999]` has 1000000 values",
        "a smaller range",
    ),
}


@pytest.mark.parametrize("text", REFUSED, ids=[message for message, _ in REFUSED.values()])
def test_what_tchecker_cannot_hold_is_refused(text: str) -> None:
    message, hint = REFUSED[text]
    with pytest.raises(InputError) as caught:
        convert(source(text), "tck")
    first, second = str(caught.value).split("\n")
    assert first.startswith(message)
    assert hint in second


def test_queries_become_labels_or_comments() -> None:
    text = """process P() { state A, B, C; init A; trans A -> B { }, B -> C { }; }
        Q = P(); R = P(); system Q, R;
        query { E<> Q.B && (R.B || R.C) } query { A[] not Q.C } query { A<> Q.C }"""
    found = convert(source(text), "tck")
    assert "location:Q:B{labels: query1_1}" in found.text
    assert "location:R:B{labels: query1_2}" in found.text
    assert "location:Q:C{labels: query2}" in found.text
    assert found.text.endswith(
        "# query 1: E<> Q.B && (R.B || R.C)\n"
        "#   satisfied if `tck-reach -l query1_1,query1_2` says REACHABLE true\n"
        "# query 2: A[] not Q.C\n"
        "#   satisfied if `tck-reach -l query2` says REACHABLE false\n"
        "# query 3, which labels cannot express: A<> Q.C\n"
    )
    assert found.notes == ("query 3 is only a comment, for labels cannot express it: A<> Q.C",)
