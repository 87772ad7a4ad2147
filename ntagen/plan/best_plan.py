"""The best plan within a budget, without a list of all plans.

A list of all plans grows with the power of the number of rolls: tens of seconds for three rolls.
The driver needs one plan, soon, and a better one if there is time. So the engine is asked for a
single plan, several times, each time for more than the best plan so far has:

1. one plan of the scene: the answer if nothing better is found;
2. with critical regions made larger, so that it has more clearance, as far as more is useful, and
   not much longer than the first. Where there is none, less is asked for: half of what is between.
   Where there is one, but its exact path comes nearer than the model's, small changes make it
   better (`ntagen.plan.neighbours`);
3. with that clearance, and fewer rolls, if they come before the length in the ranking: else the
   answer changed no drive.

If the ranking begins with the reserve, one plan with 2 mm of it is asked for: in a scene in which
all regions to avoid are larger and the target is smaller. Where there is none, the plans are listed
until one holds. More questions took twice as long, and reached no more targets.

Every plan that is found is certified in the scene itself. The number of questions is fixed, so that
equal scenes have equal answers. Where few plans can exist, all are listed, which is sooner done.

Cost: about 15 ms for a question about the paper's needle.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from ntagen.errors import LimitError
from ntagen.plan.actions import Plan
from ntagen.plan.extract import step_length_mm
from ntagen.plan.neighbours import improved
from ntagen.plan.rank import USEFUL_CLEARANCE_MM, USEFUL_RESERVE_MM, Candidate, rank, reserve_of
from ntagen.plan.stricter import BETWEEN_STEPS_MM, shorter, stricter
from ntagen.plan.synthesise import EngineSynthesiser, Listing, Synthesis, select
from ntagen.scene import Scene

_MOST_LISTED: Final = 600
"""All plans are listed if so few sequences of rolls can begin at so few places."""

_NARROW_MM: Final = 1.0
"""Less clearance than this is little: it is about what a phantom's needle errs in 20 mm."""

_MOST_PAUSES: Final = 4

_MOST_STATES_IN_TIME: Final = 20_000
"""Where regions move, a question for a better plan is given up after so many states: a second."""

MOST_WHEN_NARROW: Final = 20_000
"""All plans are also listed in more sequences than usual, if the best plan is that near."""

_MOST_TRIED: Final = 500
"""Among more sequences, so many plans are tried if all those that were found fail."""

_CLEARANCE_QUESTIONS: Final = 4
"""Questions for more clearance."""

_MORE_STEPS: Final = 2
"""A plan with more clearance may be so many steps longer than the first one that was found. Without
this limit, the longest questions take twice as long, and their plans are not better."""

_RESERVE_MM: Final = 2.0
"""The reserve that is asked for: a needle in a phantom errs about that much in 20 mm."""

_SMALL_RESERVES_MM: Final = (1.0, 0.6, 0.3, 0.0)
"""What is asked for where regions move, until there is a plan that holds."""

_RESOLUTION_MM: Final = 0.2
"""Less additional clearance than this is not asked for."""


@dataclass(frozen=True, slots=True)
class BestPlanSynthesiser:
    """Finds the best plan within a budget; see the module.

    Attributes:
        engine: Answers the questions, with its margins, ranking and limits.
    """

    engine: EngineSynthesiser

    def __call__(self, scene: Scene, asked: Scene | None = None) -> Synthesis:
        """A synthesis with the best plan that was found, and those that were found on the way.

        Raises:
            InputError, LimitError, ModelError, KeyboardInterrupt: See `EngineSynthesiser`.
        """
        asks = self.engine.ranking[0] in ("clearance", "reserve")
        if sequences(scene) <= _MOST_LISTED or not asks:
            return self.engine(scene, asked)
        known = _Known(self.engine, scene)
        known.look(asked)
        if known.found and known.asks_for_list and scene.breath is None:
            # Every plan that was found fails its certificate, or comes near a region: the list
            # tells whether all do.
            if sequences(scene) <= MOST_WHEN_NARROW:
                return self.engine(scene, asked)
            if not known.candidates:
                return replace(self.engine, max_plans=_most_listed(self.engine, scene))(scene)
        return Synthesis(
            scene=scene,
            model_xml=known.origin.model_xml,
            found=known.found,
            candidates=rank(known.candidates, self.engine.ranking),
            seconds=known.seconds,
            margins=self.engine.margins,
            ranking=self.engine.ranking,
            strategy_json=known.origin.strategy_json,
            # Without any plan nothing is left out.
            is_complete=known.is_complete or not known.found,
        )


