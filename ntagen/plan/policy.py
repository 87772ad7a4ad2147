"""A policy: when to roll, by what is measured. It is learned in a tissue with chance.

A policy keeps the rolls of a plan and their order, and decides when each of them is made: some
pushes before or after its place in the plan. It sees how many pushes and rolls were made, where the
target lies in the tip's frame, and where the tip is. `ntagen.plan.steering` learns it with the
engine; here are its file and its decisions.

For each number of rolls and pushes there is a binary tree for each of the two moves. Its leaves say
what the move costs. Where learning has never been, a policy says nothing. A policy that is no
better than its plan is *silent*: it says nothing anywhere, and has no trees.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final, Literal

from ntagen.errors import InputError
from ntagen.needle.kinematics import bending_axis
from ntagen.needle.vectors import dot, subtract
from ntagen.render import Around, Seen, render_policy
from ntagen.render.frame import model_frame, turned
from ntagen.scene import Pose, Scene
from ntagen.units import rad_from_deg

Aim = Literal["probability", "miss", "cut"]
"""What a policy is the best for."""

Move = Literal["push", "roll"]

DISCRETE: Final = ("roll_count", "push_count")
CONTINUOUS: Final = ("ahead", "beside", "above", "seen_x", "seen_y", "seen_z")
"""What is seen, by the names of variables in templates/uppaal/policy.c.jinja."""

FORMAT: Final = "ntagen policy"
VERSION: Final = 2
MOST_BYTES: Final = 64 * 2**20
"""The largest file of a policy; 100,000 runs give one of 100 KB."""

_MOST_PUSHES: Final = 10_000
"""No plan is longer."""

_MOVES: Final[dict[str, Move]] = {"Insertion.Push": "push", "Insertion.Next": "roll"}
"""The moves by the locations that they lead to."""

WHOLE: Final = 1e-6
"""Depths are whole pushes up to this."""


@dataclass(frozen=True, slots=True)
class Split:
    """A node of a tree: what lies low and what lies high."""

    feature: int
    bound: float
    low: Split | float
    high: Split | float


Tree = Split | float


@dataclass(frozen=True, slots=True)
class Policy:
    """A policy.

    Attributes:
        aim: What it is the best for.
        digest: That of the model in which it was learned.
        around: The plan whose rolls it makes, and how far it may deviate.
        strategy: What the engine has learned: JSON as ``saveStrategy`` writes it.
        values: What runs say of it and of the plan (`ntagen.plan.steering.Comparison`), as JSON.
        is_silent: Whether it never differs from the plan.
        trees: For each number of rolls and of pushes the trees of both moves.
    """

    aim: Aim
    digest: str
    around: Around
    strategy: Mapping[str, Any]
    values: Mapping[str, Any]
    is_silent: bool
    trees: Mapping[tuple[int, ...], Mapping[Move, Tree]]

    @staticmethod
    def of(
        aim: Aim,
        digest: str,
        around: Around,
        strategy: Mapping[str, Any],
        values: Mapping[str, Any],
    ) -> Policy:
        """A policy with the trees of what was learned.

        Raises:
            KeyError, TypeError, ValueError: The strategy is another one, or torn.
        """
        return Policy(aim, digest, around, strategy, values, False, _trees(strategy))

    @staticmethod
    def silent(aim: Aim, digest: str, around: Around, values: Mapping[str, Any]) -> Policy:
        """A policy that never differs from the plan.

        Args:
            aim: What it is the best for.
            digest: That of the model around this plan.
            around: The plan; the window is 0.
            values: As in `Policy`.
        """
        return Policy(aim, digest, around, {}, values, True, {})

    def decide(self, scene: Scene, tip: Pose, depth_mm: float, rolls: int) -> Move | None:
        """What to do where the tip is seen.

        Args:
            scene: The scene; of its needle only the step counts.
            tip: The pose of the tip, as it is estimated.
            depth_mm: The insertion depth.
            rolls: The rolls so far.

        Returns:
            The move; None where the policy says nothing: between two pushes of the model, after the
            last roll, where learning has never been, and everywhere if it is silent.
        """
        if self.is_silent:
            return None
        around, steps = self.around, depth_mm / push_mm(scene)
        pushes = round(steps)
        if abs(steps - pushes) > WHOLE or rolls >= len(around.rolls):
            return None
        if pushes < around.first[rolls]:
            return "push"
        if pushes >= around.last[rolls]:
            # Behind that, no run has been.
            return "roll" if pushes == around.last[rolls] else None
        trees = self.trees.get((rolls, pushes))
        if trees is None or len(trees) < len(_MOVES):
            return None
        seen = features(scene, tip)
        costs = {move: _cost(tree, seen) for move, tree in trees.items()}
        return min(costs, key=lambda move: costs[move])

    def angle_rad(self, number: int) -> float:
        """The angle of a roll of the plan; the first one has number 0."""
        return rad_from_deg(self.around.rolls[number][1])

    def text(self) -> str:
        """What stands in its file."""
        document = {
            "format": FORMAT,
            "version": VERSION,
            "aim": self.aim,
            "model_sha256": self.digest,
            "is_silent": self.is_silent,
            "around": asdict(self.around),
            "values": self.values,
            "strategy": self.strategy,
        }
        return json.dumps(document, indent=1) + "\n"


def push_mm(scene: Scene) -> float:
    """What a push of the model inserts."""
    return scene.needle.speed_mm_per_s * scene.limits.step_s


def features(scene: Scene, tip: Pose) -> tuple[float, ...]:
    """The values of `CONTINUOUS` where the tip is seen there."""
    away = subtract(scene.targets[-1].center_mm, tip.position_mm)
    axes = (tip.heading, bending_axis(tip), tip.bevel)
    place = turned(model_frame(scene.axis), tip.position_mm)
    return (*(dot(away, axis) for axis in axes), *place)


def digest_of(scene: Scene, around: Around) -> str:
    """The digest of the model in which a policy around a plan is learned."""
    return hashlib.sha256(render_policy(scene, around).encode()).hexdigest()


def read_policy(data: bytes, scene: Scene | None) -> Policy:
    """The policy of a file.

    Args:
        data: What stands in the file.
        scene: The scene for which it must be; None if that is known.

    Raises:
        InputError: The file is torn, no policy, or one of another task.
    """
    document = _document(data)
    try:
        policy = _policy(document)
    except (LookupError, TypeError, ArithmeticError, ValueError, AttributeError) as error:
        raise InputError(
            f"the file of the policy is torn, or was changed by hand: {_cause(error)}\n{_AGAIN}"
        ) from error
    if scene is not None:
        _require_task(policy, scene)
    return policy


_AGAIN: Final = "hint: `ntagen plan TASK --optimise probability -o FILE` learns a new one"


def _document(data: bytes) -> dict[str, Any]:
    try:
        document = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise InputError(f"the file of the policy is no JSON: {error}\n{_AGAIN}") from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise InputError(f"the file is none of a policy: it does not say {FORMAT!r}\n{_AGAIN}")
    if document.get("version") != VERSION:
        raise InputError(
            f"the policy has version {document.get('version')!r}, and this program reads {VERSION}"
            f"\n{_AGAIN}"
        )
    return document


def _policy(document: Mapping[str, Any]) -> Policy:
    aim: Aim = document["aim"]
    if aim not in ("probability", "miss", "cut"):
        raise ValueError(f"it is the best for {aim!r}")
    around = document["around"]
    seen = Seen(**{name: float(value) for name, value in around["seen"].items()})
    plan = tuple(int(action) for action in around["actions"])
    numbers = {name: int(around[name]) for name in ("window", "most_pushes")}
    if max(len(plan), *numbers.values()) > _MOST_PUSHES:
        raise ValueError(f"more than {_MOST_PUSHES} pushes")
    given = Around(plan, **numbers, inside_mm=float(around["inside_mm"]), seen=seen)
    digest, values = str(document["model_sha256"]), dict(document["values"])
    if not isinstance(document["is_silent"], bool):
        raise ValueError("is_silent is neither true nor false")
    if document["is_silent"]:
        return Policy.silent(aim, digest, given, values)
    return Policy.of(aim, digest, given, document["strategy"], values)


def _require_task(policy: Policy, scene: Scene) -> None:
    try:
        digest = digest_of(scene, policy.around)
    except InputError as error:
        raise InputError(f"the policy is one of another task: {error}") from error
    if digest != policy.digest:
        raise InputError(
            "the policy was learned for another task, or by another version of ntagen: its model "
            f"is not that of this task\n{_AGAIN}"
        )


def _trees(strategy: Mapping[str, Any]) -> dict[tuple[int, ...], dict[Move, Tree]]:
    """The trees of what the engine has learned."""
    seen = tuple(strategy["statevars"]), tuple(strategy["pointvars"])
    if seen != (DISCRETE, CONTINUOUS):
        raise ValueError(f"it sees {', '.join(seen[0] + seen[1])}")
    moves = {
        number: _MOVES[text.partition("->")[2].partition(" ")[0]]
        for number, text in strategy["actions"].items()
        if text != "WAIT"
    }
    return {
        tuple(int(value) for value in key.strip("()").split(",")): {
            moves[number]: _tree(tree) for number, tree in one["regressor"].items()
        }
        for key, one in strategy["regressors"].items()
    }


def _tree(given: Any, depth: int = 0) -> Tree:  # noqa: ANN401  it is checked here
    if isinstance(given, int | float):
        return _finite(given)
    feature = given["var"]
    if feature not in range(len(CONTINUOUS)) or depth > _MOST_DEPTH:
        raise ValueError(f"a node asks for number {feature!r} at depth {depth}")
    low, high = (_tree(given[side], depth + 1) for side in ("low", "high"))
    return Split(feature, _finite(given["bound"]), low, high)


_MOST_DEPTH: Final = 500


def _finite(value: float) -> float:
    if not math.isfinite(value):
        raise ValueError(f"{value!r} is no number")
    return float(value)


def _cost(tree: Tree, seen: tuple[float, ...]) -> float:
    while isinstance(tree, Split):
        tree = tree.low if seen[tree.feature] <= tree.bound else tree.high
    return tree


def _cause(error: Exception) -> str:
    return f"{error} is missing" if isinstance(error, KeyError) else str(error)
