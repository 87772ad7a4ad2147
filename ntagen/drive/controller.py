"""The online controller: the paper's workflow (section 3) on any device.

A run goes through the state machine of `ntagen.drive.states`; each state has one task here. The
driver's decisions depend only on its settings, the a-priori scene, the measurements and the
synthesiser. It reads no clock except the device's and uses no random numbers, so that the same
measurements always lead to the same decisions (`ntagen.drive.replay`).

The safety rules:

* every end of a run, and every alarm, stops the needle first;
* the needle is pulled back only along its channel. Rolls are undone where they were made, and there
  are no alarms during the pull (paper, section 3.2);
* the driver follows a plan only if its certificate holds for the newest estimate of pose and
  radius.

If there is no plan, the driver does not pull back at once. It first looks for a place behind the
tip, on the known channel, from which there is a strategy. If there is none back to the entry, the
run ends where it is.

The driver looks at known points whether somebody wants the run to end: before each motion and each
synthesis. Between two such points something is always recorded, so that a replay knows at which
point the run ended. A motion counts as made when it is commanded: nobody knows how far the needle
got if a motion failed.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Final

from ntagen.drive.device import Device
from ntagen.drive.knowledge import Knowledge
from ntagen.drive.records import (
    Command,
    Ended,
    Estimated,
    Journal,
    Learned,
    Measured,
    Predicted,
    Record,
    Synthesised,
    Timed,
    Transition,
    Visited,
)
from ntagen.drive.settings import Settings
from ntagen.drive.states import ENDS, Event, State, next_state
from ntagen.errors import DeviceError, LimitError
from ntagen.needle.estimate import Estimate, Estimator
from ntagen.needle.kinematics import orthonormal
from ntagen.needle.measurement import Measurement
from ntagen.needle.path import Path
from ntagen.needle.vectors import distance
from ntagen.plan.actions import Push, Roll
from ntagen.plan.synthesise import Synthesis, Synthesiser
from ntagen.scene import Pose, Scene

_SMALL_MM: Final = 1e-9
_NO_REGION_MM: Final = 1e9
_ROLL_NEGLIGIBLE_RAD: Final = 1e-9


class Controller:
    """One run.

    Args:
        scene: The a-priori scene, which the driver knows.
        device: The needle.
        synthesise: Finds plans.
        settings: How to drive.
        journal: Records what happens.
        listen: Raises `KeyboardInterrupt`, with the reason, if somebody wants the run to end.
    """

    def __init__(
        self,
        scene: Scene,
        device: Device,
        synthesise: Synthesiser,
        settings: Settings,
        journal: Journal,
        listen: Callable[[], None] = lambda: None,
    ) -> None:
        self._device = device
        self._synthesise = synthesise
        self._settings = settings
        self._journal = journal
        self._listen = listen
        self._knowledge = Knowledge(scene)
        self._estimator = Estimator(scene.needle.tip, scene.needle.radius_mm, settings.priors)
        self._path = Path(scene.needle.tip)
        self._estimate: Estimate | None = None
        self._measurement: Measurement | None = None
        self._moves: Iterator[tuple[Push | Roll, Pose]] = iter(())
        self._predicted: Pose = scene.needle.tip
        self._deviating = 0
        self._retreat_mm: float | None = None
        self._adjustments = 0
        self._syntheses = 0
        self._started_s = 0.0
        self._reason = ""
        self._tasks: dict[State, Callable[[], Event]] = {
            State.ARM: self._arm,
            State.INITIAL_PUSH: self._initial_push,
            State.ESTIMATE: self._make_estimate,
            State.SYNTHESISE: self._find_strategy,
            State.EXECUTE: self._execute,
            State.MONITOR: self._monitor,
            State.STOP: self._stop,
            State.PULL_BACK: self._pull_back,
            State.PUSH: self._push_again,
        }

    def run(self) -> Ended:
        """Drives until the run ends and the needle is stopped; returns the last record."""
        self._journal.started(self._knowledge.a_priori)
        state = State.ARM
        try:
            while state not in ENDS:
                event = self._perform(state)
                following = next_state(state, event)
                self._note(Transition(self._now_s(), state.value, event.value, following.value))
                state = following
        except BaseException:
            # A bug, or a log that cannot be written: the needle must not move on.
            self._device.stop()
            raise
        self._halt()
        ended = Ended(
            time_s=self._now_s(),
            outcome=state.value,
            reason=self._reason,
            depth_mm=self._path.depth_mm,
            adjustments=self._adjustments,
            syntheses=self._syntheses,
        )
        self._note(ended)
        return ended

    def _perform(self, state: State) -> Event:
        """Does a state's task; returns the event with which it ended. An error is an event too."""
        try:
            self._require_time()
            return self._tasks[state]()
        except DeviceError as error:
            self._reason = str(error)
            return Event.FAULT
        except LimitError as error:
            self._reason = str(error)
            return Event.TIMED_OUT
        except KeyboardInterrupt as error:
            self._reason = str(error) or "interrupted by the operator"
            return Event.INTERRUPT

    # The tasks, in the order of the workflow.

    def _arm(self) -> Event:
        self._started_s = self._device.now_s()
        self._measure()
        return Event.ARMED

    def _initial_push(self) -> Event:
        return self._push_watching(self._settings.initial_push_mm)

    def _make_estimate(self) -> Event:
        estimate = self._estimator.estimate()
        self._estimate = estimate
        self._path = estimate.path
        tip = estimate.tip
        self._note(
            Estimated(
                self._now_s(),
                tip.position_mm,
                tip.heading,
                tip.bevel,
                estimate.radius_mm,
                estimate.radius_std_mm,
                estimate.rms_mm,
            )
        )
        self._visit(tip.position_mm, last_too=True)
        if self._knowledge.visited == len(self._knowledge.a_priori.targets):
            self._reason = "the tip is in the last target"
            return Event.IN_TARGET
        return Event.ESTIMATED

    def _find_strategy(self) -> Event:
        here = self._ask(self._known_estimate().tip, self._path.depth_mm)
        if here.best is not None:
            self._adopt(here)
            return Event.STRATEGY_FOUND
        return self._look_back()

    def _look_back(self) -> Event:
        """Looks for the nearest place behind the tip from which there is a strategy."""
        stride_mm = self._settings.pull_mm - self._settings.push_mm
        depth_mm = self._path.depth_mm
        while depth_mm > _SMALL_MM:
            self._require_time()
            depth_mm = max(0.0, depth_mm - stride_mm)
            behind = self._path.pull(self._path.depth_mm - depth_mm)
            if self._ask(_unrolled(behind), depth_mm).best is not None:
                self._retreat_mm = depth_mm
                return Event.STRATEGY_BEHIND
        self._reason = "no plan is left, even from the entry"
        return Event.NO_STRATEGY

    def _execute(self) -> Event:
        move = next(self._moves, None)
        if move is None:
            return Event.PLAN_DONE
        action, self._predicted = move
        if isinstance(action, Roll):
            self._roll(action.angle_rad)
        else:
            self._push(action.length_mm)
        return Event.ACTED

    def _monitor(self) -> Event:
        measurement = self._measure()
        deviation_mm = distance(measurement.position_mm, self._predicted.position_mm)
        predicted = self._predicted
        self._note(
            Predicted(
                self._now_s(),
                predicted.position_mm,
                predicted.heading,
                predicted.bevel,
                deviation_mm,
            )
        )
        if self._feels(measurement):
            return Event.FORCE
        self._visit(measurement.position_mm, last_too=False)
        self._deviating = self._deviating + 1 if deviation_mm > self._settings.deviation_mm else 0
        if self._deviating >= self._settings.deviation_count:
            self._deviating = 0
            return Event.DEVIATION
        return Event.AS_PREDICTED

    def _stop(self) -> Event:
        self._note(Command(self._now_s(), "stop", 0.0))
        self._device.stop()
        if self._measurement is not None and self._feels(self._measurement):
            self._learn()
        return Event.STOPPED

    def _pull_back(self) -> Event:
        """Goes back in the channel to where the next push starts."""
        self._adjustments += 1
        depth_mm = self._path.depth_mm
        goal_mm = self._retreat_mm
        if goal_mm is None:
            goal_mm = max(0.0, depth_mm - self._settings.pull_mm + self._settings.push_mm)
        # At the entry there is no channel to push in: the next plan starts there.
        self._retreat_mm = goal_mm
        start_mm = max(0.0, goal_mm - self._settings.push_mm) if goal_mm > 0.0 else 0.0
        while self._path.depth_mm > start_mm + _SMALL_MM:
            self._undo_roll()
            last_mm = self._path.stretches[-1].arc.length_mm
            self._pull(min(last_mm, self._path.depth_mm - start_mm))
        self._undo_roll()
        return Event.PULLED

    def _push_again(self) -> Event:
        goal_mm = self._retreat_mm if self._retreat_mm is not None else self._path.depth_mm
        self._retreat_mm = None
        return self._push_watching(goal_mm - self._path.depth_mm)

    # Knowledge.

    def _learn(self) -> None:
        """Turns a contact at the current place into a region."""
        tip = self._estimator.estimate().tip
        before = set(self._knowledge.learned)
        self._knowledge = self._knowledge.with_contact(
            tip, self._settings.sensing_margin_mm, self._settings.learned_radius_mm
        )
        for region in self._knowledge.learned:
            if region not in before:
                self._note(Learned.of(self._now_s(), region))

    def _visit(self, position_mm: tuple[float, float, float], *, last_too: bool) -> None:
        """Counts targets that the tip has reached; the last one only with `last_too`."""
        targets = self._knowledge.a_priori.targets
        while self._knowledge.visited < len(targets):
            target = targets[self._knowledge.visited]
            is_last = self._knowledge.visited == len(targets) - 1
            if is_last and not last_too:
                return
            if distance(position_mm, target.center_mm) > target.radius_mm:
                return
            self._knowledge = self._knowledge.visiting()
            self._note(Visited(self._now_s(), target.name))

    def _ask(self, tip: Pose, depth_mm: float) -> Synthesis:
        """The synthesis from a pose, with the current knowledge."""
        scene = self._knowledge.scene(tip, self._known_estimate().radius_mm, depth_mm)
        self._listen()
        synthesis = self._in_time(self._synthesise(scene))
        number, best = self._syntheses + 1, synthesis.best
        self._journal.synthesised(number, synthesis)
        clearance_mm = best.certificate.critical_clearance_mm if best else -1.0
        self._note(
            Synthesised(
                time_s=self._now_s(),
                number=number,
                depth_mm=depth_mm,
                found=synthesis.found,
                accepted=len(synthesis.candidates),
                plan=str(best.plan) if best else "",
                clearance_mm=min(clearance_mm, _NO_REGION_MM),
                model_sha256=hashlib.sha256(synthesis.model_xml.encode()).hexdigest(),
            )
        )
        # If the run ended during the synthesis, the synthesis does not count.
        self._syntheses = number
        self._note(Timed(self._now_s(), number, synthesis.seconds))
        return synthesis

    def _in_time(self, synthesis: Synthesis) -> Synthesis:
        """The synthesis without the plans that cannot end within the time limit."""
        left_s = self._settings.timeout_s - (self._now_s() - self._started_s)
        longest_mm = left_s * synthesis.scene.needle.speed_mm_per_s
        kept = tuple(c for c in synthesis.candidates if c.plan.length_mm <= longest_mm)
        return replace(synthesis, candidates=kept)

    def _adopt(self, synthesis: Synthesis) -> None:
        """Chooses the best plan as the one to follow."""
        best = synthesis.best
        if best is None:
            raise AssertionError("a synthesis without a plan was adopted")
        self._moves = _moves(synthesis.scene, best.plan.actions, self._settings.spacing_mm)
        self._deviating = 0

    def _known_estimate(self) -> Estimate:
        if self._estimate is None:
            raise AssertionError("a strategy was asked for before the first estimate")
        return self._estimate

    # The device: every command and every reading goes through here, to estimator and journal.

    def _push_watching(self, length_mm: float) -> Event:
        """Pushes in pieces; checks the force, but has no prediction."""
        for piece_mm in _pieces(length_mm, self._settings.spacing_mm):
            self._require_time()
            self._push(piece_mm)
            if self._feels(self._measure()):
                return Event.FORCE
        return Event.PUSHED

    def _push(self, length_mm: float) -> None:
        self._command("push", length_mm)
        self._estimator.push(length_mm)
        self._path = self._path.push(self._radius_mm(), length_mm)
        self._device.push(length_mm)

    def _roll(self, angle_rad: float) -> None:
        self._command("roll", angle_rad)
        self._estimator.roll(angle_rad)
        self._path = self._path.roll(angle_rad)
        self._device.roll(angle_rad)

    def _pull(self, length_mm: float) -> None:
        self._command("pull", length_mm)
        self._estimator.pull(length_mm)
        self._path = self._path.pull(length_mm)
        self._device.pull(length_mm)

    def _command(self, kind: str, value: float) -> None:
        """Records a motion that begins now, unless somebody wants the run to end."""
        self._listen()
        self._note(Command(self._now_s(), kind, value))

    def _undo_roll(self) -> None:
        """Undoes the rolls at or beyond this place, so that the tip fits its channel again."""
        angle_rad = math.remainder(self._path.pending_roll_rad, 2.0 * math.pi)
        if abs(angle_rad) > _ROLL_NEGLIGIBLE_RAD:
            self._roll(-angle_rad)

    def _measure(self) -> Measurement:
        measurement = self._device.measure()
        _require_finite(measurement)
        self._measurement = measurement
        self._estimator.measure(measurement)
        self._note(
            Measured(
                time_s=measurement.time_s,
                depth_mm=self._path.depth_mm,
                position_mm=measurement.position_mm,
                force_n=measurement.force_n,
                heading=measurement.heading or (),
                bevel=measurement.bevel or (),
            )
        )
        return measurement

    def _halt(self) -> None:
        """Stops the needle at the end of a run, whatever the reason."""
        self._note(Command(self._now_s(), "stop", 0.0))
        try:
            self._device.stop()
        except DeviceError as error:
            # The run ends anyway, but the report must say that the device did not stop.
            self._reason = f"{self._reason}; it cannot be stopped: {error}"

    def _feels(self, measurement: Measurement) -> bool:
        return measurement.force_n > self._settings.force_n

    def _require_time(self) -> None:
        if self._now_s() - self._started_s >= self._settings.timeout_s:
            raise LimitError(f"the limit of {self._settings.timeout_s:g} s is over")

    def _radius_mm(self) -> float:
        if self._estimate is None:
            return self._knowledge.a_priori.needle.radius_mm
        return self._estimate.radius_mm

    def _now_s(self) -> float:
        return self._device.now_s()

    def _note(self, record: Record) -> None:
        self._journal.record(record)


