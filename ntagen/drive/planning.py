"""Looking for plans in a run: each synthesis is recorded, and plans must end in the time left."""

from __future__ import annotations

import contextlib
import hashlib
import math
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Final

from ntagen.drive.learning import Learner
from ntagen.drive.prospect import by_prospect
from ntagen.drive.records import Journal, Synthesised, Timed
from ntagen.drive.settings import Settings
from ntagen.drive.spinning import push_seconds
from ntagen.drive.states import Event
from ntagen.drive.steering import Steering
from ntagen.drive.torsion import Lag
from ntagen.drive.tube import Tube
from ntagen.errors import LimitError, ModelError, NtagenError
from ntagen.needle.estimate import Estimate, Priors
from ntagen.needle.kinematics import Arc
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.plan.certify import clearance
from ntagen.plan.extract import step_length_mm
from ntagen.plan.rank import Candidate
from ntagen.plan.synthesise import Synthesis, Synthesiser, select
from ntagen.scene import Pose, Scene

_NO_REGION_MM: Final = 1e9


@dataclass(slots=True)
class Lack:
    """Why no plan is left, over all places from which one was looked for."""

    found: bool = False
    held: bool = False
    confidence: float | None = None

    def event(self) -> tuple[Event, str]:
        """The event, and the reason in words."""
        if self.held:
            return Event.NO_TIME_LEFT, "no plan can end within the time limit"
        if self.confidence is not None:
            return Event.NONE_HOLDS, (
                f"no plan is sure enough to stay clear of critical regions: the confidence of the "
                f"best one is {self.confidence:.3f}; --set 'accept …' says which one is enough"
            )
        if self.found:
            return Event.NONE_HOLDS, "no plan of the model holds in exact kinematics"
        return Event.NO_STRATEGY, "no plan is left, even from the entry"


