"""What is watched while a needle moves, and what the driver does about it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from ntagen.drive.configure import configure
from ntagen.drive.fitting import overrun_mm
from ntagen.drive.log import Log, metadata_of
from ntagen.drive.outcome import Driven
from ntagen.drive.reading import read_log
from ntagen.drive.real import RealRun, require_overrun
from ntagen.drive.records import Command, CutShort, Ended, Journals, Measured, Transition
from ntagen.drive.replay import replay
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import synthesiser_for
from ntagen.drive.states import Event, State
from ntagen.drive.stepped import Stepped
from ntagen.drive.supervisor import Guard, Supervisor
from ntagen.errors import DeviceError, Halted, InputError
from ntagen.grbl.dialects import GRBLHAL
from ntagen.needle.measurement import Measurement
from ntagen.needle.virtual import Errors, SimulatedClock, VirtualNeedle
from ntagen.nsl import load
from ntagen.scene import Region
from tests.drive.runs import Diary

SCENE = load(Path(__file__).parents[3] / "examples" / "paper.nsl")
SETTINGS = configure((), SCENE, "all", "grbl").settings
BALL = Region.ball("C", "critical", (0.0, 0.0, 20.0), 2.0)
FAST = 0.1
"""The supervised needle's tip must stand this much after a violation, at 1 mm/s, in mm."""


def guard(settings: Settings = SETTINGS, expected_n: float = 0.5) -> Guard:
    return Guard.of(settings, ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), (BALL,), expected_n)


def at(x: float, y: float, z: float, force_n: float = 0.0) -> Measurement:
    return Measurement(0.0, (x, y, z), force_n)


def test_a_push_may_go_on_near_its_way() -> None:
    for found in (at(0.0, 0.0, 0.5), at(1.0, -1.0, 1.5), at(0.0, 0.0, 0.5, 1.4)):
        assert guard().breach(found) is None


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (at(0.0, 0.0, 0.5, 1.7), "the force is 1.70 N"),
        (at(0.0, 6.0, 0.5), "6.0 mm off its way"),
        (at(0.0, 0.0, 9.0), "8.0 mm off its way"),
        (at(0.0, 0.0, 19.5), "in the critical region 'C'"),
        (at(math.nan, 0.0, 0.0), "nan mm off its way"),
    ],
)
def test_a_push_ends_off_its_way_in_a_region_and_at_a_force(found: Measurement, words: str) -> None:
    assert words in (guard().breach(found) or "")


def test_noise_widens_a_guard_and_switched_off_force_is_not_watched() -> None:
    noisy = replace(SETTINGS, priors=replace(SETTINGS.priors, noise_mm=1.0), force_sensing=False)
    assert guard(noisy).breach(at(0.0, 6.0, 0.5)) is None
    assert guard(noisy).breach(at(0.0, 0.0, 0.5, 99.0)) is None


def test_without_a_sensor_only_the_operator_is_listened_to() -> None:
    calls = []
    Supervisor(None, lambda: calls.append(1)).watch()
    assert calls == [1]


def test_an_overrun_that_nobody_counts_on_is_refused() -> None:
    assert overrun_mm(5.0, 50.0) == pytest.approx(0.6)
    require_overrun(replace(SETTINGS, overrun_mm=0.6), overrun_mm(5.0, 50.0))
    with pytest.raises(InputError, match=r"0\.60 mm after a stop.*\n.*--set 'overrun 0\.61 mm'"):
        require_overrun(replace(SETTINGS, overrun_mm=0.5), overrun_mm(5.0, 50.0))


