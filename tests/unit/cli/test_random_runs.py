"""What the commands say of random runs: on one line, in JSON, in pictures, and when interrupted."""

from __future__ import annotations

import json
import re
import signal
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from ntagen import checker
from ntagen.cli import main
from ntagen.cli.models.answer_rows import bars
from ntagen.cli.progress import so_far

MODEL = """
clock x; int n;
process Q() { state A { x <= 4 }, B; init A; trans A -> B { guard x >= 2; }; }
process R() { state A { ; 5 }; init A; trans A -> A { guard n < 9; assign n++; }; }
system Q, R;
"""
REACHED = "Pr[<=4](<> Q.B)"
ENDLESS = ["--epsilon", "0.0001"]
"""So near an interval takes minutes."""


@pytest.fixture
def path(tmp_path: Path) -> str:
    model = tmp_path / "model.xta"
    model.write_text(MODEL, "utf-8")
    return str(model)


@contextmanager
def interrupted_after(seconds: float) -> Iterator[None]:
    """Lets what Ctrl-C does happen after this processor time."""
    old = signal.signal(signal.SIGPROF, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, old)


@pytest.mark.parametrize(
    ("query", "says"),
    [
        (REACHED, "reached at 2."),
        ("Pr[x<=4](<> Q.B)", "reached at x = 2."),
        ("Pr[<=4]([] !Q.B)", "broken at 2."),
        ("Pr[#<=40](<> Q.B)", "reached after "),
        ("Pr[<=4](<> n >= 0)", "reached at 0 in 72 of 72 runs"),
        ("E[<=1; 40](max: n)", "values "),
    ],
)
def test_a_line_says_how_values_are_distributed(
    path: str, capsys: pytest.CaptureFixture[str], query: str, says: str
) -> None:
    assert main(["check", path, "--query", query]) == 0
    assert f"          {says}" in capsys.readouterr().out


def test_without_values_there_is_no_line(path: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", path, "--query", "Pr[<=4](<> n > 100)"]) == 0
    assert "reached" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("counts", "shown"),
    [
        ([1], "█"),
        ([0, 8, 4, 1], " █▄▁"),
        ([5, 0, 0], "█"),
        ([1] * 60, "█" * 30),
        # The last bar stands for one bucket, the others for two.
        ([4] * 59, "█" * 30),
    ],
)
def test_bars_are_as_high_as_counts(counts: list[int], shown: str) -> None:
    assert bars(counts) == shown


