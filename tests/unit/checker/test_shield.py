"""Shields: what they allow, their files and their code, and what is refused."""

from __future__ import annotations

import json
import random
import runpy
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from ntagen import checker
from ntagen.checker import Answer, RejectedError

TANK = """
double level = 5;
clock x;
int[0,3] i;
const int c = 2;
process Tank() {
  int own;
  state Choose, Done;
  commit Choose, Done;
  init Choose;
  trans Choose -> Done { assign level = level + 2.5; },
        Choose -> Done { assign level = level - 5; },
        Done -u-> Choose { };
}
system Tank;
"""

AXES = "level[0,10]:4"
KEEP = "level >= 0 && level < 8"
MOVES = ["level = level + 2.5", "level = level - 5"]


def query(axes: str = AXES, keep: str = KEEP) -> str:
    return f"strategy S = acontrol: A[] {keep} {{ {axes} }}"


def shield(text: str = TANK, asked: str = query(), **options: Any) -> Answer:  # noqa: ANN401
    return checker.load(text).check(asked, **{"shield_samples": 2} | options)


def file_of(answer: Answer) -> dict[str, Any]:
    text = answer.strategy_json()
    assert text is not None
    return dict(json.loads(text))


def allowed(answer: Answer) -> list[list[int]]:
    """The moves that are allowed, cell by cell."""
    file = file_of(answer)
    runs = zip(file["cells"][::2], file["cells"][1::2], strict=True)
    return [file["sets"][number] for number, count in runs for _ in range(count)]


def test_a_tank_is_drained_in_time() -> None:
    answer = shield()
    found = answer.shielded
    assert found is not None
    assert answer.verdict == "satisfied"
    assert answer.is_shield
    assert answer.strategy is None
    assert answer.machine is None
    # The first two cells are too low to drain; filling the third leads to the last, which is full.
    assert allowed(answer) == [[0], [0], [1], []]
    assert (found.cells, found.safe_cells, found.choice_cells, found.moves) == (4, 3, 3, 2)
    assert (found.unseen_pairs, found.stuck_runs, found.safe_share) == (0, 0, 0.75)
    assert found.trial is not None
    assert (found.trial.runs, found.trial.satisfied_runs) == (1000, 0)
    assert answer.message is not None
    assert answer.message.startswith("3 of 4 cells are safe (75.0000 %)")


def test_runs_and_learners_stay_within_it() -> None:
    model = checker.load(TANK)
    bad = "Pr[#<=200; 500](<> level < 0 || level >= 8)"
    assert model.check(bad).value == 1.0
    assert model.check(query(), shield_samples=2).verdict == "satisfied"
    under = model.check(f"{bad} under S").estimate
    assert under is not None
    assert under.satisfied_runs == 0
    assert model.check("E[#<=200; 100](min: level) under S").value >= 0
    # The least level is wanted, but nothing is drained that must be filled.
    best = model.check(
        "strategy Low = minE(level)[#<=20] {} -> {level}: <> false under S", max_iterations=3
    )
    assert best.message is not None
    assert "not computed exactly: a shield is known on cells only" in best.message
    assert model.check(f"{bad} under Low").value == 0.0
    assert best.value is not None


def test_a_query_is_not_satisfied_if_runs_begin_in_an_unsafe_cell() -> None:
    model = checker.load(TANK.replace("level = 5;", "level = 9;"))
    answer = model.check(query(), shield_samples=2)
    assert answer.verdict == "not satisfied"
    assert not answer.is_shield
    assert answer.shielded is not None
    assert answer.shielded.trial is None
    with pytest.raises(RejectedError, match="there is no strategy 'S'"):
        model.check("Pr[#<=9](<> level < 0) under S")


@pytest.mark.parametrize(
    ("rule", "expected"),
    [
        ("safe", [[0], [0], [0, 1], []]),
        ("unsafe", [[0], [0], [1], []]),
        ("sample", [[0], [0], [1], []]),
    ],
)
def test_what_counts_outside_the_grid(rule: str, expected: list[list[int]]) -> None:
    answer = shield(asked=query("level[0,7.5]:3", "level >= 0 && level < 11"), out_of_bounds=rule)
    assert [*allowed(answer), []] == expected