class _Known:
    """What is known of a scene's plans so far.

    Attributes:
        candidates: The plans that hold.
        is_complete: Whether all plans of the scene are known.
        seconds: The time that the engine took.
        origin: The first answer with a plan; without any, the last answer.
    """

    origin: Listing

    def __init__(self, engine: EngineSynthesiser, scene: Scene) -> None:
        self._whole, self._engine = engine, replace(engine, max_plans=1)
        self._scene = scene
        self.is_complete = False
        self._plans: dict[Plan, None] = {}
        self.candidates: list[Candidate] = []
        self.seconds = 0.0

    @property
    def found(self) -> int:
        """The number of different plans that were found."""
        return len(self._plans)

    @property
    def asks_for_list(self) -> bool:
        """Whether no plan holds, or a better one than the best is worth waiting for.

        Where the reserve counts, they are listed if none holds.
        """
        if self._counts_reserve:
            return False
        best = self._best()
        if best is None:
            return True
        return best.certificate.critical_clearance_mm < _NARROW_MM

    def look(self, asked: Scene | None) -> None:
        """Asks for a plan of the scene, and for better ones if there is one.

        Args:
            asked: A stricter scene, which is asked before the scene itself if the reserve counts.
        """
        if self._counts_reserve:
            self._look_for_reserve(asked)
        else:
            self._note(self._engine.listed(self._scene))
            if self._plans:
                self._raise_clearance()
        if self.candidates:
            self._lower_rolls()

    def _look_for_reserve(self, asked: Scene | None) -> None:
        found = self._ask(self._scene, _RESERVE_MM)
        if found is None and asked is not None:
            found = self._note(self._engine.listed(asked))
        if found is None:
            # Nothing is asked after this. So many plans are listed: if the first fails, one of the
            # others may hold.
            most = _most_listed(self._whole, self._scene)
            listing = replace(self._whole, max_plans=most).listed(self._scene)
            self.is_complete = self._note(listing) is None and listing.is_complete
        if self._scene.breath is not None and self.found:
            for less_mm in _SMALL_RESERVES_MM:
                if not self.candidates:
                    self._ask(self._scene, less_mm)

    def _raise_clearance(self) -> None:
        """Asks for more clearance than the best plan has, as far as it is useful."""
        if not self._scene.criticals and self.candidates:
            return
        longest_mm = self.origin.plans[0].length_mm + _MORE_STEPS * step_length_mm(self._scene)
        no_longer = shorter(self._scene, longest_mm)
        wanted_mm = most_mm = USEFUL_CLEARANCE_MM
        for _ in range(_CLEARANCE_QUESTIONS):
            least_mm = max(0.0, self._worth_mm())
            if most_mm - least_mm < _RESOLUTION_MM:
                return
            found = self._ask(no_longer, wanted_mm)
            if self._worth_mm() < wanted_mm:
                if found:
                    # The model has a plan with what is wanted. Other questions would lose as much.
                    self._change(found)
                    return
                # There is none, or one that fails its certificate.
                most_mm = wanted_mm
            wanted_mm = 0.5 * (max(0.0, self._worth_mm()) + most_mm)

    def _change(self, found: Candidate) -> None:
        """Adds the best plan that small changes of a plan lead to, if the model has it."""
        engine = self._engine
        better = improved(found, self._scene, engine.margins.allow, engine.ranking)
        if better.plan in self._plans:
            return
        if self.origin.has(better.plan, self._scene):
            self._plans[better.plan] = None
            self.candidates.append(better)

    def _lower_rolls(self) -> None:
        """Asks for fewer rolls at the clearance or reserve of the best plan."""
        best = self._best()
        if not _prefers_few_rolls(self._engine.ranking) or best is None:
            return
        if best.certificate.roll_count == 0:
            return
        fewer = replace(self._scene.limits, max_rolls=best.certificate.roll_count - 1)
        most_mm = USEFUL_RESERVE_MM if self._counts_reserve else USEFUL_CLEARANCE_MM
        useful_mm = min(most_mm, self._worth_mm())
        self._ask(replace(self._scene, limits=fewer), useful_mm)

    @property
    def _counts_reserve(self) -> bool:
        return self._engine.ranking[0] == "reserve"

    def _ask(self, scene: Scene, worth_mm: float) -> Candidate | None:
        """Asks for a plan that has this clearance or reserve; gives one that holds, or None.

        A count of states is the same in replays.
        """
        keeps_strategy = self._engine.keeps_strategy and not self._plans
        engine = replace(self._engine, keeps_strategy=keeps_strategy)
        if scene.breath is not None:
            # Waits make "no" dear to prove.
            engine = replace(engine, max_states=_MOST_STATES_IN_TIME)
        try:
            return self._note(engine.listed(self._strict(scene, worth_mm)))
        except LimitError:
            if scene.breath is None:
                raise
            return None

    def _strict(self, scene: Scene, worth_mm: float) -> Scene:
        """The scene whose plans have this clearance or reserve."""
        depth_mm = self._engine.margins.depth_mm
        shells_mm = min(worth_mm, BETWEEN_STEPS_MM)
        if self._counts_reserve:
            depth_mm = max(depth_mm, worth_mm)
            # Half way, half of the distance is the same reserve.
            worth_mm = shells_mm = 0.5 * worth_mm
        return stricter(scene, worth_mm, shells_mm, depth_mm)

    def _note(self, listing: Listing) -> Candidate | None:
        """Certifies what was found in the scene itself; one that holds, or None."""
        self.seconds += listing.seconds
        if not self._plans:
            self.origin = listing
        engine = self._engine
        for plans in (listing.plans[:1], listing.plans[1:]):
            # The others count only if the first one fails.
            holding = select(plans, self._scene, engine.margins, engine.ranking)
            self.candidates += [one for one in holding if one.plan not in self._plans]
            self._plans.update(dict.fromkeys(plans))
            if holding:
                return holding[0]
        return None

    def _best(self) -> Candidate | None:
        ranked = rank(self.candidates, self._engine.ranking)
        return ranked[0] if ranked else None

    def _worth_mm(self) -> float:
        """What the best plan has of what comes first in the ranking."""
        best = self._best()
        if best is None:
            return 0.0
        if self._counts_reserve:
            return reserve_of(best.certificate)
        return best.certificate.critical_clearance_mm


