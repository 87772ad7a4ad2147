"""What a loaded model says of itself, from the three languages."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import pytest

import ntagen
from ntagen.checker import load
from ntagen.checker.facts import Channel, Clock, Query, StateSize, StoredPart, Variable

PAPER = Path(__file__).resolve().parents[3] / "examples" / "paper.nsl"

XML = """<?xml version="1.0"?>
<nta>
  <declaration>const int N = 2; clock x; urgent chan go[N]; broadcast chan all; chan plain;
meta int[0,3] m; struct { int[0,1] a; bool b; } s[3]; hybrid clock h;</declaration>
  <template>
    <name>P</name>
    <parameter>const int[0,N-1] id, bool &amp;flag</parameter>
    <declaration>clock y; double d;</declaration>
    <location id="id0" x="10" y="-20" color="#A0FFa0">
      <name x="12" y="-40">Start</name>
      <label kind="invariant" x="14" y="-6">y &lt;= 3 &amp;&amp;
x &lt;= 7</label>
    </location>
    <location id="id1" x="100" y="-20"><committed/></location>
    <location id="id2">
      <name>Late</name><urgent/><label kind="exponentialrate">1:2</label>
    </location>
    <branchpoint id="id3" x="50" y="60"/>
    <init ref="id0"/>
    <transition controllable="false">
      <source ref="id0"/><target ref="id3"/>
      <label kind="select" x="1" y="2">i : int[0,3]</label>
      <label kind="guard" x="3" y="4">x - y &lt; 2</label>
      <label kind="synchronisation" x="5" y="6">go[id] !</label>
      <label kind="assignment">m = i, flag = true</label>
      <nail x="30" y="31"/><nail x="40" y="41"/>
    </transition>
    <transition>
      <source ref="id3"/><target ref="id1"/><label kind="probability" x="7" y="8">2</label>
    </transition>
  </template>
  <system>bool f; A = P(0, f); B = P(1, f); system A, B;</system>
  <queries><query><formula>E&lt;&gt; A.Late</formula><comment>Once</comment>
    <expect outcome="failure" type="symbolic"/></query></queries>
