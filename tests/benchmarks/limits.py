"""Whether the time and memory limits hold where there are many clocks, measured from outside.

    python tests/benchmarks/limits.py [--timeout 0.5] [--memory 100] [--only workflow]

Five families of models with 30 to 250 clocks, and queries of every kind (those that a model does
not allow are passed over). Each query is answered by a process of its own, forked after the model
was loaded: printed are those that end late or take more than the limit and a tenth, by the wall
clock and by the resident memory beyond that of the loaded model, and the greatest of each. Wall
time means little on a machine that is busy with something else, so that the processor time beyond
the limit is printed too.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from ntagen import checker

MIB = 1 << 20
MOST_LATE_S = 0.5
MOST_MEMORY_RATIO = 1.1
CLOCKS = (30, 60, 120, 250)


def _workflow(clocks: int) -> str:
    """Tasks that may begin when three others have ended, each with a duration of its own."""
    return f"""
    const int N = {clocks}; typedef int[0,N-1] id_t; bool ended[id_t];
    bool may(id_t i) {{ return i < 3 || (ended[i - 1] && ended[i - 2] && ended[i - 3]); }}
    process Task(const id_t i) {{
        clock x; state Idle, Works {{ x <= 5 + i % 7 }}, Done; init Idle;
        trans Idle -> Works {{ guard may(i); assign x = 0; }},
            Works -> Done {{ guard x >= 2 + i % 3; assign ended[i] = true; }};
    }}
    system Task;"""


def _fischer(clocks: int) -> str:
    """Mutual exclusion by waiting."""
    return f"""
    const int N = {clocks}; typedef int[1,N] id_t; int[0,N] id;
    process Task(const id_t i) {{
        clock x; state Idle, Asks {{ x <= 2 }}, Works, Done; init Idle;
        trans Idle -> Asks {{ guard id == 0; assign x = 0; }},
            Asks -> Works {{ assign x = 0, id = i; }},
            Works -> Asks {{ guard id == 0; assign x = 0; }},
            Works -> Done {{ guard x > 2 && id == i; }}, Done -> Idle {{ assign id = 0; }};
    }}
    system Task;"""


def _pulses(clocks: int) -> str:
    """Oscillators that hear each other in the second half of their periods."""
    return f"""
    const int N = {clocks}; typedef int[1,N] id_t; broadcast chan pulse;
    process Task(const id_t i) {{
        clock x; int[0,20] early;
        state Idle {{ x <= i * i % 19 }}, Works {{ x <= 20 - early }}, Done; init Idle;
        trans Idle -> Works {{ guard x >= i * i % 19; assign x = 0; }},
            Works -> Works {{ guard x >= 20 - early; sync pulse!; assign x = 0, early = 0; }},
            Works -> Works {{ guard x > 10 && x <= 19 - early; sync pulse?; assign early++; }},
            Works -> Done {{ guard early == 9; }};
    }}
    system Task;"""


def _windows(clocks: int) -> str:
    """Sensors that report in windows of their own, and are answered or give up."""
    return f"""
    const int N = {clocks}; typedef int[0,N-1] id_t; chan alive, ack;
    process Centre() {{
        clock y; state Idle, Busy {{ y <= 1 }}; init Idle;
        trans Idle -> Busy {{ sync alive?; assign y = 0; }}, Busy -> Idle {{ sync ack!; }},
            Busy -> Idle {{ guard y >= 1; }};
    }}
    process Task(const id_t i) {{
        clock x;
        state Idle {{ x <= 10 * i + 1 }}, Works {{ x <= 10 * i + 3 }}, Done {{ x <= 3000 }};
        init Idle;
        trans Idle -> Works {{ guard x >= 10 * i; sync alive!; }}, Works -> Done {{ sync ack?; }},
            Works -> Done {{ guard x >= 10 * i + 3; }},
            Done -> Idle {{ guard x >= 3000; assign x = 0; }};
    }}
    system Centre, Task;"""


def _jobs(clocks: int) -> str:
    """Jobs that the environment ends, on machines that the controller gives them."""
    return f"""
    const int N = {clocks}; typedef int[1,N] id_t; int[0,2] busy;
    process Task(const id_t i) {{
        clock x; state Idle, Works {{ x <= 4 + i % 5 }}, Done; init Idle;
        trans Idle -> Works {{ guard busy < 2; assign x = 0, busy++; }},
            Works -u-> Done {{ guard x >= 1 + i % 3; assign busy--; }};
    }}
    system Task;"""


@dataclass(frozen=True)
class _End:
    """How a query ended: with what, by how much later than the limit, and with how much memory."""

    verdict: str
    late_s: float
    processor_late_s: float
    memory_mib: float


FAMILIES: dict[str, Callable[[int], str]] = {
    "workflow": _workflow,
    "fischer": _fischer,
    "pulses": _pulses,
    "windows": _windows,
    "jobs": _jobs,
}


def _queries(clocks: int) -> Iterator[str]:
    first, last = "Task(1)", f"Task({clocks - 1})"
    some = [f"Task({index})" for index in range(1, min(clocks, 40))]
    yield "E<> false"
    yield "A[] not deadlock"
    yield f"E<> {first}.Done && {last}.Done"
    yield f"E[] not ({first}.Done && {last}.Done)"
    yield "A<> " + " && ".join(f"{one}.x == 3" for one in some)
    yield f"{first}.Works --> " + " && ".join(f"({one}.x == 3 || {one}.x > 5)" for one in some)
    yield "E<> " + " && ".join(f"({one}.x < 3 || {one}.x > 5)" for one in some)
    yield f"sup: {last}.x"
    yield f"control: A<> {last}.Done"
    yield f"control: A[] not ({first}.Works && {last}.Works)"
    yield f"control_t*(500, 0): A<> {first}.Done"
    yield f"{{{first}.Idle, {first}.Done}} control: A<> {first}.Done"


def _resident_bytes(field: str) -> int:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(field + ":"):
            return int(line.split()[1]) * 1024
    raise RuntimeError(f"no {field} in /proc/self/status: this needs Linux")


def _answered(model: checker.Model, query: str, timeout_s: float, memory_mib: int) -> _End:
    """The end of a query in a process of its own, in seconds beyond the limit and in MiB."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        before, start = _resident_bytes("VmRSS"), time.monotonic()
        used_s = time.process_time()
        game = query.startswith(("control", "{"))
        try:
            answer = model.check(
                query,
                timeout_s=timeout_s,
                memory_bytes=memory_mib * MIB,
                strategy=game,
                trace=not game,
            )
            verdict: str = answer.verdict
        except checker.RejectedError:
            verdict = "rejected"
        end = {
            "verdict": verdict,
            "late_s": time.monotonic() - start - timeout_s,
            "processor_late_s": time.process_time() - used_s - timeout_s,
            "memory_mib": (_resident_bytes("VmHWM") - before) / MIB,
        }
        os.write(write, json.dumps(end).encode())
        os._exit(0)
    os.close(write)
    with os.fdopen(read) as pipe:
        text = pipe.read()
    os.waitpid(child, 0)
    if not text:
        return _End("aborted", 0.0, 0.0, 0.0)
    return _End(**json.loads(text))


