"""How fast a campaign is, and what it costs beside the runs themselves.

    python tests/benchmarks/experiment.py [--runs 50] [--workers 2] [--dask] [FILE.toml]

The experiment (by default the paper's Experiment 2: nine rows, so 450 runs) is made into a new
folder, with all logs, tables and pictures. Printed are the runs in a second, and the overhead: the
time of the campaign times its workers, against the sum of what the runs took themselves, as each
worker measured it. The start of the workers and the report count as overhead. The yardsticks: 450
runs in 60 s on two cores, and at most 10 % of overhead. With `--dask`, the workers are those of a
cluster on loopback. Ends with 1 if a yardstick is missed.

Other work on the machine makes each run slower, and the first yardstick harder to meet; the second
is a ratio of times in the same campaign.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from ntagen.experiment.campaign import carry_out
from ntagen.experiment.reading import read_experiment
from ntagen.experiment.results import Campaign
from ntagen.experiment.scripting import crew_of

ROOT = Path(__file__).resolve().parents[2]
MOST_OVERHEAD = 0.1
LEAST_RUNS_PER_CORE_S = 450 / 60.0 / 2.0


@contextlib.contextmanager
def cluster(workers: int, wanted: bool) -> Iterator[str | None]:
    """The address of a cluster on loopback, if one is wanted."""
    if not wanted:
        yield None
        return
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=workers, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    ) as found:
        yield found.scheduler_address


def slowest_rows(made: Campaign) -> str:
    """The mean time of a run in each row."""
    rows = [(row["run_s"]["avg"], row["id"]) for row in made.table if row["run_s"]]
    return ", ".join(f"{name} {1e3 * seconds:.0f} ms" for seconds, name in sorted(rows)[::-1])


def main() -> int:
    """Makes the campaign, and prints how it went."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    default = ROOT / "examples" / "experiments" / "virtual.toml"
    parser.add_argument("file", nargs="?", type=Path, default=default, metavar="FILE.toml")
    parser.add_argument("--runs", type=int, default=50)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--dask", action="store_true")
    arguments = parser.parse_args()
    experiment = read_experiment(arguments.file, arguments.runs)
    workers: int = arguments.workers
    with tempfile.TemporaryDirectory() as name, cluster(workers, arguments.dask) as address:
        since = time.perf_counter()
        crew = crew_of(None if address else workers, address)
        made = carry_out(experiment, Path(name), crew)
        seconds = time.perf_counter() - since
        size = sum(path.stat().st_size for path in Path(name).rglob("*") if path.is_file())
    own = sum(run["seconds"] for run in made.runs)
    overhead = seconds * workers / own - 1.0
    rate = len(made.runs) / seconds
    fast = rate / workers >= LEAST_RUNS_PER_CORE_S
    print(
        f"{len(made.runs)} runs in {seconds:.1f} s on {workers} workers: {rate:.1f} runs/s "
        f"(at least {LEAST_RUNS_PER_CORE_S * workers:.1f}: {'met' if fast else 'MISSED'})"
    )
    print(
        f"overhead {overhead:.1%} of {own:.1f} s in the runs themselves (at most "
        f"{MOST_OVERHEAD:.0%}: {'met' if overhead <= MOST_OVERHEAD else 'MISSED'})"
    )
    print(f"a run takes: {slowest_rows(made)}; all files take {size / 2**20:.0f} MiB")
    return 0 if fast and overhead <= MOST_OVERHEAD else 1


if __name__ == "__main__":
    sys.exit(main())