</nta>
"""


@pytest.fixture(scope="module")
def model() -> ntagen.Model:
    return load(XML, "model.xml")


def test_templates_are_as_written(model: ntagen.Model) -> None:
    template = model.template("P")
    assert template.parameters == ("const int[0, N - 1] id", "bool &flag")
    start, nameless, late = template.locations
    assert (start.id, start.name, start.kind, start.initial) == ("id0", "Start", "normal", True)
    assert start.invariant == "y <= 3 &&\nx <= 7"
    assert (nameless.name, nameless.kind, nameless.initial) == ("", "committed", False)
    assert (late.kind, late.rate, late.position) == ("urgent", "1:2", None)
    entry, leg = template.edges
    assert (entry.source, entry.target, entry.controllable) == ("id0", "id3", False)
    assert (entry.select, entry.guard, entry.sync) == ("i : int[0,3]", "x - y < 2", "go[id]!")
    assert (entry.update, entry.weight) == ("m = i, flag = true", "")
    assert (leg.weight, leg.controllable, leg.nails) == ("2", True, ())
    assert [node.id for node in template.nodes] == ["id0", "id1", "id2", "id3"]


def test_places_come_from_the_file(model: ntagen.Model) -> None:
    template = model.template("P")
    start = template.locations[0]
    assert (start.position, start.color) == ((10, -20), "#a0ffa0")
    assert start.labels == {"name": (12, -40), "invariant": (14, -6)}
    assert template.branch_points[0].position == (50, 60)
    entry = template.edges[0]
    assert entry.nails == ((30, 31), (40, 41))
    assert entry.labels == {"select": (1, 2), "guard": (3, 4), "sync": (5, 6)}


def test_processes_variables_clocks_and_channels_are_those_of_the_network(
    model: ntagen.Model,
) -> None:
    processes = [(one.name, one.template, one.location_count) for one in model.processes]
    assert processes == [("A", "P", 3), ("B", "P", 3)]
    # The two legs of a branch point are branches of the edge that leads to it.
    assert [process.edge_count for process in model.processes] == [1, 1]
    assert model.variables == (
        Variable("s", None, "struct { int[0,1] a; bool b; }", (3,), meta=False, words=6),
        Variable("f", None, "bool", (), meta=False, words=1),
        Variable("A.d", "A", "double", (), meta=False, words=2),
        Variable("B.d", "B", "double", (), meta=False, words=2),
        Variable("m", None, "int[0,3]", (), meta=True, words=1),
    )
    assert model.clocks == (
        Clock("x", None, hybrid=False),
        Clock("h", None, hybrid=True),
        Clock("A.y", "A", hybrid=False),
        Clock("B.y", "B", hybrid=False),
    )
    assert model.channels == (
        Channel("go[0]", broadcast=False, urgent=True, priority=0),
        Channel("go[1]", broadcast=False, urgent=True, priority=0),
        Channel("all", broadcast=True, urgent=False, priority=0),
        Channel("plain", broadcast=False, urgent=False, priority=0),
    )
    assert model.state == StateSize(14, location_words=2, variable_words=11, meta_words=1)
    assert model.state_words == 14


def test_the_bits_of_all_parts_are_those_of_a_stored_state(model: ntagen.Model) -> None:
    stored = model.stored_state()
    assert (stored.words, stored.meta_words) == (model.state.words, model.state.meta_words)
    parts = [part for part in stored.parts if part.kind != "left out"]
    names = [one.name for one in (*model.processes, *model.variables)]
    assert [part.name for part in parts] == names
    assert sum(part.words for part in stored.parts) == stored.words
    assert sum(part.stored_bits for part in stored.parts) == stored.stored_bits
    assert sum(part.constant_words for part in stored.parts) == stored.constant_words
    a, _, s, f, *_, m = parts
    assert a == StoredPart(
        "location",
        "A",
        "A",
        meta=False,
        words=1,
        stored_bits=8,
        constant_words=0,
        reset_words=0,
        live_locations=0,
    )
    # Nothing writes the array; nothing reads the flag.
    assert (s.words, s.stored_bits, s.constant_words, s.reset_words) == (6, 0, 6, 0)
    assert (f.stored_bits, f.reset_words, f.live_locations) == (8, 1, 0)
    assert (m.meta, m.stored_bits) == (True, 8)


@pytest.mark.parametrize("path", ["paper.nsl", "liver/liver.nsl"])
def test_parts_of_environments_are_their_states(path: str) -> None:
    stored = ntagen.load(PAPER.parent / path).stored_state()
    assert sum(part.words for part in stored.parts) == stored.words
    assert sum(part.stored_bits for part in stored.parts) == stored.stored_bits


def test_random_runs_store_no_states() -> None:
    model = load(
        "clock x; double d; "
        "process P() { state A; init A; trans A -> A { guard x > d; }; } system P;"
    )
    stored = model.stored_state()
    assert (stored.stored_bits, stored.reset_words, stored.parts) == (None, None, ())
    assert stored.words == model.state_words


def test_features_are_named(model: ntagen.Model) -> None:
    assert model.features == (
        "broadcast-channels",
        "urgent-channels",
        "urgent-locations",
        "committed-locations",
        "select-bindings",
        "branch-points",
        "uncontrollable-edges",
        "hybrid-clocks",
        "clock-differences",
        "clock-guards-on-urgent-channels",
        "exponential-rates",
        "structs",
        "doubles",
        "meta-variables",
    )
    assert load("process P() { state A; init A; } system P;").features == ()


def test_queries_have_their_comments_and_expectations(model: ntagen.Model) -> None:
    assert model.queries == (Query("E<> A.Late", "Once", "not satisfied"),)
    assert model.facts.queries == model.queries


def test_models_load_from_paths_and_texts(tmp_path: Path) -> None:
    path = tmp_path / "model.xml"
    path.write_text(XML)
    for source in (path, str(path), XML):
        assert [process.name for process in ntagen.load(source).processes] == ["A", "B"]
    names = [process.name for process in ntagen.load(PAPER).processes]
    assert names == ["User", "Needle", "Tissue", "Checker"]
    assert ntagen.load("process P() { state A; init A; } system P;").check("E<> P.A").verdict == (
        "satisfied"
    )


def test_wrong_models_are_rejected(tmp_path: Path) -> None:
    with pytest.raises(ntagen.RejectedError, match="E0201"):
        ntagen.load("system Nobody;")
    with pytest.raises(FileNotFoundError):
        ntagen.load(tmp_path / "nothing.xml")
    with pytest.raises(KeyError, match="the model has P"):
        load(XML).template("Q")


def test_facts_are_plain_values(model: ntagen.Model) -> None:
    assert pickle.loads(pickle.dumps(model.facts)) == model.facts
    assert copy.deepcopy(model.facts) == model.facts
    assert hash(model.facts) == hash(load(XML).facts)
    assert repr(model) == "<Model of 2 processes: A, B>"


def test_every_public_name_can_be_imported() -> None:
    for name in ntagen.__all__:
        assert getattr(ntagen, name).__name__ in (name, f"ntagen.{name}")
    with pytest.raises(AttributeError, match="nothing"):
        ntagen.nothing  # noqa: B018  reading it is the test
