"""Drives that spin the needle: cycles, stops in a turn, steppers, time, and the same decisions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from ntagen.drive.device import Assembly, Halted
from ntagen.drive.log import Log, metadata_of
from ntagen.drive.needles import choose
from ntagen.drive.pieces import Moves
from ntagen.drive.reading import read_log
from ntagen.drive.records import Command, CutShort, Journals
from ntagen.drive.replay import replay
from ntagen.drive.scene_json import scene_from_json, scene_to_json
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import Result, simulate, synthesiser_for
from ntagen.drive.spinning import TURN_RAD, Spun, push_seconds, steered
from ntagen.drive.stepped import Stepped
from ntagen.drive.torsion import Compensated, Lag
from ntagen.errors import DeviceError, InputError
from ntagen.needle.measurement import Measurement
from ntagen.needle.vectors import distance, dot
from ntagen.needle.virtual import Errors, SimulatedClock, VirtualNeedle
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.scene import Needle
from tests.drive.runs import Diary
from tests.steering import ENTRY, scene, sphere

DEEP = replace(
    scene(
        sphere("C", "critical", (0.0, -40.0, 8.0), 4.0),
        targets=[sphere("T", "target", (0.0, -70.0, 0.0), 5.0)],
    ),
    resolution_per_mm=None,
    limits=replace(scene().limits, max_rolls=1, spins=(0.3, 0.6)),
)
"""A task that only a needle that spins can do."""

SLOW = Settings(timeout_s=600.0)


class Bench:
    """An actuator that notes what it does, and is ended early in one of its motions."""

    def __init__(self, halts: dict[int, float] | None = None) -> None:
        self.done: list[tuple[str, float, float]] = []
        self._halts = halts or {}
        self._count = 0

    def now_s(self) -> float:
        return 0.0

    def push(self, length_mm: float) -> None:
        self._do("push", length_mm, 0.0)

    def roll(self, angle_rad: float) -> None:
        self._do("roll", 0.0, angle_rad)

    def screw(self, length_mm: float, angle_rad: float) -> None:
        self._do("screw", length_mm, angle_rad)

    def pull(self, length_mm: float) -> None:
        self._do("pull", length_mm, 0.0)

    def stop(self) -> None:
        """Nothing."""

    def _do(self, name: str, length_mm: float, angle_rad: float) -> None:
        self._count += 1
        part = self._halts.get(self._count, 1.0)
        self.done.append((name, round(part * length_mm, 9), round(part * angle_rad, 9)))
        if part < 1.0:
            halted = Halted("stopped")
            halted.part = part
            raise halted

    @property
    def angle_rad(self) -> float:
        return sum(angle for _, _, angle in self.done)

    @property
    def length_mm(self) -> float:
        return sum(length for _, length, _ in self.done)


def test_each_cycle_is_half_a_bend_a_turn_and_half_a_bend() -> None:
    bench = Bench()
    Spun(bench).spin(1.8, 0.5)
    assert bench.done == [
        ("push", 0.225, 0.0),
        ("screw", 0.45, round(TURN_RAD, 9)),
        ("push", 0.225, 0.0),
        ("push", 0.225, 0.0),
        ("screw", 0.45, -round(TURN_RAD, 9)),
        ("push", 0.225, 0.0),
    ]


@pytest.mark.parametrize("number", range(1, 7))
@pytest.mark.parametrize("part", [0.0, 0.2, 0.5, 0.7, 0.99])
@pytest.mark.parametrize("lag_rad", [0.0, 0.3])
def test_a_stop_anywhere_is_accounted_for(number: int, part: float, lag_rad: float) -> None:
    bench = Bench({number: part})
    actuator = Spun(Compensated(bench, Lag(lag_rad, 1.0)) if lag_rad else bench)
    with pytest.raises(Halted) as caught:
        actuator.spin(2.0, 0.5)
    assert caught.value.part == pytest.approx(bench.length_mm / 2.0)
    actuator.settle()
    actuator.push(0.0)
    turns = bench.angle_rad / TURN_RAD
    assert turns == pytest.approx(round(turns), abs=1e-6)
    before = len(bench.done)
    actuator.settle()
    assert len(bench.done) == before


def test_a_turn_is_ended_the_shorter_way_and_the_next_one_unwinds_it() -> None:
    for part, rest_rad, winds in ((0.25, -0.25, 1.0), (0.75, 0.25, -1.0)):
        bench = Bench({2: part})
        actuator = Spun(bench)
        with pytest.raises(Halted):
            actuator.spin(1.0, 0.5)
        actuator.roll(0.0)
        assert bench.done[2] == ("roll", 0.0, round(rest_rad * TURN_RAD, 9))
        actuator.spin(1.0, 0.5)
        assert bench.done[-2][2] == round(winds * TURN_RAD, 9)


def test_lag_is_wound_up_before_a_turn_and_unwound_after_it() -> None:
    bench = Bench()
    Spun(Compensated(bench, Lag(0.5, 1.0))).spin(1.0, 0.5)
    lag = round(0.5 * 0.25**2, 9)
    turn = round(TURN_RAD, 9)
    assert bench.done[1:4] == [("roll", 0.0, lag), ("screw", 0.5, turn), ("roll", 0.0, -lag)]


@pytest.mark.parametrize(("length_mm", "fraction"), [(0.0, 0.5), (1.0, 0.0), (1.0, 1.0)])
def test_impossible_spins_are_refused(length_mm: float, fraction: float) -> None:
    with pytest.raises(DeviceError, match="refuses to spin"):
        Spun(Bench()).spin(length_mm, fraction)


class Plain:
    """A device that cannot do both at once."""

    watch: Callable[[], None]

    def now_s(self) -> float:
        return 0.0

    def push(self, length_mm: float) -> None:
        """Nothing."""

    def roll(self, angle_rad: float) -> None:
        """Nothing."""

    def pull(self, length_mm: float) -> None:
        """Nothing."""

    def stop(self) -> None:
        """Nothing."""

    def measure(self) -> Measurement:
        raise NotImplementedError


def test_a_device_that_cannot_turn_meanwhile_is_refused_before_anything_moves() -> None:
    for device in (Plain(), Compensated(Plain(), Lag(1.0))):
        assert steered(device, scene(), 0.0) is device
        with pytest.raises(InputError, match="cannot insert and turn"):
            steered(device, DEEP, 0.0)
    with pytest.raises(DeviceError, match="cannot insert and turn"):
        Assembly(Plain(), Plain()).spin(1.0, 0.5)


def test_pieces_are_cycles_and_change_the_circle() -> None:
    plan = Plan.of([Push(2.5, 0.6), Push(1.0), Roll(1.0), Push(3.0, 0.3)])
    moves = Moves(DEEP, plan.actions, 0.25)
    made = []
    while moves:
        action, pose = moves.first()
        moves.drop_first()
        made.append(action)
    lengths = [one.length_mm for one in made if isinstance(one, Push)]
    assert lengths == pytest.approx([2.5 / 3] * 3 + [0.25] * 4 + [1.0] * 3)
    assert Plan.of(made).arcs(DEEP.needle)[-1].end.position_mm == pytest.approx(pose.position_mm)
    assert pose.position_mm == pytest.approx(plan.end(DEEP.needle).position_mm)


def test_a_turn_that_is_slower_than_the_insertion_counts() -> None:
    assert push_seconds(Push(10.0), 2.0, math.pi, 0.1) == 5.0
    assert push_seconds(Push(10.0, 0.4), 2.0, math.pi, 0.0) == 3.0 + 20.0
    assert push_seconds(Push(10.0, 0.4), 2.0, math.pi, 0.25 * math.pi) == 3.0 + 25.0
    assert push_seconds(Push(10.0, 0.4), 0.1, math.pi, 0.0) == 100.0


# ------------------------------------------------------------------------------------------ drives


def driven(name: str, journal: Journals, seed: int = 1, settings: Settings = SLOW) -> Result:
    needle = choose(name, Errors())
    settings = needle.fitting(needle.usual(settings, DEEP), DEEP, "all")
    return simulate(DEEP, synthesiser_for(settings), settings, journal, make=needle.make, seed=seed)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["virtual", "phantom", "grbl+sim"])
def test_a_deep_target_is_reached_and_decided_again(name: str, tmp_path: Path) -> None:
    path, diary = tmp_path / "run.mcap", Diary()
    needle = choose(name, Errors())
    settings = needle.fitting(needle.usual(SLOW, DEEP), DEEP, "all")
    with Log(path, metadata_of({"settings": settings.to_json()}), {}) as log:
        result = driven(name, Journals(log, diary))
    assert result.ended.outcome == "target reached"
    assert result.target_distance_mm < 0.0
    assert result.clearance_mm > 0.0
    assert any(command.spin for command in diary.of(Command))
    run = read_log(path)
    commands = [record for record in run.records if isinstance(record, Command)]
    assert commands == diary.of(Command)
    comparison = replay(run, synthesiser_for(settings))
    assert comparison.is_same
    assert comparison.complete


def test_plans_that_take_too_long_are_left_out() -> None:
    """A path of 70 mm with a turn of two seconds in each mm does not end in 90 s."""
    result = driven("virtual", Journals(), settings=Settings(timeout_s=90.0))
    assert result.ended.outcome != "target reached"
    assert "time" in result.ended.reason
    assert result.ended.depth_mm < 20.0


class Startled(VirtualNeedle):
    """A needle whose third turn is ended early."""

    turns = 0

    def screw(self, length_mm: float, angle_rad: float) -> None:
        self.turns += 1
        if self.turns != 3:
            super().screw(length_mm, angle_rad)
            return
        super().screw(0.3 * length_mm, 0.3 * angle_rad)
        halted = Halted("the force is too high")
        halted.part = 0.3
        raise halted


def test_a_push_that_is_ended_in_a_turn_goes_on_from_there(tmp_path: Path) -> None:
    path, diary = tmp_path / "run.mcap", Diary()
    settings = choose("virtual", Errors()).fitting(SLOW, DEEP, "all")
    with Log(path, metadata_of({"settings": settings.to_json()}), {}) as log:
        result = simulate(
            DEEP,
            synthesiser_for(settings),
            settings,
            Journals(log, diary),
            make=lambda needle, obstacles, seed: Startled(
                needle, obstacles, Errors(), seed, SimulatedClock()
            ),
        )
    assert result.ended.outcome == "target reached"
    (short,) = diary.of(CutShort)
    assert 0.0 < short.made_mm < 1.0
    comparison = replay(read_log(path), synthesiser_for(settings))
    assert comparison.is_same
    assert comparison.complete


def test_a_log_without_spins_is_read_as_before() -> None:
    text = scene_to_json(scene())
    assert "spins" not in text
    assert scene_from_json(text) == scene()
    assert scene_from_json(scene_to_json(DEEP)) == DEEP


# ---------------------------------------------------------------------------------------- steppers


def test_steppers_make_the_same_way() -> None:
    needle = Needle(ENTRY, 30.0, 1.0)
    alone = VirtualNeedle(needle, (), Errors(), 1, SimulatedClock())
    moved = Stepped(VirtualNeedle(needle, (), Errors(), 1, SimulatedClock()), 1.0)
    for actuator in (Spun(alone), Spun(moved)):
        actuator.push(3.0)
        actuator.spin(12.0, 0.4)
        actuator.roll(1.0)
        actuator.spin(5.5, 0.6)
    assert distance(alone.true_tip.position_mm, moved.true_tip.position_mm) < 0.02
    assert dot(alone.true_tip.bevel, moved.true_tip.bevel) == pytest.approx(1.0, abs=1e-3)
    x, *_, a = moved.actuator.position
    assert x == pytest.approx(20.5)
    assert a == pytest.approx(math.degrees(1.0), abs=0.01)


def test_a_needle_is_seen_in_a_turn() -> None:
    """What is seen on the way adds up to the same as at the end."""
    needle = Needle(ENTRY, 30.0, 1.0)
    ways: list[tuple[float, float, float]] = []
    for looks in (False, True):
        moved = Stepped(VirtualNeedle(needle, (), Errors(), 1, SimulatedClock()), 1.0)
        if looks:
            actuator = moved.actuator
            actuator.watch = lambda moved=moved: moved._settle()  # type: ignore[misc]
        Spun(moved).spin(6.0, 0.5)
        ways.append(moved.true_tip.position_mm)
    assert distance(*ways) < 0.02
