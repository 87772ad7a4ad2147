"""How long a user waits for the first plan of the paper's scene, from the start of the process.

    python tests/benchmarks/start.py [--repeats 15] [--task examples/paper.nsl]

First the stages of one process are measured, each with the modules that it imports: their median
processor time, and how much of it is importing. Then whole processes, as a user starts them: the
median of wall and processor time, with the ratio to the yardstick of 0.25 s, for `ntagen plan` up
to its first line, for `ntagen check` with one plan, and for Python alone. A ratio of at most 1 is
wanted. Compiled modules, and what the program stores for later runs, lie in a folder of this
benchmark, and are there when it begins to count.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

WHOLE_S = 0.25
QUERY = "control: A<> Checker.Final_TR_Reached"
ROOT = Path(__file__).parents[2]


def stages(task_file: Path) -> None:
    """Goes through the stages in this process; prints seconds and seconds of imports as JSON."""
    rows: list[tuple[str, float, float]] = []
    moments = [time.process_time()]

    def imported() -> None:
        moments.append(time.process_time())

    def done(stage: str) -> None:
        begin, imports, end = moments[-2], moments[-1], time.process_time()
        rows.append((stage, end - begin, imports - begin))
        moments.append(end)

    import ntagen.cli.check

    imported()
    done(f"command `{ntagen.cli.check.command.name}`")

    import ntagen.nsl.build
    import ntagen.nsl.resolve

    imported()
    task = ntagen.nsl.load_task(task_file)
    done("reading")

    from ntagen.render import render

    imported()
    text = render(task.scene)
    done("rendering")

    from ntagen import checker

    imported()
    model = checker.load(text)
    done("loading")

    imported()
    answer = model.check(QUERY, plans="all", max_plans=1)
    done("solving")

    import ntagen.plan.document
    from ntagen.drive.configure import configure
    from ntagen.plan.extract import extract
    from ntagen.plan.rank import certified

    imported()
    ranking = configure(task.given, task.scene).settings.ranking
    plans = certified(extract(answer.plans, task.scene), task.scene, ranking)
    done("certificate")
    if not plans:
        raise SystemExit("no plan was found")
    print(json.dumps(rows))


def processes(command: list[str], environment: dict[str, str], repeats: int) -> tuple[float, float]:
    """The median wall and processor seconds of a process, after two that do not count."""
    walls, processor = [], []
    for _ in range(repeats + 2):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        begin = time.perf_counter()
        subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL)
        walls.append(time.perf_counter() - begin)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        processor.append(used)
    return statistics.median(walls[2:]), statistics.median(processor[2:])


def first_line(command: list[str], environment: dict[str, str]) -> tuple[float, float] | None:
    """Wall and processor seconds until a process prints its first plan; None if that is no plan.

    Then the process is ended.
    """
    begin = time.perf_counter()
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as process:
        if process.stdout is None or b"found" not in process.stdout.readline():
            return None
        wall = time.perf_counter() - begin
        on_processor_ns = Path(f"/proc/{process.pid}/schedstat").read_text().split()[0]
        process.terminate()
        process.communicate()
    return wall, 1e-9 * int(on_processor_ns)


def first_lines(
    command: list[str], environment: dict[str, str], repeats: int
) -> tuple[float, float]:
    """The medians of seconds until the first plan, after two that do not count."""
    found = [first_line(command, environment) for _ in range(repeats + 2)][2:]
    pairs = [pair for pair in found if pair is not None]
    if len(pairs) < repeats:
        raise SystemExit("the first line is no plan")
    walls, processor = zip(*pairs, strict=True)
    return statistics.median(walls), statistics.median(processor)


def clean_environment(folder: str) -> dict[str, str]:
    """Variables for processes that keep compiled modules, and what else they store, in a folder."""
    return {
        name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"
    } | {"PYTHONPYCACHEPREFIX": folder, "XDG_CACHE_HOME": folder}


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--repeats", type=int, default=15)
    options.add_argument("--task", type=Path, default=ROOT / "examples" / "paper.nsl")
    options.add_argument("--stages", action="store_true", help=argparse.SUPPRESS)
    given = options.parse_args()
    if given.stages:
        stages(given.task)
        return
    with tempfile.TemporaryDirectory() as folder:
        environment = clean_environment(folder)
        own = [sys.executable, __file__, "--stages", "--task", str(given.task)]
        runs = []
        for _ in range(given.repeats + 1):
            output = subprocess.run(own, check=True, env=environment, capture_output=True).stdout
            runs.append(json.loads(output))
        print(f"{'stage':24} {'ms':>8} {'imports':>8}")
        for rows in zip(*runs[1:], strict=True):
            seconds = statistics.median(row[1] for row in rows)
            imports = statistics.median(row[2] for row in rows)
            print(f"{rows[0][0]:24} {1e3 * seconds:8.1f} {1e3 * imports:8.1f}")
        check = [sys.executable, "-m", "ntagen", "check", str(given.task)]
        check += ["--query", QUERY, "--plans", "-", "--set", "max plans 1"]
        print(f"{'whole process':24} {'wall ms':>8} {'ratio':>8} {'cpu ms':>8} {'ratio':>8}")
        plan = [sys.executable, "-m", "ntagen", "plan", str(given.task)]
        for name, command, measure in [
            ("python, doing nothing", [sys.executable, "-c", ""], processes),
            ("plan, to its first plan", plan, first_lines),
            ("check for one plan", check, processes),
        ]:
            wall, used = measure(command, environment, given.repeats)
            print(
                f"{name:24} {1e3 * wall:8.1f} {wall / WHOLE_S:8.2f}"
                f" {1e3 * used:8.1f} {used / WHOLE_S:8.2f}"
            )


if __name__ == "__main__":
    main()