def main() -> int:
    """Measures, and prints what does not hold; 1 if there is anything."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--timeout", type=float, default=0.5, help="in seconds")
    parser.add_argument("--memory", type=int, default=100, help="in MiB")
    parser.add_argument("--only", choices=FAMILIES, help="one family")
    asked = parser.parse_args()
    broken = 0
    for name, family in FAMILIES.items():
        if asked.only not in (None, name):
            continue
        for clocks in CLOCKS:
            model = checker.load(family(clocks), "model.xta")
            ends = []
            for query in _queries(clocks):
                end = _answered(model, query, asked.timeout, asked.memory)
                ends.append(end)
                is_late = end.late_s > MOST_LATE_S
                is_large = end.memory_mib > MOST_MEMORY_RATIO * asked.memory
                if is_late or is_large or end.verdict == "aborted":
                    broken += 1
                    print(f"  {name} {clocks}, {query[:60]}: {end}")
            decided = sum(end.verdict in ("satisfied", "not satisfied") for end in ends)
            late_s = max(end.late_s for end in ends)
            processor_s = max(end.processor_late_s for end in ends)
            memory_mib = max(end.memory_mib for end in ends)
            print(
                f"{name} {clocks}: {decided} of {len(ends)} decided, at most {late_s:.2f} s late "
                f"({processor_s:.2f} s of processor time), {memory_mib:.0f} MiB",
                flush=True,
            )
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
