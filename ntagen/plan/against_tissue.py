"""Finds a strategy against a tissue that answers, and says what holds for it.

The engine decides the game of the scene's model. Its strategy is checked by the engine's
independent room, and every branch of it is followed in exact kinematics. The model rounds, so its
margins are a little larger than the error of the tip.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

from ntagen.errors import InputError, ModelError
from ntagen.plan.closed_loop import Reach, Segment, certify_all, decisions_of
from ntagen.plan.synthesise import GUIDE, STRATEGY_QUERY
from ntagen.scene import Scene

_ROUNDING_UNITS: Final = 300
"""The margins of the model are larger by so many units: its directions are off by some units after
each push and roll, times the length that is still travelled."""


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
) -> Defence:
    """A strategy against the scene's tissue.

    Args:
        scene: The scene, with an adversarial tissue and one target.
        timeout_s: The engine stops after this time.
        memory_bytes: The engine stops when its states take this much.
        verify: Whether the engine's independent room checks the strategy.
        listen: Is called regularly, and raises `KeyboardInterrupt` to end the search.

    Returns:
        The answer. It is "unknown" with the reason ``rounding`` if the model has a strategy, and
        that does not hold in exact kinematics: then a finer resolution may help.

    Raises:
        InputError: The scene has another tissue, or several targets.
        ModelError: The model ran into a run-time error, or the strategy failed its check.
    """
    limits: dict[str, Any] = {
        "timeout_s": timeout_s,
        "memory_bytes": memory_bytes,
        "verify": verify,
        "listen": listen,
    }
    if not scene.tissue.is_adversarial:
        raise InputError("the tissue is static: it does not answer\nhint: ask for plans instead")
    if len(scene.targets) != 1:
        raise InputError("against an adversarial tissue there is one target\nhint: remove the rest")
    tip_mm = scene.tissue.tip_mm
    first = _played(scene, tip_mm + _ROUNDING_UNITS / scene.resolution_per_mm, **limits)
    if first.holds or first.verdict == "unknown":
        return first
    # Rounding decides: with the error of the tip alone, the answer may be another.
    left_s = None if timeout_s is None else max(0.0, timeout_s - first.seconds)
    limits["timeout_s"] = left_s
    second = _played(scene, tip_mm, **limits)
    both = replace(
        second,
        seconds=first.seconds + second.seconds,
        explored=first.explored + second.explored,
        stored=max(first.stored, second.stored),
    )
    if second.verdict == "satisfied" and not second.holds:
        return replace(both, verdict="unknown", stop="rounding")
    return both


def _played(
    scene: Scene,
    margin_mm: float,
    *,
    timeout_s: float | None,
    memory_bytes: int | None,
    verify: bool,
    listen: Callable[[], None],
) -> Defence:
    """Plays the game once, with these margins."""
    from ntagen import checker
    from ntagen.render import render

    harder = replace(scene, tissue=replace(scene.tissue, tip_mm=margin_mm))
    model = checker.load(render(harder, only_plans=True))
    # The model computes distances: if one wrapped round, the answer would be wrong.
    model.overflow = "error"
    answer = model.check(
        STRATEGY_QUERY,
        guide=GUIDE,
        strategy=True,
        verify=verify,
        timeout_s=timeout_s,
        memory_bytes=memory_bytes,
        progress=lambda *_: listen(),
    )
    if answer.verdict == "error":
        raise ModelError(f"the model of the scene fails: {answer.message}")
    if answer.verified is False:
        raise ModelError("the strategy fails its check\n" + "\n".join(answer.verification))
    is_won = answer.verdict == "satisfied"
    text = answer.strategy_json() if is_won else None
    tree = decisions_of(text, scene) if text is not None else None
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
    )
