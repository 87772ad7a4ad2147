"""Drives through regions that move with the breath: gates, waits, replays, and the truth."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ntagen.drive.pieces import LATE_S, Pace
from ntagen.drive.records import Breathed, Command, Record
from ntagen.drive.scene_json import scene_from_json, scene_to_json
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import phantom, simulate, synthesiser_for, virtual
from ntagen.drive.stepped import stepped
from ntagen.errors import DeviceError
from ntagen.motion import Breath, Gate, Motion
from ntagen.needle.breathing import SPACING_MM
from ntagen.needle.phantom import PhantomNeedle
from ntagen.needle.phantom_parameters import PhantomParameters
from ntagen.needle.virtual import Errors, Obstacle, SimulatedClock, VirtualNeedle
from ntagen.plan.actions import Push, Roll, Wait
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Region, Scene
from tests.scenes import PAPER

PERIOD_S = 4.0
GATE = Gate(math.radians(250), math.radians(110))
TARGET = Motion(PERIOD_S, (0.0, 0.0, 8.0))


def breathing(*, clock_s: float = 0.0, gate: Gate | None = GATE) -> Scene:
    """The paper's scene with a target and a critical region that move, and a faster needle."""
    return replace(
        PAPER,
        needle=replace(PAPER.needle, speed_mm_per_s=2.0),
        limits=replace(PAPER.limits, step_s=0.5, max_rolls=1, min_roll_distance_mm=4.0),
        targets=(replace(PAPER.targets[0].grown(-4.0), motion=TARGET),),
        criticals=tuple(
            replace(one, motion=replace(TARGET, way_mm=(0.0, 0.0, 2.0))) for one in PAPER.criticals
        ),
        detections=(),
        breath=Breath(PERIOD_S, 0.5, 1, gate, clock_s),
    )


class Kept:
    """A journal that keeps the records."""

    def __init__(self) -> None:
        self.records: list[Record] = []

    def record(self, record: Record) -> None:
        self.records.append(record)

    def started(self, scene: Scene) -> None:
        pass

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        pass


SETTINGS = Settings(force_sensing=False)


@pytest.mark.parametrize("clock_s", [0.0, 1.7])
def test_a_drive_reaches_a_target_that_moves_through_its_gate(clock_s: float) -> None:
    scene, kept = breathing(clock_s=clock_s), Kept()
    result = simulate(scene, synthesiser_for(SETTINGS), SETTINGS, kept)
    assert result.ended.outcome == "target reached", result.ended.reason
    assert result.target_distance_mm < 0.0
    assert result.clearance_mm > 0.0
    commands = [one for one in kept.records if isinstance(one, Command)]
    assert any(one.kind == "wait" for one in commands)
    for one in commands:
        if one.kind == "push":
            phase_deg = 360.0 * ((clock_s + one.time_s) % PERIOD_S) / PERIOD_S
            late_deg = 360.0 * LATE_S / PERIOD_S
            assert phase_deg >= 250.0 - 1e-6 or phase_deg <= 110.0 + late_deg


@pytest.mark.slow
def test_a_stepped_needle_keeps_pace_with_a_target_that_moves() -> None:
    """Ramps and answers of the controller make each push late; the plans hold later too."""
    scene, kept = breathing(), Kept()
    make = stepped(virtual(Errors()))
    result = simulate(scene, synthesiser_for(SETTINGS), SETTINGS, kept, make=make)
    assert result.ended.outcome == "target reached", result.ended.reason
    assert result.target_distance_mm < 0.0
    assert result.clearance_mm > 0.0
    pushes = sum(isinstance(one, Command) and one.kind == "push" for one in kept.records)
    assert pushes > 2 * len(result.syntheses)


def test_the_same_run_without_waits_would_miss() -> None:
    """The gate is what keeps the tip and the target together: at another phase it is elsewhere."""
    scene = breathing()
    result = simulate(scene, synthesiser_for(SETTINGS), SETTINGS, Kept())
    away_mm = [
        scene.targets[0].distance_at_mm(result.pierced[-1].end.position_mm, time_s)
        for time_s in np.linspace(0.0, PERIOD_S, 9)
    ]
    assert min(away_mm) < 0.0 < max(away_mm)


