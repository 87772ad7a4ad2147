"""The best plans within a budget of time, with bounds: the first one at once, then better ones.

A list of all plans grows with the power of the number of rolls, so it is not made. The criteria of
the ranking are settled one after the other. For each, the engine is asked for a plan that is better
than the best one so far: a plan of a stricter scene (`ntagen.plan.stricter`). "Yes" makes the best
plan better. "No" is a proof, and makes the *limit* smaller: no plan of the model is better than
that. When both have met, plans that are worse by that criterion count no more, and the next
criterion is settled among the others.

So at any time there are a best plan and a limit for each criterion, and the truth lies between.
If there is no plan at all, that is a proof too, unless the budget ends first.

Limits are about the model. The model rounds to integers, and between the ends of its steps it does
not look, unless the scene is swept. A plan that does not hold in exact kinematics is never given.

Cost: 10 to 100 ms for a question about cluttered scenes with three rolls of 45 degrees.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Final, Literal

from ntagen.errors import LimitError
from ntagen.needle.vectors import distance
from ntagen.plan.actions import Plan
from ntagen.plan.extract import step_length_mm
from ntagen.plan.rank import (
    CRITERIA,
    MOST_RESERVE_RATIO,
    USEFUL_CLEARANCE_MM,
    USEFUL_RESERVE_MM,
    Candidate,
    rank,
)
from ntagen.plan.stricter import BETWEEN_STEPS_MM, deeper, near_center, shorter, stricter, wider
from ntagen.plan.synthesise import EngineSynthesiser, Listing, Synthesis, select
from ntagen.rounding import precision_of
from ntagen.scene import Scene

_TRIED: Final = 64
"""If the first plans do not hold, at most so many are tried."""

_ROUNDED_MM: Final = 0.7
"""At 1,000 units per mm, a place on a path of the model may be this far from the exact one. Where
the bound of `ntagen.rounding` is less, that counts."""

_CERTIFIED: Final = 20
"""Between two looks at the clock, so many plans are certified."""

_SLACK: Final = 1e-9
"""What sums of lengths may err, in mm."""

_MOST_LISTED: Final = 500
"""If several plans are wanted, at most so many more than these are listed and compared."""


@dataclass(frozen=True, slots=True)
class Question:
    """How a criterion is asked for. What is better has a smaller badness (`rank.CRITERIA`).

    Attributes:
        ideal: No plan of this scene has less badness.
        among: The scene whose plans have at most this badness.
        resolution: A smaller difference is not asked for.
        is_counted: Whether it is a whole number.
        is_exact: Whether the model does not round it.
    """

    ideal: Callable[[Scene], float]
    among: Callable[[Scene, float], Scene]
    resolution: Callable[[Scene], float]
    is_counted: bool = False
    is_exact: bool = False


def _least_length_mm(scene: Scene) -> float:
    """The straight way to the ball around the last target."""
    last = scene.targets[-1]
    away_mm = distance(scene.needle.tip.position_mm, last.center_mm)
    return max(0.0, away_mm - last.shape.reach_mm() - last.moved_mm)


QUESTIONS: Final = {
    "clearance": Question(
        ideal=lambda _: -USEFUL_CLEARANCE_MM,
        among=lambda scene, most: wider(scene, -most),
        resolution=lambda _: 0.2,
    ),
    "reserve": Question(
        ideal=lambda _: -USEFUL_RESERVE_MM,
        # Near the start, distances count several times.
        among=lambda scene, most: deeper(wider(scene, -most / MOST_RESERVE_RATIO), -most),
        resolution=lambda _: 0.5,
    ),
    "rolls": Question(
        ideal=lambda _: 0,
        among=lambda scene, most: replace(
            scene, limits=replace(scene.limits, max_rolls=min(scene.limits.max_rolls, int(most)))
        ),
        resolution=lambda _: 0.0,
        is_counted=True,
        is_exact=True,
    ),
    "length": Question(
        ideal=_least_length_mm,
        among=shorter,
        resolution=step_length_mm,
        is_exact=True,
    ),
    "target": Question(
        ideal=lambda _: 0.0,
        among=near_center,
        resolution=lambda _: 0.2,
    ),
}
"""How each criterion of a ranking is asked for."""


@dataclass(frozen=True, slots=True)
class Best:
    """What is known of the best plans at a time.

    Attributes:
        verdict: ``found``; ``none`` if it is proved that no plan of the model holds; else
            ``unknown``.
        candidates: The best plans that were found, best first.
        limits: For each criterion that was asked about, in the order of the ranking: no plan of the
            model has less badness, of those that are as good by the criteria before.
        looked_at: The number of different plans that were certified.
        seconds: The time since the search began.
        engine_seconds: The time that the engine took of it.
        is_complete: Whether no other plan of the model is as good as the last of several.
        is_final: Whether the search is over.
    """

    verdict: Literal["found", "none", "unknown"]
    candidates: tuple[Candidate, ...]
    limits: dict[str, float]
    looked_at: int
    seconds: float
    engine_seconds: float
    is_complete: bool = False
    is_final: bool = False

    def is_settled(self, name: str, scene: Scene) -> bool:
        """Whether the best plan is as good by a criterion as any can be, up to its resolution."""
        if name not in self.limits or not self.candidates:
            return False
        badness = CRITERIA[name](self.candidates[0].certificate)
        return badness - self.limits[name] <= QUESTIONS[name].resolution(scene) + _SLACK


def goodness(name: str, badness: float) -> float:
    """The value of a criterion as users know it: clearance and reserve are better if larger."""
    return -badness if name in ("clearance", "reserve") else badness


def best_plans(
    scene: Scene,
    engine: EngineSynthesiser,
    *,
    clock: Callable[[], float],
    count: int = 1,
    budget_s: float | None = None,
) -> Iterator[Best]:
    """The best plans so far, each time that more is known; the last value is the final one.

    Args:
        scene: The scene.
        engine: Answers the questions, with its margins, ranking and memory limit.
        clock: Gives the time in seconds.
        count: How many plans to find.
        budget_s: The search ends after about this time; None: when everything is settled.

    Raises:
        InputError, ModelError, KeyboardInterrupt: See `EngineSynthesiser.listed`.
    """
    search = _Search(scene, engine, clock, count, budget_s)
    try:
        for _ in search.steps():
            yield search.best()
    except LimitError:
        # What is not known yet stays unknown.
        pass
    yield replace(search.best(), is_final=True)


def synthesis_within(
    scene: Scene,
    engine: EngineSynthesiser,
    *,
    clock: Callable[[], float],
    count: int,
    budget_s: float,
) -> Synthesis:
    """The best plans as a synthesis; see `best_plans`.

    Raises:
        InputError, LimitError, ModelError, KeyboardInterrupt: See `EngineSynthesiser.listed`.
    """
    *_, best = best_plans(scene, engine, clock=clock, count=count, budget_s=budget_s)
    if best.verdict == "unknown":
        raise LimitError("no answer from the engine: stopped by time")
    return Synthesis(
        scene=scene,
        model_xml="",
        found=best.looked_at,
        candidates=best.candidates,
        seconds=best.engine_seconds,
        margins=engine.margins,
        ranking=engine.ranking,
        is_complete=best.is_complete or best.verdict == "none",
    )


@dataclass
class _Search:
    """The state of a search; each step of `steps` has told something new."""

    scene: Scene
    engine: EngineSynthesiser
    clock: Callable[[], float]
    count: int
    budget_s: float | None
    is_complete: bool = False
    is_proved_none: bool = False
    limits: dict[str, float] = field(default_factory=dict)
    engine_seconds: float = 0.0
    start: float = field(init=False)
    plans: set[Plan] = field(default_factory=set)
    candidates: list[Candidate] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.start = self.clock()

    def best(self) -> Best:
        """What is known."""
        verdict: Literal["found", "none", "unknown"] = "found" if self.candidates else "unknown"
        return Best(
            verdict="none" if self.is_proved_none else verdict,
            candidates=rank(self.candidates, self.engine.ranking)[: self.count],
            limits=dict(self.limits),
            looked_at=len(self.plans),
            seconds=self.clock() - self.start,
            engine_seconds=self.engine_seconds,
            is_complete=self.is_complete,
        )

    def steps(self) -> Iterator[None]:
        """Asks until everything is settled."""
        if not self._find_first():
            return
        yield
        among = [self._deep(self.scene)]
        for name in self.engine.ranking:
            question = QUESTIONS[name]
            for _ in self._settle(name, question, among[-1]):
                yield
            rounded_mm = 0.0 if question.is_exact else self._rounded_mm()
            most = self._badness(name) + question.resolution(self.scene) + rounded_mm
            among.append(question.among(among[-1], most))
        if self.count > 1:
            for scene in reversed(among):
                most = _MOST_LISTED + self.count
                listing = self._ask(scene, most)
                listed = set(listing.plans)
                is_enough = sum(one.plan in listed for one in self.candidates) >= self.count
                # What is not listed here is worse by a criterion than what is.
                is_all = scene is among[0] or is_enough
                self.is_complete = is_all and listing.is_complete
                yield
                if is_enough:
                    return

    def _rounded_mm(self) -> float:
        """How far a place on a path of the model may be from the exact one."""
        return min(_ROUNDED_MM, precision_of(self.scene).path_error_mm)

    def _find_first(self) -> bool:
        """Looks for a plan that holds; whether there is one, or no proof that there is none."""
        safe = self._safer(self.scene)
        for scene, count in ((safe, 1), (self._deep(self.scene), 1), (self.scene, _TRIED)):
            listing = self._ask(scene, count)
            if self.candidates:
                return True
            if scene is not safe and not listing.plans:
                self.is_proved_none = True
                return False
        listing = self._ask(self.scene, self.engine.max_plans)
        self.is_proved_none = not self.candidates and listing.is_complete
        return bool(self.candidates)

    def _settle(self, name: str, question: Question, scene: Scene) -> Iterator[None]:
        """Asks for plans that are better by a criterion until none is, or none can be had."""
        limit = self.limits[name] = question.ideal(scene)
        resolution = question.resolution(scene)
        wanted = limit
        while (before := self._badness(name)) - limit > resolution + _SLACK:
            better = question.among(scene, wanted)
            if not self._ask(better, 1).plans:
                limit = self.limits[name] = wanted + 1 if question.is_counted else wanted
            elif self._badness(name) >= before:
                # In exact kinematics that plan is not better, so "yes" tells little.
                self._ask(self._safer(better), 1)
                if self._badness(name) >= before:
                    return
            yield
            wanted = limit if question.is_counted else 0.5 * (self._badness(name) + limit)

    def _badness(self, name: str) -> float:
        """That of the best plan."""
        return CRITERIA[name](rank(self.candidates, self.engine.ranking)[0].certificate)

    def _safer(self, scene: Scene) -> Scene:
        """The scene whose plans probably hold in exact kinematics."""
        depth_mm = self.engine.margins.depth_mm
        return stricter(scene, BETWEEN_STEPS_MM, BETWEEN_STEPS_MM, depth_mm)

    def _deep(self, scene: Scene) -> Scene:
        """The scene whose plans end as deep in the target as the margins want."""
        return deeper(scene, self.engine.margins.depth_mm)

    def _ask(self, scene: Scene, count: int) -> Listing:
        """Lists plans of a stricter scene, and certifies the new ones in the scene itself.

        Raises:
            LimitError: The budget is over, or the engine stopped at another limit.
        """
        left_s = self._require_time() or self.engine.timeout_s
        engine = replace(self.engine, max_plans=count, timeout_s=left_s, keeps_strategy=False)
        listing = engine.listed(scene)
        self.engine_seconds += listing.seconds
        new = [plan for plan in listing.plans if plan not in self.plans]
        for start in range(0, len(new), _CERTIFIED):
            self._require_time()
            some = new[start : start + _CERTIFIED]
            self.plans.update(some)
            self.candidates += select(some, self.scene, engine.margins, engine.ranking)
        return listing

    def _require_time(self) -> float | None:
        """The time that is left; None without a budget.

        Raises:
            LimitError: There is none.
        """
        if self.budget_s is None:
            return None
        left_s = self.budget_s - (self.clock() - self.start)
        if left_s <= 0.0:
            raise LimitError("the budget of time is over")
        return left_s