class Live:
    """A sensor of a needle behind an emulated controller, which shows what a test wants."""

    measures_force = True

    def __init__(self, needle: Stepped) -> None:
        self.needle = needle
        self.after_mm = math.inf
        self.change: Callable[[Measurement], Measurement] = lambda found: found
        self.stands_mm: float | None = None
        self.times = 0
        self.most_times = 10**9
        self.is_gone_behind = False
        """Whether it shows nothing more as soon as the needle was pulled back."""

    def measure(self) -> Measurement:
        return self.needle.measure()

    def newest(self) -> Measurement:
        found = self.needle.measure()
        depth_mm = self.needle.emulator.position[0]
        if self.is_gone_behind and self.times and depth_mm < self.after_mm:
            self.most_times = 0
        if depth_mm < self.after_mm or self.times >= self.most_times:
            return found
        self.times += 1
        if self.stands_mm is None:
            self.stands_mm = depth_mm
        return self.change(found)


def bench() -> tuple[Stepped, Live]:
    needle = VirtualNeedle(SCENE.needle, (), Errors(), 1, SimulatedClock())
    stepped = Stepped(needle, SCENE.needle.speed_mm_per_s)
    return stepped, Live(stepped)


def run(
    stepped: Stepped,
    live: Live,
    *,
    log: Path | None = None,
    settings: Settings = SETTINGS,
    listen: Callable[[], None] = lambda: None,
) -> tuple[Driven, Diary]:
    diary = Diary()
    synthesise = synthesiser_for(settings)
    if log is None:
        made = RealRun(
            SCENE, stepped.actuator, live, synthesise, settings, diary, listen=listen
        ).drive()
        return made, diary
    with Log(log, metadata_of({"settings": settings.to_json()}), {}) as its_log:
        journal = Journals(its_log, diary)
        made = RealRun(
            SCENE, stepped.actuator, live, synthesise, settings, journal, listen=listen
        ).drive()
    return made, diary


def stood_within(stepped: Stepped, live: Live, way_mm: float) -> bool:
    """Whether the axes stood this near after what the test showed, and for good."""
    assert live.stands_mm is not None
    here_mm = stepped.emulator.position[0]
    stepped.emulator.feed(b"~")
    stepped.emulator.advance(stepped.emulator.now_s + 10.0)
    return stepped.emulator.position[0] == here_mm and abs(here_mm - live.stands_mm) <= way_mm


def test_a_watched_needle_reaches_the_target() -> None:
    stepped, live = bench()
    made, diary = run(stepped, live)
    assert made.ended.outcome == State.TARGET_REACHED.value
    assert not diary.of(CutShort)
    assert len(made.syntheses) == made.ended.syntheses > 0


@pytest.mark.parametrize(
    "change",
    [
        lambda found: replace(found, force_n=9.0),
        lambda found: replace(found, position_mm=(9.0, found.position_mm[1], 0.0)),
    ],
    ids=["force", "position"],
)
def test_a_violation_ends_the_push_at_once_and_the_driver_plans_from_there(
    change: Callable[[Measurement], Measurement],
) -> None:
    stepped, live = bench()
    live.after_mm, live.most_times, live.change = 12.1, 1, change
    made, diary = run(stepped, live)
    (short,) = diary.of(CutShort)
    assert 0.05 < short.made_mm < 0.25
    place = diary.records.index(short)
    depth_mm = next(r.depth_mm for r in diary.records[place:] if isinstance(r, Measured))
    assert depth_mm == pytest.approx(live.stands_mm, abs=FAST)
    events = [r.event for r in diary.records[place:] if isinstance(r, Transition)]
    assert events[1] == Event.PLAN_FAILS.value
    assert made.ended.outcome == State.TARGET_REACHED.value


@pytest.mark.slow
def test_a_violation_that_stays_makes_the_driver_pull_back() -> None:
    stepped, live = bench()
    live.after_mm, live.is_gone_behind = 12.1, True
    live.change = lambda found: replace(found, force_n=9.0)
    _, diary = run(stepped, live)
    assert len(diary.of(CutShort)) == 2
    events = [record.event for record in diary.of(Transition)]
    assert events.index(Event.PLAN_FAILS.value) < events.index(Event.DEVIATION.value)


