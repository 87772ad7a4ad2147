"""The online controller: the paper's workflow (section 3) on any device.

A run goes through the state machine of `ntagen.drive.states`; each state has one task here, and
`ntagen.drive.workflow` goes from one to the next and ends the run. The driver's decisions depend
only on its settings, the a-priori scene, the measurements and the synthesiser. It reads no clock
except the device's and uses no random numbers, so that the same measurements always lead to the
same decisions (`ntagen.drive.replay`).

The safety rules:

* every end of a run, and every alarm, stops the needle first;
* the needle is pulled back only along its channel. Rolls are undone where they were made, and there
  are no alarms during the pull (paper, section 3.2);
* the driver follows a plan only if its certificate holds for the newest estimate of pose and
  radius, and a strategy only if all its branches hold.

If there is no plan, the driver does not pull back at once. It first looks for a place behind the
tip, on the known channel, from which there is a strategy. If there is none back to the entry, the
run ends where it is.

A push may be ended early while it goes on (`ntagen.drive.supervisor`). Then the driver measures,
and plans from where the needle is; at the second time in a row it pulls back.

The first push belongs to a plan from the entry. If there is none, the push is made only if no known
region is near it for any start error (`ntagen.drive.planning`).

A run that goes on from a log begins with all that the runs before it knew (`ntagen.drive.past`),
and with a question (`ntagen.drive.resuming`). It keeps no plan of theirs.

The driver looks at known points whether somebody wants the run to end: before each motion and each
synthesis. Between two such points something is always recorded, so that a replay knows at which
point the run ended.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from ntagen.drive.advice import Advice
from ntagen.drive.deviation import DeviationMonitor, DivergenceMonitor, require_explained
from ntagen.drive.device import Device
from ntagen.drive.following import Course
from ntagen.drive.guide import Guide
from ntagen.drive.learning import Learner
from ntagen.drive.pieces import Moves, Pace, pieces
from ntagen.drive.planning import Lack, Planner, is_free
from ntagen.drive.posterior import promise_of
from ntagen.drive.prospect import is_enough, is_surely_in
from ntagen.drive.records import Command, Ended, Journal, Predicted, Promised, Record, Relied
from ntagen.drive.reliance import relies_on
from ntagen.drive.resuming import Ask, Resuming
from ntagen.drive.settings import Settings
from ntagen.drive.states import Event, State
from ntagen.drive.steering import Steering
from ntagen.drive.supervisor import Guard, Supervisor
from ntagen.drive.tube import confidence_in
from ntagen.drive.workflow import Workflow
from ntagen.needle.estimate import Estimate
from ntagen.needle.kinematics import orthonormal
from ntagen.needle.measurement import Measurement
from ntagen.needle.path import Path
from ntagen.needle.vectors import distance
from ntagen.plan.actions import Action, Plan, Push, Roll, Wait
from ntagen.plan.certify import certify
from ntagen.plan.policy import Policy
from ntagen.plan.rank import Candidate, reserve_of
from ntagen.plan.synthesise import Synthesis, Synthesiser
from ntagen.scene import Pose, Scene

_SMALL_MM: Final = 1e-9
_NO_REGION_MM: Final = 1e9

_RETRACTED_MM: Final = 1.0
"""The pieces in which a needle is pulled back after a run; ours."""

_ENOUGH_BEHIND_MM: Final = 1.5
"""With this reserve, a plan from behind the tip is good enough: each mm farther back costs time."""


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
        course: In a tissue that answers, the strategy that is followed; plans without one.
        policy: In a tissue with chance, what is asked at each measurement; plans alone without one.
        ask: Asks the operator whether a run that was cut off may go on.

    Attributes:
        reason: Why the run ends, as far as it is known.
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
        course: Course | None = None,
        policy: Policy | None = None,
        ask: Ask = lambda _: False,
    ) -> None:
        self._settings = settings
        self._journal = journal
        self._listen = listen
        self._supervisor = supervisor or Supervisor()
        self._agree = agree
        self._needle = Steering(scene.needle, device, settings, journal, listen)
        self._learner = Learner(scene, settings, self._needle, journal)
        self._planner = Planner(synthesise, settings, self._needle, self._learner, journal, listen)
        self._guide = Guide(course, scene, settings, self._needle, journal)
        self._advice = Advice(policy, scene, self._needle, journal)
        self._resuming = Resuming(self._needle, self._learner, settings, journal, ask)
        self._deviation = DeviationMonitor(settings, scene.needle.length_mm)
        self._adjustments = 0
        self._forget()

    def _forget(self) -> None:
        """Begins without a plan."""
        scene = self._learner.a_priori
        self._divergence = DivergenceMonitor(self._settings)
        self._moves = Moves(scene)
        self._reviewed_mm = 0.0
        self._rest: Plan | None = None
        self._pace = Pace(scene)
        self._predicted: Pose = scene.needle.tip
        self._is_short = False
        self._short_in_row = 0
        self._retreat_mm: float | None = None
        self.reason = ""

    def run(self) -> Ended:
        """Drives until the run ends and the needle is stopped; returns the last record."""
        return self._run(State.ARM)

    def resume(self) -> Ended:
        """The same for a needle that lies in the tissue, after `was_cut`."""
        return self._run(State.RESUME)

    def was_cut(self, pending: Command | None) -> None:
        """Notes that a run was cut off, perhaps in a motion; its plan counts no more."""
        self._resuming.was_cut(pending)
        self._forget()

    def _run(self, begin: State) -> Ended:
        self._journal.started(self._learner.a_priori)
        relied = relies_on(self._settings, self._learner.a_priori, self._guide.course)
        self._note(Relied(self._now_s(), relied))
        return Workflow(self, self._needle, self._journal).run(begin)

    def retract(self) -> None:
        """Pulls the needle back to the entry after the run: in its channel, its rolls undone.

        It goes in short pieces: one that is stopped counts as made, and the next call goes on.

        Raises:
            DeviceError: The needle cannot be moved or seen.
            KeyboardInterrupt: Somebody wants it to end.
        """
        try:
            while self._needle.depth_mm > _SMALL_MM:
                self._needle.pull_back_to(max(0.0, self._needle.depth_mm - _RETRACTED_MM))
        finally:
            self._needle.stop_at_once()

    def by_state(self) -> dict[State, Callable[[], Event]]:
        """The task of each state."""
        return {
            State.ARM: self._arm,
            State.RESUME: self._resume,
            State.RETREAT: self._retreat,
            State.INITIAL_PUSH: self._initial_push,
            State.ESTIMATE: self._make_estimate,
            State.SYNTHESISE: self._find_strategy,
            State.EXECUTE: self._execute,
            State.MONITOR: self._monitor,
            State.STOP: self._stop,
            State.PULL_BACK: self._pull_back,
            State.PUSH: self._push_again,
        }

    def require_time(self, at_s: float) -> None:
        """See `Planner.require_time`."""
        self._planner.require_time(at_s)

    def ended(self, outcome: State) -> Ended:
        """The last record."""
        self._guide.leave("the run is over")
        confidence = error_mm = 0.0
        if outcome is State.TARGET_REACHED and self._needle.estimate is not None:
            estimate = self._needle.glance()
            error_mm = estimate.position_std_mm(0.0)
            confidence = confidence_in(self._learner.a_priori.targets[-1], estimate)
        return Ended(
            time_s=self._now_s(),
            outcome=outcome.value,
            reason=self.reason,
            depth_mm=self._needle.depth_mm,
            adjustments=self._adjustments,
            syntheses=self._planner.count,
            cut_mm=self._needle.cut_mm,
            confidence=confidence,
            error_mm=error_mm,
        )

    # The tasks, in the order of the workflow.

    def _arm(self) -> Event:
        self._planner.start()
        self._resuming.begins()
        measurement = self._needle.measure()
        self._learner.arm(measurement)
        if self._guide.is_on:
            self._guide.note(measurement.position_mm)
            self._guide.leave_if_lost()
        return Event.ARMED

    def _resume(self) -> Event:
        self._planner.start()
        self._guide.leave("the run was cut off")
        self._learner.recall()
        event = self._resuming.task()
        # The operator took as long as it took.
        self._planner.start()
        return event

    def _retreat(self) -> Event:
        """Pulls the needle out. It is not turned: perhaps nobody knows how it stands."""
        self._needle.withdraw()
        entry_mm = self._learner.a_priori.needle.tip.position_mm
        off_mm = distance(self._needle.measure().position_mm, entry_mm)
        self.reason = (
            "the needle was pulled back along its channel to the entry, and the tip is measured "
            f"{off_mm:.1f} mm from there"
        )
        return Event.IS_OUT

    def _make_estimate(self) -> Event:
        estimate = self._needle.estimated()
        require_explained(estimate, self._settings, self._learner.a_priori.needle.radius_mm)
        self._divergence.note(estimate)
        tip = estimate.tip
        self._learner.visit(tip.position_mm, last_too=self._is_sure_of_target(estimate))
        if self._learner.has_visited_all:
            self.reason = "the tip is in the last target"
            return Event.IN_TARGET
        return Event.ESTIMATED

    def _is_sure_of_target(self, estimate: Estimate) -> bool:
        """Whether the tip is in the last target with the confidence that is asked for."""
        target = self._learner.a_priori.targets[-1]
        if target.motion is not None or not self._settings.counts_reserve:
            return True
        return confidence_in(target, estimate) >= self._settings.accept

    def _find_strategy(self) -> Event:
        if self._guide.is_on:
            return self._begin_strategy()
        if self._guide.forbids_plans:
            self.reason = self._guide.reason
            return Event.NOT_GUARANTEED if self._guide.had_strategy else Event.NO_STRATEGY
        self._planner.lack = Lack()
        is_first = self._planner.count == 0 and self._needle.depth_mm == 0.0
        rest, self._rest = self._rest, None
        here = self._planner.ask(self._needle.known.tip, self._needle.depth_mm, rest)
        if here.best is not None:
            self._adopt(here)
            return Event.FIRST_STRATEGY if is_first else Event.STRATEGY_FOUND
        if is_first and not self._planner.lack.held and self._first_push_is_free():
            push = Push(self._settings.initial_push_mm)
            self._agree(f"push {push.length_mm:g} mm to see how the needle bends")
            self._follow(self._here(), Plan.of([push]))
            return Event.PUSH_IS_FREE
        return self._look_back()

    def _begin_strategy(self) -> Event:
        """Begins to follow the strategy against the tissue, if its longest branch ends in time."""
        if self._guide.longest_s(self._guide.root) > self._planner.left_s():
            self.reason = "the strategy against the tissue may not end within the time limit"
            return Event.NO_TIME_LEFT
        self._agree(self._guide.text)
        return Event.TREE_FOUND

    def _look_back(self) -> Event:
        """Looks for the nearest place behind the tip from which there is a strategy."""
        places = self._places_behind()
        if not places:
            with self._learner.supposing_least() as is_less:
                # If not even these leave a way, no larger ones do.
                has_hope = is_less and bool(self._places_behind())
            while has_hope and not places and self._learner.doubt():
                places = self._places_behind()
        if not places:
            event, self.reason = self._planner.lack.event()
            return event
        # The nearest place with enough reserve was found last; without one, the most reserve wins.
        if not is_enough(places[-1][1].certificate, self._needle.known, _ENOUGH_BEHIND_MM):
            places.sort(key=lambda place: reserve_of(place[1].certificate))
        depth_mm, best = places[-1]
        self._agree(f"pull back to a depth of {depth_mm:.1f} mm, for the plan {best.plan}")
        self._retreat_mm = depth_mm
        return Event.STRATEGY_BEHIND

    def _places_behind(self) -> list[tuple[float, Candidate]]:
        """Depths behind the tip, each with the best plan from there; the nearest come first.

        The list ends with the first plan that has enough reserve.
        """
        stride_mm = self._settings.pull_mm - self._settings.push_mm
        path = self._needle.path
        depth_mm = path.depth_mm
        places: list[tuple[float, Candidate]] = []
        while depth_mm > _SMALL_MM:
            self._planner.require_time(self._planner.asked_s)
            depth_mm = max(0.0, depth_mm - stride_mm)
            behind = path.pull(path.depth_mm - depth_mm)
            best = self._planner.ask(_unrolled(behind), depth_mm).best
            if best is not None:
                places.append((depth_mm, best))
                if is_enough(best.certificate, self._needle.known, _ENOUGH_BEHIND_MM):
                    break
        return places

    def _initial_push(self) -> Event:
        """Makes the first moves of the plan, or the free push if there is none."""
        goal_mm = self._settings.initial_push_mm
        while self._moves and not self._is_short:
            action, self._predicted = self._moves.first()
            if not self._keep_pace(action):
                break
            self._moves.drop_first()
            self._planner.require_time()
            self._act(action)
            if not isinstance(action, Push):
                continue
            measurement = self._needle.measure()
            if self._learner.feels(measurement):
                return Event.FORCE
            self._learner.visit(measurement.position_mm, last_too=False)
            if self._needle.depth_mm >= goal_mm - _SMALL_MM:
                break
        return Event.PUSHED

    def _execute(self) -> Event:
        if self._guide.is_on:
            return self._follow_branch()
        if not self._moves:
            return Event.PLAN_DONE
        action, self._predicted = self._moves.first()
        if not self._keep_pace(action):
            return Event.OUT_OF_STEP
        self._moves.drop_first()
        self._act(action)
        return Event.ACTED

    def _follow_branch(self) -> Event:
        """Makes the next move of the strategy that is followed."""
        move = self._guide.next()
        if move is None:
            self._guide.leave()
            if self._guide.course is None:
                return Event.PLAN_DONE
            # The tip is near the end of a branch, and those ends are deep enough in the target.
            self._learner.visit(self._predicted.position_mm, last_too=True)
            self.reason = "the tip is in the last target, where the branch that was followed ends"
            return Event.TREE_DONE
        action, self._predicted = move
        self._act(action)
        return Event.ACTED

    def _monitor(self) -> Event:
        measurement = self._needle.measure()
        if self._guide.is_on:
            return self._monitor_branch(measurement)
        predicted = self._predicted
        is_off = self._deviation.note(measurement.position_mm, predicted.position_mm)
        self._note_predicted(measurement)
        if self._learner.feels(measurement):
            return Event.FORCE
        self._learner.visit(measurement.position_mm, last_too=False)
        if is_off or (self._is_short and self._short_in_row > 1):
            return Event.DEVIATION
        if self._is_short:
            return Event.PLAN_FAILS
        return Event.IN_TARGET if self._is_there(measurement) else self._review()

    def _monitor_branch(self, measurement: Measurement) -> Event:
        """Whether a branch of the strategy explains where the tip is, and no region is felt."""
        self._guide.note(measurement.position_mm)
        self._predicted = self._guide.expected()
        self._note_predicted(measurement)
        event = Event.AS_PREDICTED
        if self._learner.feels(measurement):
            event = Event.FORCE
            self._guide.leave("the force rises, and no known region explains it")
        elif self._is_short and self._short_in_row > 1:
            event = Event.DEVIATION
            self._guide.leave("pushes are ended early")
        elif self._guide.leave_if_lost():
            event = Event.OFF_TREE
        if self._guide.forbids_plans:
            self.reason = self._guide.reason
            return Event.NOT_GUARANTEED
        if event is Event.AS_PREDICTED and self._guide.course is None:
            return self._review_branch(measurement)
        return event

    def _review_branch(self, measurement: Measurement) -> Event:
        """Whether the tip is there before the branch ends; else looks for a newer strategy."""
        if self._is_there(measurement):
            self._guide.leave()
            return Event.IN_TARGET
        if self._is_review_due():
            self._reviewed_mm = depth_mm = self._needle.depth_mm
            estimate = self._needle.glance()
            scene = self._learner.scene(estimate.tip, estimate.radius_mm, depth_mm)
            self._look_for_promise(scene, estimate)
        return Event.AS_PREDICTED

    def _is_review_due(self) -> bool:
        """Whether the needle was inserted far enough since the last look at what it follows."""
        since_mm = self._needle.depth_mm - self._reviewed_mm
        return since_mm >= self._settings.review_mm - _SMALL_MM

    def _look_for_promise(self, scene: Scene, estimate: Estimate) -> None:
        """Follows a strategy that wins from here against all that the estimate leaves open."""
        depth_mm = self._needle.depth_mm
        if self._guide.course is not None or depth_mm <= _SMALL_MM:
            return
        promise = promise_of(scene, estimate, self._settings, self._listen)
        if promise is None or self._guide.longest_s(promise.tree) > self._planner.left_s():
            return
        bounds, confidence = promise.scene.tissue, self._settings.accept
        self._note(
            Promised(
                self._now_s(),
                depth_mm,
                promise.tree.leaves,
                bounds.curvature_ratio,
                bounds.roll_rad,
                bounds.tip_mm,
                confidence,
            )
        )
        self._guide.begin(promise)
        self._agree(self._guide.text)

    def _note_predicted(self, measurement: Measurement) -> None:
        """Records where the tip was expected, and how far from there it is."""
        predicted = self._predicted
        self._note(
            Predicted(
                self._now_s(),
                predicted.position_mm,
                predicted.heading,
                predicted.bevel,
                distance(measurement.position_mm, predicted.position_mm),
            )
        )

    def _is_there(self, measurement: Measurement) -> bool:
        """Whether the tip is surely in the last target before the plan ends."""
        targets = self._learner.a_priori.targets
        last = targets[-1]
        if self._learner.knowledge.visited < len(targets) - 1:
            return False
        # A target that moves may leave the tip again before the driver has looked.
        if last.motion is not None or last.distance_mm(measurement.position_mm) > 0.0:
            return False
        return is_surely_in(last, self._needle.glance(), self._settings.margins.depth_mm)

    def _review(self) -> Event:
        """Whether the rest of the plan holds, also for the newest estimate when it is due.

        If it does, the tip is expected where the newest estimate says. If it has little reserve,
        a better plan is looked for, and the rest is one of the choices.
        """
        self._take_advice()
        if not self._is_review_due() or not self._moves:
            return Event.AS_PREDICTED
        self._reviewed_mm = self._needle.depth_mm
        estimate = self._needle.glance()
        scene, rest = self._left(estimate)
        certificate = certify(rest, scene)
        if not self._settings.margins.allow(certificate):
            return Event.PLAN_FAILS
        if self._planner.tube(scene, estimate).confidence(rest) < self._settings.accept:
            return Event.PLAN_FAILS
        if not is_enough(certificate, estimate):
            self._rest = rest
            return Event.PLAN_IS_THIN
        self._follow(scene, rest)
        self._planner.note_tube(rest, scene, estimate)
        self._look_for_promise(scene, estimate)
        return Event.AS_PREDICTED

    def _take_advice(self) -> None:
        """Follows the policy instead of the plan, where it goes on otherwise and that is safe."""
        if not self._advice.is_due():
            return
        scene, rest = self._left(self._needle.glance())
        plan = self._advice.instead_of(rest, scene, self._planner.vouched)
        if plan is not None:
            self._agree(f"follow the policy: {plan}")
            self._follow(scene, plan)

    def _left(self, estimate: Estimate) -> tuple[Scene, Plan]:
        """The known scene for an estimate, and the rest of the plan."""
        depth_mm = self._needle.depth_mm
        scene = self._learner.scene(estimate.tip, estimate.radius_mm, depth_mm)
        return scene, Plan.of(self._moves.actions)

    def _follow(self, scene: Scene, plan: Plan) -> None:
        """Makes this the plan to follow, from the pose in the scene."""
        self._moves = Moves(scene, plan.actions, self._settings.spacing_mm)
        self._pace = Pace(scene)
        self._deviation.begin()

    def _stop(self) -> Event:
        self._needle.stop()
        self._learner.learn()
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
        tube = self._planner.tube(self._here(), self._needle.known)
        if tube.confidence(Plan.of([Push(max(0.0, length_mm))])) < self._settings.accept:
            # The next plan begins here, and needs no push before it.
            return Event.PUSHED
        for piece_mm in pieces(length_mm, self._settings.spacing_mm):
            self._planner.require_time()
            start = self._needle.path
            self._push(Push(piece_mm), start.push(self._needle.known.radius_mm, piece_mm).tip)
            if self._learner.feels(self._needle.measure()):
                return Event.FORCE
            if self._is_short:
                break
        return Event.PUSHED

    def _here(self) -> Scene:
        """The known scene with the needle where it is."""
        known, depth_mm = self._needle.known, self._needle.depth_mm
        return self._learner.scene(known.tip, known.radius_mm, depth_mm)

    def _first_push_is_free(self) -> bool:
        breath = self._learner.a_priori.breath
        if breath is not None and breath.gate is not None:
            # Without a plan, nobody knows when the gate is open.
            return False
        return is_free(self._here(), self._settings.initial_push_mm, self._settings.priors)

    def _adopt(self, synthesis: Synthesis) -> None:
        """Chooses the best plan as the one to follow."""
        best = synthesis.best
        if best is None:
            raise AssertionError("a synthesis without a plan was adopted")
        self._agree(f"follow the plan {best.plan}")
        self._follow(synthesis.scene, best.plan)
        self._planner.note_tube(best.plan, synthesis.scene, self._needle.known)
        self._reviewed_mm = self._needle.depth_mm
        self._take_advice()
        self._look_for_promise(synthesis.scene, self._needle.known)

    def _keep_pace(self, action: Action) -> bool:
        """Waits until the breath is where the plan expects it; whether the plan still holds.

        If it is too late for that, the rest of the plan may hold from now on as well.
        """
        if self._learner.a_priori.breath is None:
            return True
        wait_s = self._pace.wait_s(action, self._learner.clock_now_s())
        if wait_s is None:
            scene, rest = self._left(self._needle.glance())
            if not self._settings.margins.allow(certify(rest, scene)):
                return False
            self._pace = Pace(scene)
        elif wait_s > 0.0:
            self._needle.wait(wait_s)
        self._pace.begin(action)
        return True

    def _act(self, action: Action) -> None:
        """Makes a move, at whose end the tip is predicted."""
        if isinstance(action, Roll):
            self._is_short = False
            self._needle.roll(action.turn_rad)
        elif isinstance(action, Wait):
            self._is_short = False
            self._needle.wait(max(0.0, action.seconds - self._pace.late_s))
        else:
            self._push(action, self._predicted)

    def _push(self, action: Push, predicted: Pose) -> None:
        """Pushes under guard; counts how often in a row a push was ended early."""
        settings, depth_mm = self._settings, self._needle.depth_mm
        end_mm = predicted.position_mm
        expected_n = self._learner.expected_force_n(depth_mm + action.length_mm, end_mm)
        clock_s = self._learner.clock_s(self._needle.seen_s)
        regions = tuple(one.at(clock_s) for one in self._learner.a_priori.criticals)
        way = (self._needle.path.tip.position_mm, end_mm)
        with self._supervisor.guarding(Guard.of(settings, way, regions, expected_n)):
            self._is_short = not self._needle.push(action)
        if self._is_short and action.spin:
            # Out of the guard, which would end this motion, too.
            self._needle.settle()
        self._short_in_row = self._short_in_row + 1 if self._is_short else 0

    def _now_s(self) -> float:
        return self._needle.now_s()

    def _note(self, record: Record) -> None:
        self._journal.record(record)


def _unrolled(path: Path) -> Pose:
    """The pose at the end of a channel, after the rolls beyond it have been undone."""
    return orthonormal(Path(path.entry, path.stretches).tip)
