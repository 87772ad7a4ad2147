"""`ntagen calibrate`: what it prints, writes and refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ntagen.cli import main
from ntagen.tracking.transform_file import read_transform

ROOT = Path(__file__).parents[3]
PLACES = [(0, 0, 0), (80, 0, 0), (0, 60, 0), (0, 0, 40), (80, 60, 5), (70, 10, 45)]
NOISE = [(0.3, -0.1, 0), (0, 0.2, 0.1), (-0.2, 0, 0.2), (0.1, 0.1, -0.3), (0, -0.2, 0), (0, 0, 0.1)]


def scene_of(place: tuple[float, ...]) -> tuple[float, float, float]:
    """A quarter turn about z, and a shift."""
    x, y, z = place
    return (10.0 - y, 20.0 + x, -30.0 + z)


def table(columns: str, points: list[tuple[float, ...]]) -> str:
    lines = [f"P{i},{','.join(map(str, point))}" for i, point in enumerate(points)]
    return "\n".join([f"name,{columns}", *lines]) + "\n"


@pytest.fixture
def both(tmp_path: Path) -> Path:
    path = tmp_path / "points.csv"
    columns = ",".join(f"{frame}_{axis}_mm" for frame in ("tracker", "scene") for axis in "xyz")
    pairs = [
        (*place, *(a + b for a, b in zip(scene_of(place), noise, strict=True)))
        for place, noise in zip(PLACES, NOISE, strict=True)
    ]
    path.write_text(table(columns, pairs))
    return path


def test_a_table_is_printed_and_a_file_is_written(
    both: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "r.json"
    scene = str(ROOT / "examples" / "paper.nsl")
    assert main(["calibrate", str(both), "--at", scene, "--at", "1,2,3", "-o", str(output)]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    lines = said.out.splitlines()
    assert lines[0] == "6 pairs of points, from tracker to scene"
    assert lines[2].split()[0] == "P0"
    assert [line.split("  ")[1] for line in lines if line.startswith("  ")] == [
        "centre of the points",
        "1, 2, 3",
        "T1",
        "C1",
    ]
    assert lines[-1] == f"wrote {output}"
    assert read_transform(output).point((80.0, 0.0, 0.0)) == pytest.approx(
        scene_of((80.0, 0.0, 0.0)), abs=0.5
    )


def test_json_is_one_object_with_the_same_numbers(
    both: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["calibrate", str(both), "--json", "--at", "0,0,0"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["from"] == "tracker"
    assert 0.1 < document["fre_mm"] < document["fle_mm"] < 0.5
    assert [one["at"] for one in document["tre"]] == ["centre of the points", "0, 0, 0"]
    assert document["tre"][0]["tre_mm"] < document["tre"][1]["tre_mm"]
    assert document["warnings"] == []


def test_two_files_in_different_frames(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    measured, image, output = (tmp_path / name for name in ("m.csv", "i.fcsv", "r.json"))
    measured.write_text(table("x_cm,y_cm,z_cm", [tuple(x / 10 for x in p) for p in PLACES]))
    rows = [
        f"{i},{x},{y},{z},0,0,0,1,1,1,0,P{i},,\n"
        for i, (x, y, z) in enumerate(map(scene_of, PLACES))
    ]
    image.write_text("# CoordinateSystem = 0\n" + "".join(rows))
    arguments = ["calibrate", str(measured), str(image), "--frame", "bench", "--to", "LPS"]
    assert main([*arguments, "-o", str(output)]) == 0
    assert "from bench to LPS" in capsys.readouterr().out
    x, y, z = scene_of((80.0, 60.0, 5.0))
    assert read_transform(output).point((80.0, 60.0, 5.0)) == pytest.approx((-x, -y, z))


def test_doubtful_sets_are_warned_about(
    both: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    lines = both.read_text().splitlines()
    flat = tmp_path / "flat.csv"
    flat.write_text("\n".join(lines[:4]) + "\n")
    assert main(["calibrate", str(flat)]) == 0
    said = capsys.readouterr()
    assert "warning: three points fit almost always" in said.err
    assert "warning: the points are in a plane" in said.err
    assert said.out.count(" -\n") == 3
    cells = lines[5].split(",")
    cells[-1] = str(float(cells[-1]) + 6.0)
    bad = tmp_path / "bad.csv"
    bad.write_text("\n".join([*lines[:5], ",".join(cells), *lines[6:]]) + "\n")
    assert main(["calibrate", str(bad)]) == 0
    assert "warning: P4 does not fit the others" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        (["--frame", "RAS"], "--frame RAS is too much"),
        (["--to", "LPS"], "nothing says how LPS lies in it"),
        (["--at", "1,2"], "'1,2' is not a position"),
        (["--at", "1,2,nan"], "'1,2,nan' is not a position"),
        (["--at", "none.nsl"], "none.nsl"),
    ],
)
def test_wrong_options_are_refused(
    both: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], match: str
) -> None:
    assert main(["calibrate", str(both), *arguments]) == 2
    said = capsys.readouterr()
    assert match in said.err
    assert said.out == ""


def test_the_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    examples = ROOT / "examples"
    arguments = [str(examples / "calibration.csv"), "--at", str(examples / "paper.nsl")]
    assert main(["calibrate", *arguments, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["warnings"] == []
    assert all(one["tre_mm"] < 1.0 for one in document["tre"])


def test_one_set_alone_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "p.csv"
    path.write_text(table("a_x_mm,a_y_mm,a_z_mm", PLACES))
    assert main(["calibrate", str(path)]) == 2
    assert "there are 1 sets of points, and two are needed" in capsys.readouterr().err


def test_the_points_are_not_replaced_by_the_result(
    both: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = both.read_text()
    assert main(["calibrate", str(both), "-o", str(both)]) == 2
    assert "would replace the file of points" in capsys.readouterr().err
    assert both.read_text() == before
