"""How much memory and time a large constant table takes, from its file to an answer.

    python tests/benchmarks/tables.py [--entries 2097152] [--repeats 3]

For each form of a table, models in XML are loaded and asked for the greatest value that a function
reads from it, by compiled and by interpreted code, each in a process of its own. Printed are the
peak of resident memory above the same process before loading, an entry, and its ratio to the
yardstick of 16 bytes; and the processor time of loading, and its ratio to the yardstick of 1 s.
A ratio of at most 1 is wanted.
"""

from __future__ import annotations

import argparse
import json
import random
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ENTRY_BYTES, LOAD_S = 16.0, 1.0
GREATEST = 20_000

MODEL = """<?xml version="1.0" encoding="utf-8"?>
<nta><declaration>
{declaration}
int x;
int get(int i) {{ if (i &lt; 0) return 0; return {look_up}; }}
</declaration>
<template><name>P</name><location id="a"/><init ref="a"/>
<transition><source ref="a"/><target ref="a"/><label kind="select">i : int[0, 199]</label>
<label kind="assignment">x = get(i)</label></transition></template>
<system>system P;</system></nta>
"""


def listed(dimensions: list[int], numbers: random.Random) -> str:
    """A nested list of random numbers; the last one is the greatest of all."""
    if len(dimensions) == 1:
        parts = [str(numbers.randint(-999, 9999)) for _ in range(dimensions[0])]
    else:
        parts = [listed(dimensions[1:], numbers) for _ in range(dimensions[0])]
    return "{" + (", " if len(dimensions) == 1 else ",\n").join(parts) + "}"


def models(entries: int) -> dict[str, str]:
    """The models, by the form of their table; each can read the greatest value."""
    side = round(entries ** (1 / 3))
    rows, last = entries // 4, side - 1
    forms = {
        "cube": (f"[{side}]" * 3, [side] * 3, f"T[{last} - i % {side}][{last}][{last}]"),
        "index type": (f"[int[0, {entries - 1}]]", [entries], f"T[{entries - 1} - i]"),
        "rows of 4": (f"[{rows}][4]", [rows, 4], f"T[{rows - 1} - i][3]"),
    }
    texts = {}
    for form, (sizes, dimensions, look_up) in forms.items():
        table = listed(dimensions, random.Random(1))
        end = table.rindex(",") + 1
        closing = table[len(table.rstrip("}")) :]
        declaration = f"const int T{sizes} = {table[:end]} {GREATEST}{closing};"
        texts[form] = MODEL.format(declaration=declaration, look_up=look_up)
    return texts


def measure(path: Path, engine: str) -> None:
    """Loads a model and asks about it; prints seconds, bytes and the answer as JSON."""
    from ntagen import checker

    def peak_bytes() -> int:
        # The peak that `getrusage` tells counts what this process was before it was this program.
        status = Path("/proc/self/status").read_text()
        return 1024 * int(re.findall(r"VmHWM:\s*(\d+) kB", status)[0])

    before, begin = peak_bytes(), time.process_time()
    model = checker.load_file(path)
    seconds = time.process_time() - begin
    answer = model.check("sup: x", engine=engine)
    entry = {"seconds": seconds, "bytes": peak_bytes() - before, "greatest": answer.value}
    print(json.dumps(entry))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--entries", type=int, default=128**3)
    options.add_argument("--repeats", type=int, default=3)
    options.add_argument("--measure", type=Path, help=argparse.SUPPRESS)
    options.add_argument("--engine", default="jit", help=argparse.SUPPRESS)
    given = options.parse_args()
    if given.measure:
        measure(given.measure, given.engine)
        return
    print(f"{'table':12} {'code':12} {'bytes/entry':>12} {'ratio':>6} {'load s':>8} {'ratio':>6}")
    with tempfile.TemporaryDirectory() as folder:
        for form, text in models(given.entries).items():
            path = Path(folder) / "model.xml"
            path.write_text(text)
            for engine in ("jit", "interpreter"):
                command = [sys.executable, __file__, "--measure", str(path), "--engine", engine]
                runs = [
                    json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
                    for _ in range(given.repeats)
                ]
                if any(run["greatest"] != GREATEST for run in runs):
                    raise SystemExit(f"wrong answer: {runs[0]['greatest']}")
                size = statistics.median(run["bytes"] for run in runs) / given.entries
                seconds = statistics.median(run["seconds"] for run in runs)
                print(
                    f"{form:12} {engine:12} {size:12.1f} {size / ENTRY_BYTES:6.2f}"
                    f" {seconds:8.2f} {seconds / LOAD_S:6.2f}"
                )


if __name__ == "__main__":
    main()
