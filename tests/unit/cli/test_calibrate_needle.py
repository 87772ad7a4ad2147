"""`ntagen calibrate needle`: the recipe, what is found, what is written, and what is refused."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ntagen import nsl
from ntagen.cli import main
from ntagen.drive.reading import read_log
from ntagen.drive.records import Command
from ntagen.errors import InputError
from ntagen.needle.kinematics import push, roll
from ntagen.scene import Needle
from ntagen.tracking.frames import IDENTITY
from ntagen.tracking.insertions import read_insertions

EXAMPLES = Path(__file__).parents[3] / "examples"
TASK = EXAMPLES / "needles" / "bent_tip.nsl"
TABLE = EXAMPLES / "tracker" / "insertions.csv"

Row = list[str]
Rows = list[Row]


def rows() -> Rows:
    """The rows of the example, its head first."""
    with TABLE.open() as file:
        return list(csv.reader(file))


def written(path: Path, table: Rows) -> str:
    path.write_text("\n".join(",".join(row) for row in table) + "\n")
    return str(path)


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(["calibrate", "needle", *arguments]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert "hint:" in said.err
    return said.err


def test_the_recipe_has_five_insertions_that_the_needle_can_make(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["calibrate", "needle", str(TASK)]) == 0
    said = capsys.readouterr().out
    assert "five insertions, each 100 mm deep" in said
    assert "roll the base by -180 deg at 70 mm" in said
    assert main(["calibrate", "needle", str(TASK), "--json"]) == 0
    recipe = json.loads(capsys.readouterr().out)["insertions"]
    assert [one["roll_deg"] for one in recipe] == [0, 180, -180, 90, -90]
    assert {one["depth_mm"] for one in recipe} == {100.0}


def test_the_values_are_those_of_the_phantom(capsys: pytest.CaptureFixture[str]) -> None:
    """The example was made with a radius of 64 mm, a bevel of 6 deg, and a lag of 40 deg."""
    assert main(["calibrate", "needle", str(TASK), str(TABLE), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    for name, unit, true in (("radius", "mm", 64.0), ("bevel", "deg", 6.0), ("lag", "deg", 40.0)):
        assert found[f"{name}_{unit}"] == pytest.approx(true, abs=2.0 * found[f"{name}_std_{unit}"])
    assert found["noise_mm"] == pytest.approx(0.08, rel=0.1)
    assert len(found["insertions"]) == 5
    assert found["insertions"][0]["lag_deg"] is None
    assert all(one["left_out_mm"] > one["residual_mm"] for one in found["insertions"])
    assert found["suspect"] is None


def exact(path: Path, needle: Needle, lag_deg: float) -> str:
    """Insertions of a needle whose tissue does nothing, computed by kinematics alone."""
    table: Rows = [["insertion", "depth_mm", "roll_deg", "x_mm", "y_mm", "z_mm"]]
    generator = np.random.default_rng(1)
    for number, angle_deg in enumerate((0, 180, -180, 90, -90), start=1):
        pose, roll_deg = needle.tip, 0
        for depth_mm in range(1, 101):
            # The tissue bends the needle more on the first 10 mm, and that is known.
            radius_mm = needle.radius_mm / (1.16 if depth_mm <= 10 else 1.0)
            pose = push(pose, radius_mm, 1.0)
            place = np.array(pose.position_mm) + generator.normal(0.0, 0.02, 3)
            table.append(
                [str(number), str(depth_mm), str(roll_deg), *(f"{one:.4f}" for one in place)]
            )
            if depth_mm == 70 and angle_deg:
                roll_deg = angle_deg
                short_deg = math.copysign(lag_deg * 0.49, angle_deg)
                pose = roll(pose, math.radians(angle_deg - short_deg))
    return written(path, table)


def test_a_needle_in_even_tissue_is_found_exactly(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    needle = nsl.load(TASK).needle
    true = Needle(roll(needle.tip, math.radians(-9.0)), 81.0, 1.0, 120.0)
    table = exact(tmp_path / "exact.csv", true, 30.0)
    assert main(["calibrate", "needle", str(TASK), table, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["radius_mm"] == pytest.approx(81.0, rel=3e-3)
    assert found["bevel_deg"] == pytest.approx(-9.0, abs=0.3)
    assert found["lag_deg"] == pytest.approx(30.0, abs=1.0)


def test_what_is_found_is_written_and_all_else_stays(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    task = tmp_path / "task.nsl"
    before = TASK.read_text().replace("\n", "\r\n").encode()
    task.write_bytes(before)
    assert main(["calibrate", "needle", str(task), str(TABLE), "--into", str(task)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == f"wrote {task}"
    after = task.read_bytes()
    block = b"\r\n\r\n  drive {\r\n    lag compensation 40.5 deg\r\n  }"
    assert after.count(block) == 1
    back = after.replace(block, b"").replace(b"radius 65.65 mm", b"radius 70 mm")
    assert back.replace(b"bevel (-0.080012, 0, 0.996794)", b"bevel +z") == before
    changed = nsl.load_task(task)
    assert changed.scene.needle.radius_mm == 65.65
    (lag,) = changed.given
    assert (lag.parameter.words, lag.value) == ("lag compensation", math.radians(40.5))
    # The same insertions find no other needle from there.
    assert main(["calibrate", "needle", str(task), str(TABLE), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["bevel_deg"] == pytest.approx(0.0, abs=0.1)
    assert found["radius_mm"] == pytest.approx(65.65, abs=0.01)


def test_each_insertion_can_have_a_file_of_its_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    head, *all_rows = rows()
    files = [
        written(
            tmp_path / f"{number}.csv", [head[1:], *(r[1:] for r in all_rows if r[0] == number)]
        )
        for number in "12345"
    ]
    results = []
    for sources in ([str(TABLE)], files):
        assert main(["calibrate", "needle", str(TASK), *sources, "--json"]) == 0
        results.append(json.loads(capsys.readouterr().out))
    assert results[0]["radius_mm"] == results[1]["radius_mm"]
    assert results[1]["insertions"][4]["name"] == files[4]
    assert "5.csv is given twice" in refused(capsys, str(TASK), *files, files[4])


def test_the_log_of_a_run_is_an_insertion(tmp_path: Path) -> None:
    log = tmp_path / "run.mcap"
    words = ["drive", str(EXAMPLES / "paper.nsl"), "--needle", "phantom", "--seed", "1"]
    assert main([*words, "--set", "guarantee off", "--quiet", "--log", str(log)]) == 0
    (found,) = read_insertions(log, None)
    assert math.degrees(found.compensated_rad) == pytest.approx(45.0)
    assert len(found.places_mm) > 100
    assert found.depths_mm == sorted(found.depths_mm)
    commands = [one for one in read_log(log).records if isinstance(one, Command)]
    pushed_mm = sum(one.value for one in commands if one.kind == "push")
    assert found.depth_mm == pytest.approx(pushed_mm)
    assert [one.angle_rad for one in found.turns] == [
        one.value for one in commands if one.kind == "roll"
    ]
    with pytest.raises(InputError, match="in the scene's frame already"):
        read_insertions(log, IDENTITY)


def only(*numbers: str) -> Callable[[Rows], Rows]:
    return lambda table: [table[0], *(row for row in table[1:] if row[0] in numbers)]


def upto(depth_mm: float) -> Callable[[Rows], Rows]:
    return lambda table: [table[0], *(row for row in table[1:] if float(row[1]) <= depth_mm)]


def with_cells(change: Callable[[Row], Row]) -> Callable[[Rows], Rows]:
    return lambda table: [table[0], *(change(list(row)) for row in table[1:])]


def without_rolls(row: Row) -> Row:
    row[2] = "0"
    return row


def one_direction(row: Row) -> Row:
    row[2] = str(abs(int(row[2])))
    return row


def small_rolls(row: Row) -> Row:
    row[2] = str(int(row[2]) // 10)
    return row


def in_metres(row: Row) -> Row:
    row[1] = str(float(row[1]) / 1000.0)
    return row


def reversed_way(row: Row) -> Row:
    row[4] = str(-float(row[4]))
    return row


def far_away(row: Row) -> Row:
    row[3] = str(float(row[3]) + 40.0)
    return row


def noisy(table: Rows) -> Rows:
    generator = np.random.default_rng(1)
    head, *rest = table
    return [
        head,
        *(
            [*row[:3], *(f"{float(one) + generator.normal(0.0, 1.5):.2f}" for one in row[3:])]
            for row in rest
        ),
    ]


def thinned(table: Rows) -> Rows:
    return [table[0], *(row for row in table[1:] if float(row[1]) % 10 == 0)]


def named(table: Rows) -> Rows:
    return [["insertion", "depth_mm", "angle_deg", "x_mm", "y_mm", "z_mm"], *table[1:]]


def without_name(table: Rows) -> Rows:
    return [row[1:] for row in table]


def with_a_gap(table: Rows) -> Rows:
    table[50][4] = "nan"
    return table


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (only("1", "2", "3", "4"), "there are 4 insertions, and 5 to 100 are needed"),
        (upto(25.0), "insertion 1: the insertion is 25.0 mm deep, and 30 mm is the least"),
        (thinned, "insertion 1: there are 10 positions, and 20 are the least"),
        (with_cells(without_rolls), "in none of the insertions the needle is rolled"),
        (upto(75.0), "no roll shows its lag: the deepest one, by 180 deg, is at 70.0 mm of 75.0"),
        (with_cells(small_rolls), "no roll shows its lag: the deepest one, by 18 deg"),
        (with_cells(one_direction), "all rolls are in one direction (positive)"),
        (noisy, "have a noise of 1."),
        (with_cells(in_metres), "the insertion is 0.1 mm deep"),
        (with_cells(reversed_way), "the needle goes against its heading"),
        (with_cells(far_away), "the first position is 40."),
        (without_name, ":102: the needle was pulled back here, from 100 mm to 1 mm"),
        (named, "there is no column roll_deg"),
        (with_a_gap, ":51: 'nan' is not a number"),
    ],
)
def test_poor_insertions_are_refused_with_a_way_out(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    change: Callable[[Rows], Rows],
    message: str,
) -> None:
    assert message in refused(capsys, str(TASK), written(tmp_path / "poor.csv", change(rows())))


def test_a_needle_that_hardly_bends_does_not_show_its_lag(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    needle = replace(nsl.load(TASK).needle, radius_mm=2500.0)
    said = refused(capsys, str(TASK), exact(tmp_path / "straight.csv", needle, 30.0))
    assert "is known to" in said
    assert "only (one standard deviation)" in said


def test_options_without_insertions_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = refused(capsys, str(TASK), "--into", str(tmp_path / "task.nsl"))
    assert "is for insertions, and there are none" in said


def test_an_insertion_of_another_needle_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def other(row: Row) -> Row:
        if row[0] == "1":
            # A straight needle.
            row[3:] = ["0", f"-{row[1]}", "0"]
        return row

    said = refused(capsys, str(TASK), written(tmp_path / "other.csv", with_cells(other)(rows())))
    assert "insertion 1 does not fit the others; make it again" in said


def test_a_file_without_the_needle_is_not_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "let.nsl"
    other.write_text("let a = 1 mm\n")
    said = refused(capsys, str(TASK), str(TABLE), "--into", str(other))
    assert "there is no needle { … } in this file" in said
    assert other.read_text() == "let a = 1 mm\n"


def test_the_shell_offers_the_other_calibrations(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def offered(words: str) -> list[str]:
        monkeypatch.setenv("_NTAGEN_COMPLETE", "bash_complete")
        monkeypatch.setenv("COMP_WORDS", words)
        monkeypatch.setenv("COMP_CWORD", str(len(words.split(" ")) - 1))
        assert main([]) == 0
        return capsys.readouterr().out.splitlines()

    assert offered("ntagen calibrate ") == [
        "file,",
        "plain,pivot",
        "plain,hand-eye",
        "plain,needle",
    ]
    assert offered("ntagen calibrate h") == ["file,h", "plain,hand-eye"]
    assert offered("ntagen calibrate task") == ["file,task"]
    assert "plain,--into" in offered("ntagen calibrate needle --")
