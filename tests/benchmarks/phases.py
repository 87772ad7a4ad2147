"""Whether limits and Ctrl-C hold in every phase of a command, measured from outside.

    python tests/benchmarks/phases.py [--only writing] [--limits 1s,200MiB,^C] [--messages]

Each row is a command that would spend its time in one phase: loading, solving, checking, printing,
writing, drawing and so on. Each column is a limit: of time, of memory, Ctrl-C after a second, and
Ctrl-C twice in a row. A command with a limit runs in a process of its own; printed is how late it
ends, or how much memory it takes beyond its limit, and its exit code.

What is taken away: the time and the memory of a command that does nothing. Whoever is late by more
than half a second and a tenth of the limit, or takes more than a tenth beside it, is marked with !;
so is an exit code that is not that of a limit or of Ctrl-C, a traceback, and a file that is left
half written. A command that ends before its limit is marked with =. On a machine that is busy the
wall clock says little, so that a command counts as late only if its processor time is late, too.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

MIB = 1 << 20
MOST_LATE_S = 0.5
MOST_BESIDE = 0.1
COLUMNS = ("1s", "3s", "10s", "200MiB", "500MiB", "^C", "^C^C")
STOPPED, INTERRUPTED = 3, 130
TOO_LONG_S = 40.0


def functions(mebibytes: int) -> str:
    """A model whose text is long."""
    lines, size = ["int v;\n"], 0
    while size < mebibytes * MIB:
        number = len(lines)
        lines.append(
            f"int f{number}(int a) {{ int b = a + {number}; if (b > {number % 97}) "
            f"{{ b = b * 3 - a; }} else {{ b = b / 7 + a * {number % 13}; }} return b; }}\n"
        )
        size += len(lines[-1])
    process = "process P() { state S; init S; trans S -> S { guard v < 3; assign v++; }; }"
    return "".join([*lines, process, " system P;"])


def edges(count: int) -> str:
    """A model with as many locations and edges."""
    moves = ",".join(
        f"L{i} -> L{(i * 7 + 1) % count} {{ guard x >= {i % 50} && v < {i % 97}; "
        f"assign x = 0, v = (v + {i}) % 17; }}"
        for i in range(count)
    )
    places = ",".join(f"L{i}" for i in range(count))
    head = "clock x; int v; process P() {"
    return f"{head} state {places}; init L0; trans {moves}; }} system P;"


def processes(count: int) -> str:
    """A template with as many instances."""
    places = ",".join(f"L{i} {{ x <= {i + 10} }}" for i in range(30))
    moves = ",".join(
        f"L{i} -> L{(i + 1) % 30} {{ guard x >= {i} && v[id] < {i}; "
        f"assign x = 0, v[id] = (v[id] + {i}) % 17; }}"
        for i in range(30)
    )
    head = f"typedef int[0,{count - 1}] id_t; int[0,20] v[id_t]; clock x; process P(const id_t id)"
    return f"{head} {{ state {places}; init L0; trans {moves}; }} system P;"


def regions(count: int) -> str:
    """A task with as many obstacles."""
    task = (Path(__file__).parents[2] / "examples" / "paper.nsl").read_text()
    end = task.rindex("}")
    kinds = "ABCDEFGH"
    each = " ".join(
        f"critical {kind}[i] sphere (400 + i / 200, i - i / 200 * 200, {3 * at}) mm radius 1 mm"
        for at, kind in enumerate(kinds)
    )
    more = f"  for i in 0..{count // len(kinds) - 1} {{ {each} }}"
    return f"{task[:end]}{more}\n{task[end:]}"


COUNTERS = """
int[0,30000] a, b;
process P() { state S; init S; trans S -> S { guard a < 30000; assign a = a + 1; }; }
process Q() { state S; init S; trans S -> S { guard b < 30000; assign b = b + 1; }; }
system P, Q;"""

URGENT = COUNTERS.replace("init S;", "urgent S; init S;")

JOBS = """
const int N = 40; typedef int[1,N] id_t; int[0,2] busy;
process Task(const id_t i) {
    clock x; state Idle, Works { x <= 4 + i % 5 }, Done; init Idle;
    trans Idle -> Works { guard busy < 2; assign x = 0, busy++; },
        Works -u-> Done { guard x >= 1 + i % 3; assign busy--; };
}
system Task;"""

GUARD = """
const int N = 3000; int[0,N] a, b; clock x;
process E() {
    state S { x <= 3 }, Lost; init S;
    trans S -u-> S { guard a < N && x >= 1; assign a++, x = 0; },
        S -u-> S { guard b < N && x >= 1; assign b++, x = 0; }, S -u-> Lost { guard x > 2; };
}
process C() { state S; init S; trans S -> S { guard x >= 1 && x <= 2; assign x = 0; }; }
system E, C;"""

WORDY_GAME = """
int zeros[4000]; int[0,9000] a; clock x;
process E() {
    state S { x <= 3 }, Lost; init S;
    trans S -u-> S { guard a < 9000 && x >= 1; assign a++, x = 0; }, S -u-> Lost { guard x > 2; };
}
process C() { state S; init S; trans S -> S { guard x >= 1 && x <= 2; assign x = 0; }; }
system E, C;"""

WORDY = """
int zeros[4000]; int[0,20000] n; clock x;
process P() {
    state S { x <= 2 }; init S;
    trans S -> S { guard x >= 1 && n < 20000; assign n = n + 1, x = 0; };
}
system P;"""

LONG = """
int[0,3000000] n; clock x;
process P() {
    state S { x <= 2 }; init S; trans S -> S { guard x >= 1; assign n = n + 1, x = 0; };
}
system P;"""

WORDIER = WORDY.replace("20000", "90000")

TWO_WAYS = """
int[0,60] n; clock x;
process P() {
    state S { x <= 1 }, Goal; init S;
    trans S -> S { guard x >= 1 && n < 60; assign n++, x = 0; },
        S -> S { guard x >= 1 && n < 60; assign x = 0, n++; }, S -> Goal { guard n == 60; };
}
system P;"""

GRID = """
int[0,97] a, b;
process P() { state S; init S; trans S -> S { guard a < 97; assign a = a + 1; }; }
process Q() { state S; init S; trans S -> S { guard b < 97; assign b = b + 1; }; }
system P, Q;"""

WALK = """
int n; clock x;
process P() {
    state S { x <= 1 }, Never; init S;
    trans S -> S { assign x = 0, n = (n + 1) % 7; }, S -> Never { guard n == 9; };
}
system P;"""


@dataclass(frozen=True)
class Case:
    """A command that spends its time in one phase.

    Attributes:
        phase: Its name.
        model: The text of the model, or what makes it.
        words: The words of the command behind the model.
        command: The command.
        before: The words of a `check` that makes a file that is needed.
        name: The name of the model.
    """

    phase: str
    model: str | Callable[[], str]
    words: tuple[str, ...]
    command: str = "check"
    before: tuple[str, ...] = ()
    name: str = "model.xta"


def _asked(query: str, *words: str) -> tuple[str, ...]:
    return ("--query", query, *words)


_SAFE = "control: A[] not E.Lost"
_ALL = "A[] n <= 90000"
_LAST = "E<> n == 20000"

CASES = (
    Case("loading a long text", lambda: functions(40), _asked("E<> v == 2")),
    Case("loading many edges", lambda: edges(500_000), _asked("E<> v == -1")),
    Case("loading many processes", lambda: processes(30_000), _asked("E<> x > 50")),
    Case("loading a task", lambda: regions(9_600), (), name="task.nsl"),
    Case("searching", COUNTERS, _asked("E<> a + b > 59999")),
    Case("searching loops", URGENT, _asked("A<> a + b > 59999")),
    Case("searching values", COUNTERS, _asked("sup: a + b")),
    Case("solving a game", JOBS, _asked("control: A<> Task(39).Done && Task(1).Done")),
    Case("extracting a strategy", GUARD, _asked(_SAFE, "--strategy", "out.json")),
    Case(
        "checking a strategy",
        GUARD.replace("3000", "700"),
        ("made.json",),
        "verify",
        _asked(_SAFE, "--strategy", "made.json"),
    ),
    Case("computing times", LONG, _asked("E<> n == 2900000", "--verify")),
    Case("printing a trace", WORDY, _asked(_LAST, "--trace", "-")),
    Case("writing a trace", WORDY, _asked(_LAST, "--trace", "out.txt")),
    Case("writing a trace, JSON", WORDY, _asked(_LAST, "--trace", "out.json")),
    Case("writing a trace, XML", WORDY, _asked(_LAST, "--trace", "out.xml")),
    Case("writing a trace, XTR", WORDY, _asked(_LAST, "--trace", "out.xtr")),
    Case("writing a certificate", WORDIER, _asked(_ALL, "--certificate", "out.jsonl")),
    Case("printing a strategy", WORDY_GAME, _asked(_SAFE, "--strategy", "-")),
    Case("writing a strategy", WORDY_GAME, _asked(_SAFE, "--strategy", "out.txt")),
    Case("writing a strategy, JSON", WORDY_GAME, _asked(_SAFE, "--strategy", "out.json")),
    Case("writing a controller", GUARD.replace("3000", "400"), _asked(_SAFE, "--strategy", "o.c")),
    Case("listing plans", TWO_WAYS, _asked("control: A<> P.Goal", "--plans", "out.jsonl")),
    Case("writing plans", TWO_WAYS, _asked("control: A<> P.Goal", "--plans", "out.json")),
    Case(
        "drawing a graph", GRID, ("--as", "states", "--set", "limit 20000", "-o", "out.svg"), "plot"
    ),
    Case("drawing a trace", LONG, _asked("E<> n == 300000", "-o", "out.svg"), "plot"),
    Case("drawing templates", lambda: edges(60_000), ("--as", "templates", "-o", "o.svg"), "plot"),
    Case("one random run", WALK, _asked("Pr[<=1000000000](<> P.Never)")),
    Case("many random runs", WALK, _asked("Pr[<=10](<> P.Never)", "--runs", "1000000000")),
    Case("runs that are shown", WALK, _asked("simulate[<=100000; 1000]{n}", "--json")),
    Case("describing a model", lambda: edges(300_000), ("--json",), "info"),
    Case(
        "checking a certificate",
        GRID.replace("97", "900"),
        ("made.jsonl",),
        "verify",
        _asked("A[] a + b <= 1800", "--certificate", "made.jsonl"),
    ),
    Case("serving", COUNTERS, (), "serve"),
)


@dataclass(frozen=True)
class End:
    """How a command ended."""

    wall_s: float
    processor_s: float
    peak_bytes: int
    code: int
    said: str
    half_written: bool


def _run(words: Sequence[str], folder: Path, interrupts: Sequence[float] = ()) -> End:
    """Runs a command, and interrupts it at these moments."""
    for old in folder.glob(".ntagen-*"):
        old.unlink()
    start_s = time.monotonic()
    with (folder / "said").open("wb") as said, (folder / "printed").open("wb") as printed:
        process = subprocess.Popen(
            [sys.executable, "-m", "ntagen", *words], cwd=folder, stdout=printed, stderr=said
        )
        timers = [threading.Timer(at, process.send_signal, [signal.SIGINT]) for at in interrupts]
        timers.append(threading.Timer(TOO_LONG_S, process.kill))
        for timer in timers:
            timer.start()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    for timer in timers:
        timer.cancel()
    text = (folder / "said").read_text(errors="replace")
    lines = (folder / "printed").read_bytes()[-100_000:].decode(errors="replace")
    stopped = [line for line in (text + lines).splitlines() if "stopped" in line[:400]]
    parts = [*folder.glob(".ntagen-*"), *folder.glob("**/*.part")]
    return End(
        time.monotonic() - start_s,
        usage.ru_utime + usage.ru_stime,
        usage.ru_maxrss * 1024,
        process.returncode,
        "Traceback" if "Traceback" in text else (stopped or text.splitlines() or [""])[-1].strip(),
        bool(parts),
    )


def _serve(words: Sequence[str], folder: Path) -> End:
    """Asks a server for more than its limits allow, and then whether it lives."""
    started = subprocess.Popen(
        [sys.executable, "-m", "ntagen", "serve", *words],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        assert started.stdout is not None
        address, _, token = started.stdout.readline().split()[-1].partition("?token=")

        def ask(path: str, data: object = None) -> dict[str, object]:
            body = data if isinstance(data, bytes) or data is None else json.dumps(data).encode()
            asked = urllib.request.Request(f"{address}api/{path}", body, {"X-Ntagen-Token": token})
            answer: dict[str, object] = json.load(urllib.request.urlopen(asked, timeout=30))
            return answer

        number = ask("files?name=model.xta", (folder / "model.xta").read_bytes())["file"]
        start_s = time.monotonic()
        wish = {"action": "check", "query": "E<> a + b > 59999"}
        job = ask(f"files/{number}/jobs", wish)["job"]
        while (told := ask(f"jobs/{job}"))["state"] == "running":
            time.sleep(0.02)
        wall_s = time.monotonic() - start_s
        lives = ask(f"files/{number}/jobs", {"action": "info"}).get("job") is not None
        said = json.dumps(told.get("answers"))[:300] if lives else "the server does not answer"
        return End(wall_s, wall_s, 0, int(str(told["exit"])), said, not lives)
    finally:
        started.terminate()
        started.wait()


def _limited(case: Case, column: str, folder: Path, nothing: End) -> End:
    """A command with the limit of a column."""
    words = [case.command, case.name, *case.words]
    if column.startswith("^"):
        at_s = nothing.wall_s + 1.0
        return _run(words, folder, [at_s, at_s + 0.1][: column.count("^")])
    option = "--timeout" if column.endswith("s") else "--memory"
    if case.command == "serve":
        return _serve([option, column], folder)
    return _run([*words, option, column], folder)


def _cell(end: End, column: str, nothing: End) -> tuple[str, bool]:
    """What is shown of a command, and whether its limit held."""
    codes = [STOPPED]
    if column.startswith("^"):
        late_s = end.wall_s - nothing.wall_s - 1.0
        text, codes, limit_s = f"{late_s:+.2f} s", [INTERRUPTED, STOPPED], 1.0
        processor_late_s = end.processor_s - nothing.processor_s - limit_s
        held = min(late_s, processor_late_s) <= MOST_LATE_S
        if end.code in (0, 1):
            return f"={end.code}", True
    elif column.endswith("s"):
        limit_s = float(column[:-1])
        late_s = end.wall_s - nothing.wall_s - limit_s
        processor_late_s = end.processor_s - nothing.processor_s - limit_s
        most_s = max(MOST_LATE_S, MOST_BESIDE * limit_s)
        text = f"{late_s:+.2f} s"
        held = min(late_s, processor_late_s) <= most_s
        if end.code in (0, 1):
            return f"={end.code}", late_s <= most_s
    else:
        limit = float(column[:-3]) * MIB
        ratio = (end.peak_bytes - nothing.peak_bytes) / limit
        text = f"{ratio:.2f} x"
        held = ratio <= 1 + MOST_BESIDE
        if held and end.code in (0, 1, -signal.SIGKILL):
            # It needs no more memory than that, or was ended after a long time.
            return f"={end.code}", True
    held = held and end.code in codes and end.said != "Traceback" and not end.half_written
    return f"{text} {end.code}", held


def main() -> int:
    """Measures, and prints the table; 1 if a limit does not hold."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", default="", help="phases whose names contain this")
    parser.add_argument("--limits", default=",".join(COLUMNS), help="columns, with commas")
    parser.add_argument("--messages", action="store_true", help="print what each command says")
    asked = parser.parse_args()
    columns = asked.limits.split(",")
    broken = 0
    # Where a shell lets this program ignore Ctrl-C, the commands would ignore it, too.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "nothing.xta").write_text("process P() { state S; init S; } system P;")
        nothing = _run(["check", "nothing.xta", "--query", "E<> P.S"], folder)
    beside = f"{nothing.wall_s:.2f} s and {nothing.peak_bytes / MIB:.0f} MiB"
    print(f"taken away: {beside} of a command that does nothing")
    print("".join(["phase".ljust(26), *(column.rjust(14) for column in columns)]))
    for case in CASES:
        if asked.only not in case.phase:
            continue
        print(case.phase.ljust(26), end="", flush=True)
        messages = []
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            model = case.model if isinstance(case.model, str) else case.model()
            (folder / case.name).write_text(model)
            if case.before:
                _run(["check", case.name, *case.before], folder)
            for column in columns:
                if case.command == "serve" and (column.startswith("^") or column.endswith("B")):
                    print("".rjust(14), end="")
                    continue
                end = _limited(case, column, folder, nothing)
                text, held = _cell(end, column, nothing)
                broken += not held
                print(f"{text}{' ' if held else '!'}".rjust(14), end="", flush=True)
                messages.append(f"    {column}: {end.said}")
        print()
        if asked.messages:
            print("\n".join(messages), flush=True)
    print(f"{broken} do not hold")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
