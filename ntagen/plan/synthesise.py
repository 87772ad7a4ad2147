"""Finds the plans of a scene: model, strategy synthesis, certificates, ranking.

The model decides which plans exist. The certificate in exact kinematics decides which of them may
be driven. A plan can fail its certificate, because the model checks regions only at the ends of
its steps, and with integers. Such a plan is refused; if no plan is left, there is no strategy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING, Final, Protocol

from ntagen.errors import LimitError, ModelError
from ntagen.plan.actions import Plan
from ntagen.plan.certify import Certificate
from ntagen.plan.extract import leads_to_target, pages_of
from ntagen.plan.rank import DEFAULT_RANKING, Candidate, certified, rank
from ntagen.scene import Scene
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.checker import Model

STRATEGY_QUERY: Final = "control: A<> Checker.Final_TR_Reached"
"""The paper's second query; its strategy has the plans."""

GUIDE: Final = "get_miss()"
"""The function of the model that says by how much the tip misses the target after one more roll."""


@dataclass(frozen=True, slots=True)
class Margins:
    """The margins that a plan must have in exact kinematics.

    Attributes:
        clearance_mm: The path's distance to every critical region is greater than this.
        depth_mm: The path's end lies at least this deep in the last target.
        detection_mm: The path's distance to every detection region is greater than this.
    """

    clearance_mm: float = 0.0
    depth_mm: float = 0.3
    detection_mm: float = 0.0

    def allow(self, certificate: Certificate) -> bool:
        """Whether a plan with this certificate holds."""
        return certificate.holds(self.clearance_mm, self.depth_mm, self.detection_mm)


@dataclass(frozen=True, slots=True)
class Synthesis:
    """The answer for one scene.

    Attributes:
        scene: The scene.
        model_xml: The model that was checked; empty if the plans have another origin.
        found: The number of plans of the model; if it is not complete, of those that were found.
        candidates: The plans that hold in exact kinematics, best first.
        seconds: The time that the engine took.
        loop_seconds: The time of the whole synthesis: rendering, loading, solving, certifying and
            ranking.
        margins: The margins with which the candidates hold.
        ranking: The criteria by which they are ranked.
        strategy_json: The strategy of the model, as `ntagen check --strategy` writes it; empty if
            there is none, or if it was not wanted.
        is_complete: Whether all plans of the model were listed, not only the best one looked for.
    """

    scene: Scene
    model_xml: str
    found: int
    candidates: tuple[Candidate, ...]
    seconds: float
    loop_seconds: float = 0.0
    margins: Margins = Margins()
    ranking: tuple[str, ...] = DEFAULT_RANKING
    strategy_json: str = ""
    is_complete: bool = True

    @property
    def best(self) -> Candidate | None:
        """The plan to be driven, or None if there is no strategy."""
        return self.candidates[0] if self.candidates else None

    def with_candidates(self, candidates: Iterable[Candidate]) -> Synthesis:
        """The same with other plans that hold, best first."""
        return replace(self, candidates=tuple(candidates))

    def with_plan(self, plan: Plan) -> Synthesis:
        """The same with a plan from elsewhere among the candidates, if it holds."""
        more = select([plan], self.scene, self.margins, self.ranking)
        return replace(self, candidates=rank((*more, *self.candidates), self.ranking))


@dataclass(frozen=True, slots=True)
class Listing:
    """Plans as the engine lists them.

    Attributes:
        model_xml: The model that was checked.
        model: The same, as the engine has loaded it.
        plans: Its plans.
        seconds: The time that the engine took.
        strategy_json: The strategy, if it is kept; empty without one.
        is_complete: Whether the model has no other plans.
    """

    model_xml: str
    model: Model
    plans: tuple[Plan, ...]
    seconds: float
    strategy_json: str = ""
    is_complete: bool = True

    def has(self, plan: Plan, scene: Scene) -> bool:
        """Whether the model, which is that of the scene, can make a plan and reaches its target.

        It takes about 9 ms for a plan of 25 steps.

        Raises:
            ModelError: The model ran into a run-time error.
        """
        # To compile the model would take longer than to interpret a single path.
        return leads_to_target(self.model.walk("interpreter"), plan, scene)


