"""The limits of a whole command: a stop in each phase has a clear answer and leaves no file."""

from __future__ import annotations

import contextlib
import json
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from ntagen import checker, system
from ntagen.cli import main
from ntagen.cli.guard import Guard, resident_bytes
from ntagen.cli.models.evidence import Outputs, Questions, backed
from ntagen.cli.models.outcomes import Outcome
from ntagen.cli.models.queries import Asked
from ntagen.cli.signals import Ending, Limit, LimitReached, Terminated, handled
from ntagen.errors import LimitError
from ntagen.files import GrowingFile, abandon, write_files
from ntagen.loading import load_file

GAME = """
clock x; process P() { state S { x <= 2 }, Won, Lost; init S;
    trans S -> Won { guard x >= 1; }, S -u-> Lost { guard x > 1; }; }
system P;
"""
WIN = "control: A<> P.Won"


@pytest.fixture
def model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    (tmp_path / "model.xta").write_text(GAME)
    monkeypatch.chdir(tmp_path)
    return "model.xta"


Stop = Callable[[str, Limit], None]


@pytest.fixture
def stop_in(monkeypatch: pytest.MonkeyPatch) -> Stop:
    """Lets a limit be reached when a command begins with something."""

    def stop(what: str, limit: Limit) -> None:
        @contextlib.contextmanager
        def doing(now: str) -> Iterator[None]:
            if now.startswith(what):
                raise LimitReached(limit, f"{now} was stopped by the {limit} limit")
            yield

        monkeypatch.setattr("ntagen.cli.check.doing", doing)
        for module in ("evidence", "info", "plot_models", "verify"):
            monkeypatch.setattr(f"ntagen.cli.models.{module}.doing", doing)
        monkeypatch.setattr("ntagen.cli.plot.doing", doing)

    return stop


def work_within(timeout_s: float | None, memory_bytes: int | None, taken_bytes: int) -> None:
    """Takes memory, and works in Python without an end."""
    with Guard(timeout_s, memory_bytes):
        taken = bytearray(b"x") * taken_bytes
        while taken:
            pass


def test_time_ends_python_code_and_the_message_says_in_what() -> None:
    with pytest.raises(
        LimitError, match=r"^reading the input was stopped by the time limit of 0 s"
    ):
        work_within(0.0, None, 1)


@pytest.mark.skipif(resident_bytes() is None, reason="this system does not say it")
def test_memory_ends_python_code() -> None:
    with pytest.raises(LimitError, match="stopped by the memory limit of 1 MiB"):
        work_within(None, 1 << 20, 64 << 20)


def test_a_limit_ends_a_search_of_the_engine_and_its_answer_says_so() -> None:
    text = """int[0,30000] a, b;
        process P() { state S; init S; trans S -> S { guard a < 30000; assign a++; }; }
        process Q() { state S; init S; trans S -> S { guard b < 30000; assign b++; }; }
        system P, Q;"""
    searched = checker.load(text)
    with Guard(0.0, None):
        answer = searched.check("A[] a + b < 60000")
    assert (answer.verdict, answer.stop) == ("unknown", "time")


def test_nothing_is_raised_when_a_command_is_over() -> None:
    before = signal.getsignal(system.ALARM)
    with Guard(100.0, 1 << 40) as guard:
        assert guard.reached is None
        assert 0 < (guard.left_s() or 0) <= 100
    assert signal.getsignal(system.ALARM) == before


def test_a_stop_while_the_model_is_loaded(
    model: str, stop_in: Stop, capsys: pytest.CaptureFixture[str]
) -> None:
    stop_in("loading the model", "time")
    for words in (["check", model, "--query", WIN], ["info", model], ["verify", model, model]):
        assert main([*words, "--timeout", "9s"]) == 3
        said = capsys.readouterr()
        assert said.out == ""
        first, hint = said.err.splitlines()
        assert first == "error: loading the model was stopped by the time limit"
        assert hint == "hint: give more time with --timeout"


def test_a_stop_before_there_is_an_answer(
    model: str, stop_in: Stop, capsys: pytest.CaptureFixture[str]
) -> None:
    stop_in("the search for", "memory")
    assert main(["check", model, "--query", WIN, "--query", "E<> P.Won", "--json"]) == 3
    records = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [(one["verdict"], one["stop"]) for one in records] == [("unknown", "memory")] * 2
    assert f"the answer to {WIN} was stopped by the memory limit" in records[0]["message"]


