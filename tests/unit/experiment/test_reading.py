"""Files of experiments: what they mean, and what is said about each mistake."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from ntagen.errors import InputError
from ntagen.experiment.reading import read_experiment
from tests.unit.experiment.files import QUICK, written

ROW = '[[row]]\nscenario = "small_mid_cr.nsl"\nseeds = 2\n'


def check_mistake(tmp_path: Path, text: str, *parts: str) -> None:
    with pytest.raises(InputError) as caught:
        read_experiment(written(tmp_path, text))
    said = str(caught.value)
    assert "quick.toml" in said
    for part in parts:
        assert part in said, said


def test_rows_get_what_the_defaults_say_and_override_it(tmp_path: Path) -> None:
    blocked, free = read_experiment(written(tmp_path)).rows
    assert (blocked.id, blocked.known, blocked.needle) == ("blocked", "all", "virtual")
    assert blocked.seeds == (1, 2, 3)
    assert free.seeds == (7, 4)
    assert blocked.values == {"needle.noise_mm": 0.1}
    assert free.values == {"needle.noise_mm": 0.1, "initial_push_mm": 4.0}


def test_lists_make_a_row_for_each_combination(tmp_path: Path) -> None:
    text = (
        '[[row]]\nid = "x"\nscenario = "small_mid_cr.nsl"\nknown = ["all", "none", "C1"]\n'
        'noise = [0.1, "1 mm"]\nroll_error = "2 deg"\nseeds = "5..6"\n'
    )
    rows = read_experiment(written(tmp_path, text)).rows
    assert [row.id for row in rows] == [
        f"x-{known}-noise_{noise}mm" for known in ("all", "none", "C1") for noise in ("0.1", "1")
    ]
    assert rows[0].seeds == (5, 6)
    assert rows[0].values["needle.roll_rad"] == pytest.approx(math.radians(2.0))
    assert len({row.digest for row in rows}) == 6


def test_a_row_without_a_name_has_that_of_its_scene(tmp_path: Path) -> None:
    text = '[[row]]\nscenario = ["no_cr.nsl", "tunnel_crs.nsl"]\nknown = ["all", "none"]\nseeds = 1'
    rows = read_experiment(written(tmp_path, text)).rows
    names = ["no_cr-all", "no_cr-none", "tunnel_crs-all", "tunnel_crs-none"]
    assert [row.id for row in rows] == names


@pytest.mark.parametrize(
    ("seeds", "runs", "expected"),
    [
        ("3", None, (1, 2, 3)),
        ("3", 5, (1, 2, 3, 4, 5)),
        ('"101..150"', 2, (101, 102)),
        ("[9, 2, 5]", 2, (9, 2)),
        ('"0..0"', None, (0,)),
    ],
)
def test_seeds(tmp_path: Path, seeds: str, runs: int | None, expected: tuple[int, ...]) -> None:
    file = written(tmp_path, f'[[row]]\nscenario = "no_cr.nsl"\nseeds = {seeds}\n')
    assert read_experiment(file, runs).rows[0].seeds == expected


def test_the_digest_tells_rows_and_scenes_apart_but_not_seeds_or_comments(tmp_path: Path) -> None:
    file = written(tmp_path)
    digest = read_experiment(file).digest
    assert read_experiment(file, 1).rows[0].digest == read_experiment(file).rows[0].digest
    file.write_text("# a comment\n" + QUICK, "utf-8")
    assert read_experiment(file).digest == digest
    scene = tmp_path / "no_cr.nsl"
    scene.write_text(scene.read_text("utf-8") + "// a comment\n", "utf-8")
    assert read_experiment(file).digest == digest
    scene.write_text(scene.read_text("utf-8").replace("-50", "-51"), "utf-8")
    assert read_experiment(file).digest != digest


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("x = ", ("hint: the file is written in TOML",)),
        ('name = "x"', ("there is no row", "[[row]]")),
        ('nam = "x"\n' + ROW, ("toml:1", "unknown key `nam`", "did you mean `name`?")),
        (ROW + 'sceanrio = "x"\n', (":4: row 1", "`sceanrio`", "did you mean `scenario`?")),
        ("[defaults]\nnoize = 1\n" + ROW, (":2:", "did you mean `noise`?")),
        (ROW + 'known = "C9"\n', ("row 1: `known`", "C9", "choose from all, none, C1")),
        (ROW + 'needle = "virtul"\n', ("no simulated needle 'virtul'", "did you mean 'virtual'?")),
        (ROW + 'needle = "grbl:/dev/x"\n', ("no simulated needle", "hint: choose from virtual")),
        (ROW + "noise = -1\n", (":4: row 1: `noise`", "at least 0 mm")),
        (ROW + 'noise = "1 deg"\n', ("`noise`", "is not a length", "1 deg")),
        (ROW + "noise = nan\n", ("`noise`", "nan")),
        (ROW + 'drive = { "initial psh" = 4 }\n', ("drive.initial psh", "`initial push`")),
        (ROW + "drive = { seed = 4 }\n", ("unknown key `drive.seed`",)),
        (ROW + "drive = 4\n", ("4 is no table",)),
        (ROW + "drive = { pull = 1, push = 2 }\n", ("`pull` (1 mm)", "must be greater")),
        (ROW.replace("2", "0"), ("`seeds`", "0 is not 1 to 1,000,000 seeds")),
        (ROW.replace("2", "10" * 9), ("`seeds`", "is not 1 to 1,000,000 seeds")),
        (ROW.replace("2", "-3"), ("`seeds`", "-3 is not 1 to")),
        (ROW.replace("2", "[]"), ("`seeds`", "there are no seeds")),
        (ROW.replace("2", "[1, -1]"), ("`seeds`", "each 0 or more")),
        (ROW.replace("2", "[1, 1]"), ("a seed stands there twice",)),
        (ROW.replace("2", "2.5"), ("2.5 is no number of runs",)),
        (ROW.replace("2", "true"), ("True is no number of runs",)),
        (ROW.replace("seeds = 2", ""), ("`seeds`: there are no seeds", "write seeds = 50")),
        (ROW.replace("small_mid", "smal_mid"), ("no file", "did you mean 'small_mid_cr.nsl'?")),
        ("[[row]]\nseeds = 1\n", ("`scenario`: it is missing",)),
        (ROW + ROW, ("two rows have the name small_mid_cr",)),
        (ROW + 'id = "a/b"\n', ("`id`", "cannot be a part of a file's name")),
        (ROW + 'paper = "Small"\n', ("'Small' is no line of it", "Small/None")),
        (ROW + 'paper = "Small/All"\nknown = ["all", "none"]\n', ("it stands for several rows",)),
        ("row = 3", ("there is no row",)),
        ("row = [3]", ("3 is no table",)),
    ],
)
def test_mistakes(tmp_path: Path, text: str, parts: tuple[str, ...]) -> None:
    check_mistake(tmp_path, text, *parts)


def test_all_mistakes_are_told_at_once(tmp_path: Path) -> None:
    text = "[defaults]\nseds = 3\n" + ROW + "noise = -1\n" + ROW + 'knwon = "all"\n'
    check_mistake(tmp_path, text, ":2: unknown key `seds`", ":6: row 1", ":10: row 2")


def test_more_runs_than_listed_seeds_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the list has 2 seeds, and 3 are wanted"):
        read_experiment(written(tmp_path), 3)


def test_mistakes_of_a_scene_are_told(tmp_path: Path) -> None:
    file = written(tmp_path, '[[row]]\nscenario = "wrong.nsl"\nseeds = 1\n')
    (tmp_path / "wrong.nsl").write_text("environment X {", "utf-8")
    with pytest.raises(InputError, match=r"the scene has mistakes(.|\n)*wrong\.nsl:1"):
        read_experiment(file)


def test_a_tissue_that_answers_is_refused(tmp_path: Path) -> None:
    file = written(tmp_path, '[[row]]\nscenario = "no_cr.nsl"\nseeds = 1\n')
    scene = tmp_path / "no_cr.nsl"
    text = scene.read_text("utf-8").replace(
        "target T1", "tissue adversarial curvature 10 %  roll 5 deg  tip 0.5 mm\n  target T1"
    )
    scene.write_text(text, "utf-8")
    with pytest.raises(InputError, match=r"the tissue of no_cr\.nsl answers"):
        read_experiment(file)
