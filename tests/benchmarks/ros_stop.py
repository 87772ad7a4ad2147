"""How soon `ntagen ros` stops a needle after its service stop was called, from outside.

    python tests/benchmarks/ros_stop.py --stops 20

The time is from the call to the last word to the stage that leads deeper, by the clock of one
process that does both: it has the way of the service and that of the topic. It is 0 where nothing
moved at the moment. ROS 2 must be there.
"""

from __future__ import annotations

import argparse
import random
import statistics
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from geometry_msgs.msg import PoseStamped

from ntagen.ros.bridge import quality
from ntagen.ros.topics import STAGE_COMMAND
from tests.faults.ros import Bench

_SMALL_M = 1e-6


def one(seed: int, folder: Path) -> tuple[float, float]:
    """A stop in the middle of a run: ms until the last word deeper, and mm that the stage went."""
    told: list[tuple[float, float]] = []
    with Bench("virtual", seed, folder) as bench:
        bench.peer.hear(
            STAGE_COMMAND,
            PoseStamped,
            lambda message: told.append((time.monotonic(), -message.pose.position.y)),
            quality(depth=100),
        )
        bench.start()
        wanted_mm = random.Random(seed).uniform(2.0, 15.0)
        bench.wait_until(lambda: bench.depth_mm() > wanted_mm, 60.0)
        # In the middle of a push: the last two words lead deeper.
        while len(told) < 2 or not told[-1][1] > told[-2][1]:
            time.sleep(0.0005)
        asked_s, there_mm = time.monotonic(), bench.depth_mm()
        bench.stop()
        bench.finish()
        last_s = asked_s
        deepest = max(depth for at_s, depth in told if at_s < asked_s)
        for at_s, depth in told:
            if at_s >= asked_s and depth > deepest + _SMALL_M:
                last_s, deepest = at_s, depth
        return 1e3 * (last_s - asked_s), bench.depth_mm() - there_mm


def main() -> None:
    """Prints each stop, and the median and the greatest of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stops", type=int, default=20)
    options = parser.parse_args()
    found = []
    for seed in range(options.stops):
        with tempfile.TemporaryDirectory() as folder:
            found.append(one(seed, Path(folder)))
        print(f"{found[-1][0]:7.1f} ms  {found[-1][1]:6.2f} mm", flush=True)
    times = [ms for ms, _ in found]
    ways = [mm for _, mm in found]
    print(
        f"{len(found)} stops: {statistics.median(times):.1f} ms in the median, {max(times):.1f} ms "
        f"at most; the stage went on by {max(ways):.2f} mm at most"
    )


if __name__ == "__main__":
    main()