def _moves(
    scene: Scene, actions: tuple[Push | Roll, ...], spacing_mm: float
) -> Iterator[tuple[Push | Roll, Pose]]:
    """A plan in short pieces, each with the pose that is expected after it."""
    path = Path(scene.needle.tip)
    for action in actions:
        if isinstance(action, Roll):
            path = path.roll(action.angle_rad)
            yield action, path.tip
            continue
        for piece_mm in _pieces(action.length_mm, spacing_mm):
            path = path.push(scene.needle.radius_mm, piece_mm)
            yield Push(piece_mm), path.tip


def _pieces(length_mm: float, spacing_mm: float) -> list[float]:
    """A length in equal pieces, none longer than the spacing."""
    if length_mm <= _SMALL_MM:
        return []
    count = math.ceil(length_mm / spacing_mm - _SMALL_MM)
    return [length_mm / count] * count


def _unrolled(path: Path) -> Pose:
    """The pose at the end of a channel, after the rolls beyond it have been undone."""
    return orthonormal(Path(path.entry, path.stretches).tip)


def _require_finite(measurement: Measurement) -> None:
    numbers = (*measurement.position_mm, measurement.force_n, measurement.time_s)
    if not all(math.isfinite(number) for number in numbers):
        raise DeviceError(f"the sensor reported {measurement}: not a number")
