"""How long a decision to stop, or a sample that demands it, takes to become a byte on the wire.

    python tests/benchmarks/stop.py [--stops 1000] [--busy 2]

A driver pushes a needle by an emulated GRBL controller on a pseudo-terminal. Another thread decides
to stop at random moments of the motion and calls `GrblActuator.stop`. Noted are the times from the
decision until the stop byte has gone into the terminal, and until it can be read at the other end
(by an own process, which answers nothing itself).

Then a tracker in a process of its own sends 40 samples a second through OpenIGTLink, and at random
moments of a push one with a force that the guard of the push forbids. Noted is the time from the
sending of that sample until the supervisor's stop byte has gone into the terminal.

First the machine is as it is, then ``--busy`` processes keep it busy. The bar: p99 at most 20 ms.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import os
import pty
import random
import select
import statistics
import threading
import time
import tty
from multiprocessing.connection import Connection

from ntagen.drive.supervisor import Guard, Supervisor
from ntagen.errors import Halted
from ntagen.grbl.actuator import GrblActuator, StoppedError
from ntagen.grbl.axes import Axes, Axis
from ntagen.grbl.dialects import GRBLHAL
from ntagen.grbl.emulator import Emulator
from ntagen.grbl.memory import Memory
from ntagen.grbl.port import SerialPort
from ntagen.grbl.protocol import HOLD
from ntagen.needle.measurement import Measurement
from ntagen.openigtlink.server import Server
from ntagen.tracking.frames import IDENTITY
from ntagen.tracking.live import LiveTracker, Source
from ntagen.tracking.simulated import FORCE, NEEDLE, packets_of

BAR_MS = 20.0
RATE_HZ = 40.0


class _NotingPort(SerialPort):
    """Notes when the last stop byte was written."""

    stop_written_s = 0.0

    def write(self, data: bytes) -> None:
        super().write(data)
        if data.startswith(HOLD):
            self.stop_written_s = time.monotonic()


def _controller(results: Connection, names: Connection) -> None:
    """An emulated controller in a process of its own; notes when each stop byte arrives."""
    emulator = Emulator(GRBLHAL, memory=Memory(GRBLHAL, {110: 6000.0, 111: 6000.0, 120: 200.0}))
    emulator.power_on()
    here, there = pty.openpty()
    tty.setraw(there)
    names.send(os.ttyname(there))
    began_s = time.monotonic()
    while True:
        due_s = emulator.next_event_s() - (time.monotonic() - began_s)
        ready, _, _ = select.select([here, results], [], [], max(0.0, min(0.01, due_s)))
        if results in ready:
            return
        data = os.read(here, 4096) if here in ready else b""
        if HOLD in data:
            results.send(time.monotonic())
        emulator.advance(time.monotonic() - began_s)
        emulator.feed(data)
        os.write(here, emulator.take())


def _spin() -> None:
    while True:
        math.sqrt(2.0)


def _measure(stops: int, busy: int) -> None:
    load = [multiprocessing.Process(target=_spin, daemon=True) for _ in range(busy)]
    results, far_results = multiprocessing.Pipe()
    names, far_names = multiprocessing.Pipe()
    controller = multiprocessing.Process(
        target=_controller, args=(far_results, far_names), daemon=True
    )
    for process in (controller, *load):
        process.start()
    port = _NotingPort(names.recv())
    actuator = GrblActuator(port, Axes(insert=Axis("X"), roll=Axis("Y")))
    draw = random.Random(1)
    written, arrived, confirmed = [], [], []
    for _ in range(stops):
        failures: list[Exception] = []
        push = threading.Thread(target=_push, args=(actuator, failures))
        push.start()
        time.sleep(draw.uniform(0.02, 0.12))
        decided_s = time.monotonic()
        actuator.stop()
        confirmed.append(time.monotonic() - decided_s)
        push.join()
        if failures:
            raise failures[0]
        written.append(port.stop_written_s - decided_s)
        arrived.append(results.recv() - decided_s)
    seen = _supervised(actuator, port, results, stops, draw)
    results.send(None)
    for process in (controller, *load):
        process.terminate()
        process.join()
    actuator.close()
    print(f"{stops} stops, {busy} busy processes, {os.cpu_count()} processors")
    _tell("decision to stop byte written", written)
    _tell("decision to stop byte readable", arrived)
    _tell("decision to standing confirmed", confirmed, bar_ms=None)
    _tell("sample sent to stop byte written", seen)


def _tracker(orders: Connection) -> None:
    """Sends samples; after an order to hurt, and its delay, one with too much force."""
    with Server("127.0.0.1") as server:
        orders.send(server.port)
        force_n, due_s = 0.0, math.inf
        while True:
            if orders.poll(0.0):
                order = orders.recv()
                if order is None:
                    return
                force_n, due_s = 0.0, time.monotonic() + order
            wait_s = min(1.0 / RATE_HZ, max(0.0, due_s - time.monotonic()))
            time.sleep(wait_s)
            if time.monotonic() >= due_s:
                force_n, due_s = 9.0, math.inf
                orders.send(time.monotonic())
            server.send(*packets_of(Measurement(0.0, (0.0, 0.0, 0.0), force_n)))


def _supervised(
    actuator: GrblActuator, port: _NotingPort, results: Connection, stops: int, draw: random.Random
) -> list[float]:
    """The times from samples that demand a stop until the stop byte is written."""
    orders, far_orders = multiprocessing.Pipe()
    tracker = multiprocessing.Process(target=_tracker, args=(far_orders,), daemon=True)
    tracker.start()
    source = Source("127.0.0.1", orders.recv(), NEEDLE, force=FORCE)
    guard = Guard((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0, 5.0, (), 1.0)
    seconds = []
    with LiveTracker(source, IDENTITY, actuator.now_s) as sensor:
        supervisor = Supervisor(sensor)
        actuator.watch = supervisor.watch
        for _ in range(stops):
            orders.send(draw.uniform(0.1, 0.2))
            while sensor.measure().force_n > 0.0:
                pass
            try:
                with supervisor.guarding(guard):
                    actuator.push(5.0)
            except Halted:
                seconds.append(port.stop_written_s - orders.recv())
                while results.poll(0.2):
                    results.recv()
            else:
                raise RuntimeError("a motion was not stopped")
    orders.send(None)
    tracker.join()
    return seconds


def _push(actuator: GrblActuator, failures: list[Exception]) -> None:
    """Pushes until somebody stops it; notes any other end."""
    try:
        actuator.push(5.0)
    except StoppedError:
        return
    except Exception as error:
        failures.append(error)
    else:
        failures.append(RuntimeError("a motion was not stopped"))


def _tell(what: str, seconds: list[float], bar_ms: float | None = BAR_MS) -> None:
    ms = sorted(1000.0 * s for s in seconds)
    p99 = ms[math.ceil(0.99 * len(ms)) - 1]
    verdict = "" if bar_ms is None else f"   p99 / bar = {p99 / bar_ms:.2f}"
    print(f"  {what}: p50 {statistics.median(ms):.2f}  p99 {p99:.2f}  max {ms[-1]:.2f} ms{verdict}")


def main() -> None:
    """Measures twice and prints."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stops", type=int, default=1000)
    parser.add_argument("--busy", type=int, default=2)
    options = parser.parse_args()
    for busy in (0, options.busy):
        _measure(options.stops, busy)


if __name__ == "__main__":
    main()