class Planner:
    """What looks for plans, and knows the time that is left.

    Args:
        synthesise: Finds plans.
        settings: How to drive.
        needle: The needle.
        learner: What the driver knows.
        journal: Records each synthesis.
        listen: Raises `KeyboardInterrupt` if somebody wants the run to end.

    Attributes:
        count: The number of syntheses.
        asked_s: When the last one was over.
        lack: Why no plan is left.
    """

    def __init__(
        self,
        synthesise: Synthesiser,
        settings: Settings,
        needle: Steering,
        learner: Learner,
        journal: Journal,
        listen: Callable[[], None],
    ) -> None:
        self._synthesise = synthesise
        self._settings = settings
        self._needle = needle
        self._learner = learner
        self._journal = journal
        self._listen = listen
        # The clock of a device may begin anywhere.
        self._started_s = math.inf
        self.count = 0
        self.asked_s = 0.0
        self.lack = Lack()

    def start(self) -> None:
        """The time of the run begins now."""
        self._started_s = self._needle.now_s()

    def require_time(self, at_s: float | None = None) -> None:
        """Does nothing while there is time left.

        Args:
            at_s: The time that counts; now by default. Before something that may take long, it must
                be that of the last record: a replay has no other clock than the next record.

        Raises:
            LimitError: The time limit is over.
        """
        now_s = self._needle.now_s() if at_s is None else at_s
        if now_s - self._started_s >= self._settings.timeout_s:
            raise LimitError(f"the limit of {self._settings.timeout_s:g} s is over")

    def left_s(self) -> float:
        """The time that is left."""
        return self._settings.timeout_s - (self._needle.now_s() - self._started_s)

    def ask(self, tip: Pose, depth_mm: float, rest: Plan | None = None) -> Synthesis:
        """The synthesis from a pose, with the current knowledge, and in the time left.

        Args:
            tip: The pose.
            depth_mm: Its depth.
            rest: The rest of a plan, which is a choice too.
        """
        scene = self._learner.scene(tip, self._needle.known.radius_mm, depth_mm)
        self._listen()
        back_mm = self._needle.depth_mm - depth_mm
        whole = self._found(scene, rest)
        self.lack.found |= whole.found > 0
        whole = self._sure(whole)
        self.lack.held |= bool(whole.candidates)
        synthesis = self._in_time(whole, back_mm)
        if whole.candidates and not synthesis.candidates:
            # The engine gives the best plans. A shorter one may end in time.
            shorter = self._shorter(scene, back_mm)
            if shorter.needle.length_mm > step_length_mm(scene):
                synthesis = self._in_time(self._sure(self._found(shorter, rest)), back_mm)
        number, best = self.count + 1, synthesis.best
        self._journal.synthesised(number, synthesis)
        clearance_mm = best.certificate.critical_clearance_mm if best else -1.0
        self._journal.record(
            Synthesised(
                time_s=self._needle.now_s(),
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
        self.count = number
        self.asked_s = self._needle.now_s()
        self._journal.record(Timed(self.asked_s, number, synthesis.seconds, synthesis.loop_seconds))
        return synthesis

    def vouched(self, scene: Scene, plans: Iterable[Plan]) -> tuple[Candidate, ...]:
        """Those of some plans that may be followed from where the needle is, best first."""
        settings = self._settings
        kept = select(plans, scene, settings.margins, settings.ranking)
        synthesis = Synthesis(
            scene, "", len(kept), kept, 0.0, margins=settings.margins, ranking=settings.ranking
        )
        return self._in_time(self._sure(synthesis), 0.0).candidates

    def _found(self, scene: Scene, rest: Plan | None) -> Synthesis:
        """The plans of a scene, and the rest of a plan if that holds, best first."""
        has_tube = self._has_tube(scene)
        asked = self.tube(scene, self._needle.known).asked() if has_tube else None
        found = self._synthesise(scene) if asked is None else self._synthesise(scene, asked)
        if rest is not None:
            found = found.with_plan(rest)
        if not self._settings.counts_reserve:
            return found
        estimate, left_s = self._needle.known, self.left_s()
        return timed(found, lambda one: by_prospect(one, estimate, self._settings, left_s))

    def _sure(self, synthesis: Synthesis) -> Synthesis:
        """The synthesis without the plans that may soon touch a known critical region."""
        if not synthesis.candidates or not self._has_tube(synthesis.scene):
            return synthesis
        tube = self.tube(synthesis.scene, self._needle.known)
        sure, best = [], 0.0
        for candidate in synthesis.candidates:
            confidence = tube.confidence(candidate.plan)
            best = max(best, confidence)
            if confidence >= self._settings.accept:
                sure.append(candidate)
        if not sure:
            self.lack.confidence = max(best, self.lack.confidence or 0.0)
        return synthesis.with_candidates(sure)

    def tube(self, scene: Scene, estimate: Estimate) -> Tube:
        """What is around the ways from where the needle is in a scene.

        Only regions that were told count. Where a learned one lies is a guess, and the force is
        watched there. Regions that move are left to the certificates, which follow them in time.
        """
        regions = self._learner.a_priori.criticals if self._has_tube(scene) else ()
        return Tube(scene, estimate, self._settings, regions)

    def note_tube(self, plan: Plan, scene: Scene, estimate: Estimate) -> None:
        """Records the tube of a plan that is followed from where the needle is."""
        if self._has_tube(scene):
            tube = self.tube(scene, estimate)
            now_s, depth_mm = self._needle.now_s(), self._needle.depth_mm
            self._journal.record(tube.foreseen(plan, now_s, depth_mm))

    def _has_tube(self, scene: Scene) -> bool:
        """Whether plans are judged by their tubes."""
        return self._settings.counts_reserve and scene.breath is None

    def _shorter(self, scene: Scene, back_mm: float) -> Scene:
        """The scene with a needle so short that its plans, with all their rolls, end in time.

        None of them spins the needle, since turns take time.
        """
        angles_rad = (abs(Roll(one).turn_rad) for one in scene.limits.roll_angles_rad)
        turned_rad = (scene.limits.max_rolls + 1) * max(angles_rad, default=0.0)
        seconds = self._left_after_s(scene, back_mm) - turned_rad / self._settings.roll_rad_per_s
        length_mm = max(0.0, min(scene.needle.length_mm, seconds * scene.needle.speed_mm_per_s))
        needle, limits = replace(scene.needle, length_mm=length_mm), replace(scene.limits, spins=())
        return replace(scene, needle=needle, limits=limits)

    def _in_time(self, synthesis: Synthesis, back_mm: float) -> Synthesis:
        """The synthesis without the plans that cannot end within the time limit.

        Args:
            synthesis: The synthesis.
            back_mm: How far the needle must be pulled back before.
        """
        left_s = self._left_after_s(synthesis.scene, back_mm)
        kept = tuple(
            candidate
            for candidate in synthesis.candidates
            if self._seconds(candidate.plan, synthesis.scene) <= left_s
        )
        return replace(synthesis, candidates=kept)

    def _left_after_s(self, scene: Scene, back_mm: float) -> float:
        """The time that is left after the needle was pulled back, and pushed again."""
        left_s, speed_mm_per_s = self.left_s(), scene.needle.speed_mm_per_s
        if back_mm > 0.0:
            # Beyond the place, and again up to it, in the open channel.
            again_mm = self._settings.push_mm
            left_s -= (back_mm + again_mm) / (self._settings.pull_speed_ratio * speed_mm_per_s)
            left_s -= again_mm / speed_mm_per_s
        return left_s

    def _seconds(self, plan: Plan, scene: Scene) -> float:
        """How long a plan takes: its pushes, its rolls and its waits.

        After a roll, it may be a period until the breath is where the plan expects it.
        """
        speed_mm_per_s = scene.needle.speed_mm_per_s
        if scene.breath is not None:
            periods_s = scene.breath.period_s * plan.roll_count
            return plan.length_mm / speed_mm_per_s + periods_s + plan.waits_s
        roll_rad_per_s = self._settings.roll_rad_per_s
        lag = Lag(self._settings.compensated_lag_rad)
        depth_mm, longer_s = self._needle.depth_mm, 0.0
        for one in plan.actions:
            if isinstance(one, Push):
                depth_mm += one.length_mm
            if isinstance(one, Push) and one.spin:
                seconds = push_seconds(one, speed_mm_per_s, roll_rad_per_s, lag.at_rad(depth_mm))
                longer_s += seconds - one.length_mm / speed_mm_per_s
        rolls_rad = sum(abs(one.turn_rad) for one in plan.actions if isinstance(one, Roll))
        return plan.length_mm / speed_mm_per_s + rolls_rad / roll_rad_per_s + longer_s


SIGMAS: Final = 3.0
"""Start errors count up to this many standard deviations."""


def start_error_mm(length_mm: float, radius_mm: float, priors: Priors) -> float:
    """The radius of the ball in which the tip is after a push from the entry."""
    sideways_mm = length_mm**2 / (2.0 * radius_mm)
    return SIGMAS * (
        priors.position_mm
        + length_mm * priors.heading_rad
        + sideways_mm * (priors.bevel_rad + priors.curvature_ratio)
    )


def is_free(scene: Scene, length_mm: float, priors: Priors) -> bool:
    """Whether a push of this length keeps out of all critical, detection and unexplored regions.

    Where the needle is known only by the scene's description, its tip is after ``s`` mm within a
    ball around the expected place. The ball's radius adds up what each start error does at most:
    the entry is moved, the heading is turned, and over the sideways part ``s^2 / 2r`` of the arc
    the bevel is turned and the curvature differs.
    """
    needle = scene.needle
    arcs = (Arc(needle.tip, needle.radius_mm, length_mm),)
    reach_mm = start_error_mm(length_mm, needle.radius_mm, priors)
    return all(
        clearance(arcs, needle.tip.position_mm, region).distance_mm > reach_mm
        for region in scene.avoided
    )


def timed(synthesis: Synthesis, work: Callable[[Synthesis], Synthesis]) -> Synthesis:
    """What further work makes of a synthesis, with the time of that work."""
    start_s = time.perf_counter()
    done = work(synthesis)
    seconds = synthesis.loop_seconds + time.perf_counter() - start_s
    return replace(done, loop_seconds=seconds)


@contextlib.contextmanager
def mistakes_of_models() -> Iterator[None]:
    """Lets a mistake in a model end as one of this program.

    Raises:
        NtagenError: There was one. The model is ours: its exit code would say that no strategy
            holds.
    """
    try:
        yield
    except ModelError as error:
        raise NtagenError(f"the planner failed, and the needle is stopped: {error}") from error
