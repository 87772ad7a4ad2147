"""XTA and UPPAAL's XML both ways: the engine loads the same network from both."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ntagen import build, checker
from ntagen.convert import convert, source_of
from ntagen.convert.converting import first_difference
from ntagen.convert.xta_reading import parse_xta
from ntagen.convert.xta_writing import written_xta
from ntagen.errors import InputError
from tests.systems import source

ROOT = Path(__file__).parents[3]
MODELS = [
    *sorted((ROOT / "examples" / "models").glob("*.xta")),
    *sorted((ROOT / "tests" / "corpus" / "verdicts").glob("*.x*")),
    *sorted((ROOT / "tests" / "corpus" / "syntax" / "ok").glob("old_*")),
]

RICH = """// What is counted.
int n; /* a
block; } */ struct { int a; bool b; } pair = { 1, true };
chan go[2]; broadcast chan all;
int add(int a, int b) { if (a > b) { return a; } return b; }
process P(const int[0,1] id, int &count) {
  // Its own clock.
  clock x; int local[2] = { 1, 2 };
  state A { x <= 5 && forall (i : int[0,1]) local[i] > 0; 3 }, B, C;
  branchpoint fork;
  commit B; urgent C; init A;
  trans A -> B { select k : int[0,1]; guard x >= 1 && k == id; sync go[id]!;
      assign count = add(1, 2); },
    -> C { sync all?; }, C -u-> fork { }, fork -> A { probability 3; }, fork -> B { assign x = 0; };
}
int late = 2;
Q = P(0, n);
system Q;
query { E<> Q.B }
"""


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_the_same_network_comes_back(path: Path) -> None:
    given_source = source_of(checker.load_file(path), path.name)
    xml = convert(given_source, "xml")
    again = source_of(checker.load(xml.text, "again.xml"), "again.xml")
    xta = convert(again, "xta")
    assert first_difference(given_source.model, checker.load(xta.text, "back.xta")) == ""


def test_all_parts_are_read() -> None:
    model = parse_xta(RICH)
    assert model.declarations.startswith("// What is counted.\nint n; /* a\nblock; } */ struct")
    assert model.declarations.endswith("int late = 2;")
    assert model.system == "Q = P(0, n);\nsystem Q;"
    assert [query.formula for query in model.queries] == ["E<> Q.B"]
    template = model["P"]
    assert template.parameters == "const int[0,1] id, int &count"
    assert template.declarations.splitlines()[0].strip() == "// Its own clock."
    first, fork = template["A"], template.branch_points[0]
    assert template.initial is first
    assert first.invariant == "x <= 5 && forall (i : int[0,1]) local[i] > 0"
    assert first.rate == "3"
    assert (template["B"].committed, template["C"].urgent) == (True, True)
    edge, second, into, leg, _ = template.edges
    assert (edge.select, edge.sync) == ("k : int[0,1]", "go[id]!")
    assert (edge.guard, edge.update) == ("x >= 1 && k == id", "count = add(1, 2)")
    assert (second.source, second.sync) == (first, "all?")
    assert (into.target, into.controllable) == (fork, False)
    assert leg.weight == "3"


def test_what_was_written_is_read_again() -> None:
    model = parse_xta(RICH)
    again = parse_xta(written_xta(model))
    assert written_xta(again) == written_xta(model)
    assert first_difference(model.load(), again.load()) == ""


NAMES = st.sampled_from(["Idle", "Busy", "Done", "Off"])
GUARDS = st.sampled_from(["", "x > 2", "n == 1 && x <= 7", "(n + 1) % 2 == 0"])
UPDATES = st.sampled_from(["", "x = 0", "n++, x = 0", "n = n > 2 ? 0 : 1"])


@st.composite
def built_models(draw: st.DrawFn) -> build.Model:
    model = build.Model(declarations="int[0,9] n; chan go;")
    names = []
    for number in range(draw(st.integers(1, 3))):
        template = model.template(f"T{number}", declarations="clock x;")
        places = draw(st.lists(NAMES, min_size=1, max_size=4, unique=True))
        for place, name in enumerate(places):
            invariant = draw(st.sampled_from(["", "x <= 9"]))
            kind = draw(st.sampled_from(["", "urgent", "committed"]))
            template.location(
                name,
                initial=place == 0,
                invariant=invariant,
                urgent=kind == "urgent",
                committed=kind == "committed",
            )
        for _ in range(draw(st.integers(0, 5))):
            template.edge(
                draw(st.sampled_from(places)),
                draw(st.sampled_from(places)),
                guard=draw(GUARDS),
                sync=draw(st.sampled_from(["", "go!", "go?"])),
                update=draw(UPDATES),
                controllable=draw(st.booleans()),
            )
        names.append(template.name)
    model.system = f"system {', '.join(names)};"
    return model


@settings(max_examples=50, deadline=None)
@given(built_models())
def test_built_models_come_back(model: build.Model) -> None:
    again = parse_xta(written_xta(model))
    for one in (*model.templates, *again.templates):
        for number, node in enumerate(one.nodes):
            node.id = str(number)
    assert again == model


def test_locations_without_names_get_some() -> None:
    model = build.Model(system="system P;")
    template = model.template("P", declarations="int _P_0;")
    first, second = template.location(initial=True), template.location()
    template.edge(first, second)
    converted = convert(source_of(model.load(), "nameless.xml"), "xta")
    names = [one.name for one in parse_xta(converted.text)["P"].locations]
    assert all(names)
    assert len({*names, "_P_0"}) == 3


def test_comments_become_comments_and_settings_are_named() -> None:
    model = build.Model(system="system P;")
    template = model.template("P")
    place = template.location("A", initial=True, comment="begins */ here")
    place.extra.append('<label kind="testcodeEnter">press()</label>')
    converted = convert(source_of(model.load(), "tested.xml"), "xta")
    assert "/* begins * / here */ A" in converted.text
    assert [note.partition(": ")[2] for note in converted.notes] == [
        'template P, A: <label kind="testcodeEnter">press()</label>'
    ]


def test_a_chart_is_refused() -> None:
    model = build.Model(system="system P;", extra=["<lsc><name>Chart</name></lsc>"])
    model.template("P").location("A", initial=True)
    chart = source_of(model.load(), "chart.xml")
    with pytest.raises(InputError, match=r"chart\.xml: the model has a live sequence chart"):
        convert(chart, "xta")


def test_queries_stand_beside_xta_and_inside_xml() -> None:
    model = build.Model(system="system P;")
    model.template("P").location("A", initial=True)
    model.query("E<>\n P.A", "it begins\nthere", expect=True)
    model.query("", "a heading")
    model.query("A[] P.A", expect=False)
    beside = convert(source_of(model.load(), "asked.xml"), "xta").queries
    assert beside == (
        "// it begins\n// there\n// EXPECT:T\nE<> P.A\n\n// a heading\n\n// EXPECT:F\nA[] P.A\n\n"
        "// Written by ntagen convert.\n"
    )


def test_queries_of_the_text_are_kept_once() -> None:
    given_source = source(RICH)
    assert [one.formula for one in given_source.written.queries] == ["E<> Q.B"]
    xml = convert(given_source, "xml")
    assert xml.queries is None
    assert [one.formula for one in build.parse(xml.text).queries] == ["E<> Q.B"]
