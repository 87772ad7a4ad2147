"""`ntagen drive --resume`: what it refuses, what it asks, and what its log says."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import click
import pytest

from ntagen.cli import main
from ntagen.drive.log import EARLIER, RESUMES, Log
from ntagen.drive.reading import read_log
from ntagen.drive.records import Answered, Command, Ended, Found, Measured

EXAMPLES = Path(__file__).parents[3] / "examples"
PAPER = str(EXAMPLES / "paper.nsl")
SMALL = str(EXAMPLES / "scenarios" / "small_mid_cr.nsl")
REAL = "grbl:/dev/ttyACM0"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a run that has reached its target."""
    path = tmp_path_factory.mktemp("whole") / "run.mcap"
    assert (
        main(["drive", PAPER, "--noise", "0.1", "--seed", "1", "--quiet", "--log", str(path)]) == 0
    )
    return path


@pytest.fixture
def cut(whole: Path, tmp_path: Path) -> Path:
    """The same, cut off."""
    path = tmp_path / "run.mcap"
    data = whole.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    return path


@pytest.fixture
def answers(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[str]]:
    """A terminal at which somebody gives answers; returns the questions."""

    def given(*says: bool) -> list[str]:
        questions: list[str] = []
        left = list(says)

        def confirm(text: str, **_: object) -> bool:
            questions.append(text)
            return left.pop(0)

        monkeypatch.setattr(sys.stdin, "isatty", lambda: True)
        monkeypatch.setattr(click, "confirm", confirm)
        return questions

    return given


def other(log: Path, path: Path, **metadata: str | None) -> Path:
    """A log with other metadata, and the same records and attachments."""
    run = read_log(log)
    changed = run.metadata | {name: text for name, text in metadata.items() if text is not None}
    for name in ("format_version", *(name for name, text in metadata.items() if text is None)):
        changed.pop(name, None)
    with Log(path, changed, run.attachments) as copy:
        for record in run.records:
            copy.record(record)
    return path


