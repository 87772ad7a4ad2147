"""The command report: files, exit codes, messages."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ntagen.cli import main

PAPER = Path(__file__).parents[3] / "examples" / "paper.nsl"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    assert main(["drive", str(PAPER), "--quiet", "--log", str(path)]) == 0
    return path


def test_a_report_has_the_name_of_its_log(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["report", str(run)]) == 0
    assert capsys.readouterr().out == "wrote run.html\n"
    page = (tmp_path / "run.html").read_text("utf-8")
    assert page.startswith("<!DOCTYPE html>")
    assert page.rstrip().endswith("</html>")
    assert [one.name for one in tmp_path.iterdir()] == ["run.html"]


def test_the_facts_go_to_the_output_or_a_file(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["report", str(run), "--json"]) == 0
    out, err = capsys.readouterr()
    assert (out.count("\n"), err) == (1, "")
    path = tmp_path / "new" / "facts.json"
    assert main(["report", str(run), "--json", "-o", str(path)]) == 0
    assert capsys.readouterr().out == f"wrote {path}\n"
    assert json.loads(path.read_text()) == json.loads(out)
    assert json.loads(out)["end"]["outcome"] == "target reached"


def test_an_unchanged_log_is_verified(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "run.html"
    assert main(["report", str(run), "--verify", "-o", str(path)]) == 0
    assert capsys.readouterr().out == f"7 of 7 checks hold\nwrote {path}\n"
    page = path.read_text("utf-8")
    assert "all that was checked holds" in page
    assert "strategy verified" in page


def test_a_changed_log_is_reported_with_exit_code_1(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = run.read_bytes()
    assert b'"push_mm": 16.0' in data
    log, path = tmp_path / "changed.mcap", tmp_path / "changed.html"
    log.write_bytes(data.replace(b'"push_mm": 16.0', b'"push_mm": 15.0', 1))
    assert main(["report", str(log), "--verify", "-o", str(path)]) == 1
    out = capsys.readouterr().out
    assert "synthesis 1: plans: does not hold: " in out
    assert "6 of 7 checks hold" in out
    assert "Not all of this run holds" in path.read_text("utf-8")
    assert main(["report", str(log), "--verify", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["holds"] is False


def test_a_torn_log_is_reported(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = run.read_bytes()
    log, path = tmp_path / "torn.mcap", tmp_path / "torn.html"
    log.write_bytes(data[: len(data) // 2])
    assert main(["report", str(log), "-o", str(path)]) == 0
    assert "the log is cut off: it can be read up to byte " in capsys.readouterr().out
    assert "The log is cut off" in path.read_text("utf-8")


@pytest.mark.slow
def test_many_regions_have_a_row_each(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = [f"V{number}" for number in range(38)]
    rows = [
        f"critical {name} sphere ({18 + index % 5}, {-8 - index}, {9 - index % 19}) mm radius 1 mm"
        for index, name in enumerate(names)
    ]
    task, log, path = tmp_path / "many.nsl", tmp_path / "many.mcap", tmp_path / "many.html"
    text = PAPER.read_text().replace("resolution 1000 per mm", "").rstrip().removesuffix("}")
    task.write_text("\n".join([text, *rows, "}"]))
    assert main(["drive", str(task), "--quiet", "--log", str(log)]) == 0
    assert main(["report", str(log), "-o", str(path)]) == 0
    page = path.read_text("utf-8")
    for name in names:
        assert page.count(f"<td>{name}</td>") == 2  # its margin, and its bounds
    capsys.readouterr()


@pytest.mark.parametrize(
    ("says", "arguments"),
    [
        ("cannot read nowhere.mcap", ["nowhere.mcap"]),
        ("not the log of a run", [str(PAPER)]),
        ("would replace the log", ["RUN", "-o", "RUN"]),
    ],
)
def test_what_is_no_log_is_refused(
    run: Path, capsys: pytest.CaptureFixture[str], says: str, arguments: list[str]
) -> None:
    given = [str(run) if one == "RUN" else one for one in arguments]
    assert main(["report", *given]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert says in err


def test_a_log_of_another_version_is_refused(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old, new = b"format_version\x01\x00\x00\x001", b"format_version\x01\x00\x00\x009"
    data = run.read_bytes()
    assert old in data
    log = tmp_path / "later.mcap"
    log.write_bytes(data.replace(old, new))
    assert main(["report", str(log), "-o", str(tmp_path / "later.html")]) == 2
    assert "this log has version 9" in capsys.readouterr().err
    assert [one.name for one in tmp_path.iterdir()] == ["later.mcap"]
