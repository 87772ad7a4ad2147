"""A needle behind an emulated controller: the same decisions, and an end at every fault."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest

from ntagen.drive.configure import configure
from ntagen.drive.plant import NeedlePlant, simulated_axes
from ntagen.drive.records import Command, Ended, Record
from ntagen.drive.simulate import Maker, Result, Simulated, simulate, synthesiser_for
from ntagen.drive.states import State
from ntagen.drive.stepped import Stepped
from ntagen.grbl.axes import Axes, Axis
from ntagen.grbl.emulator import Emulator
from ntagen.needle.virtual import Obstacle
from ntagen.nsl import load
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Needle, Scene

SCENE = load(Path(__file__).parents[3] / "examples" / "paper.nsl")


class Diary:
    """A journal that keeps the records."""

    def __init__(self) -> None:
        self.records: list[Record] = []

    def record(self, record: Record) -> None:
        self.records.append(record)

    def started(self, scene: Scene) -> None:
        pass

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        pass

    def commands(self) -> list[tuple[str, float]]:
        return [(r.kind, round(r.value, 2)) for r in self.records if isinstance(r, Command)]


def drive(name: str, make: Maker | None = None) -> tuple[Result, Diary]:
    configuration = configure((), SCENE, "all", name)
    diary = Diary()
    settings = configuration.settings
    result = simulate(
        SCENE,
        synthesiser_for(settings),
        settings,
        diary,
        errors=configuration.errors,
        make=make or configuration.needle.make,
        seed=3,
    )
    return result, diary


@pytest.mark.slow
def test_the_same_decisions_are_made_behind_the_controller() -> None:
    plain, plain_diary = drive("phantom")
    result, diary = drive("grbl+sim")
    assert diary.commands() == plain_diary.commands()
    assert result.ended.outcome == plain.ended.outcome == State.TARGET_REACHED.value
    assert result.clearance_mm == pytest.approx(plain.clearance_mm, abs=0.01)
    assert result.target_distance_mm == pytest.approx(plain.target_distance_mm, abs=0.01)
    # Ramps and reports take time on the controller's clock.
    assert plain.ended.time_s < result.ended.time_s < 1.2 * plain.ended.time_s


FAULTS: dict[str, Callable[[Emulator], object]] = {
    "alarm": lambda emulator: emulator.raise_alarm(1),
    "power cut": lambda emulator: emulator.power_on(),
    "noise": lambda emulator: emulator.send(b"\xff\xfe\n"),
    "silence": lambda emulator: setattr(emulator.faults, "is_silent", True),
    "stuck": lambda emulator: setattr(emulator.faults, "pace", 0.0),
}


@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("seconds", [0.5, 17.3])
def test_a_fault_ends_the_run_and_nothing_moves_after_it(name: str, seconds: float) -> None:
    made: list[Stepped] = []
    choice = configure((), SCENE, "all", "virtual").needle

    def make(needle: Needle, obstacles: tuple[Obstacle, ...], seed: int) -> Simulated:
        device = Stepped(choice.make(needle, obstacles, seed), needle.speed_mm_per_s)
        device.emulator.after(seconds, lambda: FAULTS[name](device.emulator))
        made.append(device)
        return device

    result, diary = drive("virtual", make)
    assert result.ended.outcome == State.FAULTED.value
    assert any(isinstance(record, Ended) for record in diary.records)
    emulator = made[0].emulator
    emulator.faults.pace = 1.0
    stopped = emulator.position
    emulator.advance(emulator.now_s + 20.0)
    assert emulator.position == pytest.approx(stopped, abs=1e-6)
    assert result.clearance_mm > 0.0


class Moves:
    """A needle that notes how it is moved."""

    def __init__(self) -> None:
        self.moves: list[tuple[str, float]] = []

    def push(self, length_mm: float) -> None:
        self.moves.append(("push", length_mm))

    def roll(self, angle_rad: float) -> None:
        self.moves.append(("roll", angle_rad))

    def roll_on(self, angle_rad: float) -> None:
        self.moves.append(("roll on", angle_rad))

    def pull(self, length_mm: float) -> None:
        self.moves.append(("pull", length_mm))


def test_pieces_of_a_motion_are_one_motion_of_the_needle() -> None:
    needle = Moves()
    plant = NeedlePlant(needle, simulated_axes(1.0))
    for axis, step in (("X", 0.5), ("X", 0.5), ("A", 90.0), ("A", -90.0), ("X", -0.25), ("X", 0.0)):
        plant.move({axis: step}, 0.01)
    plant.settle()
    plant.settle()
    assert needle.moves == [
        ("push", 1.0),
        ("roll", pytest.approx(math.pi / 2)),
        ("roll", pytest.approx(-math.pi / 2)),
        ("pull", 0.25),
    ]


def test_a_roll_that_is_seen_on_its_way_is_one_roll() -> None:
    needle = Moves()
    plant = NeedlePlant(needle, simulated_axes(1.0))
    for step in (45.0, 45.0, -90.0, -90.0):
        plant.move({"A": step}, 0.01)
        plant.settle()
    plant.move({"X": 1.0}, 0.01)
    plant.move({"A": -90.0}, 0.01)
    plant.settle()
    kinds = [kind for kind, _ in needle.moves]
    assert kinds == ["roll", "roll on", "roll", "roll on", "push", "roll"]
    plant.finish()
    plant.move({"A": -90.0}, 0.01)
    plant.settle()
    assert needle.moves[-1][0] == "roll"


def test_an_axis_that_turns_the_other_way_round_moves_the_needle_the_right_way() -> None:
    axes = Axes(Axis("Y", -1), Axis("Z", -1))
    needle = Moves()
    plant = NeedlePlant(needle, axes)
    for axis, step in (("Y", -2.0), ("Z", -180.0), ("Y", 1.0), ("X", 7.0)):
        plant.move({axis: step}, 0.01)
    plant.settle()
    assert needle.moves == [("push", 2.0), ("roll", pytest.approx(math.pi)), ("pull", 1.0)]
