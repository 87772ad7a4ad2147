"""What Windows does otherwise: it is taken away here, because no test runs there."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import types
from pathlib import Path

import pytest

from ntagen import system
from ntagen.cli.needle.operator import signalled_operator
from ntagen.errors import InputError
from ntagen.files import GrowingFile, open_file
from ntagen.grbl.port import SerialPort

ROOT = Path(__file__).parents[2]
FISCHER = "examples/models/fischer"


def windows_like(*words: str) -> subprocess.CompletedProcess[str]:
    """Runs a command without what Windows lacks, into a pipe as it is there."""
    return subprocess.run(
        [sys.executable, "-m", "tests.without_posix", *words],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "cp1252"},
        capture_output=True,
        encoding="cp1252",
        check=False,
    )


@pytest.mark.parametrize(
    ("words", "part"),
    [
        ((f"{FISCHER}.xta", f"{FISCHER}.q", "--expect"), "3 as expected"),
        (("examples/models/four_states.xta", "--query", "control: A<> Main.Won"), "yes"),
    ],
)
def test_models_are_checked(words: tuple[str, ...], part: str) -> None:
    found = windows_like("check", *words)
    assert (found.returncode, found.stderr) == (0, "")
    assert part in found.stdout


def test_verifyta_is_stood_in_for(tmp_path: Path) -> None:
    trace = tmp_path / "trace"
    found = windows_like("verifyta", "-t0", "-f", str(trace), f"{FISCHER}.xta", f"{FISCHER}.q")
    assert found.returncode == 0, found.stderr
    assert "Formula is NOT satisfied" in found.stdout
    assert sorted(path.name for path in tmp_path.iterdir()) == ["trace-2", "trace-3"]


def test_texts_are_written_with_the_characters_that_a_pipe_has() -> None:
    found = windows_like("explain", "E0101")
    assert found.returncode == 0, found.stderr
    assert "E0101" in found.stdout
    assert r"\u2264" in found.stdout


@pytest.mark.slow
def test_tasks_are_formatted_drawn_and_driven(tmp_path: Path) -> None:
    task = tmp_path / "task.nsl"
    text = (ROOT / "examples" / "paper.nsl").read_text()
    task.write_text(text.replace("  ", "      "))
    scene, log = tmp_path / "scene.svg", tmp_path / "run.mcap"
    for words in (
        ("fmt", str(task)),
        ("plot", str(task), "-o", str(scene)),
        ("drive", str(task), "--needle", "virtual", "--log", str(log)),
        ("replay", str(log)),
    ):
        found = windows_like(*words)
        assert found.returncode == 0, found.stderr
    assert task.read_text() == text
    assert scene.read_text().startswith("<?xml")
    assert sorted(tmp_path.iterdir()) == [log, scene, task]


def test_what_needs_a_pseudo_terminal_says_so() -> None:
    found = windows_like("device", "check", "grbl+sim")
    assert found.returncode == 5
    assert "has no pseudo-terminals" in found.stderr
    assert "WSL" in found.stderr


@pytest.fixture
def locked(monkeypatch: pytest.MonkeyPatch) -> dict[tuple[int, int], int]:
    """The locked bytes by file and place, on a system that locks bytes."""
    found: dict[tuple[int, int], int] = {}

    def locking(descriptor: int, _mode: int, count: int) -> None:
        place = os.fstat(descriptor).st_ino, os.lseek(descriptor, 0, os.SEEK_CUR)
        assert count == 1
        if found.setdefault(place, descriptor) != descriptor:
            raise PermissionError(errno.EACCES, "locked")

    monkeypatch.setitem(sys.modules, "fcntl", None)
    fake = types.SimpleNamespace(locking=locking, LK_NBLCK=2)
    monkeypatch.setitem(sys.modules, "msvcrt", fake)
    return found


def test_a_byte_behind_the_content_is_locked(
    tmp_path: Path, locked: dict[tuple[int, int], int]
) -> None:
    path = tmp_path / "log"
    first = GrowingFile(path)
    with pytest.raises(InputError, match="another run is writing"):
        GrowingFile(path)
    first.write(b"entry")
    first.acknowledge(to_disk=False)
    assert path.read_bytes() == b"entry"
    assert [place > 2**30 for _, place in locked] == [True]
    first.close()


def test_where_there_are_no_locks_files_are_written_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def locking(*_: int) -> None:
        raise OSError(errno.EINVAL, "no locks")

    monkeypatch.setitem(sys.modules, "fcntl", None)
    fake = types.SimpleNamespace(locking=locking, LK_NBLCK=2)
    monkeypatch.setitem(sys.modules, "msvcrt", fake)
    GrowingFile(tmp_path / "log").close()
    with (tmp_path / "log").open("rb") as file, pytest.raises(OSError, match="no locks"):
        system.take_lock(file.fileno())


def test_a_folder_that_cannot_be_opened_is_a_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: str, *_: int) -> int:
        raise PermissionError(errno.EACCES, "Permission denied", path)

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(IsADirectoryError):
        open_file(tmp_path, 1)
    with pytest.raises(PermissionError):
        open_file(tmp_path / "file", 1)


def test_a_port_that_is_no_file_is_read() -> None:
    port = SerialPort("loop://")
    assert port.read(0.0) == b""
    assert port.read(0.005) == b""
    port.write(b"ok")
    assert port.read(1.0) == b"ok"
    port.close()


def test_the_cores_are_counted_where_they_cannot_be_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    assert system.core_count() == len(os.sched_getaffinity(0))
    monkeypatch.delattr(os, "sched_getaffinity")
    assert system.core_count() == os.cpu_count()


def test_a_closed_terminal_ends_a_run() -> None:
    assert system.HANG_UPS == (signal.SIGHUP,)
    # Tests that nohup runs ignore the signal; so would the run, as its user wishes.
    inherited = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    try:
        with signalled_operator() as operator:
            signal.raise_signal(signal.SIGHUP)
    finally:
        signal.signal(signal.SIGHUP, inherited)
    assert operator.was_terminated
    with pytest.raises(KeyboardInterrupt, match=r"the terminal was closed \(SIGHUP\)"):
        operator.listen()
