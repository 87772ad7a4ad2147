"""Mutants: how texts are changed, what each operator makes, and what kills it."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import pytest

from ntagen import build
from ntagen.cli import main
from ntagen.errors import InputError
from ntagen.mutation import OPERATORS, Judge, Judged, mutants
from ntagen.mutation.conditions import (
    comparisons,
    negations,
    other_signs,
    parts,
    with_bound,
    with_sign,
)
from ntagen.suites import Limits, cover, suite_json
from tests.unit.suites.models import lamp


def bounds(text: str, clocks: tuple[str, ...] = ("x",)) -> list[str]:
    return [with_bound(text, one, 1, clocks) for one in comparisons(text)]


@pytest.mark.parametrize(
    ("text", "changed"),
    [
        ("x < 5", ["x < 6"]),
        ("5 >= x", ["6 >= x"]),
        ("x - y <= N*2", ["x - y <= (N*2) + 1"]),
        ("x<5 && y>=a[i]", ["x<6 && y>=a[i]", "x<5 && y>=(a[i]) + 1"]),
        ("f(i < 3, 2) == 1", ["f(i < 4, 2) == 1", "f(i < 3, 2) == 2"]),
        ("x < 3 // y < 4", ["x < 4 // y < 4"]),
        ("x' == 0 && x <= 4", ["x' == 0 && x <= 5"]),
        ("x <= (b ? 2 : 3)", ["x <= ((b ? 2 : 3)) + 1"]),
        ("a <? b", []),
        ("a == b ? 1 : 2", []),
        ("ready", []),
        ("", []),
    ],
)
def test_bounds(text: str, changed: list[str]) -> None:
    assert bounds(text) == changed


def test_a_bound_of_zero_stays_readable() -> None:
    assert with_bound("x > 0", comparisons("x > 0")[0], -1, ("x",)) == "x > (0 - 1)"


def test_signs() -> None:
    assert other_signs("<") == ("<=", ">=")
    assert other_signs("==") == ("!=",)
    assert with_sign("x<5", comparisons("x<5")[0], ">=") == "x>=5"


@pytest.mark.parametrize(
    ("guard", "opposites"),
    [
        ("x < 5", ["x >= 5"]),
        ("x == 5", ["x < 5", "x > 5"]),
        ("n == 5", ["n != 5"]),
        ("x < 5 && n", ["x >= 5", "x < 5 && !(n)"]),
        ("n > 1 || m", ["!(n > 1 || m)"]),
        ("x < 5 // late", ["x >= 5"]),
        ("forall (i : int[0,1]) a[i] > 2", ["!(forall (i : int[0,1]) a[i] > 2)"]),
    ],
)
def test_negations(guard: str, opposites: list[str]) -> None:
    assert negations(guard, ("x",)) == opposites


def test_parts_are_outside_of_brackets() -> None:
    assert parts("a = f(1, 2), b[i, j] = 3", ",") == ["a = f(1, 2)", " b[i, j] = 3"]


def judged(model: build.Model, *operators: str, limits: Limits | None = None) -> list[Judged]:
    loaded = model.load()
    judge = Judge(loaded, limits=limits)
    return [judge.judge(one) for one in mutants(model, loaded, operators, ["Lamp"])]


def test_every_operator_makes_mutants_with_one_difference() -> None:
    model = lamp()
    model.declarations += "\nchan other;"
    loaded = model.load()
    found = Counter(one.operator for one in mutants(model, loaded, (), ["Lamp"]))
    # 4 edges, 3 locations, 4 comparisons in guards (3 of them strict), 1 clock.
    assert found == {
        "guard-bound": 8,
        "guard-sign": 8,
        "guard-negation": 3,
        "invariant-bound": 2,
        "target": 8,
        "source": 8,
        "action": 2,
        "reset": 4,
        "sink": 4,
        "drop-edge": 4,
    }
    assert set(found) == set(OPERATORS)
    before = model.xml()
    for one in mutants(model, loaded):
        assert one.model.xml() != before, one
    assert model.xml() == before


def test_queries_kill_what_changes_their_answers() -> None:
    found = {one.mutant.change: one for one in judged(lamp(), "invariant-bound")}
    late = found["invariant x <= 20 becomes x <= 21"]
    assert late.fate == "killed"
    assert late.queries == ("A[] Lamp.x <= 20 || Lamp.Off",)
    assert late.reason == "A[] Lamp.x <= 20 || Lamp.Off is not satisfied"
    assert found["invariant x <= 20 becomes x <= 19"].fate == "survived"


def test_a_reset_is_taken_away_or_added() -> None:
    changes = [one.mutant.change for one in judged(lamp(), "reset")]
    assert changes == [
        "update x = 0, count = count + 1 becomes count = count + 1",
        "update none becomes x = 0",
        "update x = 0 // again becomes none",
        "update none becomes x = 0",
    ]


def test_a_mutant_that_does_not_load_is_invalid() -> None:
    model = lamp()
    model["Lamp"].edges[1].guard = "x == 20"
    found = {one.mutant.change: one for one in judged(model, "guard-sign")}
    # A guard cannot say that a clock is unequal.
    wrong = found["guard x == 20 becomes x != 20"]
    assert wrong.fate == "invalid"
    assert "cannot be a guard" in wrong.reason


def test_limits_leave_mutants_unknown() -> None:
    model = build.Model(declarations="int n = 0;")
    t = model.template("Lamp")
    place, end = t.location("Place", initial=True), t.location("End")
    t.edge(place, place, guard="n < 9000", update="n = n + 1")
    t.edge(place, end, guard="n >= 0")
    model.system = "system Lamp;"
    model.query("E<> Lamp.End")
    found = {one.mutant.change: one for one in judged(model, "guard-sign", limits=Limits(states=2))}
    assert found["guard n >= 0 becomes n < 0"].fate == "unknown"
    assert found["guard n >= 0 becomes n > 0"].fate == "survived"


def test_tests_kill_what_queries_do_not() -> None:
    model = lamp()
    loaded = model.load()
    suite = cover(loaded, ["edges"])
    without = Judge(loaded)
    by_tests = Judge(loaded, tests=suite.tests)
    made = list(mutants(model, loaded, ["guard-bound"], ["Lamp"]))
    late = next(one for one in made if one.change == "guard x >= 20 becomes x >= 21")
    assert without.judge(late).fate == "survived"
    killed = by_tests.judge(late)
    assert killed.fate == "killed"
    assert killed.tests == (suite.tests[suite.goals[1].tests[0]].name,)


def test_few_mutants_are_spread_over_all() -> None:
    model = lamp()
    loaded = model.load()
    found = [one.name for one in mutants(model, loaded, ["target"], ["Lamp"], most=2)]
    assert found == ["target-0", "target-4"]


def test_unknown_names_are_refused() -> None:
    model = lamp()
    loaded = model.load()
    with pytest.raises(InputError, match="there is no operator swap\nhint: there are guard-bound"):
        list(mutants(model, loaded, ["swap"]))
    with pytest.raises(InputError, match="there is no template Lmap"):
        list(mutants(model, loaded, (), ["Lmap"]))


def test_a_model_without_queries_is_refused() -> None:
    model = lamp()
    model.queries = []
    with pytest.raises(InputError, match="nothing can kill a mutant"):
        Judge(model.load())


def test_tests_of_another_model_are_refused() -> None:
    suite = cover(lamp().load(), ["edges"])
    other = lamp()
    other["Lamp"].edges[0].update = "x = 0"
    with pytest.raises(InputError, match="is no test of this model"):
        Judge(other.load(), tests=suite.tests)


def test_the_command_counts_and_keeps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, suite = tmp_path / "lamp.xml", tmp_path / "suite.json"
    lamp().write(path)
    suite.write_text(suite_json(cover(lamp().load(), ["edges"])))
    arguments = ["mutate", str(path), "--template", "Lamp", "--operators", "target,sink"]
    assert main([*arguments, "--keep", str(tmp_path / "kept"), "--json"]) == 1
    value = json.loads(capsys.readouterr().out)
    assert sum(value["counts"].values()) == len(value["mutants"]) == 12
    kept = sorted(one.stem for one in (tmp_path / "kept").iterdir())
    assert kept == sorted(one["name"] for one in value["mutants"])
    assert build.read(tmp_path / "kept" / "sink-0.xml") != lamp()
    assert main([*arguments, "--suite", str(suite)]) == 1
    shown = capsys.readouterr().out
    assert "test_0" in shown
    assert "survived: target-" in shown


def test_all_killed_is_done(tmp_path: Path) -> None:
    path, suite = tmp_path / "lamp.xml", tmp_path / "suite.json"
    lamp().write(path)
    suite.write_text(suite_json(cover(lamp().load(), ["edges"])))
    arguments = ["mutate", str(path), "--operators", "guard-negation", "--template", "Person"]
    assert main([*arguments, "--suite", str(suite)]) == 0


def test_the_command_refuses_an_unknown_operator(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lamp().write(tmp_path / "lamp.xml")
    assert main(["mutate", str(tmp_path / "lamp.xml"), "--operators", "swap"]) == 2
    assert "there is no operator swap" in capsys.readouterr().err
