"""States on disk: answers are the same, folders are left as they were, and a full disk says so."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from ntagen import checker

WALK = """
const int N = 99;
int[0, N] a, b, c;
process P() {
  state S; init S;
  trans S -> S { guard a < N; assign a = a + 1; },
        S -> S { guard b < N; assign b = b + 1; },
        S -> S { guard c < N; assign c = c + 1; };
}
system P;
"""
"""A million states."""

CORNER = "E<> a == N && b == N && c == N"


def command(model: Path, place: Path, *options: str) -> list[str]:
    """A search that puts states into `place`."""
    asked = ["check", str(model), "--query", CORNER, "--json", "--spill", str(place)]
    return [sys.executable, "-m", "ntagen", *asked, *options]


@pytest.fixture
def model(tmp_path: Path) -> Path:
    """The model."""
    path = tmp_path / "walk.xta"
    path.write_text(WALK, encoding="utf-8")
    return path


def answer(run: subprocess.CompletedProcess[str]) -> dict[str, Any]:
    """The answer that a command has printed."""
    found: dict[str, Any] = json.loads(run.stdout.splitlines()[-1])
    return found


def test_more_states_than_memory_has_room_for(tmp_path: Path) -> None:
    """Half of the memory is enough, and the folder is empty then."""
    model = checker.load(WALK, "walk.xta")
    whole = model.check(CORNER, trace=True)
    half = whole.peak_bytes // 2
    assert model.check(CORNER, memory_bytes=half).stop == "memory"
    place = tmp_path / "new" / "states"
    answer = model.check(CORNER, memory_bytes=half, spill=place, trace=True)
    assert answer.satisfied
    assert (answer.stored, answer.explored) == (whole.stored, whole.explored)
    assert answer.peak_bytes <= half
    assert len(answer.trace_lines()) == len(whole.trace_lines())
    assert list(place.iterdir()) == []


def test_what_a_killed_run_leaves_is_removed(model: Path, tmp_path: Path) -> None:
    """A run that was killed leaves its states; the next one removes them, but not the user's."""
    place = tmp_path / "states"
    place.mkdir()
    own = place / "ntagen-states-of-mine.txt"
    own.write_text("mine", encoding="utf-8")
    with subprocess.Popen(command(model, place, "--memory", "6MB"), stdout=subprocess.PIPE) as run:
        while not any(one.stat().st_size for one in place.glob("*/states")):
            assert run.poll() is None
            time.sleep(0.002)
        run.kill()
    assert len(list(place.iterdir())) == 2
    options = ("--states", "1k")
    done = subprocess.run(
        command(model, place, *options), capture_output=True, text=True, check=False
    )
    assert answer(done)["stop"] == "states"
    assert list(place.iterdir()) == [own]


def test_a_full_disk_stops_the_search(model: Path, tmp_path: Path) -> None:
    """A file that may not grow is as a disk that is full."""
    resource = pytest.importorskip("resource")
    most = (1 << 20, 1 << 20)
    done = subprocess.run(
        command(model, tmp_path / "states", "--memory", "6MB"),
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, most),
    )
    assert (answer(done)["stop"], done.returncode) == ("disk", 3)
    assert list((tmp_path / "states").iterdir()) == []


def test_a_place_that_is_no_folder_is_told(model: Path, tmp_path: Path) -> None:
    """A file stands where the folder should be."""
    place = tmp_path / "states"
    place.write_text("a file", encoding="utf-8")
    done = subprocess.run(command(model, place), capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "states cannot be written there" in done.stderr


def test_where_nothing_goes_to_disk_it_is_said(tmp_path: Path) -> None:
    """Games keep everything in memory."""
    model = tmp_path / "game.xta"
    game = WALK.replace("S -> S { guard b", "S -u-> S { guard b")
    model.write_text(game, encoding="utf-8")
    asked = ["check", str(model), "--query", "control: A<> a == N"]
    run = [sys.executable, "-m", "ntagen", *asked, "--spill", str(tmp_path / "states")]
    done = subprocess.run([*run, "--states", "100"], capture_output=True, text=True, check=False)
    assert "--spill has no effect here" in done.stderr
