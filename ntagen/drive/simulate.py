"""Runs the driver with a simulated needle, which alone knows the true scene."""

from __future__ import annotations

import functools
import gc
import importlib
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final, Protocol

from ntagen.drive.controller import Controller
from ntagen.drive.device import Assembly, Counts, Device, Forwarding, Sensor, Waiting
from ntagen.drive.following import Course
from ntagen.drive.knowledge import obstacles_of, told
from ntagen.drive.outcome import Driven, SynthesisCounter
from ntagen.drive.past import Leg, Relay, go_on
from ntagen.drive.records import Ended, Journal, Journals, Looked, Measured, Record, Truth
from ntagen.drive.resuming import Ask
from ntagen.drive.settings import Settings, engine_for
from ntagen.drive.spinning import steered
from ntagen.errors import InputError
from ntagen.needle.answering import Answers, between, corners, drawn, given
from ntagen.needle.kinematics import Arc
from ntagen.needle.phantom import PhantomNeedle
from ntagen.needle.phantom_parameters import PhantomParameters
from ntagen.needle.virtual import Errors, Obstacle, SimulatedClock, VirtualNeedle
from ntagen.plan.best_plan import BestPlanSynthesiser
from ntagen.plan.branches import worst_path
from ntagen.plan.closed_loop import Segment
from ntagen.plan.policy import Policy
from ntagen.plan.synthesise import Synthesis, Synthesiser
from ntagen.scene import Needle, Pose, Scene

_NO_REGION_MM: Final = 1e9


class Knowing(Protocol):
    """What knows the truth about a needle."""

    @property
    def true_tip(self) -> Pose:
        """The true pose of the tip."""

    def true_clearance_mm(self) -> float:
        """The smallest distance of all that was cut to any actual critical region."""


class Simulated(Device, Knowing, Protocol):
    """A simulated needle: a device that knows the truth."""

    def screw(self, length_mm: float, angle_rad: float) -> None:
        """Inserts it and turns its base at once."""

    def roll_on(self, angle_rad: float) -> None:
        """Goes on with the last roll: no error is added."""

    @property
    def pierced(self) -> tuple[Arc, ...]:
        """All arcs that were cut."""


Maker = Callable[[Needle, tuple[Obstacle, ...], int], Simulated]
"""Makes a simulated needle from a true one, the actual critical regions and a seed."""


def virtual(errors: Errors) -> Maker:
    """Virtual needles with these errors."""
    return lambda needle, obstacles, seed: VirtualNeedle(
        needle, obstacles, errors, seed, SimulatedClock()
    )


def answering(errors: Errors, scene: Scene, kind: str, tree: Segment | None = None) -> Maker:
    """Virtual needles in a tissue that answers.

    Args:
        errors: Their other errors.
        scene: The scene, with the bounds of the tissue.
        kind: What the tissue does: ``corners`` picks corners or the middle of its bounds at random,
            ``between`` any values; ``worst`` is worst for the strategy; ``expected`` picks nothing;
            ``drawn`` is a tissue with chance.
        tree: The strategy for which ``worst`` is worst.

    Raises:
        InputError: Nothing can be worst without a strategy.
    """
    if kind == "worst" and tree is None:
        raise InputError(
            "without a strategy that is followed, nothing is the worst for it\n"
            "hint: use --tissue corners"
        )

    picked = {"corners": corners, "between": between, "drawn": drawn}

    def answers(seed: int) -> Answers:
        if kind in picked:
            return picked[kind](scene.tissue, seed)
        way = worst_path(tree, scene) if kind == "worst" and tree is not None else ()
        return given((one.branch.factor, one.branch.roll_error_rad) for one in way)

    return lambda needle, obstacles, seed: VirtualNeedle(
        needle,
        obstacles,
        errors,
        seed,
        SimulatedClock(),
        answers=answers(seed),
        free_bevel=scene.limits.free_bevel,
    )


