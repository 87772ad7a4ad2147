"""What states on disk cost: a search in half of the memory that it takes, against one in all of it.

    python tests/benchmarks/spill.py [--place DIR] [--runs 3] [MODEL QUERY]

Without a model, two machines of ``machines/`` and a lattice of counters are searched. For each, the
memory that the search takes is measured first. Then it is searched alternately in memory, and with
half of it and the rest in a folder. Times are medians; MB are what the process takes beyond what it
took before the search, pages of the file with it.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent / "machines"
LATTICE = """
int[0, 139] a, b, c;
process P() {
  state S; init S;
  trans S -> S { guard a < 139; assign a = a + 1; },
        S -> S { guard b < 139; assign b = b + 1; },
        S -> S { guard c < 139; assign c = c + 1; };
}
system P;
"""
SEARCH = """
import json, re, sys
from pathlib import Path
from ntagen import checker
def taken(name):
    status = Path("/proc/self/status").read_text()
    return int(re.search(name + r":\\s+(\\d+)", status)[1]) * 1024
path, query, memory, place = sys.argv[1:]
model = checker.load_file(Path(path))
before = taken("VmRSS")
limits = {"memory_bytes": int(memory), "spill": Path(place)} if place else {}
answer = model.check(query, **limits)
print(json.dumps([answer.verdict, answer.stored, answer.peak_bytes, answer.seconds,
                  taken("VmHWM") - before]))
"""
ROW = "{:<10} {:>10} {:>8} {:>8} {:>8} {:>7} {:>7} {:>6}"


def searched(model: Path, query: str, memory: int, place: str) -> list[Any]:
    """Verdict, states, bytes that the engine counts, seconds, bytes of the process."""
    command = [sys.executable, "-c", SEARCH, str(model), query, str(memory), place]
    run = subprocess.run(command, capture_output=True, text=True, check=True, cwd=FOLDER)
    found: list[Any] = json.loads(run.stdout)
    return found


def main() -> None:
    """Prints a row for each model."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("asked", nargs="*", help="a model and a query")
    parser.add_argument("--place", help="a folder on the disk that is to be measured")
    parser.add_argument("--runs", type=int, default=3)
    options = parser.parse_args()
    print(ROW.format("model", "states", "MB", "on disk", "counted", "s", "s", "ratio"))
    with tempfile.TemporaryDirectory(dir=options.place) as place:
        lattice = Path(place) / "lattice.xta"
        lattice.write_text(LATTICE, encoding="utf-8")
        todo = [
            (lattice, "A[] a + b + c < 1000"),
            (FOLDER / "copying.xta", "E<> sender.Done && !is_copied()"),
            (FOLDER / "sorting.xta", "A[] at <= 27"),
        ]
        if options.asked:
            todo = [(Path(options.asked[0]).resolve(), options.asked[1])]
        for model, query in todo:
            half = searched(model, query, 0, "")[2] // 2
            pairs = [
                (searched(model, query, 0, ""), searched(model, query, half, place))
                for _ in range(options.runs)
            ]
            whole, spilled = pairs[-1]
            if whole[:2] != spilled[:2]:
                raise SystemExit(f"{model.stem}: {whole} in memory, {spilled} on disk")
            seconds = [statistics.median(pair[one][3] for pair in pairs) for one in (0, 1)]
            sizes = [round(one / 2**20) for one in (whole[4], spilled[4], spilled[2])]
            times = [f"{one:.1f}" for one in seconds]
            ratio = f"{seconds[1] / seconds[0]:.2f}"
            print(ROW.format(model.stem, whole[1], *sizes, *times, ratio), flush=True)


if __name__ == "__main__":
    main()