@pytest.mark.slow
def test_phantoms_reach_a_target_that_moves() -> None:
    scene, kept = breathing(), Kept()
    make = phantom(PhantomParameters())
    results = [
        simulate(scene, synthesiser_for(SETTINGS), SETTINGS, kept, make=make, seed=seed)
        for seed in range(3)
    ]
    assert [one.ended.outcome for one in results].count("target reached") >= 2
    assert all(one.clearance_mm > 0.0 for one in results)
    assert any(isinstance(one, Breathed) for one in kept.records)


def test_a_region_moves_over_a_needle_that_rests() -> None:
    """The truth is that of dense samples, written afresh; the needle lies still all the time."""
    motion = Motion(PERIOD_S, (0.0, 0.0, 9.0))
    region = Region.ball("C", "critical", (0.0, -8.0, -8.0), 2.0)
    obstacle = Obstacle(replace(region, motion=motion), 3.0, clock_s=0.5)
    for needle in (
        VirtualNeedle(PAPER.needle, (obstacle,), Errors(), 0, SimulatedClock()),
        PhantomNeedle(PAPER.needle, (obstacle,), 0, SimulatedClock()),
    ):
        needle.push(15.0)
        far_mm = needle.true_clearance_mm()
        needle.wait(PERIOD_S)
        heights = [
            9.0 * 0.5 * (1.0 - math.cos(turn)) - 8.0
            for turn in np.linspace(0.0, 2.0 * math.pi, 400)
        ]
        shaft = [
            pose.pose_at(at).position_mm
            for pose in needle.pierced
            for at in np.linspace(0.0, pose.length_mm, 20)
        ]
        least_mm = min(math.dist(point, (0.0, -8.0, z)) for point in shaft for z in heights) - 2.0
        found_mm = needle.true_clearance_mm()
        assert least_mm - 2.0 * SPACING_MM <= found_mm <= least_mm + 1e-6
        assert found_mm <= far_mm
        assert found_mm < 0.0


@pytest.mark.parametrize("seconds", [-1.0, math.nan, math.inf])
def test_impossible_waits_are_refused(seconds: float) -> None:
    for needle in (
        VirtualNeedle(PAPER.needle, (), Errors(), 0, SimulatedClock()),
        PhantomNeedle(PAPER.needle, (), 0, SimulatedClock()),
    ):
        with pytest.raises(DeviceError, match="wait"):
            needle.wait(seconds)


def test_a_scene_that_moves_is_kept_in_logs() -> None:
    table = Motion(PERIOD_S, table=((0.0, (0.0, 0.0, 0.0)), (1.5, (1.0, 2.0, 3.0))))
    scene = breathing(clock_s=0.3).with_regions(
        Region("D", "detection", PAPER.detections[0].shape, motion=table)
    )
    assert scene_from_json(scene_to_json(scene)) == scene
    assert "breath" not in scene_to_json(PAPER)
    assert "motion" not in scene_to_json(PAPER)


def test_after_a_roll_the_driver_waits_for_the_breath_of_the_plan() -> None:
    pace = Pace(breathing())
    assert pace.wait_s(Push(1.0), 0.0) == 0.0
    pace.begin(Push(1.0))
    assert pace.wait_s(Roll(1.0), 0.5) == 0.0
    pace.begin(Roll(1.0))
    # The roll took 0.8 s, so the phase of the plan comes again 3.2 s later.
    assert pace.wait_s(Push(1.0), 1.3) == pytest.approx(3.2)
    pace.begin(Push(1.0))
    assert pace.wait_s(Wait(0.5), 1.0 + 0.5 * LATE_S) == 0.0
    assert pace.late_s == pytest.approx(0.5 * LATE_S)
    assert pace.wait_s(Push(1.0), 1.0 + 3.0 * LATE_S) is None, "too late, and there was no roll"