@pytest.mark.slow
def test_a_run_with_a_push_that_was_ended_early_is_decided_again(tmp_path: Path) -> None:
    stepped, live = bench()
    live.after_mm, live.most_times = 12.1, 2
    live.change = lambda found: replace(found, force_n=9.0)
    made, diary = run(stepped, live, log=tmp_path / "run.mcap")
    log = read_log(tmp_path / "run.mcap")
    comparison = replay(log, synthesiser_for(SETTINGS))
    assert comparison.is_same
    assert comparison.complete
    assert made.ended == diary.of(Ended)[0]


def lost(_: Measurement) -> Measurement:
    raise DeviceError("the tracker is gone")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lost, "the tracker is gone"),
        (lambda found: replace(found, force_n=math.nan), "not a number"),
        (lambda found: replace(found, position_mm=(0.0, math.inf, 0.0)), "not a number"),
    ],
)
def test_a_sample_that_is_missing_or_impossible_stops_the_needle_for_good(
    change: Callable[[Measurement], Measurement], words: str
) -> None:
    stepped, live = bench()
    live.after_mm, live.change = 12.1, change
    made, _ = run(stepped, live)
    assert made.ended.outcome == State.FAULTED.value
    assert words in made.ended.reason
    assert stood_within(stepped, live, FAST)


def test_the_operator_ends_a_motion_in_its_middle() -> None:
    stepped, live = bench()
    live.after_mm = 12.1
    presses = []

    def listen() -> None:
        if live.stands_mm is not None:
            presses.append(1)
            raise KeyboardInterrupt("enough")

    made, diary = run(stepped, live, listen=listen)
    assert made.ended.outcome == State.INTERRUPTED.value
    assert made.ended.reason == "enough"
    assert stood_within(stepped, live, FAST)
    assert [record.kind for record in diary.of(Command)][-1] == "stop"


def test_an_alarm_of_the_controller_in_a_motion_ends_the_run() -> None:
    stepped, live = bench()
    live.after_mm, live.most_times = 12.1, 1

    def alarm(found: Measurement) -> Measurement:
        stepped.emulator.raise_alarm(1)
        return found

    live.change = alarm
    made, _ = run(stepped, live)
    assert made.ended.outcome == State.FAULTED.value
    assert "ALARM:1" in made.ended.reason
    assert stood_within(stepped, live, FAST)


def test_who_does_not_agree_ends_the_run_before_anything_moves() -> None:
    stepped, live = bench()
    asked = []

    def agree(text: str) -> None:
        asked.append(text)
        raise KeyboardInterrupt(f"the operator did not agree to {text}")

    diary = Diary()
    synthesise = synthesiser_for(SETTINGS)
    made = RealRun(SCENE, stepped.actuator, live, synthesise, SETTINGS, diary, agree=agree).drive()
    assert made.ended.outcome == State.INTERRUPTED.value
    assert asked[0].startswith("follow the plan ")
    assert stepped.emulator.position[0] == 0.0
    assert [record.kind for record in diary.of(Command)] == ["stop"]


@pytest.mark.parametrize("motion", ["push", "pull", "roll"])
def test_a_halted_motion_says_how_much_of_it_was_made(motion: str) -> None:
    stepped, _ = bench()
    actuator = stepped.actuator
    if motion == "pull":
        actuator.push(8.0)
    length = math.pi if motion == "roll" else 8.0
    began_s = actuator.now_s()
    speed = {"push": 1.0, "pull": 5.0, "roll": math.pi}[motion]

    def watch() -> None:
        if actuator.now_s() - began_s > 0.5 * length / speed:
            raise Halted("enough")

    actuator.watch = watch
    index = GRBLHAL.axes.index("A" if motion == "roll" else "X")
    before = stepped.emulator.position[index]
    with pytest.raises(Halted) as caught:
        getattr(actuator, motion)(length)
    made = abs(stepped.emulator.position[index] - before)
    whole = math.degrees(length) if motion == "roll" else length
    assert caught.value.part == pytest.approx(made / whole, abs=1e-3)
    assert 0.3 < caught.value.part < 0.7
    actuator.watch = lambda: None
    getattr(actuator, motion)(0.1)
