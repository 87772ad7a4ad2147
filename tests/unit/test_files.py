"""Files that the user names: what is written is whole, nothing else is changed, nothing is left."""

from __future__ import annotations

import contextlib
import os
import resource
import signal
import socket
import stat
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from ntagen.cli import main
from ntagen.errors import InputError
from ntagen.files import GrowingFile, json_of, open_file, read_file, require_apart, write_files

ROOT = Path(__file__).parents[2]
PAPER = str(ROOT / "examples" / "paper.nsl")
GAME = """
clock x;
process P() {
    state A, B; init A;
    trans A -> B { guard x >= 1; };
}
system P;
"""
QUERY = ["--query", "control: A<> P.B"]


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@contextlib.contextmanager
def no_room(size: int = 100) -> Iterator[None]:
    """Files cannot grow beyond this many bytes, as on a full disk.

    That holds for what the test runner prints into a file too, so nothing but what is tested
    happens in between.
    """
    old = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, old[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, old)
        signal.signal(signal.SIGXFSZ, handler)


# ---------------------------------------------------------------------------------- write_files


def test_texts_and_bytes_are_written_and_folders_made(tmp_path: Path) -> None:
    write_files({tmp_path / "a" / "b": "é\n", tmp_path / "c": b"\xff"})
    assert (tmp_path / "a" / "b").read_bytes() == "é\n".encode()
    assert (tmp_path / "c").read_bytes() == b"\xff"
    assert names(tmp_path) == ["a", "c"]


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o755, 0o444])
def test_the_mode_of_an_existing_file_stays(tmp_path: Path, mode: int) -> None:
    path = tmp_path / "file"
    path.write_text("old")
    path.chmod(mode)
    if os.access(path, os.W_OK):
        write_files({path: "new"})
        assert path.read_text() == "new"
    else:
        with pytest.raises(InputError, match="permission denied"):
            write_files({path: "new"})
        assert path.read_text() == "old"
    assert stat.S_IMODE(path.stat().st_mode) == mode


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may give files away")
def test_the_owner_of_an_existing_file_stays(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("old")
    os.chown(path, 1234, 4321)
    path.chmod(0o640)
    write_files({path: "new"})
    found = path.stat()
    assert (found.st_uid, found.st_gid, stat.S_IMODE(found.st_mode)) == (1234, 4321, 0o640)


def test_new_files_obey_the_umask(tmp_path: Path) -> None:
    old = os.umask(0o027)
    try:
        write_files({tmp_path / "file": "new"})
    finally:
        os.umask(old)
    assert stat.S_IMODE((tmp_path / "file").stat().st_mode) == 0o640


def test_a_link_stays_and_what_it_leads_to_is_written(tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    real = tmp_path / "far" / "real"
    real.write_text("old")
    (tmp_path / "middle").symlink_to("far/real")
    (tmp_path / "link").symlink_to(tmp_path / "middle")
    (tmp_path / "dangling").symlink_to("far/made")
    write_files({tmp_path / "link": "new", tmp_path / "dangling": "made"})
    assert (real.read_text(), (tmp_path / "far" / "made").read_text()) == ("new", "made")
    assert [(tmp_path / name).is_symlink() for name in ("link", "middle", "dangling")] == [True] * 3
    assert names(tmp_path / "far") == ["made", "real"]


def test_links_in_a_circle_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    with pytest.raises(InputError, match="too many levels of symbolic links"):
        write_files({tmp_path / "a": ""})


def test_a_pipe_is_written_through(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe, 0o600)
    read: list[str] = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_text()))
    reader.start()
    write_files({pipe: "through" * 100_000})
    reader.join()
    assert read == ["through" * 100_000]
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert names(tmp_path) == ["pipe"]


def test_devices_are_written_through(tmp_path: Path) -> None:
    before = os.stat(os.devnull)
    write_files({Path(os.devnull): "gone"})
    assert os.stat(os.devnull).st_ino == before.st_ino
    with pytest.raises(InputError, match="/dev/full: no space left"):
        write_files({Path("/dev/full"): "x", tmp_path / "made" / "file": "x"})
    assert names(tmp_path) == []