class Synthesiser(Protocol):
    """Anything that can find the plans of a scene."""

    def __call__(self, scene: Scene, asked: Scene | None = None) -> Synthesis:
        """The plans of a scene; equal scenes have equal answers, except for the seconds.

        Args:
            scene: The scene, in which plans must hold.
            asked: The scene whose model is asked, if that is a stricter one. If it has no plan that
                holds, that of the scene itself is asked.
        """


def select(
    plans: Iterable[Plan],
    scene: Scene,
    margins: Margins,
    ranking: Sequence[str] = DEFAULT_RANKING,
) -> tuple[Candidate, ...]:
    """The plans that hold with these margins, best first."""
    return tuple(
        candidate
        for candidate in certified(plans, scene, ranking)
        if margins.allow(candidate.certificate)
    )


@dataclass(frozen=True, slots=True)
class EngineSynthesiser:
    """The synthesiser that renders the model of a scene and asks the engine.

    Attributes:
        margins: The margins that a plan must have.
        ranking: The criteria, the most important first.
        max_plans: At most this many plans are listed.
        timeout_s: The engine stops after this time.
        memory_bytes: The engine stops when its states take this much.
        max_states: The engine stops when it has stored so many states.
        keeps_strategy: Whether a synthesis has the strategy as JSON.
        listen: Is called regularly, and raises `KeyboardInterrupt` to end a synthesis.
    """

    margins: Margins = Margins()
    ranking: tuple[str, ...] = DEFAULT_RANKING
    max_plans: int = 100_000
    timeout_s: float | None = 60.0
    memory_bytes: int | None = 2 << 30
    max_states: int | None = None
    keeps_strategy: bool = False
    listen: Callable[[], None] = lambda: None

    def __call__(self, scene: Scene, asked: Scene | None = None) -> Synthesis:
        """The plans of a scene.

        Raises:
            InputError, LimitError, ModelError, KeyboardInterrupt: See `listed`.
        """
        listing = self.listed(asked or scene)
        candidates = select(self._heard(listing.plans), scene, self.margins, self.ranking)
        if asked is not None and not candidates:
            return self(scene)
        return Synthesis(
            scene=scene,
            model_xml=listing.model_xml,
            found=len(listing.plans),
            candidates=candidates,
            seconds=listing.seconds,
            margins=self.margins,
            ranking=self.ranking,
            strategy_json=listing.strategy_json,
            is_complete=listing.is_complete,
        )

    def listed(self, scene: Scene) -> Listing:
        """The plans of the scene's model, whether they hold or not.

        Raises:
            InputError: The scene does not fit the model's numbers.
            LimitError: The engine stopped at a limit before it had an answer.
            ModelError: The model ran into a run-time error.
            KeyboardInterrupt: `listen` raised it, or the user interrupted.
        """
        from ntagen import checker
        from ntagen.render import render

        model_xml = render(scene.expected(), only_plans=True)
        model = checker.load(model_xml)
        # The model computes distances: if one wrapped round, the answer would be wrong.
        model.overflow = "error"
        answer = model.check(
            STRATEGY_QUERY,
            plans="all",
            max_plans=self.max_plans,
            guide=GUIDE,
            timeout_s=self.timeout_s,
            memory_bytes=self.memory_bytes,
            states=self.max_states,
            strategy=self.keeps_strategy,
            progress=lambda *_: self.listen(),
        )
        if answer.verdict == "error":
            raise ModelError(f"the model of the scene fails: {answer.message}")
        if answer.verdict not in ("satisfied", "not satisfied"):
            raise LimitError(f"no answer from the engine: stopped by {answer.stop}")
        is_won = answer.verdict == "satisfied"
        plans = tuple(chain.from_iterable(pages_of(answer, scene))) if is_won else ()
        strategy_json = (answer.strategy_json() or "") if is_won and self.keeps_strategy else ""
        return Listing(
            model_xml, model, plans, answer.seconds, strategy_json, not answer.has_more_plans
        )

    def _heard(self, plans: Iterable[Plan]) -> Iterator[Plan]:
        """The plans; calls `listen` before each."""
        for plan in plans:
            self.listen()
            yield plan