def test_json_has_the_distribution(path: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", path, "--query", REACHED, "--runs", "1000", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["distribution"]
    assert (found["of"], found["broken"], found["runs"], found["count"]) == (
        *("time", False),
        *(1000, 1000),
    )
    assert sum(found["histogram"]["counts"]) == 1000
    cumulative = found["cumulative"]
    assert len(cumulative["at"]) == len(cumulative["value"]) <= 200
    for at, lower, upper in zip(
        cumulative["at"], cumulative["lower"], cumulative["upper"], strict=True
    ):
        assert lower <= (at - 2) / 2 <= upper
    assert main(["check", path, "--query", "Pr[<=4](<> n > 100)", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["distribution"]
    assert (found["histogram"], found["mean"], found["cumulative"]["at"]) == (None, None, [])


def test_verifyta_prints_the_histogram(
    path: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    queries = tmp_path / "model.q"
    queries.write_text(f"{REACHED}\n\nE[<=9; 10](max: x)\n\nPr[<=4](<> n > 100)\n", "utf-8")
    assert main(["verifyta", path, str(queries)]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("Values")]
    assert len(lines) == 2
    first, counts = lines[0].split(": ")
    assert first.startswith("Values in [2.")
    assert " mean=3." in first
    # All of the fewest runs that are all satisfied count.
    assert sum(map(int, counts.split())) == 72
    assert len(counts.split()) == 9
    assert lines[1] == "Values in [9,9] mean=9 steps=1: 10"


@pytest.mark.slow
def test_ctrl_c_gives_the_result_so_far(path: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["check", path, "--query", REACHED.replace("4]", "3]"), "--query", "E<> Q.B", *ENDLESS]
    with interrupted_after(0.4):
        assert main(words) == 3
    said = capsys.readouterr()
    assert "is answered by the runs until now, and 1 query is not asked" in said.err
    assert "stopped by the user, " in said.out
    assert "the estimate is that of the runs until then" in said.out
    assert "E<> Q.B" not in said.out
    with interrupted_after(0.4):
        assert main([*words, "--json", "--threads", "2"]) == 3
    record = json.loads(capsys.readouterr().out)
    assert (record["verdict"], record["stop"]) == ("unknown", "interrupted")
    assert record["lower"] < record["value"] < record["upper"]
    assert record["runs"] == record["distribution"]["runs"]


def test_ctrl_c_gives_the_result_so_far_in_verifyta_too(
    path: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    queries = tmp_path / "model.q"
    queries.write_text("Pr[<=3](<> Q.B)\n\nE<> Q.B\n", "utf-8")
    with interrupted_after(0.4):
        assert main(["verifyta", "-sq", "-E", "0.0001", path, str(queries)]) == 130
    said = capsys.readouterr()
    lines = said.out.splitlines()
    label = lines.index(" -- Interrupted: this is what the runs until now say.")
    assert lines[label - 1].startswith("Verifying formula 1 at ")
    found = re.fullmatch(
        r"\((\d+)/(\d+) runs\) Pr\(<> …\) in \[(.*),(.*)\] \(95% CI\)", lines[label + 1]
    )
    assert found is not None
    assert float(found[3]) < int(found[1]) / int(found[2]) < float(found[4])
    assert lines[label + 2].startswith("Values in [2")
    assert len(lines) == label + 3
    # Clients look for these words.
    assert "satisfied" not in said.out
    assert "is answered by the runs until now, and 1 query is not asked" in said.err


def test_ctrl_c_before_the_first_result_is_an_interruption(
    path: str, capsys: pytest.CaptureFixture[str]
) -> None:
    endless = "Pr[#<=2000000000](<> n > 9)"
    model = Path(path)
    model.write_text(MODEL.replace("guard n < 9; assign n++;", ""), "utf-8")
    with interrupted_after(0.4):
        assert main(["check", path, "--query", endless]) == 130
    assert f"{endless}\n  no random run has ended yet" in capsys.readouterr().err


def test_python_gets_the_result_so_far(path: str) -> None:
    model = checker.load_file(Path(path))
    with interrupted_after(0.4), pytest.raises(KeyboardInterrupt) as caught:
        model.check("Pr[<=3](<> Q.B)", epsilon=0.0001)
    assert isinstance(caught.value, checker.Interrupted)
    answer = caught.value.answer
    assert (answer.verdict, answer.stop) == ("unknown", "interrupted")
    assert answer.estimate is not None
    assert answer.estimate.value == pytest.approx(0.5, abs=0.1)


def test_what_progress_raises_ends_the_runs(path: str) -> None:
    def fail(*_: object) -> None:
        raise KeyboardInterrupt

    model = checker.load_file(Path(path))
    with pytest.raises(checker.Interrupted) as caught:
        model.check("Pr[<=3](<> Q.B)", epsilon=0.0001, run_progress=fail, timeout_s=60)
    assert caught.value.answer.stop == "interrupted"


def test_progress_shows_the_interval_so_far(path: str) -> None:
    seen: list[tuple[int, float | None, float | None, float | None]] = []
    model = checker.load_file(Path(path))
    model.check("Pr[<=3](<> Q.B)", epsilon=0.001, run_progress=lambda *one: seen.append(one))
    assert seen
    for runs, estimate, lower, upper in seen:
        assert runs > 0
        assert estimate is not None
        assert lower is not None
        assert upper is not None
        assert lower <= estimate <= upper
    assert [one[0] for one in seen] == sorted(one[0] for one in seen)
    assert so_far(1500, 0.25, 0.2, 0.3, 2.0) == "1,500 runs (750/s), 0.25 so far, in [0.2, 0.3]"
    assert so_far(3, None, None, None, 0.0) == "3 runs (0/s)"


def test_json_says_how_often_it_holds_at_each_moment(
    path: str, capsys: pytest.CaptureFixture[str]
) -> None:
    query = "simulate[<=4; 300]{n, Q.B}"
    assert main(["check", path, "--query", query, "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)["over_time"]
    assert shown["time"][::50] == [0, 1, 2, 3, 4]
    assert shown["runs"] == [300] * 201
    # Q.B is reached between 2 and 4, at each moment with the same chance.
    shares = shown["mean"]["Q.B"][::50]
    assert shares[:3] == [0, 0, 0]
    assert shares[3] == pytest.approx(0.5, abs=0.15)
    assert shares[4] > 0.97
    assert shown["lower"]["n"][50] <= shown["mean"]["n"][50] <= shown["upper"]["n"][50]
    assert main(["check", path, "--query", "simulate[<=4; 1]{n}", "--json"]) == 0
    assert "over_time" not in json.loads(capsys.readouterr().out)


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["svg", "png", "pdf"])
@pytest.mark.parametrize("query", [REACHED, "E[<=1; 40](max: n)", "simulate[<=3; 20]{n, Q.B}"])
def test_plot_draws_random_runs(path: str, tmp_path: Path, ending: str, query: str) -> None:
    picture = tmp_path / f"picture.{ending}"
    assert main(["plot", path, "--query", query, "-o", str(picture)]) == 0
    data = picture.read_bytes()
    assert data.startswith({"svg": b"<svg", "png": b"\x89PNG", "pdf": b"%PDF"}[ending])
    assert main(["plot", path, "--query", query, "-o", str(picture)]) == 0
    assert picture.read_bytes() == data, "the same runs give the same picture"


def test_plot_takes_buckets_and_runs(path: str, tmp_path: Path) -> None:
    picture = tmp_path / "picture.svg"
    words = [
        "plot",
        path,
        "--query",
        REACHED,
        "-o",
        str(picture),
        "--set",
        "runs 500",
        "--set",
        "seed 3",
    ]
    assert main([*words, "--set", "buckets 10"]) == 0
    root = ET.fromstring(picture.read_text("utf-8"))
    titles = [one.text or "" for one in root.iter("{http://www.w3.org/2000/svg}title")]
    assert sum(re.match(r"[\d.]+ to [\d.]+: ", one) is not None for one in titles) == 10
    assert "500 values of 500 runs" in picture.read_text("utf-8")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--query", REACHED, "-o", "a.jpg"], "endings: .svg, .png, .pdf"),
        (["--query", "Pr[<=1](<> n > 100)"], "none of 72 runs reaches what"),
        (["--query", "Pr[<=1]([] n < 100)"], "none of 72 runs breaks what"),
        (["--query", "simulate[<=1; 5]{n} : 2 : n > 100"], "shows no run"),
        (["--query", "E<> Q.B", "--as", "runs"], "is not answered by random runs"),
        (["--query", REACHED, "--as", "gantt"], "has no trace"),
        (["--query", REACHED, "--set", "buckets 3", "--set", "bucket width 1"], "not both"),
    ],
)
def test_plot_refuses_what_cannot_be_drawn(
    path: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    says: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["plot", path, *arguments]) == 2
    assert says in capsys.readouterr().err


def test_plot_draws_what_there_is_at_a_limit(
    path: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "picture.svg"
    words = ["plot", path, "--query", "E[<=1; 100000000](max: n)", "-o", str(picture)]
    assert main([*words, "--timeout", "0.3s"]) == 3
    assert "stopped by the time limit: the picture shows the runs until then" in (
        capsys.readouterr().err
    )
    assert picture.exists()
    assert main(["plot", path, "--query", "E<> Q.B", "--set", "runs 3", "-o", str(picture)]) == 0
    assert "--set 'runs …' has no effect here: no random runs are drawn" in capsys.readouterr().err
