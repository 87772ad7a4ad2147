"""`ntagen calibrate pivot` and `hand-eye`: what they print, write and refuse, and what stays."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ntagen.cli import main
from ntagen.tracking.transform_file import read_transform

EXAMPLES = Path(__file__).parents[3] / "examples"
PIVOT = str(EXAMPLES / "tracker" / "pivot.csv")
STAGE = str(EXAMPLES / "tracker" / "stage.csv")
SENSOR = str(EXAMPLES / "tracker" / "sensor.csv")


def test_the_tip_is_printed_as_the_tracker_takes_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "pivot", PIVOT]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    lines = said.out.splitlines()
    assert lines[0] == "40 poses in the frame tracker"
    assert lines[-1].endswith("tip=1.63/-0.91/141.90")


def test_the_tip_as_json_is_within_its_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "pivot", PIVOT, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["tip_mm"] == pytest.approx([1.5, -0.8, 142.0], abs=2.0 * found["tip_error_mm"])
    assert found["divot_mm"] == pytest.approx([40, -25, -900], abs=2.0 * found["tip_error_mm"])
    assert found["rms_mm"] < found["left_out_rms_mm"] < found["max_mm"] < 1.0
    assert found["max_mm"] == max(pose["residual_mm"] for pose in found["poses"])
    assert len(found["poses"]) == 40


def test_the_registration_of_a_stage_is_one_that_drive_reads(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "registration.json"
    assert main(["calibrate", "hand-eye", STAGE, SENSOR, "-o", str(output)]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    lines = said.out.splitlines()
    assert lines[0] == "14 pairs of poses, from tracker to stage"
    assert lines[2].startswith("P1 ")
    assert lines[-1] == f"wrote {output}"
    transform = read_transform(output)
    assert (transform.source, transform.target) == ("tracker", "stage")
    assert transform.translation_mm == pytest.approx((120, -340, 860), abs=0.5)


def test_the_stage_as_json_is_one_object(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "hand-eye", STAGE, SENSOR, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["format"] == "ntagen-registration"
    assert found["rms_mm"] < found["left_out_rms_mm"] < 0.6
    assert found["rms_deg"] < found["left_out_rms_deg"] < 0.3
    assert found["sensor"]["translation_mm"] == pytest.approx([3, 12, 35], abs=0.5)
    assert len(found["poses"]) == 14
    assert found["warnings"] == []


def test_what_is_not_known_is_null_and_few_poses_are_warned_about(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # Without the last pose, all rotations are about x.
    turns = ["0,0,0,1", "0.2,0,0,0.98", "-0.2,0,0,0.98", "0.1,0,0,0.995", "0,0.3,0,0.954"]
    path = tmp_path / "same.csv"
    rows = [f"{10 * at},{at * at},0,{turn}" for at, turn in enumerate(turns)]
    path.write_text("\n".join(["x_mm,y_mm,z_mm,qx,qy,qz,qw", *rows]) + "\n")
    assert main(["calibrate", "hand-eye", str(path), str(path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["poses"][4]["left_out_mm"] is None
    assert found["left_out_rms_deg"] is None
    assert found["warnings"] == ["there are 5 poses; with 12 or more, errors show better"]
    assert main(["calibrate", "hand-eye", str(path), str(path)]) == 0
    said = capsys.readouterr()
    assert said.out.splitlines()[6].endswith(" -")
    assert "warning: there are 5 poses" in said.err


def test_the_stage_is_not_replaced_by_the_result(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stage = tmp_path / "stage.csv"
    stage.write_text(Path(STAGE).read_text())
    assert main(["calibrate", "hand-eye", str(stage), SENSOR, "-o", str(stage)]) == 2
    assert "would replace the file of the stage" in capsys.readouterr().err
    assert stage.read_text() == Path(STAGE).read_text()


@pytest.mark.parametrize(
    ("words", "match"),
    [
        (["pivot", "none.csv"], "cannot read none.csv: no such file"),
        (["pivot", STAGE], "the tip did not rest"),
        (["pivot", str(EXAMPLES / "calibration.csv")], "there are positions in 2 frames"),
        (["pivot"], "Missing argument 'POSES.csv'"),
        (["pivot", PIVOT, PIVOT], "Got unexpected extra argument"),
        (["hand-eye", STAGE], "Missing argument 'TRACKER.csv'"),
        (["hand-eye", STAGE, "none.csv"], "cannot read none.csv: no such file"),
        (["hand-eye", STAGE, PIVOT], "stage.csv names its poses, and"),
        (["hand-eye", PIVOT, PIVOT + "2"], "pivot.csv2: no such file"),
    ],
)
def test_what_is_wrong_is_refused(
    words: list[str], match: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["calibrate", *words]) == 2
    said = capsys.readouterr()
    assert match in said.err
    assert said.out == ""


# The registration by points is as it was.


@pytest.mark.parametrize("words", [["--help"], ["-h"]])
def test_the_help_has_both_the_points_and_the_commands(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["calibrate", *words]) == 0
    said = capsys.readouterr().out
    assert said.startswith("Usage: ntagen calibrate [OPTIONS] POINTS [SCENE_POINTS]\n")
    for word in ("--by-order", "--at X,Y,Z|ENV.nsl", "\n  pivot ", "\n  hand-eye "):
        assert word in said
    for name in ("pivot", "hand-eye"):
        assert main(["calibrate", name, *words]) == 0
        said = capsys.readouterr().out
        assert said.startswith(f"Usage: ntagen calibrate {name} [OPTIONS] ")
        assert f"  ntagen calibrate {name} examples/" in said


def test_a_file_of_points_with_the_name_of_a_command_can_be_given(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "pivot"
    folder.mkdir()
    points = (EXAMPLES / "calibration.csv").read_text()
    (folder / "p.csv").write_text(points)
    assert main(["calibrate", "pivot/p.csv"]) == 0
    assert "6 pairs of points" in capsys.readouterr().out
    (tmp_path / "hand-eye").write_text(points)
    assert main(["calibrate", "./hand-eye"]) == 2
    assert "hand-eye: this is no file of points" in capsys.readouterr().err
    assert main(["calibrate", "--json", "hand-eye"]) == 2
    assert "hand-eye: this is no file of points" in capsys.readouterr().err


def test_options_before_the_points_and_former_options_are_known(
    capsys: pytest.CaptureFixture[str],
) -> None:
    points = str(EXAMPLES / "calibration.csv")
    assert main(["calibrate", "--json", points]) == 0
    assert json.loads(capsys.readouterr().out)["from"] == "tracker"
    assert main(["calibrate", points, "--scene", "task.nsl"]) == 2
    assert "write --at task.nsl" in capsys.readouterr().err
    assert main(["calibrate"]) == 2
    assert "Missing argument 'POINTS'" in capsys.readouterr().err
