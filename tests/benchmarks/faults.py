"""Random faults of a stepper controller at random moments: does every run end well?

    python tests/benchmarks/faults.py [--runs 1000] [--first 0]

Each run steers the virtual needle of the paper's scene behind an emulated controller, on a
simulated clock, with one fault at a random moment. The needle must end still; nothing may move
afterwards, not even when somebody presses the resume button; the needle must stay out of the known
critical region; and a fault that can be noticed must end the run as a device fault within one
motion. A motor that loses steps or jams goes unnoticed by the controller, and slow axes are noticed
in long motions only: there the measured position must keep the needle safe. A hold button that is
pressed in the last 50 ms of a jog changes nothing, as the controller has computed the rest already.
Printed are counts for each fault, and the greatest way that the axes made after it. The yardstick
is 0 wrong runs.
"""

from __future__ import annotations

import argparse
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from ntagen.drive.configure import configure
from ntagen.drive.records import Record
from ntagen.drive.simulate import Simulated, simulate, synthesiser_for
from ntagen.drive.states import State
from ntagen.drive.stepped import Stepped
from ntagen.grbl.emulator import Emulator
from ntagen.needle.virtual import Obstacle
from ntagen.nsl import load
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Needle, Scene

SCENE = load(Path(__file__).resolve().parents[2] / "examples" / "paper.nsl")
LONGEST_S = 75.0
ONE_MOTION_MM = 5.01
STILL = 1e-6

NOTICED: dict[str, Callable[[Emulator], object]] = {
    "limit switch (ALARM:1)": lambda emulator: emulator.raise_alarm(1),
    "alarm (ALARM:3)": lambda emulator: emulator.raise_alarm(3),
    "soft reset": lambda emulator: emulator.feed(b"\x18"),
    "power cut": lambda emulator: emulator.power_on(),
    "noise": lambda emulator: emulator.send(b"\xff\xfe\x80\n"),
    "long noise": lambda emulator: emulator.send(b"U" * 3000),
    "silence": lambda emulator: setattr(emulator.faults, "is_silent", True),
    "frozen axes": lambda emulator: setattr(emulator.faults, "pace", 0.0),
    "door": lambda emulator: emulator.feed(b"\x84"),
    "cable pulled": lambda emulator: None,
}
UNNOTICED: dict[str, Callable[[Emulator], object]] = {
    "lost steps, 10 %": lambda emulator: emulator.faults.lost.update(X=0.1),
    "insertion jams": lambda emulator: emulator.faults.lost.update(X=1.0),
    "slow axes": lambda emulator: setattr(emulator.faults, "pace", 0.2),
    "hold button": lambda emulator: emulator.feed(b"!"),
    "roll jams": lambda emulator: emulator.faults.lost.update(A=1.0),
}
FAULTS = NOTICED | UNNOTICED


@dataclass
class Tally:
    """What happened in the runs with one fault."""

    outcomes: dict[str, int] = field(default_factory=dict)
    wrong: list[str] = field(default_factory=list)
    farthest_mm: float = 0.0


class _Silent:
    """A journal that keeps nothing."""

    def record(self, record: Record) -> None:
        pass

    def started(self, scene: Scene) -> None:
        pass

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        pass


def _run(seed: int, tallies: dict[str, Tally]) -> None:
    draw = random.Random(seed)
    name = draw.choice(sorted(FAULTS))
    at_s = draw.uniform(0.0, LONGEST_S)
    configuration = configure((), SCENE, "all", "virtual")
    devices: list[Stepped] = []
    struck: list[float] = []

    def make(needle: Needle, obstacles: tuple[Obstacle, ...], number: int) -> Simulated:
        inner = configuration.needle.make(needle, obstacles, number)
        device = Stepped(inner, needle.speed_mm_per_s)

        def strike() -> None:
            struck.append(device.emulator.position[0])
            FAULTS[name](device.emulator)
            if name == "cable pulled":
                device.port.break_off()

        device.emulator.after(at_s, strike)
        devices.append(device)
        return device

    settings = configuration.settings
    result = simulate(SCENE, synthesiser_for(settings), settings, _Silent(), make=make, seed=seed)
    emulator, tally = devices[0].emulator, tallies.setdefault(name, Tally())
    outcome = result.ended.outcome if struck else "over before the fault"
    tally.outcomes[outcome] = tally.outcomes.get(outcome, 0) + 1
    place = f"seed {seed}, {at_s:.3f} s: "
    if result.clearance_mm <= 0.0:
        tally.wrong.append(f"{place}a critical region was pierced")
    if struck and name in NOTICED:
        if outcome != State.FAULTED.value and not _is_late(at_s, result.ended.time_s):
            tally.wrong.append(f"{place}the run ended as '{outcome}'")
        after_mm = abs(emulator.position[0] - struck[0]) if name != "power cut" else 0.0
        tally.farthest_mm = max(tally.farthest_mm, after_mm)
        if after_mm > ONE_MOTION_MM:
            tally.wrong.append(f"{place}the needle went on for {after_mm:.2f} mm")
    if name != "cable pulled":
        _require_stillness(emulator, tally, place)


def _is_late(at_s: float, ended_s: float) -> bool:
    """Whether the fault came with the last stop of the run, when nothing was left to do."""
    return at_s > ended_s - 0.2


def _require_stillness(emulator: Emulator, tally: Tally, place: str) -> None:
    """Waits, and presses the resume button, after the fault is over."""
    emulator.faults.pace, emulator.faults.is_silent = 1.0, False
    before = emulator.position
    for button in (b"", b"~"):
        emulator.feed(button)
        emulator.advance(emulator.now_s + 20.0)
    if any(abs(a - b) > STILL for a, b in zip(before, emulator.position, strict=True)):
        tally.wrong.append(f"{place}something moved after the end")


def main() -> None:
    """Makes the runs and prints a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    tallies: dict[str, Tally] = {}
    for seed in range(options.first, options.first + options.runs):
        _run(seed, tallies)
    for name in FAULTS:
        if name not in tallies:
            continue
        tally = tallies[name]
        counts = ", ".join(
            f"{count} {outcome}" for outcome, count in sorted(tally.outcomes.items())
        )
        print(f"{name:24} {counts}; at most {tally.farthest_mm:.2f} mm after the fault")
        for wrong in tally.wrong[:5]:
            print(f"    WRONG: {wrong}")
    wrong_count = sum(len(tally.wrong) for tally in tallies.values())
    print(f"{options.runs} runs, {wrong_count} wrong (yardstick: 0)")


if __name__ == "__main__":
    main()
