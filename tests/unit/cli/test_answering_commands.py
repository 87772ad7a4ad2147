"""The commands drive, check, plot and replay in a tissue that answers."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ntagen.cli import main
from ntagen.drive.reading import read_log
from ntagen.drive.records import Followed

EXAMPLE = Path(__file__).parents[3] / "examples" / "answering" / "answering.nsl"

TASK = """environment small {
  needle { radius 30 mm  speed 1 mm/s  length 45 mm }
  motion { step 5 s  roll by 90, 180, 270 deg  at most 1 times }
  target T  sphere (0, -36, -3) mm  radius 7 mm
  critical C  sphere (0, -22, 4) mm  radius 3 mm
  tissue adversarial  curvature 5 %  roll 2 deg  tip 0.2 mm
  resolution 100000 per mm
  safety swept
}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a task, and its strategy."""
    path = tmp_path_factory.mktemp("answering")
    (path / "task.nsl").write_text(TASK)
    arguments = ["check", str(path / "task.nsl"), "--query", "ReachFinalTR"]
    assert main([*arguments, "--plans", str(path / "tree.json")]) == 0
    return path


def check_refused(capsys: pytest.CaptureFixture[str], says: str, *arguments: str) -> None:
    assert main(["drive", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert says in err
    assert "hint:" in err or "strategy" in err
    assert "Traceback" not in err


@pytest.mark.slow
def test_drive_follows_a_strategy_and_says_what_held(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    task, tree, log = str(folder / "task.nsl"), str(folder / "tree.json"), tmp_path / "run.mcap"
    arguments = ["drive", task, "--strategy", tree, "--seed", "3", "--log", str(log)]
    assert main(arguments) == 0
    told = capsys.readouterr().out
    assert "the needle bends" in told
    assert "so: stop in the target" in told
    assert "the guarantee held up to the target" in told
    assert main(["replay", str(log)]) == 0
    assert main(["plot", str(log), "-o", str(tmp_path / "run.png")]) == 0
    run = read_log(log)
    assert [record for record in run.records if isinstance(record, Followed)]
    capsys.readouterr()
    assert main([*arguments, "--json"]) == 0
    kept = json.loads(capsys.readouterr().out)["guarantee"]
    assert (kept["by"], kept["held"], kept["reason"]) == ("strategy", True, "")
    assert kept["most_off_mm"] < kept["tip_mm"] == 0.2
    assert kept["branches"] > 3


def test_without_a_file_the_strategy_is_found_first(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["drive", str(folder / "task.nsl"), "--tissue", "worst", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["guarantee"]["held"] is True
    assert main(["drive", str(folder / "task.nsl"), "--strategy", "none", "--json"]) == 0
    kept = json.loads(capsys.readouterr().out)["guarantee"]
    assert (kept["by"], kept["held"], kept["branches"]) == ("plans", False, None)


def test_a_run_may_be_ended_with_its_guarantee(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    task, tree = str(folder / "task.nsl"), str(folder / "tree.json")
    arguments = ["drive", task, "--strategy", tree, "--set", "true radius 24 mm", "--quiet"]
    assert main([*arguments, "--only-guaranteed"]) == 4
    assert capsys.readouterr().out.startswith("no longer guaranteed: the tip is")


@pytest.mark.parametrize(
    ("entry", "value", "says"),
    [
        ("scene_sha256", "0" * 64, "another task"),
        ("format", "ntagen-plans", "another format"),
        ("version", 1, "reads only version"),
        ("tree", {"roll_rad": 0.0, "branches": [1]}, "no strategy against a tissue"),
        ("tree", {"roll_rad": 0.0, "branches": []}, "does not answer all"),
    ],
)
def test_a_file_that_does_not_fit_is_refused(
    folder: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    entry: str,
    value: object,
    says: str,
) -> None:
    document = json.loads((folder / "tree.json").read_text()) | {entry: value}
    path = tmp_path / "tree.json"
    path.write_text(json.dumps(document))
    check_refused(capsys, says, str(folder / "task.nsl"), "--strategy", str(path))


def test_a_strategy_that_does_not_hold_is_refused(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    document = json.loads((folder / "tree.json").read_text())
    branch = document["tree"]["branches"][0]
    while branch["then"] is not None:
        branch = branch["then"]["branches"][0]
    branch["length_mm"] -= 10.0
    path = tmp_path / "tree.json"
    path.write_text(json.dumps(document))
    task = str(folder / "task.nsl")
    check_refused(capsys, "does not hold in this task", task, "--strategy", str(path))
    missing = str(tmp_path / "none.json")
    check_refused(capsys, "cannot read", task, "--strategy", missing)


def test_options_that_contradict_each_other_are_refused(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    task = str(folder / "task.nsl")
    check_refused(capsys, "no guarantee", task, "--strategy", "none", "--only-guaranteed")
    check_refused(capsys, "nothing is the worst", task, "--strategy", "none", "--tissue", "worst")
    other = folder / "other.nsl"
    other.write_text(TASK.replace("radius 7 mm", "radius 7.5 mm"))
    tree = str(folder / "tree.json")
    check_refused(capsys, "`ntagen check TASK", str(other), "--strategy", tree)


def test_without_a_strategy_the_driver_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "task.nsl"
    path.write_text(TASK.replace("radius 7 mm", "radius 1 mm").replace("5 %", "20 %"))
    assert main(["drive", str(path), "--only-guaranteed", "--json"]) == 1
    ended = json.loads(capsys.readouterr().out)
    assert ended["depth_mm"] == 0.0
    assert ended["guarantee"]["reason"] == "no strategy wins whatever the tissue picks"


def test_static_tissue_has_no_such_options(capsys: pytest.CaptureFixture[str]) -> None:
    paper = str(EXAMPLE.parents[1] / "paper.nsl")
    assert main(["drive", paper, "--tissue", "corners", "--settings"]) == 0
    assert "--tissue has no effect in a tissue that is static" in capsys.readouterr().err


def test_plot_draws_all_branches(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    task, tree, path = str(folder / "task.nsl"), str(folder / "tree.json"), tmp_path / "task.svg"
    assert main(["plot", task, "--strategy", tree, "-o", str(path)]) == 0
    drawn = path.read_text()
    assert drawn.count("<path") > 3 * 27
    assert capsys.readouterr().out == f"wrote {path}\n"


@pytest.mark.slow
def test_the_example_is_driven_with_its_guarantee(capsys: pytest.CaptureFixture[str]) -> None:
    for tissue in ("corners", "worst"):
        assert main(["drive", str(EXAMPLE), "--tissue", tissue, "--only-guaranteed", "--json"]) == 0
        ended = json.loads(capsys.readouterr().out)
        assert ended["guarantee"]["held"] is True
        assert ended["true_target_distance_mm"] <= -0.5
        assert ended["true_clearance_mm"] >= 0.5
