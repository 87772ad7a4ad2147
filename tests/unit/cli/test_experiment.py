"""`ntagen experiment`: what it prints, and how it ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from ntagen.cli import main
from tests.unit.experiment.files import written

LONG = '[[row]]\nscenario = "large_mid_cr.nsl"\nnoise = 0.1\nseeds = 200\n'


@pytest.mark.usefixtures("here")
def test_the_table_is_printed_and_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["experiment", str(written(tmp_path)), "--runs", "1"]) == 0
    said = capsys.readouterr()
    assert "wrote quick/table.json" in said.out
    assert said.out.splitlines()[2].split()[:3] == ["free", "1", "100.0%"]
    assert "2 of 2 runs, 1 reached, 0 hits" in said.err
    assert json.loads(Path("quick/table.json").read_bytes())["rows"][0]["runs"] == 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--runs", "0"], "0 is not in the range"),
        (["--runs", "-1"], "-1 is not in the range"),
        (["--workers", "0"], "0 is not in the range"),
        (["-o", "FILE"], "FILE is no folder"),
        (["-o", "/proc/nothing"], "hint: choose another folder with -o"),
    ],
)
@pytest.mark.usefixtures("here")
def test_wrong_options(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], message: str
) -> None:
    file = written(tmp_path)
    (tmp_path / "FILE").write_text("", "utf-8")
    options = [str(tmp_path / one) if one == "FILE" else one for one in options]
    assert main(["experiment", str(file), *options]) == 2
    assert message.replace("FILE", str(tmp_path / "FILE")) in capsys.readouterr().err


def test_a_missing_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["experiment", str(tmp_path / "no.toml")]) == 2
    assert "no.toml: no such file or directory" in capsys.readouterr().err


def begun(tmp_path: Path) -> subprocess.Popen[str]:
    """A long experiment of which a few runs are finished."""
    file = written(tmp_path, LONG)
    words = [sys.executable, "-m", "ntagen", "experiment", str(file), "-o", str(tmp_path / "x")]
    process = subprocess.Popen(
        [*words, "--workers", "2"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    while process.poll() is None and len(finished(tmp_path)) < 4:
        time.sleep(0.02)
    return process


def finished(tmp_path: Path) -> list[dict[str, Any]]:
    """The lines of finished runs."""
    lines = []
    for path in (tmp_path / "x" / "results").glob("*.jsonl"):
        lines += [line for line in path.read_text("utf-8").splitlines(True) if line[-1] == "\n"]
    return [json.loads(line) for line in lines]


def alive(processes: list[int]) -> bool:
    def is_alive(pid: int) -> bool:
        try:
            return Path(f"/proc/{pid}/stat").read_text().rsplit(")")[-1].split()[0] != "Z"
        except OSError:
            return False

    return any(is_alive(pid) for pid in processes)


def children(pid: int) -> list[int]:
    return [int(one) for one in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def until(done: Callable[[], bool]) -> None:
    """Waits up to a minute."""
    for _ in range(3000):
        if done():
            return
        time.sleep(0.02)
    raise AssertionError


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_an_end_in_the_middle_keeps_what_is_finished(tmp_path: Path, number: int) -> None:
    process = begun(tmp_path)
    workers = children(process.pid)
    process.send_signal(number)
    said = process.communicate(timeout=60)[1]
    if number == signal.SIGKILL:
        assert process.returncode == -signal.SIGKILL
    else:
        assert process.returncode == (130 if number == signal.SIGINT else 143)
        assert "finished runs are kept in" in said
        assert "go on with --resume" in said
        assert "Traceback" not in said
    until(lambda: not alive(workers))
    before = {run["seed"]: run for run in finished(tmp_path)}
    assert 4 <= len(before) < 200
    file = str(tmp_path / "quick.toml")
    count = str(len(before) + 3)
    words = [sys.executable, "-m", "ntagen", "experiment", file, "--resume", "--runs", count]
    subprocess.run([*words, "-o", tmp_path / "x"], check=True, env=os.environ, timeout=120)
    runs = json.loads((tmp_path / "x" / "table.json").read_bytes())["runs"]
    assert len(runs) == len(before) + 3
    # Also the time that a run took is as it was: it was not made again.
    kept = [run for run in runs if run["seed"] in before]
    assert all(run == before[run["seed"]] for run in kept)
    assert len(finished(tmp_path)) == len({run["seed"] for run in finished(tmp_path)})
