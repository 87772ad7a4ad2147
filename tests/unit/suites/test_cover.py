"""Suites: what they cover, what cannot be covered, and that their tests are runs of the model."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import pytest

from ntagen import build
from ntagen.checker import Model, load
from ntagen.errors import InputError, ModelError
from ntagen.suites import Limits, Suite, cover, read_suite, replay, suite_json
from tests.unit.suites.models import lamp


def verdicts(suite: Suite) -> dict[str, str]:
    return {one.goal.name: one.verdict for one in suite.goals}


def taken_edges(suite: Suite, model: Model) -> set[tuple[str, int]]:
    """The edges of templates that the tests take, by process and number in the engine."""
    return {
        (edge["process"], edge["edge"])
        for case in suite.tests
        for step in case.trace["run"]["steps"]
        for edge in step["edges"]
    }


def test_every_edge_is_taken_or_proven_unreachable() -> None:
    model = lamp().load()
    suite = cover(model, ["edges"])
    assert taken_edges(suite, model) == {("Lamp", 0), ("Lamp", 1), ("Lamp", 2), ("Person", 0)}
    assert verdicts(suite) == {
        "Lamp: Off -> On [press?]": "covered",
        "Lamp: On -> Off": "covered",
        "Lamp: On -> On [press?]": "covered",
        "Lamp: On -> Broken": "unreachable",
        "Person: Person.0 -> Person.0 [press!]": "covered",
    }
    assert len(suite.tests) == 2


def test_tests_are_traces_of_the_model_itself() -> None:
    model = lamp().load()
    suite = cover(model, ["locations", "edges", "queries"])
    for case in suite.tests:
        assert model.verify(json.dumps(case.trace)).holds
        assert replay(case, model) is None
        assert "ntagen_goal" not in json.dumps(case.trace)


def test_times_are_exact() -> None:
    suite = cover(lamp().load(), ["edges"])
    case = suite.tests[suite.goals[1].tests[0]]
    assert case.duration == Fraction(20)
    assert [step.time for step in case.steps][-1] == 20
    assert case.steps[-1].before.locations["Lamp"] == "On"
    assert case.steps[-1].after.locations["Lamp"] == "Off"
    assert case.steps[0].after.variables == {"count": 1}
    assert [edge.direction for edge in case.steps[0].edges] == ["send", "receive"]
    assert case.steps[0].edges[0].action == "press"


def test_locations_without_names_and_branch_points_are_covered() -> None:
    model = build.Model()
    t = model.template("T", declarations="clock x;")
    start, middle = t.location(initial=True, invariant="x <= 1"), t.location()
    point = t.branch_point()
    end = t.location("End")
    t.edge(start, point, guard="x == 1")
    t.edge(point, middle, weight="1")
    t.edge(point, end, weight="2", update="x = 0")
    model.system = "A = T(); B = T(); system A, B;"
    suite = cover(model.load(), ["locations", "edges"], each_process=True)
    assert set(verdicts(suite).values()) == {"covered"}
    assert len(suite.goals) == 2 * (3 + 2)
    for case in suite.tests:
        assert case.trace["run"]["states"][0]["locations"]["A"] != "ntagen_goal"


def test_a_test_does_not_end_in_a_committed_location() -> None:
    model = build.Model()
    t = model.template("T")
    idle, busy = t.location("Idle", initial=True), t.location("Busy", committed=True)
    t.edge(idle, busy)
    t.edge(busy, idle)
    model.system = "system T;"
    for kind in ("locations", "edges"):
        suite = cover(model.load(), [kind])
        ends = {case.run.states[-1].locations["T"] for case in suite.tests}
        assert ends == {"Idle"}


def test_queries_give_witnesses_and_counterexamples() -> None:
    model = lamp()
    model.query("A[] count < 3")
    model.query("Pr[<=10](<> Lamp.On)")
    suite = cover(model.load(), ["queries"])
    assert [one.verdict for one in suite.goals] == [
        "no trace",
        "covered",
        "no trace",
        "covered",
        "no trace",
    ]
    assert suite.tests[suite.goals[3].tests[0]].run.states[-1].variables["count"] == 3


def test_limits_leave_goals_unknown() -> None:
    suite = cover(lamp(9_000).load(), ["edges"], limits=Limits(states=2))
    assert suite.count("unknown") > 0
    assert "state limit" in suite.goals[3].reason


def test_constants_hold_in_the_search() -> None:
    model = build.Model(declarations="const int N = 1;")
    t = model.template("T")
    one, two = t.location("One", initial=True), t.location("Two")
    t.edge(one, two, guard="N > 1")
    model.system = "system T;"
    assert verdicts(cover(model.load(), ["edges"])) == {"T: One -> Two": "unreachable"}
    larger = model.load().with_constants(N=2)
    found = cover(larger, ["edges"], constants={"N": "2"})
    assert verdicts(found) == {"T: One -> Two": "covered"}


def test_a_template_without_a_process_covers_nothing() -> None:
    model = lamp()
    unused = model.template("Unused")
    place = unused.location("Place", initial=True)
    unused.edge(place, place)
    found = {one.goal.name: one for one in cover(model.load(), ["edges"]).goals}
    assert found["Unused: Place -> Place"].reason == "no process runs Unused"


def test_a_suite_is_read_as_it_was_written(tmp_path: Path) -> None:
    suite = cover(lamp().load(), ["locations", "edges"], name="lamp.xml")
    path = tmp_path / "suite.json"
    path.write_text(suite_json(suite), "utf-8")
    assert read_suite(path) == suite


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": "ntagen-suite", "version": 2}'])
def test_another_file_is_no_suite(tmp_path: Path, text: str) -> None:
    path = tmp_path / "suite.json"
    path.write_text(text)
    with pytest.raises(InputError, match="is no test suite"):
        read_suite(path)


def test_a_broken_trace_is_no_suite(tmp_path: Path) -> None:
    value = json.loads(suite_json(cover(lamp().load(), ["edges"])))
    del value["tests"][0]["trace"]["run"]["steps"]
    path = tmp_path / "suite.json"
    path.write_text(json.dumps(value))
    with pytest.raises(InputError, match="steps"):
        read_suite(path)


def test_nothing_to_cover_is_refused() -> None:
    model = lamp()
    model.queries = []
    with pytest.raises(InputError, match="no queries, so there is nothing to cover"):
        cover(model.load(), ["queries"])


def test_xta_is_refused() -> None:
    with pytest.raises(InputError, match="XTA"):
        cover(load("process T() { state A; init A; } system T;"), ["locations"])


def test_an_error_of_the_model_is_told() -> None:
    model = build.Model(declarations="int[0,1] n = 1;")
    t = model.template("T")
    place, end = t.location("Place", initial=True), t.location("End")
    t.edge(place, place, update="n = n + 1")
    t.edge(place, end, guard="n == 0")
    model.system = "system T;"
    with pytest.raises(ModelError, match=r"T\.End"):
        cover(model.load(), ["locations"])


def test_a_model_that_does_otherwise_cannot_replay() -> None:
    suite = cover(lamp().load(), ["edges"])
    later, longer, silent = lamp(), lamp(), lamp()
    later["Lamp"].edges[1].guard = "x >= 25"
    longer["Lamp"].edges[0].update = "x = 0"
    silent["Lamp"].edges[0].sync = ""
    reasons = [
        {replay(case, model.load()) for case in suite.tests} for model in (later, longer, silent)
    ]
    assert any("there is no" in str(one) or "not possible" in str(one) for one in reasons[0])
    assert "after step 1: count is 0 and not 1" in reasons[1]
    assert any("there is no Person" in str(one) for one in reasons[2])
