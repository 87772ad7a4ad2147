"""The frame of the command line: what is listed, and what errors become."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import click
import pytest

from ntagen import cli
from ntagen.errors import DeviceError, InputError, LimitError, ModelError

ROOT = Path(__file__).parents[3]


def check_error(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    error: BaseException,
    code: int,
    *parts: str,
) -> str:
    """What `main` makes of an error in a command: the exit code, and one message on stderr."""

    def fail(_arguments: list[str]) -> int:
        raise error

    monkeypatch.setattr(cli, "_run", fail)
    monkeypatch.setattr(cli, "_abandon_output", lambda: None)
    assert cli.main([]) == code
    out, err = capsys.readouterr()
    assert out == ""
    for part in parts:
        assert part in err
    return err


@pytest.mark.parametrize(
    ("error", "code", "part"),
    [
        (InputError("no such thing"), 2, "error: no such thing\n"),
        (InputError("a.nsl:1:2: error[N001]: odd"), 2, "a.nsl:1:2: error[N001]: odd\n"),
        (LimitError("out of states"), 3, "error: out of states\n"),
        (ModelError("division by zero"), 4, "error: division by zero\n"),
        (DeviceError("no answer"), 5, "error: no answer\n"),
        (FileNotFoundError(errno.ENOENT, "No such file or directory", "x"), 2, "x: no such file"),
        (PermissionError(errno.EACCES, "Permission denied", "/y"), 2, "/y: permission denied"),
        (OSError(errno.ENOSPC, "No space left on device"), 2, "error: no space left on device"),
        (BrokenPipeError(errno.EPIPE, "Broken pipe"), 141, ""),
        (click.UsageError("no such option"), 2, "Error: no such option"),
        (KeyboardInterrupt(), 130, "interrupted\n"),
        (click.Abort(), 130, "interrupted\n"),
        (ModuleNotFoundError("No module named 'ntagen._checker'"), 70, "make setup"),
        (ValueError("odd"), 70, "internal error: ValueError: odd"),
        (RecursionError("deep"), 70, "internal error: RecursionError"),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, BaseException) else None,
)
def test_errors_become_one_message_and_a_code(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    error: BaseException,
    code: int,
    part: str,
) -> None:
    err = check_error(monkeypatch, capsys, error, code, part)
    assert "Traceback" not in err


def test_the_trace_is_shown_on_request(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(cli.DEBUG_VARIABLE, "1")
    check_error(monkeypatch, capsys, ValueError("odd"), 70, "Traceback", "in fail")


def test_a_file_name_that_is_no_text_can_be_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    error = FileNotFoundError(errno.ENOENT, "No such file or directory", "bad\udcff.nsl")
    check_error(monkeypatch, capsys, error, 2, r"bad\udcff.nsl: no such file")


def test_the_help_lists_every_command_that_exists(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["--help"]) == 0
    text = capsys.readouterr().out
    for name, (_, help_text) in cli.COMMANDS.items():
        assert f"  {name} " in text
        assert help_text in text


@pytest.mark.parametrize("name", cli.COMMANDS)
def test_every_command_has_a_help_with_an_example(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main([name, "--help"]) == 0
    assert f"ntagen {name} " in capsys.readouterr().out.partition("xample")[2]


def test_an_unknown_command_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["bogus"]) == 2
    assert "No such command 'bogus'" in capsys.readouterr().err


def test_the_help_waits_for_no_library() -> None:
    heavy = {"jinja2", "lark", "matplotlib", "numpy", "rich", "scipy", "ntagen.nsl"}
    script = f"import sys, ntagen.cli; print({heavy!r} & set(sys.modules))"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert run.stdout == "set()\n"


@pytest.mark.parametrize("words", [["plan"], ["check", "--plans", "-", "--set", "max plans 1"]])
def test_a_first_plan_waits_for_no_library(words: list[str]) -> None:
    heavy = {"matplotlib", "numpy", "rich", "scipy", "msgspec", "google"}
    arguments = [words[0], str(ROOT / "examples" / "paper.nsl"), *words[1:]]
    script = (
        f"import sys; from ntagen.cli import main; main({arguments!r});"
        f" print({heavy!r} & set(sys.modules))"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert run.stdout.splitlines()[-1] == "set()"


@pytest.mark.parametrize(
    "options",
    [
        [],
        ["--verify", "--trace", "-"],
        ["--threads", "2", "--json"],
        ["--set", "trace shortest", "--trace", "-"],
    ],
)
def test_a_check_of_a_model_imports_nothing_about_needles(options: list[str]) -> None:
    model = ROOT / "examples" / "models" / "four_states.xta"
    rooms = ("cli.needle", "drive", "motion", "needle", "nsl", "plan", "plot", "render")
    rooms += ("rules", "scene", "shapes")
    script = (
        f"import sys; from ntagen.cli import main; main({['check', str(model), *options]!r});"
        f"print([m for m in sys.modules for room in {rooms!r} if f'{{m}}.'.startswith("
        "f'ntagen.{room}.')])"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert run.stdout.splitlines()[-1] == "[]"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_full_disk_behind_the_output_is_one_message() -> None:
    with Path("/dev/full").open("w") as full:
        run = subprocess.run(
            [sys.executable, "-m", "ntagen", "--help"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert (run.returncode, run.stderr) == (2, "error: no space left on device\n")


@pytest.mark.parametrize(("given", "threads"), [(None, "1"), ("3", "3")])
def test_matrices_take_one_thread_unless_the_user_wants_more(
    monkeypatch: pytest.MonkeyPatch, given: str | None, threads: str
) -> None:
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    if given is not None:
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", given)
    assert cli.main(["--version"]) == 0
    assert os.environ["OPENBLAS_NUM_THREADS"] == threads
