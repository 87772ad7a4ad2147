"""How long a user waits for a plan of a cluttered scene: whole processes, against UNC's planners.

    python -m tests.benchmarks.clutter_start FOLDER [--repeats 3]

FOLDER has scenes as for `tests.benchmarks.clutter`, of three kinds: spheres (clutter10 to 30),
vessels, and a tunnel. Each becomes a task with rolls by multiples of 45 deg, at most 3, the bevel
free before the entry, and the tight target. `ntagen plan TASK` is started, and ended when it has
printed its first plan, which is certified; compiled modules are there already.

Printed are, for each kind, wall and processor seconds: the median of the scenes, the 90th
percentile and the most, each scene by the median of its repeats. The yardstick is the quickest of
UNC's three planners (RRT) with the same scenes in voxels of 1 mm: 0.27 s before its search (loading
and what can be reached), and 4, 32 and 692 ms of search (median, 90th percentile, most). It was
measured apart from this script, on an idle machine of the same kind, for all scenes together. A
ratio of at most 1 is wanted.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import tempfile
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

from tests.benchmarks.clutter import percentile
from tests.benchmarks.start import clean_environment, first_line

BEFORE_SEARCH_S = 0.27
SEARCH_S = (0.004, 0.032, 0.692)


def task_of(path: Path) -> str:
    """A scene as a task."""
    data = json.loads(path.read_text())
    needle, target = data["needle"], data["target"]

    def vector(values: Sequence[float]) -> str:
        return "(" + ", ".join(f"{value:.6f}" for value in values) + ")"

    lines = [
        f"environment {path.stem.replace('-', '_')} {{",
        f"  needle {{ tip {vector(needle['tip'])} mm  heading {vector(needle['heading'])}",
        f"    bevel free  radius {needle['radius']} mm  speed 1 mm/s",
        f"    length {needle['max_length']} mm }}",
        "  motion { step 2 s",
        "    roll by 45, 90, 135, 180, 225, 270, 315 deg at most 3 times at least 0 mm apart }",
        f"  target T sphere {vector(target['center'])} mm radius {target['tight_radius']} mm",
    ]
    lines += [
        f"  critical C{i} sphere {vector(sphere[:3])} mm radius {sphere[3]:.6f} mm"
        for i, sphere in enumerate(data["spheres"])
    ]
    lines += [
        f"  critical V{i} capsule {vector(rod[:3])} mm to {vector(rod[3:6])} mm"
        f" radius {rod[6]:.6f} mm"
        for i, rod in enumerate(data["capsules"])
    ]
    lines += ["  resolution 10000 per mm", "  drive { depth in target 0 mm }", "}"]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    kinds: defaultdict[str, list[tuple[float, float] | None]] = defaultdict(list)
    with tempfile.TemporaryDirectory() as folder:
        environment = clean_environment(folder)
        for path in sorted(options.folder.glob("*.json")):
            task = Path(folder, f"{path.stem}.nsl")
            task.write_text(task_of(path))
            command = [sys.executable, "-m", "ntagen", "plan", str(task)]
            times = [first_line(command, environment) for _ in range(options.repeats + 1)][1:]
            found = [time for time in times if time is not None]
            kind = path.stem.rpartition("-")[0].rstrip("0123456789")
            walls, processor = zip(*found, strict=True) if found else ((), ())
            kinds[kind].append(
                (statistics.median(walls), statistics.median(processor)) if found else None
            )
    if not kinds:
        raise SystemExit(f"no scenes in {options.folder}")
    yardsticks = [BEFORE_SEARCH_S + search for search in SEARCH_S]
    print(f"{'kind':10} {'solved':>9}  seconds: {'median':>14} {'90 %':>14} {'most':>14}")
    for kind, outcomes in kinds.items():
        solved = [outcome for outcome in outcomes if outcome is not None]
        share = f"{len(solved)} of {len(outcomes)}"
        for index, name in enumerate(("wall", "processor")):
            seconds = [outcome[index] for outcome in solved]
            values = [percentile(seconds, 0.5), percentile(seconds, 0.9), max(seconds)]
            cells = [
                f"{value:.3f} ({value / yardstick:.2f})"
                for value, yardstick in zip(values, yardsticks, strict=True)
            ]
            row = "".join(f" {cell:>14}" for cell in cells)
            print(f"{kind:10} {share:>9} {name:>9}{row}")
    print("in parentheses: the ratio to the yardstick")


if __name__ == "__main__":
    main()