def _most_listed(engine: EngineSynthesiser, scene: Scene) -> int:
    """How many plans are listed of a scene whose first ones fail."""
    if scene.breath is not None:
        # A list would take too long.
        return 1
    is_narrow = sequences(scene) <= MOST_WHEN_NARROW
    return engine.max_plans if is_narrow else min(_MOST_TRIED, engine.max_plans)


def _prefers_few_rolls(ranking: tuple[str, ...]) -> bool:
    """Whether rolls come before the length in a ranking."""
    before, _, _ = ",".join(ranking).partition("length")
    return "rolls" in before


def sequences(scene: Scene) -> float:
    """About how many sequences of rolls there are: each roll anywhere, by any angle; pauses too.

    It counts the steps that lead straight through the last target.
    """
    target, tip = scene.targets[-1], scene.needle.tip
    reach_mm = min(target.shape.reach_mm(), scene.needle.length_mm) + sum(
        (a - b) * c for a, b, c in zip(target.center_mm, tip.position_mm, scene.axis, strict=True)
    )
    steps = max(1.0, reach_mm / step_length_mm(scene))
    angles = max(1, len(scene.limits.roll_angles_rad))
    bevels = angles + 1 if scene.limits.free_bevel else 1
    # A plan with many rolls and pauses can be one of more than a number holds.
    waits = 1.0 if scene.breath is None else scene.breath.period_s / scene.breath.wait_s
    pauses = 0 if scene.breath is None else min(scene.breath.max_pauses, _MOST_PAUSES)
    return float(bevels * (steps * angles) ** scene.limits.max_rolls) * (steps * waits) ** pauses