def test_a_grid_that_runs_leave_is_an_error() -> None:
    wanted = r"a run from level = 5 by Tank\.Choose->Tank\.Done .* comes to level = 7\.5, outside"
    with pytest.raises(RejectedError, match=wanted):
        shield(asked=query("level[0,7.5]:3", "level >= 0 && level < 11"))


def test_the_same_seed_gives_the_same_shield() -> None:
    noisy = TANK.replace("level + 2.5", "level + 2 + random(1.0)")
    asked = query("level[0,10]:40")
    files = [
        shield(noisy, asked, seed=seed, threads=threads, shield_repeats=3).strategy_json()
        for seed, threads in ((1, 1), (1, 2), (2, 1))
    ]
    assert files[0] == files[1]
    assert files[0] != files[2]


def test_a_file_is_read_again_and_written_alike(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    model = checker.load(TANK, str(tmp_path / "tank.xta"))
    model.check(query(f"Tank.location, i[0,3], {AXES}"), shield_samples=2)
    for text in (
        'saveStrategy("a.json", S)',
        'strategy T = loadStrategy("a.json")',
        'saveStrategy("b.json", T)',
    ):
        assert model.check(text).verdict == "satisfied"
    first, again = (json.loads((tmp_path / f"{name}.json").read_text()) for name in "ab")
    assert {**first, "query": again["query"]} == again
    assert first["format"] == "ntagen-shield"
    assert model.check("Pr[#<=200; 500](<> level < 0 || level >= 8) under T").value == 0.0


@pytest.mark.parametrize(
    ("change", "wanted"),
    [
        ({"version": 2}, "version 2 of the format is not known"),
        ({"axes": [{"name": "leve", "low": 0, "high": 9, "cells": 4}]}, "leve is nothing that"),
        ({"axes": [{"name": "level", "low": 9, "high": 0, "cells": 4}]}, "no bounds of cells"),
        ({"axes": [{"name": "level", "low": 0, "high": 9}]}, "of another kind in the model"),
        ({"axes": []}, "these axes make 1 cells"),
        ({"actions": ["Tank.Choose->Tank.Gone { }", "b"]}, "no move of the controller"),
        ({"actions": ["Tank.Choose->Tank.Done { 1, tau, level = level - 5 }"]}, "has the move"),
        ({"sets": [[0, 7]]}, "there is no action 7"),
        ({"cells": [0, 2]}, "these are 2 cells, and the axes make 4"),
        ({"cells": [0, 99]}, "no list of sets with numbers of cells"),
        ({"more": 1}, 'there is no field "more" here'),
    ],
)
def test_a_foreign_file_is_refused(tmp_path: Path, change: dict[str, object], wanted: str) -> None:
    path = tmp_path / "s.json"
    path.write_text(json.dumps(file_of(shield()) | change), encoding="utf-8")
    model = checker.load(TANK, str(tmp_path / "tank.xta"))
    with pytest.raises(RejectedError, match=wanted) as refused:
        model.check('strategy T = loadStrategy("s.json")')
    assert "E0805" in str(refused.value)


def test_torn_and_other_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "s.json"
    model = checker.load(TANK, str(tmp_path / "tank.xta"))
    text = shield().strategy_json()
    assert text is not None
    path.write_text(text[: len(text) // 2], encoding="utf-8")
    with pytest.raises(RejectedError, match="E0805"):
        model.check('strategy T = loadStrategy("s.json")')
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RejectedError, match="it is a shield"):
        model.verify(text)


@pytest.mark.parametrize(
    ("axes", "code", "wanted"),
    [
        ("nothing[0,1]", "E0201", "nothing"),
        ("own[0,1]", "E0201", "own"),
        ("level[0,10]", "E0289", "number of cells is missing"),
        ("x[0,10]", "E0289", "number of cells is missing"),
        ("level", "E0289", "bounds are missing"),
        ("i", "E0289", "bounds are missing"),
        ("i[0,3]:4", "E0289", "each value of an integer is a cell"),
        ("i[0,2.5]", "E0289", "bounds of an integer are integers"),
        ("i[3,0]", "E0289", "no value from 3 to 0"),
        ("level[10,0]:4", "E0289", "nothing lies between"),
        ("level[0,10]:2.5", "E0289", "2.5 is no number of cells"),
        ("level[0,10]:0", "E02", "number of cells cannot be 0"),
        ("level[0,level]:4", "E02", "must be known when the model is loaded"),
        ("Tank.location[0,1]", "E0289", "each location is a cell"),
        ("c[0,3]", "E0289", "this is none"),
        ("i++[0,3]", "E02", "a feature"),
        ("level[0,10]:4, level[0,9]:3", "E0289", "level is here twice"),
        ("level[0,10]:100000, x[0,1]:100000", "E0807", "4,294,967,295 is the most"),
    ],
)
def test_axes_without_meaning_are_refused(axes: str, code: str, wanted: str) -> None:
    with pytest.raises(RejectedError, match=wanted) as refused:
        shield(asked=query(axes))
    assert code in str(refused.value)


def test_an_integer_of_a_process_is_an_axis() -> None:
    answer = shield(asked=query(f"Tank.own[0,0], {AXES}"))
    assert allowed(answer) == [[0], [0], [1], []]


@pytest.mark.parametrize(
    ("asked", "wanted"),
    [
        (query().removeprefix("strategy S = "), "E0277"),
        (f"{query()} under S", "E0274"),
        ("A[] i < 9 under S", "E0801"),
        ("control: A[] true under S", "E0801"),
    ],
)
def test_other_forms_are_refused(asked: str, wanted: str) -> None:
    model = checker.load(TANK)
    model.check(query(), shield_samples=2)
    with pytest.raises(RejectedError, match=wanted):
        model.check(asked)


def test_memory_and_time_are_limits() -> None:
    with pytest.raises(RejectedError, match=r"E0807.*more than is allowed"):
        shield(asked=query("level[0,10]:1000000"), memory_bytes=1 << 20)
    cut = shield(asked=query("level[0,10]:3000000"), timeout_s=0.2)
    assert (cut.verdict, cut.stop) == ("unknown", "time")
    assert not cut.is_shield


def with_many_drains(count: int) -> str:
    """The tank with so many edges to drain it."""
    one = "Choose -> Done { assign level = level - 5; }"
    many = f"Choose -> Done {{ select k : int[1,{count}]; assign level = level - 5 + 0.0 * k; }}"
    return TANK.replace(one, many)


def test_sixty_four_moves_are_told_apart_and_no_more() -> None:
    assert allowed(shield(with_many_drains(63))) == [[0], [0], list(range(1, 64)), []]
    with pytest.raises(RejectedError, match=r"at most 64 moves .* and here are 65"):
        shield(with_many_drains(64))


def test_code_decides_as_the_file_says(tmp_path: Path) -> None:
    noisy = TANK.replace("level + 2.5", "level + 2 + random(1.0)")
    answer = shield(noisy, query("i[0,3], level[0,10]:40"), shield_repeats=3)
    sets = allowed(answer)
    (tmp_path / "s.py").write_text(answer.shield_code("python"), encoding="utf-8")
    decide = runpy.run_path(str(tmp_path / "s.py"))["allowed"]
    drawn = random.Random(1)
    values = [(drawn.randint(-1, 4), drawn.uniform(-1, 11)) for _ in range(2000)]
    values += [(0, k / 4) for k in range(-1, 42)]
    wanted = []
    for i, level in values:
        inside = 0 <= i <= 3 and 0 <= level < 10
        bits = sum(1 << one for one in sets[i * 40 + int(level / 0.25)]) if inside else 0b11
        wanted.append(bits or 0b11)
    assert [decide(one, 0b11) for one in values] == wanted
    assert decide(values[0], 0b01) == 0b01
    if (compiler := shutil.which("cc")) is None:
        return
    rows = ",".join(f"{{{i},{level!r}}}" for i, level in values)
    main = f"""#include <stdio.h>
static const double rows[][2] = {{{rows}}};
int main(void)
{{
    size_t i;
    for (i = 0; i < {len(values)}; i++)
        printf("%d\\n", (int)S_allowed(rows[i], 3));
    return 0;
}}
"""
    (tmp_path / "s.c").write_text(answer.shield_code("c", "S") + main, encoding="utf-8")
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"]
    subprocess.run([compiler, *flags, "s.c", "-o", "s"], cwd=tmp_path, check=True)
    printed = subprocess.run([tmp_path / "s"], capture_output=True, text=True, check=True).stdout
    assert [int(line) for line in printed.split()] == wanted


def test_options_without_meaning_are_refused() -> None:
    with pytest.raises(ValueError, match="shield_samples is 0"):
        shield(shield_samples=0)
    with pytest.raises(ValueError, match="out of bounds"):
        shield(out_of_bounds="x")