def phantom(parameters: PhantomParameters) -> Maker:
    """Phantom needles with these parameters."""
    return lambda needle, obstacles, seed: PhantomNeedle(
        needle, obstacles, seed, SimulatedClock(), parameters
    )


@dataclass(frozen=True, slots=True)
class Result(Driven):
    """The end of a simulated run, and the truth about it.

    Attributes:
        clearance_mm: The smallest distance of the needle's path to any actual critical region;
            infinite without one, negative if one was pierced.
        target_distance_mm: The distance of the true tip to the surface of the last target at the
            last measurement; negative inside.
        pierced: All arcs that were really cut.
    """

    clearance_mm: float
    target_distance_mm: float
    pierced: tuple[Arc, ...]


def simulate(
    scene: Scene,
    synthesise: Synthesiser,
    settings: Settings,
    journal: Journal,
    *,
    known: str = "all",
    errors: Errors | None = None,
    make: Maker | None = None,
    seed: int = 0,
    sense: Callable[[Device], Sensor] | None = None,
    listen: Callable[[], None] = lambda: None,
    agree: Callable[[str], None] = lambda _: None,
    course: Course | None = None,
    policy: Policy | None = None,
    legs: Sequence[Leg] = (),
    ask: Ask = lambda _: False,
) -> Result:
    """Drives a simulated needle through the scene.

    Args:
        scene: The actual scene; the true needle may differ from its own by `errors`.
        synthesise: Finds plans.
        settings: How to drive.
        journal: Records what happens.
        known: The critical regions that the driver knows (`ntagen.drive.knowledge.told`).
        errors: The needle's errors; none by default. Only the virtual needle has noise and roll
            errors of this kind.
        make: Makes another needle than the virtual one.
        seed: The seed of the errors.
        sense: Gives what measures the needle; by default it measures itself.
        listen: Raises `KeyboardInterrupt` if somebody wants the run to end.
        agree: As in `Controller`.
        course: As in `Controller`.
        policy: As in `Controller`.
        legs: The runs from which this one goes on (`ntagen.drive.past`). Their motions are made by
            the needle once more, since it is nowhere else.
        ask: As in `Controller`.

    Raises:
        InputError: The needle cannot wait for regions that move, or the runs before it are decided
            otherwise now, or by another needle.
    """
    needle = simulated(scene, settings, seed, errors, make)
    if scene.breath is not None and not isinstance(needle, Waiting):
        raise InputError(
            "this simulated needle cannot wait for regions that move\n"
            "hint: use --needle virtual or --needle phantom"
        )
    sensor = needle if sense is None else sense(needle)
    actuator = steered(Counted(needle), scene, settings.compensated_lag_rad)
    witness = Witness(needle, journal)
    counter = SynthesisCounter()
    relay = Relay(
        Assembly(actuator, sensor),
        Journals(journal, witness, counter),
        listen,
        agree,
        ask,
        shadow=True,
    )
    controller = Controller(
        told(scene, known),
        relay,
        synthesise,
        settings,
        relay,
        relay.listen,
        agree=relay.agree,
        course=course,
        policy=policy,
        ask=relay.ask,
    )
    ended = go_on(controller, relay, legs)
    last = scene.targets[-1]
    tip_mm = needle.true_tip.position_mm
    # The driver decides by its last look; a target that moves goes on while the needle is stopped.
    clock_s = witness.watched_s + (0.0 if scene.breath is None else scene.breath.clock_s)
    return Result(
        ended=ended,
        clearance_mm=needle.true_clearance_mm(),
        target_distance_mm=last.distance_at_mm(tip_mm, clock_s),
        pierced=needle.pierced,
        syntheses=tuple(counter.syntheses),
        guaranteed=counter.guaranteed,
        promised=counter.promised,
    )


