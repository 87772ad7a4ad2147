"""Traces in UPPAAL's formats, read by an independent reader and compared with the engine's own."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

import ntagen
from ntagen.checker import Answer, Model
from ntagen.checker.edges import EngineStep
from ntagen.checker.states import Simulation
from ntagen.verifyta.compiled import compiled_text
from ntagen.verifyta.trace import network_of, trace_of
from ntagen.verifyta.trace_xml import trace_xml_text
from ntagen.verifyta.xtr import fewest_constraints, xtr_text
from tests.oracles.xtr import (
    UNBOUNDED,
    Bound,
    Compiled,
    ReadTrace,
    closed,
    read_compiled,
    read_trace,
)

CORPUS = Path(__file__).parents[2] / "corpus" / "verdicts"
MODELS = [
    "branch_points",
    "broadcast_takes_all",
    "broadcast_with_clock_guard",
    "channel_arrays",
    "clock_copies",
    "clock_differences",
    "committed_interleaving",
    "extrema_of_clocks",
    "fischer_too_eager",
    "leg_meets_a_committed_receiver",
    "legs_with_all_labels",
    "liveness_with_a_loop",
    "meta_is_not_identity",
    "scalars",
    "selects",
    "stopwatch",
    "urgent_within_a_window",
]
ARRAYS = """
typedef struct { int[0,9] a; bool b[2]; } pair;
pair p;
const int N = 2;
typedef int[0,N-1] id;
int last = -1;
clock all;
broadcast chan go[N];
process Cell(id me) {
  clock x;
  int[0,3] n = 1;
  state Rest { x <= 4 }, Busy, Done;
  urgent Busy;
  init Rest;
  trans Rest -> Busy { guard x > 1 && x < 4; sync go[me]!; assign n = n + 1, last = me; },
        Busy -> Done { select i: id, j: int[3,5]; guard i != me;
                       assign p.a = i + j, p.b[me] = true; };
}
process Ear() {
  state On;
  init On;
  trans On -> On { select i: id; guard all >= 2; sync go[i]?; };
}
system Cell, Ear;
"""


def queries_of(path: Path) -> list[str]:
    return re.findall(r"^// query: (.*)$", path.read_text("utf-8"), re.MULTILINE)


def answers() -> list[Any]:
    cases = [(name, CORPUS / f"{name}.xta") for name in MODELS]
    return [
        pytest.param(path.read_text("utf-8"), query, id=f"{name}-{number}")
        for name, path in cases
        for number, query in enumerate(queries_of(path))
    ] + [pytest.param(ARRAYS, "E<> p.a == 6 && p.b[1] && last == 0", id="arrays")]


def read(model: Model, answer: Answer) -> tuple[Compiled, ReadTrace] | None:
    text = xtr_text(model, answer)
    if text is None:
        return None
    compiled = read_compiled(compiled_text(model))
    return compiled, read_trace(text, compiled)


def of_engine(trace: dict[str, Any], clocks: list[str]) -> list[dict[tuple[str, str], Bound]]:
    """The zones of a trace from the texts of their constraints."""
    names = {
        f"{one}-{other}": (i, j) for i, one in enumerate(clocks) for j, other in enumerate(clocks)
    }
    zones = []
    for state in trace["states"]:
        bounds: dict[tuple[int, int], Bound] = {}
        for text in state["zone"]:
            left, relation, number = text.rsplit(" ", 2)
            strict = 0 if relation.endswith("=") else -1
            if left in names:
                bounds[names[left]] = (float(number), strict)
            elif relation.startswith("<"):
                bounds[clocks.index(left), 0] = (float(number), strict)
            else:
                bounds[0, clocks.index(left)] = (-float(number), strict)
        zones.append(closed(bounds, clocks))
    return zones


@pytest.mark.parametrize(("source", "query"), answers())
def test_an_xtr_trace_says_what_the_engine_says(source: str, query: str) -> None:
    model = ntagen.load(source)
    answer = model.check(query)
    found = read(model, answer)
    text = answer.trace_json()
    if text is None:
        assert found is None
        return
    assert found is not None
    compiled, trace = found
    raw = json.loads(text)
    first = raw["traces"][0] if "traces" in raw else raw
    assert [state.locations for state in trace.states] == [
        state["locations"] for state in first["states"]
    ]
    for state, expected in zip(trace.states, first["states"], strict=True):
        # Doubles are no part of these files.
        kept = {name: expected["variables"][name] for name in compiled.variables}
        assert state.variables == kept
    assert [state.zone for state in trace.states] == of_engine(first, compiled.clocks)
    for taken, edges in zip(trace.transitions, first["transitions"], strict=True):
        for (edge, select), other in zip(taken, edges, strict=True):
            ends = edge.process, edge.source, edge.target
            assert ends == (other["process"], other["source"], other["target"])
            labels = edge.guard, edge.sync, edge.update
            assert labels == (
                other["guard"] or "1",
                other["sync"] or "0",
                other["update"] or "1",
            )
            assert sorted(select) == sorted(other["select"].values())


@pytest.mark.parametrize(("source", "query"), answers())
def test_an_xtr_trace_is_a_walk_through_the_model(source: str, query: str) -> None:
    model = ntagen.load(source)
    found = read(model, model.check(query))
    if found is None:
        return
    compiled, trace = found
    start = model.walk()
    assert compiled.initial_locations == start.locations
    assert compiled.initial == {name: start.variables[name] for name in compiled.variables}
    path: list[int] = []
    for taken, after in zip(trace.transitions, trace.states[1:], strict=True):
        wanted = [(edge.process, edge.source, edge.target, select) for edge, select in taken]
        moves = walked(model, path).moves()
        fitting = [index for index, move in enumerate(moves) if edges_of(move) == wanted]
        # Legs of a branch point with one target differ in their updates only.
        ends = [walked(model, [*path, index]) for index in fitting]
        right = [
            index
            for index, end in zip(fitting, ends, strict=True)
            if end.locations == after.locations and after.variables.items() <= end.variables.items()
        ]
        assert right, (wanted, moves)
        path.append(right[0])


def walked(model: Model, path: list[int]) -> Simulation:
    """A walk from the start that takes these moves."""
    walk = model.walk()
    for index in path:
        walk.take(index)
    return walk


def edges_of(move: EngineStep) -> list[tuple[str, str, str, list[int]]]:
    return [
        (edge.process, edge.source, edge.target, list(edge.select.values())) for edge in move.edges
    ]


@pytest.mark.parametrize(("source", "query"), answers())
def test_an_xml_trace_says_the_same_as_the_xtr_trace(source: str, query: str) -> None:
    model = ntagen.load(source)
    answer = model.check(query)
    found = read(model, answer)
    text = trace_xml_text(model, answer)
    if found is None or text is None:
        assert (found, text) == (None, None)
        return
    compiled, trace = found
    root = ElementTree.fromstring(text)
    ids = {one.get("id"): one for one in root.iter() if one.get("id")}
    assert len(ids) == len([one for one in root.iter() if one.get("id")])
    node = ids[root.get("initial_node")]
    nodes = [node, *(ids[one.get("to")] for one in root.iter("transition"))]
    assert len(nodes) == len(trace.states)
    clocks = [one.get("id") for one in root.iter("clock")]
    for one, state in zip(nodes, trace.states, strict=True):
        vector = ids[one.get("location_vector")].get("locations", "").split()
        assert vector == [f"{process}.{place}" for process, place in state.locations.items()]
        values = [
            (entry.get("variable", "").removeprefix("sys."), int(entry.get("value", "")))
            for entry in ids[one.get("variable_vector")]
        ]
        assert values == list(state.variables.items())
        matrix = list(ids[one.get("dbm_instance", "").strip()])
        assert [entry.get("clock2") for entry in matrix[: len(clocks)]] == in_layout(
            clocks, compiled
        )
        read_back = {
            (short(entry.get("clock1", "")), short(entry.get("clock2", ""))): bound_of(entry)
            for entry in matrix
        }
        assert read_back == state.zone
    for one, taken in zip(root.iter("transition"), trace.transitions, strict=True):
        edges = [ids[name] for name in one.get("edges", "").split()]
        ends = [(edge.get("from"), edge.get("to")) for edge in edges]
        assert ends == [
            (f"{edge.process}.{edge.source}", f"{edge.process}.{edge.target}") for edge, _ in taken
        ]


def short(clock: str) -> str:
    return clock.removeprefix("sys.").removeprefix("#")


def in_layout(clocks: list[str | None], compiled: Compiled) -> list[str | None]:
    """The clocks of a file in the order of the compiled form."""
    return sorted(clocks, key=lambda one: compiled.clocks.index(short(one or "")))


def bound_of(entry: ElementTree.Element) -> Bound:
    if entry.get("bound") == "inf":
        return UNBOUNDED
    return float(entry.get("bound", "")), 0 if entry.get("comp") == "<=" else -1


def test_a_compiled_form_has_names_ranges_and_labels() -> None:
    compiled = read_compiled(compiled_text(ntagen.load(ARRAYS)))
    assert compiled.processes == ["Cell(0)", "Cell(1)", "Ear"]
    assert compiled.clocks == ["t(0)", "all", "Cell(0).x", "Cell(1).x"]
    assert compiled.variables[:4] == ["p.a", "p.b[0]", "p.b[1]", "last"]
    assert compiled.initial["last"] == -1
    assert compiled.initial["Cell(1).n"] == 1
    assert compiled.ranges["p.a"] == (0, 9)
    assert compiled.ranges["p.b[1]"] == (0, 1)
    assert compiled.kinds == {
        **dict.fromkeys(["Cell(0).Rest", "Cell(1).Rest", "Ear.On"], ""),
        **dict.fromkeys(["Cell(0).Busy", "Cell(1).Busy"], "urgent"),
        **dict.fromkeys(["Cell(0).Done", "Cell(1).Done"], ""),
    }
    assert compiled.invariants["Cell(0)"]["Rest"] == "x <= 4"
    first = compiled.edges["Cell(1)"][0]
    assert (first.guard, first.sync) == ("x > 1 && x < 4", "go[me]!")
    assert "\r" not in compiled_text(ntagen.load(ARRAYS))


def test_the_fewest_constraints_are_fewer_and_none_can_be_left_out() -> None:
    model = ntagen.load(ARRAYS)
    trace = trace_of(model.check("E<> p.a == 6"), network_of(model))
    assert trace is not None
    clocks = list(network_of(model).clocks)
    for state in trace.states:
        whole = {
            (i, j): (float(bound[0]), -int(bound[1]))
            for i, row in enumerate(state.zone)
            for j, bound in enumerate(row)
            if bound is not None
        }
        few = {
            (i, j): (float(value), -int(strict))
            for i, j, (value, strict) in fewest_constraints(state.zone)
        }
        assert closed(few, clocks) == closed(whole, clocks)
        for left_out in few:
            rest = {pair: bound for pair, bound in few.items() if pair != left_out}
            # Readers know that clocks are not negative.
            if left_out[0] != 0 or few[left_out] != (0.0, 0):
                assert closed(rest, clocks) != closed(whole, clocks)
