"""Finds a strategy against a tissue that answers, and says what holds for it.

The engine decides the game of the scene's model. Its strategy is checked by the engine's
independent room, and every branch of it is followed in exact kinematics. The model rounds, so its
margins are a little larger than the error of the tip.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal

from ntagen.errors import InputError, ModelError
from ntagen.plan.branches import Reach, certify_all
from ntagen.plan.closed_loop import Segment, decisions_of
from ntagen.plan.synthesise import GUIDE, STRATEGY_QUERY
from ntagen.rounding import units_per_mm
from ntagen.scene import Scene

if TYPE_CHECKING:
    from ntagen.checker import Answer, Options

_ROUNDING_UNITS: Final = 1000
"""The margins of the model are larger by so many units: its directions are off by some units after
each push and roll, times the length that is still travelled."""

_PLAYS: Final = 3
"""So often the game is played with more margin, if rounding took more than there was."""

_GROWTH: Final = 2.0
"""Each time the reserve for rounding is at least so many times as large."""


@dataclass(frozen=True, slots=True)
class Defence:
    """The answer to a scene with an adversarial tissue.

    Attributes:
        scene: The scene.
        verdict: Whether there is a strategy; ``unknown`` if a limit came first.
        stop: That limit.
        tree: The strategy; None without one, or if none holds in exact kinematics.
        reach: What holds on all its branches.
        verified: Whether the engine's check agreed; None if it did not finish or was not wanted.
        verification: What the check covered.
        seconds: The time that the engine took.
        explored: The states that it explored.
        stored: The states that it stored.
        answer: What the engine said last.
    """

    scene: Scene
    verdict: Literal["satisfied", "not satisfied", "unknown"]
    stop: str | None
    tree: Segment | None
    reach: Reach | None
    verified: bool | None
    verification: tuple[str, ...]
    seconds: float
    explored: int
    stored: int
    answer: Answer

    @property
    def holds(self) -> bool:
        """Whether the strategy holds on all branches, with the error of the tip."""
        return self.reach is not None and self.reach.holds(self.scene.tissue.tip_mm)

    def guarantee(self) -> tuple[str, ...]:
        """What is guaranteed, and what is not, in words."""
        if self.tree is None or self.reach is None:
            return ()
        tissue, reach = self.scene.tissue, self.reach
        return (
            f"{reach.leaves} branches, at most {reach.most_rolls} rolls and "
            f"{reach.longest_mm:g} mm: clearance {reach.clearance_mm:.2f} mm, "
            f"{reach.depth_mm:.2f} mm deep in the target",
            f"guaranteed for a tip that is off by up to {tissue.tip_mm:g} mm, and a tissue that "
            "picks corners or the middle in each segment"
            if self.holds
            else "not guaranteed: a branch in exact kinematics comes too near",
            "measured, not guaranteed, for values between these: docs/adversary.md",
        )


def defend(
    scene: Scene,
    *,
    timeout_s: float | None = 60.0,
    memory_bytes: int | None = 2 << 30,
    verify: bool = False,
    listen: Callable[[], None] = lambda: None,
    options: Options | None = None,
) -> Defence:
    """A strategy against the scene's tissue.

    Args:
        scene: The scene, with an adversarial tissue and one target.
        timeout_s: The engine stops after this time.
        memory_bytes: The engine stops when its states take this much.
        verify: Whether the engine's independent room checks the strategy.
        listen: Is called regularly, and raises `KeyboardInterrupt` to end the search.
        options: How else the engine is to answer; what is said above comes first.

    Returns:
        The answer. It is "unknown" with the reason ``rounding`` if the model has a strategy, and
        that does not hold in exact kinematics: then a finer resolution may help.

    Raises:
        InputError: The scene has another tissue, or several targets.
        ModelError: The model ran into a run-time error, or the strategy failed its check.
    """
    if not scene.tissue.is_adversarial:
        raise InputError("the tissue is static: it does not answer\nhint: ask for plans instead")
    if len(scene.targets) != 1:
        raise InputError("against an adversarial tissue there is one target\nhint: remove the rest")
    from ntagen.checker import Options

    asked = replace(
        options or Options(),
        guide=options.guide if options and options.guide else GUIDE,
        plans="none",
        trace=False,
        certificate=False,
        strategy=True,
        wanted_strategy="controller",
        verify=verify,
        memory_bytes=memory_bytes,
        progress=options.progress if options and options.progress else lambda *_: listen(),
    )
    plays: list[Defence] = []

    def play(margin_mm: float) -> Defence:
        spent_s = sum(one.seconds for one in plays)
        left_s = None if timeout_s is None else max(0.0, timeout_s - spent_s)
        plays.append(_played(scene, margin_mm, replace(asked, timeout_s=left_s)))
        return replace(
            plays[-1],
            seconds=sum(one.seconds for one in plays),
            explored=sum(one.explored for one in plays),
            stored=max(one.stored for one in plays),
        )

    tip_mm = scene.tissue.tip_mm
    reserve_mm = _ROUNDING_UNITS / units_per_mm(scene)
    for _ in range(_PLAYS):
        found = play(tip_mm + reserve_mm)
        if found.reach is None or found.holds:
            break
        reserve_mm = _GROWTH * (reserve_mm + found.reach.missing_mm(tip_mm))
    if found.verdict == "not satisfied":
        # Rounding decides: with the error of the tip alone, the answer may be another.
        found = play(tip_mm)
    if found.reach is not None and not found.holds:
        return replace(found, verdict="unknown", stop="rounding")
    return found


def _played(scene: Scene, margin_mm: float, options: Options) -> Defence:
    """Plays the game once, with these margins."""
    from ntagen import checker
    from ntagen.render import render

    harder = replace(scene, tissue=replace(scene.tissue, tip_mm=margin_mm))
    model = checker.load(render(harder, only_plans=True))
    # The model computes distances: if one wrapped round, the answer would be wrong.
    model.overflow = "error"
    answer = model.answer(STRATEGY_QUERY, options)
    if answer.verdict == "error":
        raise ModelError(f"the model of the scene fails: {answer.message}")
    if answer.verified is False:
        raise ModelError("the strategy fails its check\n" + "\n".join(answer.verification))
    is_won = answer.verdict == "satisfied"
    # Lengths in it are in the units of the model that was played.
    tree = decisions_of(answer, harder) if is_won else None
    verdict: Literal["satisfied", "not satisfied", "unknown"] = "unknown"
    if answer.verdict in ("satisfied", "not satisfied"):
        verdict = "satisfied" if is_won else "not satisfied"
    return Defence(
        scene=scene,
        verdict=verdict,
        stop=answer.stop,
        tree=tree,
        reach=None if tree is None else certify_all(tree, scene),
        verified=answer.verified,
        verification=answer.verification,
        seconds=answer.seconds,
        explored=answer.explored,
        stored=answer.stored,
        answer=answer,
    )