def real(log: Path, path: Path, tracker: str) -> Path:
    """The log of a run with a real needle."""
    return other(log, path, needle=REAL, tracker=tracker, seed=None)


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """The message with which a command line is refused."""
    assert main(["drive", "--resume", *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "Traceback" not in err
    return err


def test_a_run_goes_on_and_its_log_names_the_one_before(
    cut: Path, answers: Callable[..., list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    before = read_log(cut)
    questions = answers(True)
    assert main(["drive", "--resume", str(cut), PAPER]) == 0
    out, err = capsys.readouterr()
    assert "run.mcap was cut off at" in err
    assert out.index("found: ") < out.index("may the needle go on") < out.index("synthesis ")
    assert questions[0].startswith("May the needle go on from ")
    path = cut.with_name("run-resumed.mcap")
    log = read_log(path)
    assert json.loads(log.metadata[RESUMES]) == {"file": "run.mcap", "sha256": before.sha256}
    assert log.attachments[EARLIER] == cut.read_bytes()
    assert log.earlier == before
    kinds = [type(record) for record in log.records]
    answered = kinds.index(Answered)
    assert kinds.index(Found) < answered
    assert Command not in kinds[:answered]
    assert kinds[answered:].index(Measured) < kinds[answered:].index(Command)
    assert main(["replay", str(path)]) == 0
    assert "the same decisions again: all" in capsys.readouterr().out
    assert main(["report", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["log"]["resumes"]["sha256"] == before.sha256


def test_a_resumed_run_is_resumed_and_pulled_back(
    cut: Path, answers: Callable[..., list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    questions = answers(False, False)
    assert main(["drive", "--resume", str(cut), "--json"]) == 130
    out, err = capsys.readouterr()
    assert json.loads(out)["reason"] == "the operator did not agree to go on, nor to pull back"
    assert "found: " in err
    assert len(questions) == 2
    first = cut.with_name("run-resumed.mcap")
    questions = answers(False, True)
    assert main(["drive", "--resume", str(first), "--quiet"]) == 7
    assert "be pulled back along its channel to the entry, by" in questions[1]
    second = cut.with_name("run-resumed-2.mcap")
    ended = next(one for one in read_log(second).records if isinstance(one, Ended))
    assert (ended.outcome, ended.depth_mm) == ("pulled back", pytest.approx(0.0))
    assert not any(
        one.kind in ("push", "roll") for one in read_log(second).records if isinstance(one, Command)
    )
    capsys.readouterr()
    assert main(["replay", str(second)]) == 0
    capsys.readouterr()
    assert "after the needle was pulled out" in refused(capsys, str(second))
    err = refused(capsys, str(cut))
    assert "run-resumed.mcap is the log of a run that went on from this one" in err


def test_a_run_that_has_nothing_to_go_on_with_is_refused(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "has reached its target (the tip is in the last target)" in refused(capsys, str(whole))
    early = tmp_path / "early.mcap"
    early.write_bytes(whole.read_bytes()[:60_000])
    err = refused(capsys, str(early))
    assert "this run ended before the needle was inserted" in err
    assert "hint: begin anew" in err
    assert "not the log of a run: it is no MCAP file" in refused(capsys, PAPER)
    assert "no such file or directory" in refused(capsys, str(tmp_path / "none.mcap"))


def test_another_task_is_refused(cut: Path, capsys: pytest.CaptureFixture[str]) -> None:
    err = refused(capsys, str(cut), SMALL)
    assert "this is the log of another task, 'paper' with the digest" in err
    assert "hint: leave the task out" in err


@pytest.mark.parametrize(
    ("words", "option"),
    [
        (["--seed", "2"], "--seed"),
        (["--set", "accept 0.5"], "--set"),
        (["--known", "none"], "--known"),
        (["--timeout", "20"], "--timeout"),
        (["--strategy", "none"], "--strategy"),
        (["--settings"], "--settings"),
    ],
)
def test_what_would_make_it_another_run_is_refused(
    cut: Path, capsys: pytest.CaptureFixture[str], words: list[str], option: str
) -> None:
    assert f"{option} cannot stand beside --resume" in refused(capsys, str(cut), *words)


def test_nothing_is_replaced(
    cut: Path, answers: Callable[..., list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    questions = answers()
    there = cut.with_name("run-resumed.mcap")
    there.write_text("something else")
    assert "run-resumed.mcap is there already" in refused(capsys, str(cut))
    assert "run.mcap is there already" in refused(capsys, str(cut), "--log", str(cut))
    assert there.read_text() == "something else"
    assert questions == []


def test_nobody_who_could_answer_is_refused(
    cut: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys.stdin, "isatty", lambda: False)
    err = refused(capsys, str(cut))
    assert "a run goes on only if somebody at a terminal agrees, and there is none" in err
    assert not cut.with_name("run-resumed.mcap").exists()


def test_the_log_of_a_run_that_still_drives_is_refused(
    cut: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fcntl = pytest.importorskip("fcntl")
    with cut.open("rb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        assert "is the log of a run that is still driving" in refused(capsys, str(cut))


def test_another_needle_is_refused(
    cut: Path,
    tmp_path: Path,
    answers: Callable[..., list[str]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    err = refused(capsys, str(cut), "--needle", "phantom")
    assert "the log is of a run with --needle virtual, not phantom" in err
    answers(True)
    false = other(cut, tmp_path / "false.mcap", seed="7")
    assert "it is measured elsewhere now" in refused(capsys, str(false))
    assert not tmp_path.joinpath("false-resumed.mcap").exists()
    measured = other(cut, tmp_path / "by.mcap", tracker="openigtlink+sim")
    assert "cannot be brought back" in refused(capsys, str(measured))
    assert "measures itself" in refused(capsys, str(cut), "--tracker", "csv:x.csv")


@pytest.mark.parametrize(
    ("logged", "words", "says"),
    [
        ("openigtlink:a:1:Tip", ["--tracker", "openigtlink:b:2:Other"], "with --tracker openigt"),
        ("openigtlink:a:1:Tip,sends=changes", ["--registration", "none"], "sends changes only"),
        ("openigtlink:a:1:Tip", [], "nothing says where the scene lies"),
        ("openigtlink:a:1:Tip", ["--needle", "virtual"], f"with --needle {REAL}, not virtual"),
    ],
)
def test_another_tracker_or_one_that_cannot_be_trusted_is_refused(
    cut: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    logged: str,
    words: list[str],
    says: str,
) -> None:
    log = real(cut, tmp_path / "real.mcap", logged)
    assert says in refused(capsys, str(log), *words)


def test_a_log_whose_log_before_was_changed_is_refused(
    cut: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    named = json.dumps({"file": "gone.mcap", "sha256": "0" * 64})
    log = other(cut, tmp_path / "false.mcap", **{RESUMES: named})
    assert "goes on from gone.mcap, and that log is not in the attachment" in refused(
        capsys, str(log)
    )
    log = other(cut, tmp_path / "odd.mcap", **{RESUMES: "7"})
    assert "is not named as it should be" in refused(capsys, str(log))


@pytest.mark.slow
def test_a_question_is_asked_at_a_terminal(cut: Path) -> None:
    pty = pytest.importorskip("pty")
    ours, theirs = pty.openpty()
    words = [sys.executable, "-m", "ntagen", "drive", "--resume", str(cut), "--quiet"]
    environment = {**os.environ, "PYTHONPATH": str(EXAMPLES.parent)}
    with subprocess.Popen(
        words, stdin=theirs, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=environment
    ) as process:
        os.write(ours, b"y\n")
        out, _ = process.communicate(timeout=120)
    os.close(theirs)
    os.close(ours)
    assert process.returncode == 0, out
    assert b"May the needle go on from" in out
