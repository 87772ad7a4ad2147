"""Lists more than 10^6 plans to disk, certified: plans per second, and memory.

    python tests/benchmarks/plan_list.py [--rolls 4] [--depth 34]

The scene has seven angles, so the number of plans grows fast with the number of rolls: with 4 rolls
there are 1.3 million. Printed are the seconds until the engine has the list, those until all plans
are certified and on disk, the peak of memory after each of both (`getrusage`), the bytes of memory
and of the file for each plan, and three ratios: to 60 s and 500 MB for each 10^6 plans,
and of the time of a certificate to that of one alone (`ntagen.plan.certify`, a sample of 500).
"""

from __future__ import annotations

import argparse
import itertools
import math
import resource
import tempfile
import time
from pathlib import Path

from ntagen import checker
from ntagen.cli.models.plan_lists import ListLimits
from ntagen.cli.needle.task_questions import write_certified
from ntagen.nsl import load_task
from ntagen.plan.certify import certify
from ntagen.plan.extract import pages_of
from ntagen.plan.rank import in_pages
from ntagen.plan.synthesise import GUIDE, STRATEGY_QUERY
from ntagen.render import render

LIMIT_S, LIMIT_MB, MANY, SAMPLE = 60.0, 500.0, 1e6, 500

TASK = """
environment many {{
  needle {{ tip (0, 0, 0) mm  heading -y  bevel +z  radius 60 mm  speed 1 mm/s }}
  motion {{
    step 2 s
    roll by 45, 90, 135, 180, 225, 270, 315 deg  at most {rolls} times  at least 2 mm apart
  }}
  target    T1  sphere (0, -{depth:g}, 0) mm  radius 12 mm
  critical  C1  sphere (12, -12, 0) mm  radius 2 mm
  detection D1  sphere (12, -12, 0) mm  radius 5 mm
  tissue static
  resolution 1000 per mm
  safety sampled
}}
"""


def peak_mb() -> float:
    """The most memory that this process has taken."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def main() -> None:
    """Prints the figures."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rolls", type=int, default=4)
    parser.add_argument("--depth", type=float, default=34.0, help="of the target, in mm")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "many.nsl"
        path.write_text(TASK.format(rolls=options.rolls, depth=options.depth))
        task = load_task(path)
        model = checker.load(render(task.scene, only_plans=True))
        start = time.perf_counter()
        answer = model.check(STRATEGY_QUERY, plans="all", max_plans=1 << 62, guide=GUIDE)
        engine_s, engine_mb = time.perf_counter() - start, peak_mb()
        file = Path(folder) / "plans.jsonl"
        written = write_certified(answer, file, ListLimits(), task)
        whole_s, whole_mb, file_bytes = time.perf_counter() - start, peak_mb(), file.stat().st_size
    count = answer.plan_count or 0
    print("\n".join(written.notes[1:]))
    print(f"engine: {engine_s:.1f} s, {answer.stored} states stored, peak {engine_mb:.0f} MB")
    rate, more_bytes = count / (whole_s - engine_s), (whole_mb - engine_mb) * 1e6 / count
    print(f"to disk: {whole_s - engine_s:.1f} s more, {rate:,.0f} plans/s, peak {whole_mb:.0f} MB")
    print(f"bytes for each plan: {more_bytes:.0f} of memory, {file_bytes / count:.0f} on disk")
    per_plan = MANY / count
    print(f"ratio to 60 s for each 10^6 plans: {whole_s * per_plan / LIMIT_S:.2f}")
    print(f"ratio to 500 MB for each 10^6 plans: {whole_mb * per_plan / LIMIT_MB:.2f}")
    plans = list(
        itertools.islice(itertools.chain.from_iterable(pages_of(answer, task.scene)), 8192)
    )
    start = time.perf_counter()
    for _ in in_pages(plans, task.scene):
        pass
    together_s = (time.perf_counter() - start) / len(plans)
    sample = plans[:: math.ceil(len(plans) / SAMPLE)]
    start = time.perf_counter()
    for plan in sample:
        certify(plan, task.scene)
    alone_s = (time.perf_counter() - start) / len(sample)
    print(f"a certificate: {1e6 * together_s:.0f} us, alone {1e6 * alone_s:.0f} us", end="")
    print(f", ratio {together_s / alone_s:.2f}")


if __name__ == "__main__":
    main()