@pytest.mark.parametrize(
    ("option", "file", "what"),
    [
        ("--strategy", "out.json", "the strategy was found; writing it"),
        ("--strategy", "out.txt", "the strategy was found; writing it"),
        ("--strategy", "out.c", "the strategy was found; writing it"),
        ("--plans", "out.json", "writing the plans"),
        ("--trace", "out.xml", "writing the trace"),
        ("--certificate", "out.jsonl", "writing the certificate"),
    ],
)
def test_a_stop_while_evidence_is_written(
    option: str,
    file: str,
    what: str,
    model: str,
    stop_in: Stop,
    capsys: pytest.CaptureFixture[str],
) -> None:
    stop_in(what, "time")
    query = {"--trace": "E<> P.Won", "--certificate": "A[] x >= 0"}.get(option, WIN)
    if option == "--plans":
        Path(model).write_text(GAME.replace(", S -u-> Lost { guard x > 1; }", ""))
    assert main(["check", model, "--query", query, option, file, "--timeout", "9s"]) == 3
    out = capsys.readouterr().out
    assert f"{what} was stopped by the time limit; not written: {option}" in out
    assert "  yes     " in out
    assert [one.name for one in Path().iterdir()] == [model]


def test_a_stop_while_an_answer_is_printed(
    model: str, stop_in: Stop, capsys: pytest.CaptureFixture[str]
) -> None:
    stop_in("printing the answer", "time")
    assert main(["check", model, "--query", WIN]) == 3
    said = capsys.readouterr()
    assert "error: printing the answer was stopped by the time limit" in said.err
    assert "  stopped " in said.out


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (["--as", "states"], "the search for the states"),
        (["--as", "states"], "drawing the graph"),
        (["--as", "templates"], "drawing the templates"),
        (["--query", "E<> P.Won"], "drawing the picture"),
    ],
)
def test_a_stop_while_a_picture_is_drawn(
    words: list[str],
    what: str,
    model: str,
    stop_in: Stop,
    capsys: pytest.CaptureFixture[str],
) -> None:
    stop_in(what, "time")
    assert main(["plot", model, *words, "-o", "out.svg", "--timeout", "9s"]) == 3
    assert capsys.readouterr().err.startswith(f"error: {what} was stopped by the time limit")
    assert not Path("out.svg").exists()


def test_what_the_engine_did_not_come_to_is_no_success(model: str) -> None:
    loaded = load_file(Path(model))
    answer = loaded.model.check(WIN)
    assert answer.stopped == ()
    nothing = Outputs(None, None, None, None, ())
    outcome = Outcome(Asked(None, WIN, None), answer)
    assert backed(outcome, nothing, Questions(loaded.model), verify=True).code == 0
    answer.stopped = (("check", "time"),)
    stopped = backed(outcome, nothing, Questions(loaded.model), verify=True)
    assert (stopped.code, stopped.stop) == (3, "time")


def test_the_second_signal_ends_the_program_at_once(tmp_path: Path) -> None:
    left: list[int] = []

    class Left(BaseException):
        pass

    def leave(code: int) -> None:
        left.append(code)
        raise Left

    ending = Ending(leave)  # type: ignore[arg-type]
    with handled({signal.SIGINT: ending.handle, signal.SIGTERM: ending.handle}):
        with pytest.raises(Terminated):
            signal.raise_signal(signal.SIGTERM)
        with pytest.raises(Left):
            signal.raise_signal(signal.SIGINT)
    assert left == [143]


def test_whoever_leaves_at_once_leaves_nothing_half_written(tmp_path: Path) -> None:
    growing = GrowingFile(tmp_path / "grows")
    growing.write(b"whole\n")
    growing.acknowledge(to_disk=False)
    growing.write(b"ha")

    def pieces() -> Iterator[str]:
        yield "x" * (3 << 20)
        assert len(list(tmp_path.glob("new/.ntagen-*"))) == 1
        abandon()
        assert list(tmp_path.iterdir()) == [tmp_path / "grows"]
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_files({tmp_path / "new" / "file": pieces()})
    assert growing.closed
    assert [one.read_bytes() for one in tmp_path.iterdir()] == [b"whole\n"]
