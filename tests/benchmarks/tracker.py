"""How late a sample is that comes by OpenIGTLink, and how much a client of pyigtl adds.

    python tests/benchmarks/tracker.py [--rate HZ] [--samples N]

A server in a process of its own sends the pose of a needle on this machine. Each message carries
the time at which it was sent. The latency is the time from there until the reader has the
measurement in the coordinates of the scene. The yardstick is the budget of a supervisor, 20 ms from
the sample to the stop, and pyigtl, read as its documentation shows, on the same server.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time

from ntagen.openigtlink.samples import Policy
from ntagen.tracking.frames import IDENTITY
from ntagen.tracking.live import LiveTracker, Source

BUDGET_MS = 20.0
SERVER = """
import sys, time
from ntagen.openigtlink.messages import Transform
from ntagen.openigtlink.packets import Packet
from ntagen.openigtlink.server import Server

with Server() as server:
    print(server.port, flush=True)
    origin_s = float(sys.argv[1])
    while True:
        time.sleep(1.0 / float(sys.argv[2]))
        # 32-bit numbers hold a minute in microseconds.
        sent_ms = (time.monotonic() - origin_s) * 1e3
        columns = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (sent_ms, 0.0, 0.0))
        server.send(Packet("Needle", Transform(columns)))
"""


def ours(port: int, origin_s: float, count: int) -> list[float]:
    """The latencies of our client in ms."""
    found = []
    source = Source("127.0.0.1", port, "Needle", policy=Policy(stale_s=5.0))
    with LiveTracker(source, IDENTITY, time.monotonic) as tracker:
        for _ in range(count):
            sent_ms = tracker.measure().position_mm[0]
            found.append((time.monotonic() - origin_s) * 1e3 - sent_ms)
    return found


def theirs(port: int, origin_s: float, count: int) -> list[float]:
    """The latencies of the client of pyigtl in ms."""
    import pyigtl

    client = pyigtl.OpenIGTLinkClient("127.0.0.1", port)
    found = []
    for _ in range(count):
        message = client.wait_for_message("Needle", timeout=5)
        found.append((time.monotonic() - origin_s) * 1e3 - float(message.matrix[0, 3]))
    client.stop()
    return found


def main() -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rate", type=float, default=100.0, help="messages a second")
    parser.add_argument("--samples", type=int, default=1000)
    options = parser.parse_args()
    for name, read in (("ntagen", ours), ("pyigtl", theirs)):
        origin_s = time.monotonic()
        command = [sys.executable, "-c", SERVER, str(origin_s), str(options.rate)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
            assert server.stdout is not None
            try:
                found = sorted(read(int(server.stdout.readline()), origin_s, options.samples))
            finally:
                server.kill()
        p50, p99 = (found[int(part * (len(found) - 1))] for part in (0.5, 0.99))
        share = p99 / BUDGET_MS
        print(
            f"{name}: median {p50:.2f} ms, p99 {p99:.2f} ms, max {found[-1]:.2f} ms: "
            f"p99 is {share:.0%} of the budget of {BUDGET_MS:g} ms"
        )


if __name__ == "__main__":
    main()