class Counted(Forwarding):
    """A simulated needle that counts its motions, as the controller of a real one does."""

    def __init__(self, needle: Simulated) -> None:
        super().__init__(needle)
        self._needle = needle
        self._counts = (0.0, 0.0)

    def push(self, length_mm: float) -> None:
        """See `Actuator.push`."""
        super().push(length_mm)
        self._count(length_mm, 0.0)

    def roll(self, angle_rad: float) -> None:
        """See `Actuator.roll`."""
        super().roll(angle_rad)
        self._count(0.0, angle_rad)

    def pull(self, length_mm: float) -> None:
        """See `Actuator.pull`."""
        super().pull(length_mm)
        self._count(-length_mm, 0.0)

    def screw(self, length_mm: float, angle_rad: float) -> None:
        """See `Screwing.screw`."""
        self._needle.screw(length_mm, angle_rad)
        self._count(length_mm, angle_rad)

    def counts(self) -> Counts:
        """Where the axes stand: from 0."""
        return self._counts

    def _count(self, length_mm: float, angle_rad: float) -> None:
        self._counts = (self._counts[0] + length_mm, self._counts[1] + angle_rad)


def simulated(
    scene: Scene, settings: Settings, seed: int, errors: Errors | None, make: Maker | None
) -> Simulated:
    """A simulated needle at the entry of a scene; the arguments are those of `simulate`."""
    errors = errors or Errors()
    obstacles = obstacles_of(scene, settings.sensing_margin_mm)
    return (make or virtual(errors))(errors.true_needle(scene.needle), obstacles, seed)


def synthesiser_for(
    settings: Settings,
    listen: Callable[[], None] = lambda: None,
    *,
    keeps_strategy: bool = False,
) -> TimedSynthesiser:
    """The synthesiser with the margins, the ranking and the budgets of the settings."""
    _load()
    engine = engine_for(settings, listen, keeps_strategy=keeps_strategy)
    return TimedSynthesiser(BestPlanSynthesiser(engine))


@functools.cache
def _load() -> None:
    """Loads what the first synthesis needs, before the needle waits for it."""
    for name in ("ntagen.checker", "ntagen.render"):
        importlib.import_module(name)
    # The collector would look at all of it again and again, which takes 20 ms: as long as the
    # engine needs for a synthesis.
    gc.collect()
    gc.freeze()


class Witness:
    """Adds the truth to a journal, at each measurement and at the end.

    Attributes:
        watched_s: The time from the first to the last measurement.
    """

    def __init__(self, needle: Knowing, journal: Journal) -> None:
        self._needle = needle
        self._journal = journal
        self._first_s: float | None = None
        self.watched_s = 0.0

    def record(self, record: Record) -> None:
        """Adds the truth to it, if it is a measurement or the end."""
        if isinstance(record, Measured | Looked):
            self._first_s = record.time_s if self._first_s is None else self._first_s
            self.watched_s = record.time_s - self._first_s
        if isinstance(record, Measured | Ended):
            clearance_mm = self._needle.true_clearance_mm()
            shown_mm = clearance_mm if math.isfinite(clearance_mm) else _NO_REGION_MM
            tip_mm = self._needle.true_tip.position_mm
            self._journal.record(Truth(record.time_s, tip_mm, shown_mm))

    def started(self, scene: Scene) -> None:
        """Does nothing: the truth is added to measurements only."""

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Does nothing: the truth is added to measurements only."""


@dataclass(frozen=True, slots=True)
class TimedSynthesiser:
    """A synthesiser that says how long it took: `Synthesis.loop_seconds`.

    Attributes:
        inner: Finds the plans.
    """

    inner: BestPlanSynthesiser

    def __call__(self, scene: Scene, asked: Scene | None = None) -> Synthesis:
        """The synthesis, with its time."""
        start_s = time.perf_counter()
        synthesis = self.inner(scene, asked)
        return replace(synthesis, loop_seconds=time.perf_counter() - start_s)