def test_a_socket_is_refused_and_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as one:
        one.bind("socket")
        with pytest.raises(InputError, match="cannot write socket"):
            write_files({Path("socket"): "x"})
        assert stat.S_ISSOCK(os.stat("socket").st_mode)


@pytest.mark.parametrize("size", [101, 3_000_000])
def test_a_full_disk_changes_nothing(tmp_path: Path, size: int) -> None:
    (tmp_path / "old").write_text("old")
    with no_room(), pytest.raises(InputError, match=r"cannot write .*large: file too large"):
        write_files({tmp_path / "old": "new", tmp_path / "new" / "deep" / "large": "x" * size})
    assert (tmp_path / "old").read_text() == "old"
    assert names(tmp_path) == ["old"]


def test_an_interruption_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(_: int) -> None:
        raise KeyboardInterrupt

    (tmp_path / "old").write_text("old")
    monkeypatch.setattr(os, "fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_files({tmp_path / "old": "new"})
    assert (tmp_path / "old").read_text() == "old"
    assert names(tmp_path) == ["old"]


def test_outputs_replace_neither_inputs_nor_each_other(tmp_path: Path) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    one.write_text("")
    two.symlink_to(one)
    require_apart({"--a": one, "--b": tmp_path / "three", "--c": None, "--d": "-"}, {})
    require_apart({"--a": os.devnull, "--b": os.devnull}, {"model": Path(os.devnull)})
    with pytest.raises(InputError, match=r"--a .*two would replace the model .*one"):
        require_apart({"--a": two}, {"model": one})
    with pytest.raises(InputError, match=r"--b .* would replace the output of --a"):
        require_apart({"--a": tmp_path / "new", "--b": tmp_path / "." / "new"}, {})


# --------------------------------------------------------------------------------- GrowingFile


def test_a_growing_file_keeps_its_mode_and_is_emptied(tmp_path: Path) -> None:
    path = tmp_path / "log"
    path.write_text("old, and longer")
    path.chmod(0o600)
    file = GrowingFile(path)
    file.write(b"new")
    assert path.read_bytes() == b""
    file.acknowledge(to_disk=True)
    assert (path.read_bytes(), file.tell()) == (b"new", 3)
    file.write(b"never acknowledged")
    file.close()
    assert path.read_bytes() == b"new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_a_growing_file_is_locked_until_it_is_closed(tmp_path: Path) -> None:
    path = tmp_path / "log"
    file = GrowingFile(path)
    file.write(b"whole")
    file.acknowledge(to_disk=False)
    with pytest.raises(InputError, match="another run is writing to it"):
        GrowingFile(path)
    assert path.read_bytes() == b"whole"
    file.close()
    GrowingFile(path).close()


def test_the_lock_ends_with_the_process(tmp_path: Path) -> None:
    path = tmp_path / "log"
    holder = (
        "import sys, pathlib; from ntagen.files import GrowingFile\n"
        "f = GrowingFile(pathlib.Path(sys.argv[1])); print('locked', flush=True); input()"
    )
    command = [sys.executable, "-c", holder, str(path)]
    with subprocess.Popen(
        command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"locked\n"
        with pytest.raises(InputError, match="another run"):
            GrowingFile(path)
        process.kill()
    GrowingFile(path).close()


def test_a_growing_file_ends_with_what_was_acknowledged(tmp_path: Path) -> None:
    file = GrowingFile(tmp_path / "log")
    with no_room():
        file.write(b"x" * 60)
        file.acknowledge(to_disk=False)
        file.write(b"y" * 60)
        with pytest.raises(InputError, match="file too large"):
            file.acknowledge(to_disk=False)
    assert file.closed
    assert (tmp_path / "log").read_bytes() == b"x" * 60


def test_a_growing_device_is_not_locked() -> None:
    files = [GrowingFile(Path(os.devnull)) for _ in range(2)]
    for file in files:
        file.write(b"x")
        file.acknowledge(to_disk=True)
        file.close()


# ------------------------------------------------------------------------------------- reading


def test_files_are_read_up_to_a_limit(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"x" * 2**20)
    assert len(read_file(path, 2**20)) == 2**20
    with pytest.raises(OSError, match="more than 0 MiB"):
        read_file(path, 2**20 - 1)


def sparse(folder: Path) -> Path:
    path = folder / "sparse"
    with path.open("wb") as file:
        file.truncate(5 * 2**30)
    return path


def silent_pipe(folder: Path) -> Path:
    os.mkfifo(folder / "pipe")
    return folder / "pipe"


UNREADABLE: list[tuple[Callable[[Path], Path], str]] = [
    (lambda _: Path("/dev/zero"), "it is a device, not a file"),
    (lambda _: Path("/dev/null"), "it is a device, not a file"),
    (lambda folder: folder, "it is a folder"),
    (sparse, "it has more than"),
    (silent_pipe, "nobody writes to it"),
]


@pytest.mark.parametrize(("make", "says"), UNREADABLE)
def test_what_cannot_be_read_is_refused_at_once(
    tmp_path: Path, make: Callable[[Path], Path], says: str
) -> None:
    with pytest.raises(OSError, match=says):
        read_file(make(tmp_path), 2**30)


def test_a_pipe_is_read_to_its_end(tmp_path: Path) -> None:
    pipe = silent_pipe(tmp_path)
    command = ["sh", "-c", 'exec > "$0"; printf one; sleep 0; printf two', str(pipe)]
    # The shell waits with opening the pipe until it is read.
    with subprocess.Popen(command):
        file = None
        while file is None:
            try:
                file = open_file(pipe, 100)
            except OSError as error:
                assert "nobody writes to it" in str(error)  # noqa: PT017  it has not come so far
        assert file.read() == b"onetwo"


def test_a_pipe_without_end_is_refused() -> None:
    with subprocess.Popen(["cat", "/dev/zero"], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        with pytest.raises(OSError, match="more than 3 MiB"):
            read_file(f"/dev/fd/{process.stdout.fileno()}", 3 * 2**20)
        process.kill()


# ---------------------------------------------------------------------------- the command line

READERS = [
    ["check", "{}"],
    ["check", "{}.nsl"],
    ["check", "game.xta", "{}"],
    ["info", "{}"],
    ["compile", "{}.nsl"],
    ["plot", "{}.nsl", "-o", "x.png"],
    ["plot", "{}.mcap", "-o", "x.png"],
    ["drive", "{}.nsl"],
    ["replay", "{}"],
    ["fmt", "{}"],
    ["verify", "{}", "game.xta"],
    ["verify", "game.xta", "{}"],
    ["play", "{}", "--auto", "1"],
    ["play", "game.xta", "--strategy", "{}", "--auto", "1"],
]
"""Every command that reads a file; the ending of its name is a link's."""


@pytest.mark.parametrize(("make", "says"), UNREADABLE)
@pytest.mark.parametrize("arguments", READERS, ids=" ".join)
def test_every_command_refuses_what_cannot_be_read(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    make: Callable[[Path], Path],
    says: str,
) -> None:
    (tmp_path / "odd").mkdir()
    odd = make(tmp_path / "odd")
    monkeypatch.chdir(tmp_path)
    Path("game.xta").write_text(GAME)
    for ending in ("", ".nsl", ".mcap"):
        Path(f"link{ending}").symlink_to(odd)
    assert main([argument.replace("{}", "link") for argument in arguments]) == 2
    said = capsys.readouterr().err
    assert "error" in said
    assert says in said
    assert "internal" not in said


def ntagen(*arguments: str, folder: Path, **options: object) -> subprocess.CompletedProcess[bytes]:
    command = [sys.executable, "-m", "ntagen", *arguments]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(command, cwd=folder, env=environment, check=False, **options)  # type: ignore[call-overload,no-any-return]


def test_dev_stdout_goes_where_standard_output_goes(tmp_path: Path) -> None:
    (tmp_path / "game.xta").write_text(GAME)
    arguments = ["check", "game.xta", *QUERY, "--strategy", "/dev/stdout"]
    device = os.lstat("/dev/stdout")
    piped = ntagen(*arguments, folder=tmp_path, stdout=subprocess.PIPE)
    with (tmp_path / "out").open("wb") as out:
        ntagen(*arguments, folder=tmp_path, stdout=out)
    for text in (piped.stdout, (tmp_path / "out").read_bytes()):
        # What was printed before is still there, and what is printed later comes later.
        places = [text.index(part) for part in (b"loaded in", b"P.A", b"written to /dev/stdout")]
        assert places == sorted(places)
    assert os.lstat("/dev/stdout").st_ino == device.st_ino
    assert names(tmp_path) == ["game.xta", "out"]


WRITERS = [
    ["check", "game.xta", *QUERY, "--strategy", "{}"],
    ["check", "game.xta", *QUERY, "--strategy", "{}.c"],
    ["check", "game.xta", *QUERY, "--plans", "{}"],
    ["check", "game.xta", "--query", "E<> P.B", "--trace", "{}"],
    ["check", "game.xta", "--query", "A[] x >= 0", "--certificate", "{}"],
    ["play", "game.xta", *QUERY, "--auto", "1", "--log", "{}"],
    ["plot", PAPER, "--plans", "0", "-o", "{}.png"],
    ["drive", PAPER, "--quiet", "--log", "{}"],
    ["fmt", "{}.nsl"],
    ["compile", "{}.nsl", "-o", "."],
]
"""Every command that writes a file."""


@pytest.mark.parametrize("arguments", WRITERS, ids=" ".join)
def test_every_command_keeps_modes_and_links_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("game.xta").write_text(GAME)
    Path("real").mkdir()
    made = {"compile": ["file.xml", "file.q"]}.get(arguments[0], ["file"])
    made = {"{}.png": ["file.png"], "{}.c": ["file.c"]}.get(arguments[-1], made)
    if "{}.nsl" in arguments:
        Path("file.nsl").write_text(Path(PAPER).read_text().replace("  ", "   "))
        made = ["file.nsl"] if arguments[0] == "fmt" else made
    for name in made:
        real = Path("real") / name
        real.write_bytes(Path(name).read_bytes() if Path(name).exists() else b"old")
        Path(name).unlink(missing_ok=True)
        real.chmod(0o600)
        Path(name).symlink_to(real)
    before = {name: Path(name).read_bytes() for name in made}
    assert main([argument.replace("{}", "file") for argument in arguments]) == 0
    for name in made:
        assert Path(name).is_symlink()
        assert Path(name).read_bytes() != before[name]
        assert stat.S_IMODE(Path(name).stat().st_mode) == 0o600
    others = {"game.xta", "real"} | ({"file.nsl"} if "{}.nsl" in arguments else set())
    assert set(names(tmp_path)) == others | set(made)
    assert names(Path("real")) == sorted(made)


@pytest.mark.parametrize("arguments", WRITERS, ids=" ".join)
def test_every_command_leaves_the_old_file_on_a_full_disk(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "game.xta").write_text(GAME)
    (tmp_path / "file.nsl").write_text(Path(PAPER).read_text().replace("  ", "   "))
    (tmp_path / "file.png").write_text("old")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with no_room(10):
        code = main([argument.replace("{}", "file") for argument in arguments])
    assert code == 2
    assert "file too large" in capsys.readouterr().err
    after = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    # The log of a run grows, so that what was written of it stays.
    after.pop("file", None) if arguments[0] == "drive" else None
    assert after == before


def test_check_does_not_replace_its_model(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "game.xta"
    model.write_text(GAME)
    assert main(["check", str(model), *QUERY, "--strategy", str(model)]) == 2
    assert "would replace the model" in capsys.readouterr().err
    assert model.read_text() == GAME


def test_json_with_too_many_values_is_refused_before_it_is_read() -> None:
    for text in ("[" * 1_000_001, b"[" + b'{"":0},' * 600_000 + b"0]"):
        with pytest.raises(ValueError, match="more than 1,000,000 values"):
            json_of(text)
    assert json_of("[1, {}]") == json_of(b"[1, {}]") == [1, {}]
