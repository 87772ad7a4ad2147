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

A push may be ended early while it goes on (`ntagen.drive.supervisor`). Then the driver measures,
and plans from where the needle is; at the second time in a row it pulls back.

The first push belongs to a plan from the entry. If there is none, the push is made only if no known
region is near it for any start error (`ntagen.drive.first_push`).

The driver looks at known points whether somebody wants the run to end: before each motion and each
synthesis. Between two such points something is always recorded, so that a replay knows at which
point the run ended.
"""

from __future__ import annotations

import contextlib
import hashlib
import math
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Final

from ntagen.drive.deviation import DeviationMonitor, require_explained
from ntagen.drive.device import Device
from ntagen.drive.first_push import is_free
from ntagen.drive.force import ForceMonitor, Rise
from ntagen.drive.knowledge import Knowledge, position_unsure_mm
from ntagen.drive.records import (
    Command,
    Ended,
    Forgotten,
    Journal,
    JournalError,
    Learned,
    Predicted,
    Record,
    Relied,
    Synthesised,
    Timed,
    Transition,
    Visited,
)
from ntagen.drive.reliance import relies_on
from ntagen.drive.reserve import is_enough, is_surely_in
from ntagen.drive.settings import Settings
from ntagen.drive.states import ENDS, Event, State, next_state
from ntagen.drive.steering import Steering
from ntagen.drive.supervisor import Guard, Supervisor
from ntagen.errors import DeviceError, LimitError
from ntagen.needle.estimate import Estimate
from ntagen.needle.kinematics import orthonormal
from ntagen.needle.measurement import Measurement
from ntagen.needle.path import Path
from ntagen.needle.vectors import distance
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.plan.certify import certify
from ntagen.plan.rank import Candidate, reserve_of
from ntagen.plan.synthesise import Synthesis, Synthesiser
from ntagen.scene import Pose, Scene

_SMALL_MM: Final = 1e-9
_NO_REGION_MM: Final = 1e9

_ENOUGH_BEHIND_MM: Final = 1.5
"""With this reserve, a plan from behind the tip is good enough: each mm farther back costs time."""


@dataclass(slots=True)
class _Lack:
    """Why no plan is left, over all places from which one was looked for."""

    found: bool = False
    held: bool = False

    def event(self) -> tuple[Event, str]:
        """The event, and the reason in words."""
        if self.held:
            return Event.NO_TIME_LEFT, "no plan can end within the time limit"
        if self.found:
            return Event.NONE_HOLDS, "no plan of the model holds in exact kinematics"
        return Event.NO_STRATEGY, "no plan is left, even from the entry"


class Controller:
    """One run.

    Args:
        scene: The a-priori scene, which the driver knows.
        device: The needle.
        synthesise: Finds plans.
        settings: How to drive.
        journal: Records what happens.
        listen: Raises `KeyboardInterrupt`, with the reason, if somebody wants the run to end.
        supervisor: What watches the needle while it moves.
        agree: Is told each time what the driver wants to do next; raises `KeyboardInterrupt` if
            the operator does not want that.
    """

    def __init__(
        self,
        scene: Scene,
        device: Device,
        synthesise: Synthesiser,
        settings: Settings,
        journal: Journal,
        listen: Callable[[], None] = lambda: None,
        supervisor: Supervisor | None = None,
        agree: Callable[[str], None] = lambda _: None,
    ) -> None:
        self._synthesise = synthesise
        self._settings = settings
        self._journal = journal
        self._listen = listen
        self._supervisor = supervisor or Supervisor()
        self._agree = agree
        self._knowledge = Knowledge(scene)
        self._needle = Steering(scene.needle, device, settings, journal, listen)
        self._force = ForceMonitor(settings, scene.needle.length_mm)
        self._deviation = DeviationMonitor(settings, scene.needle.length_mm)
        self._rise: Rise | None = None
        self._moves: deque[tuple[Push | Roll, Pose]] = deque()
        self._reviewed_mm = 0.0
        self._rest: Plan | None = None
        self._predicted: Pose = scene.needle.tip
        self._is_short = False
        self._short_in_row = 0
        self._lack = _Lack()
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
        self._note(Relied(self._now_s(), relies_on(self._settings, self._knowledge.a_priori)))
        state = State.ARM
        try:
            while state not in ENDS:
                state = self._turn(state, self._perform(state))
        except BaseException as error:
            # A bug, or the operator's second Ctrl-C: the needle must not move on.
            try:
                self._needle.stop_at_once()
            finally:
                self._tell_bug(state, error)
            raise
        return self._finish(self._halt(state))

    def _turn(self, state: State, event: Event) -> State:
        """The next state. A run that cannot be recorded ends with a fault."""
        try:
            return self._went_on(state, event)
        except JournalError as error:
            self._reason = str(error)
            return self._went_on(state, Event.FAULT)

    def _went_on(self, state: State, event: Event) -> State:
        following = next_state(state, event)
        self._note(Transition(self._now_s(), state.value, event.value, following.value))
        return following

    def _finish(self, state: State) -> Ended:
        """Records the end; one that cannot be recorded is a fault."""
        try:
            return self._ended(state)
        except JournalError as error:
            self._reason = str(error)
            return self._ended(State.FAULTED)

    def _ended(self, state: State) -> Ended:
        ended = Ended(
            time_s=self._now_s(),
            outcome=state.value,
            reason=self._reason,
            depth_mm=self._needle.depth_mm,
            adjustments=self._adjustments,
            syntheses=self._syntheses,
        )
        self._note(ended)
        return ended

    def _tell_bug(self, state: State, error: BaseException) -> None:
        """Records that a mistake of the program ended the run, as far as that is possible.

        A second Ctrl-C is no such mistake: it may have come in the middle of a record.
        """
        if isinstance(error, KeyboardInterrupt):
            return
        said = " ".join(str(error).split())
        self._reason = f"internal error: {type(error).__name__}: {said}"
        with contextlib.suppress(Exception):
            self._went_on(state, Event.FAULT)
            self._note(Command(self._now_s(), "stop", 0.0))
            self._ended(State.FAULTED)

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
        self._started_s = self._now_s()
        measurement = self._needle.measure()
        if self._settings.force_sensing:
            tip_mm = self._knowledge.a_priori.needle.tip.position_mm
            allowed_n = self._knowledge.expected_force_n(tip_mm, self._settings)
            self._force.note(0.0, measurement.force_n, allowed_n)
        return Event.ARMED

    def _make_estimate(self) -> Event:
        estimate = self._needle.estimated()
        require_explained(estimate, self._settings, self._knowledge.a_priori.needle.radius_mm)
        tip = estimate.tip
        self._visit(tip.position_mm, last_too=True)
        if self._knowledge.visited == len(self._knowledge.a_priori.targets):
            self._reason = "the tip is in the last target"
            return Event.IN_TARGET
        return Event.ESTIMATED

    def _find_strategy(self) -> Event:
        self._lack = _Lack()
        is_first = self._syntheses == 0
        rest, self._rest = self._rest, None
        here = self._ask(self._estimate().tip, self._needle.depth_mm, rest)
        if here.best is not None:
            self._adopt(here)
            return Event.FIRST_STRATEGY if is_first else Event.STRATEGY_FOUND
        if is_first and not self._lack.held and self._first_push_is_free():
            push = Push(self._settings.initial_push_mm)
            self._agree(f"push {push.length_mm:g} mm to see how the needle bends")
            self._follow(self._here(), Plan.of([push]))
            return Event.PUSH_IS_FREE
        return self._look_back()

    def _look_back(self) -> Event:
        """Looks for the nearest place behind the tip from which there is a strategy."""
        stride_mm = self._settings.pull_mm - self._settings.push_mm
        path = self._needle.path
        depth_mm = path.depth_mm
        places: list[tuple[float, Candidate]] = []
        while depth_mm > _SMALL_MM:
            self._require_time()
            depth_mm = max(0.0, depth_mm - stride_mm)
            behind = path.pull(path.depth_mm - depth_mm)
            best = self._ask(_unrolled(behind), depth_mm).best
            if best is not None:
                places.append((depth_mm, best))
                if is_enough(best.certificate, self._estimate(), _ENOUGH_BEHIND_MM):
                    break
        if not places:
            event, self._reason = self._lack.event()
            return event
        # The nearest place with enough reserve was found last; without one, the most reserve wins.
        if not is_enough(places[-1][1].certificate, self._estimate(), _ENOUGH_BEHIND_MM):
            places.sort(key=lambda place: reserve_of(place[1].certificate))
        depth_mm, best = places[-1]
        self._agree(f"pull back to a depth of {depth_mm:.1f} mm, for the plan {best.plan}")
        self._retreat_mm = depth_mm
        return Event.STRATEGY_BEHIND

    def _initial_push(self) -> Event:
        """Makes the first moves of the plan, or the free push if there is none."""
        goal_mm = self._settings.initial_push_mm
        while self._moves and not self._is_short:
            action, self._predicted = self._moves.popleft()
            self._require_time()
            self._act(action)
            if isinstance(action, Roll):
                continue
            measurement = self._needle.measure()
            if self._feels(measurement):
                return Event.FORCE
            self._visit(measurement.position_mm, last_too=False)
            if self._needle.depth_mm >= goal_mm - _SMALL_MM:
                break
        return Event.PUSHED

    def _execute(self) -> Event:
        if not self._moves:
            return Event.PLAN_DONE
        action, self._predicted = self._moves.popleft()
        self._act(action)
        return Event.ACTED

    def _monitor(self) -> Event:
        measurement = self._needle.measure()
        predicted = self._predicted
        is_off = self._deviation.note(measurement.position_mm, predicted.position_mm)
        self._note(
            Predicted(
                self._now_s(),
                predicted.position_mm,
                predicted.heading,
                predicted.bevel,
                distance(measurement.position_mm, predicted.position_mm),
            )
        )
        if self._feels(measurement):
            return Event.FORCE
        self._visit(measurement.position_mm, last_too=False)
        if is_off or (self._is_short and self._short_in_row > 1):
            return Event.DEVIATION
        if self._is_short:
            return Event.PLAN_FAILS
        return Event.IN_TARGET if self._is_there(measurement) else self._review()

    def _is_there(self, measurement: Measurement) -> bool:
        """Whether the tip is surely in the last target before the plan ends."""
        targets = self._knowledge.a_priori.targets
        last = targets[-1]
        if self._knowledge.visited < len(targets) - 1:
            return False
        if distance(measurement.position_mm, last.center_mm) > last.radius_mm:
            return False
        return is_surely_in(last, self._needle.glance(), self._settings.margins.depth_mm)

    def _review(self) -> Event:
        """Whether the rest of the plan holds, also for the newest estimate when it is due.

        If it does, the tip is expected where the newest estimate says. If it has little reserve,
        a better plan is looked for, and the rest is one of the choices.
        """
        depth_mm = self._needle.depth_mm
        if depth_mm - self._reviewed_mm < self._settings.review_mm - _SMALL_MM or not self._moves:
            return Event.AS_PREDICTED
        self._reviewed_mm = depth_mm
        estimate = self._needle.glance()
        scene = self._knowledge.scene(estimate.tip, estimate.radius_mm, depth_mm)
        rest = Plan.of(action for action, _ in self._moves)
        certificate = certify(rest, scene)
        if not self._settings.margins.allow(certificate):
            return Event.PLAN_FAILS
        if not is_enough(certificate, estimate):
            self._rest = rest
            return Event.PLAN_IS_THIN
        self._follow(scene, rest)
        return Event.AS_PREDICTED

    def _follow(self, scene: Scene, plan: Plan) -> None:
        """Makes this the plan to follow, from the pose in the scene."""
        self._moves = deque(_moves(scene, plan.actions, self._settings.spacing_mm))
        self._deviation.begin()

    def _stop(self) -> Event:
        self._needle.stop()
        if self._rise is not None:
            self._learn(self._rise)
            self._rise = None
        return Event.STOPPED

    def _pull_back(self) -> Event:
        """Goes back in the channel to where the next push starts."""
        self._adjustments += 1
        goal_mm = self._retreat_mm
        if goal_mm is None:
            goal_mm = max(
                0.0, self._needle.depth_mm - self._settings.pull_mm + self._settings.push_mm
            )
        # At the entry there is no channel to push in: the next plan starts there.
        self._retreat_mm = goal_mm
        self._needle.pull_back_to(max(0.0, goal_mm - self._settings.push_mm))
        return Event.PULLED

    def _push_again(self) -> Event:
        """Pushes in the open channel, and measures."""
        goal_mm = self._retreat_mm if self._retreat_mm is not None else self._needle.depth_mm
        self._retreat_mm = None
        length_mm = goal_mm - self._needle.depth_mm
        for piece_mm in _pieces(length_mm, self._settings.spacing_mm):
            self._require_time()
            start = self._needle.path
            self._push(piece_mm, start.push(self._estimate().radius_mm, piece_mm).tip)
            if self._feels(self._needle.measure()):
                return Event.FORCE
            if self._is_short:
                break
        return Event.PUSHED

    # Knowledge.

    def _feels(self, measurement: Measurement) -> bool:
        """Whether the force rises more than plain insertion and known regions explain."""
        if not self._settings.force_sensing or not self._needle.cuts:
            return False
        tip_mm = self._needle.path.tip.position_mm
        allowed_n = self._knowledge.expected_force_n(tip_mm, self._settings)
        self._rise = self._force.note(self._needle.depth_mm, measurement.force_n, allowed_n)
        return self._rise is not None

    def _learn(self, rise: Rise) -> None:
        """Turns a rise of the force into a region, ahead of the place where it began."""
        self._force.forget_rise()
        path = self._needle.glance().path
        began = path.pull(rise.felt_mm - rise.began_mm)
        before = self._knowledge.learned
        self._knowledge = self._knowledge.with_contact(
            orthonormal(began.tip),
            self._settings.sensing_margin_mm,
            self._settings.learned_radius_mm,
            self._needle.channels,
            position_unsure_mm(self._settings),
        )
        for region in self._knowledge.learned:
            if region not in before:
                self._note(Learned.of(self._now_s(), region))
        kept = {(region.kind, region.name) for region in self._knowledge.learned}
        for region in before:
            if (region.kind, region.name) not in kept:
                self._note(Forgotten(self._now_s(), region.name, region.kind))

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

    def _here(self) -> Scene:
        """The known scene with the needle where it is."""
        estimate = self._estimate()
        return self._knowledge.scene(estimate.tip, estimate.radius_mm, self._needle.depth_mm)

    def _first_push_is_free(self) -> bool:
        return is_free(self._here(), self._settings.initial_push_mm, self._settings.priors)

    def _ask(self, tip: Pose, depth_mm: float, rest: Plan | None = None) -> Synthesis:
        """The synthesis from a pose, with the current knowledge, and in the time left.

        Args:
            tip: The pose.
            depth_mm: Its depth.
            rest: The rest of a plan, which is a choice too.
        """
        scene = self._knowledge.scene(tip, self._estimate().radius_mm, depth_mm)
        self._listen()
        whole = self._synthesise(scene)
        if rest is not None:
            whole = whole.with_plan(rest)
        synthesis = self._in_time(whole, self._needle.depth_mm - depth_mm)
        self._lack.found |= whole.found > 0
        self._lack.held |= bool(whole.candidates)
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
                partial=not synthesis.is_complete,
            )
        )
        # If the run ended during the synthesis, the synthesis does not count.
        self._syntheses = number
        self._note(Timed(self._now_s(), number, synthesis.seconds, synthesis.loop_seconds))
        return synthesis

    def _in_time(self, synthesis: Synthesis, back_mm: float) -> Synthesis:
        """The synthesis without the plans that cannot end within the time limit.

        Args:
            synthesis: The synthesis.
            back_mm: How far the needle must be pulled back before.
        """
        left_s = self._settings.timeout_s - (self._now_s() - self._started_s)
        speed_mm_per_s = synthesis.scene.needle.speed_mm_per_s
        if back_mm > 0.0:
            # Beyond the place, and again up to it, in the open channel.
            again_mm = self._settings.push_mm
            left_s -= (back_mm + again_mm) / (self._settings.pull_speed_ratio * speed_mm_per_s)
            left_s -= again_mm / speed_mm_per_s
        kept = tuple(
            candidate
            for candidate in synthesis.candidates
            if self._seconds(candidate.plan, speed_mm_per_s) <= left_s
        )
        return replace(synthesis, candidates=kept)

    def _seconds(self, plan: Plan, speed_mm_per_s: float) -> float:
        """How long a plan takes: its pushes and its rolls."""
        rolls_rad = sum(abs(one.angle_rad) for one in plan.actions if isinstance(one, Roll))
        return plan.length_mm / speed_mm_per_s + rolls_rad / self._settings.roll_rad_per_s

    def _adopt(self, synthesis: Synthesis) -> None:
        """Chooses the best plan as the one to follow."""
        best = synthesis.best
        if best is None:
            raise AssertionError("a synthesis without a plan was adopted")
        self._agree(f"follow the plan {best.plan}")
        self._follow(synthesis.scene, best.plan)
        self._reviewed_mm = self._needle.depth_mm

    def _estimate(self) -> Estimate:
        if self._needle.estimate is None:
            raise AssertionError("the estimate comes before this")
        return self._needle.estimate

    def _act(self, action: Push | Roll) -> None:
        """Makes a move, at whose end the tip is predicted."""
        if isinstance(action, Roll):
            self._is_short = False
            self._needle.roll(action.angle_rad)
        else:
            self._push(action.length_mm, self._predicted)

    def _push(self, length_mm: float, predicted: Pose) -> None:
        """Pushes under guard; counts how often in a row a push was ended early."""
        settings, depth_mm = self._settings, self._needle.depth_mm
        end_mm = predicted.position_mm
        a_priori = self._knowledge.a_priori
        expected_n = self._force.expected_n(depth_mm + length_mm)
        expected_n += self._knowledge.expected_force_n(end_mm, settings)
        way = (self._needle.path.tip.position_mm, end_mm)
        with self._supervisor.guarding(Guard.of(settings, way, a_priori.criticals, expected_n)):
            self._is_short = not self._needle.push(length_mm)
        self._short_in_row = self._short_in_row + 1 if self._is_short else 0

    def _halt(self, state: State) -> State:
        """Stops the needle at the end of a run, whatever the reason; returns how it ends."""
        try:
            self._needle.stop()
        except JournalError as error:
            self._reason = str(error)
            return State.FAULTED
        except DeviceError as error:
            # The run ends anyway, but the report must say that the device did not stop.
            self._reason = f"{self._reason}; it cannot be stopped: {error}"
        return state

    def _require_time(self) -> None:
        if self._now_s() - self._started_s >= self._settings.timeout_s:
            raise LimitError(f"the limit of {self._settings.timeout_s:g} s is over")

    def _now_s(self) -> float:
        return self._needle.now_s()

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
