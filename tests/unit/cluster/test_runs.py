"""Random runs on a Dask cluster on loopback: the same answers as on one machine."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ntagen import checker
from ntagen.checker import Options
from ntagen.checker.options import UnderChoice
from ntagen.cli import main
from ntagen.cluster import runs as cluster_runs
from ntagen.cluster.identity import identity
from ntagen.cluster.runs import DaskRuns, Job, make_block, why_here
from ntagen.errors import InputError, NtagenError
from tests.clusters import local_cluster

MODEL = """
clock x; int n;
process Q() { state A { x <= 4 }, B; init A; trans A -> B { guard x >= 2; }; }
process R() { state A { ; 5 }; init A; trans A -> A { guard n < 9; assign n++; }; }
system Q, R;
"""
REACHED = "Pr[<=3](<> Q.B)"

GAME = """
clock x, t; int n;
process P() {
    state A { x <= 4 }, B, C;
    init A;
    trans A -> B { guard x >= 1; }, A -u-> C { guard x > 2; };
}
process R() { state A { ; 5 }; init A; trans A -u-> A { guard n < 9; assign n++; }; }
system P, R;
"""
KEPT_SAFE = "strategy Safe = control: A[] not P.C"
EARLY = "Pr[<=10](<> P.B && t <= 1.5) under Safe"
"""The strategy leaves open when P moves between 1 and 2."""

SLOW = """
clock x; int n;
int work(int k) {
    int i, j;
    for (i = 0; i < 3000; i++) {
        for (j = 0; j < 1000; j++) { k = (k * 31 + i + j) % 1009; }
    }
    return k % 3;
}
process Q() {
    state A { x <= 4 }, B;
    init A;
    trans A -> B { select i : int[0,9]; assign n = work(i); };
}
system Q;
"""
"""Each run takes tens of milliseconds."""


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """A cluster with two worker processes."""
    with local_cluster() as found:
        yield found


def lines(printed: str) -> list[dict[str, Any]]:
    """The JSON of answers without their times."""
    found = [json.loads(line) for line in printed.splitlines()]
    for line in found:
        del line["seconds"], line["load_seconds"]
    return found


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_json_is_that_of_one_machine(
    tmp_path: Path,
    cluster: Any,  # noqa: ANN401
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / "model.xta"
    path.write_text(MODEL, "utf-8")
    words = ["check", str(path), "--json", "--seed", "3", "--epsilon", "0.004"]
    for query in [
        REACHED,
        "Pr[<=3; 20000]([] !Q.B)",
        "Pr[<=3](<> Q.B) >= 0.49",
        "Pr[<=3](<> Q.B) >= Pr[<=3](<> n > 8)",
        "E[<=1; 30000](max: n)",
    ]:
        words += ["--query", query]
    code = main(words)
    here = lines(capsys.readouterr().out)
    assert main([*words, "--set", f"dask {cluster.scheduler_address}"]) == code
    assert lines(capsys.readouterr().out) == here
    assert len(here) == 5
    assert here[0]["runs"] > 20_000
    assert here[1]["distribution"]["runs"] == 20_000


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("choice", ["race", "lazy"])
def test_runs_under_a_strategy_are_those_of_one_machine(
    tmp_path: Path,
    cluster: Any,  # noqa: ANN401
    capsys: pytest.CaptureFixture[str],
    choice: str,
) -> None:
    path = tmp_path / "game.xta"
    path.write_text(GAME, "utf-8")
    words = ["check", str(path), "--json", "--epsilon", "0.01", "--set", f"under choice {choice}"]
    for query in [KEPT_SAFE, EARLY, "E[<=3; 5000](max: n) under Safe"]:
        words += ["--query", query]
    assert main(words) == 0
    here = lines(capsys.readouterr().out)
    assert main([*words, "--set", f"dask {cluster.scheduler_address}"]) == 0
    said = capsys.readouterr()
    assert "by this machine" not in said.err
    assert lines(said.out) == here
    # Among the times from 1 to 4, half of the moves that are drawn are not made.
    early = pytest.approx(1 - (5 / 6) ** 0.5, abs=0.03)
    assert here[1]["value"] == (0 if choice == "lazy" else early)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_runs_under_a_learned_strategy_are_made_here(
    tmp_path: Path,
    cluster: Any,  # noqa: ANN401
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / "game.xta"
    path.write_text(GAME, "utf-8")
    learned = "strategy Least = minE(n)[<=3]{}->{t}: <> t >= 3"
    few = ["--set", "good-runs 200", "--set", "max-iterations 3"]
    words = ["check", str(path), "--json", "--seed", "1", *few]
    for query in [learned, "E[<=3; 500](max: n) under Least", "E[<=3; 500](max: n)"]:
        words += ["--query", query]
    assert main(words) == 0
    here = lines(capsys.readouterr().out)
    assert main([*words, "--set", f"dask {cluster.scheduler_address}"]) == 0
    said = capsys.readouterr()
    assert lines(said.out) == here
    assert said.err.count("by this machine: Least is no strategy of a game") == 1
    model = checker.load(GAME)
    model.check(learned, seed=1, good_runs=200, max_iterations=3)
    with (
        DaskRuns(cluster.scheduler_address) as runs,
        pytest.raises(InputError, match="Least is no strategy of a game"),
    ):
        runs.check(model, "E[<=3; 500](max: n) under Least")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_lost_worker_changes_nothing(cluster: Any) -> None:  # noqa: ANN401
    model, options = checker.load(SLOW), Options(runs=50)
    query = "Pr[<=3](<> n == 1)"
    with DaskRuns(cluster.scheduler_address) as runs:
        client = runs._workers.client
        victim = next(iter(client.run(os.getpid).values()))
        killed: list[float] = []

        def kill() -> None:
            # Blocks are being made from the first moment on.
            time.sleep(0.5)
            os.kill(victim, signal.SIGKILL)
            killed.append(time.monotonic())

        thread = threading.Thread(target=kill)
        thread.start()
        there = runs.answer(model, query, options)
        ended = time.monotonic()
        thread.join()
    assert killed[0] < ended, "the worker was killed too late"
    assert there.estimate == checker.load(SLOW).answer(query, options).estimate


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_workers_end_what_nobody_wants(cluster: Any) -> None:  # noqa: ANN401
    # One run takes for ever.
    endless = (
        "int n; process P() { state S { ; 9 }; init S; trans S -> S { assign n = 1 - n; }; } "
        "system P;"
    )
    with DaskRuns(cluster.scheduler_address) as runs:
        model = checker.load(endless)
        answer = runs.check(model, "Pr[<=1000000000](<> n > 1)", timeout_s=1.5)
        assert (answer.verdict, answer.stop) == ("unknown", "time")
        start = time.monotonic()
        found = runs.check(checker.load(MODEL), REACHED, runs=1000)
        assert found.estimate is not None
        assert found.estimate.runs == 1000
        assert time.monotonic() - start < 60, "the workers still make the endless runs"


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_what_is_made_here_is_said(
    tmp_path: Path,
    cluster: Any,  # noqa: ANN401
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / "model.xta"
    path.write_text(MODEL, "utf-8")
    words = ["check", str(path), "--set", f"dask {cluster.scheduler_address}"]
    words += ["--query", "simulate[<=3]{n}", "--query", REACHED, "--query", "E<> Q.B"]
    assert main(words) == 0
    said = capsys.readouterr().err
    assert said.splitlines() == [
        "note: simulate[<=3]{n}: runs are made by this machine: only the runs of Pr and E are made "
        "by a cluster"
    ]
    words = ["check", str(path), "--query", REACHED, "--set", "dask tcp://x:1"]
    assert main([*words, "--set", "joint on"]) == 0
    assert "queries that are answered jointly share their runs" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_workers_are_waited_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    distributed = pytest.importorskip("distributed", reason="needs ntagen[cluster]")
    path = tmp_path / "model.xta"
    path.write_text(MODEL, "utf-8")
    with distributed.LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address=None) as empty:
        address = empty.scheduler_address
        words = ["check", str(path), "--query", REACHED, "--set", f"dask {address}"]
        assert main([*words, "--timeout", "500ms"]) == 3
    said = capsys.readouterr()
    assert (
        said.err == f"note: the Dask cluster at {address} has no workers yet, and is waited for\n"
    )
    assert "no run has ended until then" in said.out


def test_without_statistical_queries_it_has_no_effect(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "model.xta"
    path.write_text(MODEL, "utf-8")
    assert main(["check", str(path), "--query", "E<> Q.B", "--set", "dask tcp://x:1"]) == 0
    assert (
        "--set 'dask …' has no effect here: no query is a statistical one"
        in capsys.readouterr().err
    )


def test_without_dask_there_is_a_hint(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    path = tmp_path / "model.xta"
    path.write_text(MODEL, "utf-8")
    assert main(["check", str(path), "--query", REACHED, "--set", "dask tcp://127.0.0.1:9"]) == 2
    assert "hint: pip install 'ntagen[cluster]'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("query", "options", "says"),
    [
        (REACHED, Options(), None),
        ("E[<=3; 9](max: n)", Options(), None),
        (REACHED + " >= 0.5", Options(), None),
        (REACHED + " under S", Options(), None),
        (REACHED, Options(levels="n"), "importance splitting"),
        ("simulate[<=3]{n}", Options(), "only the runs of Pr and E"),
        ("E<> Q.B", Options(), "only the runs of Pr and E"),
        ("rubbish", Options(), "only the runs of Pr and E"),
    ],
)
def test_which_runs_are_made_elsewhere(query: str, options: Options, says: str | None) -> None:
    reason = why_here(query, options)
    assert reason is None if says is None else says in (reason or "")


class Done:
    """A block that is made when it is wanted."""

    def __init__(self, job: Job, first: int, count: int) -> None:
        self.job, self.first, self.count = job, first, count

    def result(self) -> tuple[bytes, float]:
        return make_block(self.job, self.first, self.count)


class HereClient:
    """A client whose tasks are done by this process."""

    def __init__(self) -> None:
        self.blocks: list[tuple[int, int]] = []
        self.cancelled = 0

    def submit(self, task: Any, *arguments: Any, **_: Any) -> Any:  # noqa: ANN401
        if task is not make_block:
            return task(*arguments)
        _, first, count = arguments
        self.blocks.append((first, count))
        return Done(*arguments)

    def as_current(self) -> contextlib.nullcontext[None]:
        return contextlib.nullcontext()

    def cancel(self, futures: list[Any], **_: Any) -> None:  # noqa: ANN401
        self.cancelled += len(futures)


class HereWorkers:
    """Three workers that are this process."""

    size = 3

    def __init__(self, _: str) -> None:
        self.client = HereClient()

    def close(self) -> None:
        pass


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> DaskRuns:
    """A cluster that is this process."""
    pytest.importorskip("distributed", reason="needs ntagen[cluster]")
    monkeypatch.setattr(cluster_runs, "Workers", HereWorkers)
    found = DaskRuns("tcp://here:1")
    monkeypatch.setattr("distributed.wait", lambda *_, **__: None)
    return found


def test_blocks_grow_and_are_in_order(here: DaskRuns) -> None:
    model = checker.load(MODEL)
    answer = here.check(model, REACHED, epsilon=0.005)
    assert answer.estimate == model.check(REACHED, epsilon=0.005).estimate
    client: Any = here._workers.client
    ends = [first + count for first, count in client.blocks]
    assert [first for first, _ in client.blocks] == [0, *ends[:-1]]
    sizes = [count for _, count in client.blocks]
    assert sizes[0] == 1
    assert sizes == sorted(sizes)
    assert client.cancelled > 0


def test_no_runs_are_made_that_nobody_needs(here: DaskRuns) -> None:
    model = checker.load(MODEL)
    answer = here.check(model, "E[<=3; 5000](max: n)")
    assert answer.estimate is not None
    assert answer.estimate.runs == 5000
    client: Any = here._workers.client
    assert sum(count for _, count in client.blocks) == 5000
    assert client.blocks[-1][1] < 1700, "the last runs are shared by all workers"


@pytest.mark.parametrize("choice", ["race", "eager", "lazy"])
def test_the_strategy_goes_to_the_workers(here: DaskRuns, choice: UnderChoice) -> None:
    model = checker.load(GAME)
    assert model.check(KEPT_SAFE).verdict == "satisfied"
    answer = here.check(model, EARLY, epsilon=0.02, under_choice=choice)
    assert answer.estimate == model.check(EARLY, epsilon=0.02, under_choice=choice).estimate
    # A later strategy of the same name is another one.
    assert model.check("strategy Safe = control: A<> P.B").verdict == "satisfied"
    answer = here.check(model, EARLY, epsilon=0.02, under_choice=choice)
    assert answer.estimate == model.check(EARLY, epsilon=0.02, under_choice=choice).estimate


def test_a_strategy_that_is_missing_is_refused_as_without_a_cluster(here: DaskRuns) -> None:
    model = checker.load(GAME)
    with pytest.raises(checker.RejectedError, match="there is no strategy 'Safe'"):
        here.check(model, EARLY)
    assert model.check("strategy Safe = control: A[] P.A").verdict == "not satisfied"
    with pytest.raises(checker.RejectedError, match="there is no strategy 'Safe': "):
        here.check(model, EARLY)


def test_another_version_is_refused() -> None:
    job = Job("another", MODEL, "wrap", REACHED, None, Options())
    with pytest.raises(InputError, match=r"has another version of ntagen(.|\n)*hint: "):
        make_block(job, 0, 1)
    right = Job(identity(), MODEL, "wrap", REACHED, None, Options())
    block, seconds = make_block(right, 0, 5)
    assert block == checker.load(MODEL).block_of_runs(REACHED, 0, 5, Options())
    assert seconds > 0


def test_what_a_cluster_cannot_do_is_refused(here: DaskRuns) -> None:
    with pytest.raises(InputError, match=r"only the runs of Pr and E(.|\n)*hint: "):
        here.check(checker.load(MODEL), "simulate[<=3]{n}")


def test_a_cluster_that_fails_is_a_message(here: DaskRuns, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> tuple[bytes, float]:
        raise ConnectionError("the scheduler is gone")

    monkeypatch.setattr(Done, "result", broken)
    with pytest.raises(NtagenError, match=r"failed: ConnectionError: the sch(.|\n)*hint: start"):
        here.check(checker.load(MODEL), REACHED)
