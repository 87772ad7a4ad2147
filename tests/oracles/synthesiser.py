"""A synthesiser from the independent planner, for drives without the engine."""

from __future__ import annotations

from functools import lru_cache

from ntagen.plan.actions import Plan, Push, Roll
from ntagen.plan.rank import DEFAULT_RANKING
from ntagen.plan.synthesise import Margins, Synthesis, select
from ntagen.scene import Scene
from tests.oracles import planner


@lru_cache(maxsize=100)
def oracle_synthesis(scene: Scene, asked: Scene | None = None) -> Synthesis:
    """All plans of a scene by brute force; several targets are planned one after the other.

    It has no model, so no stricter one is asked for.

    The same scenes come in many runs, and in their replays: their plans are computed once.
    """
    plans = _chained(scene)
    return Synthesis(
        scene=scene,
        model_xml="",
        found=len(plans),
        candidates=select(plans, scene, Margins(), DEFAULT_RANKING),
        seconds=0.0,
    )


def _chained(scene: Scene) -> list[Plan]:
    """Plans through the targets in order: the best few to the first, each continued to the next."""
    first = [
        Plan.of(Push(value) if kind == "push" else Roll(value) for kind, value in steps)
        for steps in planner.plans(scene)
    ]
    if len(scene.targets) == 1:
        return first
    only = scene.with_targets(scene.targets[:1])
    best = select(first, only, Margins(), ("clearance", "target"))[:3]
    plans: list[Plan] = []
    for candidate in best:
        there = scene.with_needle(candidate.plan.end(scene.needle), scene.needle.radius_mm)
        for rest in _chained(there.with_targets(scene.targets[1:])):
            plans.append(Plan.of((*candidate.plan.actions, *rest.actions)))
    return plans
