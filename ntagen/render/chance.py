"""The numbers of a tissue with chance, for the templates.

The true pose of the tip is kept in doubles, in mm and rad, so nothing here is rounded to units.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Final

from ntagen.errors import InputError
from ntagen.render.frame import Matrix, turned
from ntagen.render.solids import FORMS, Solids
from ntagen.scene import Region, Scene, Vector
from ntagen.values import dataclass

SPACING_MM: Final = 0.25
"""The way of the tip is looked at in places that are at most so far apart. Between two of them it
comes nearer to a ball with its centre 2 mm away by at most 0.004 mm."""

_WHOLE: Final = 1e-6
"""Distances between rolls are whole pushes up to this."""

TOUCH_MM: Final = 10.0
"""A tip that touches a region counts as one that misses the target by this much; ours."""

UNSEEN_MM: Final = 1e6
"""What distances are before anything was looked at."""


@dataclass(frozen=True, slots=True)
class Seen:
    """How exactly the pose of the tip is seen after each push: standard deviations.

    Attributes:
        position_mm: Of each coordinate of the tip.
        heading_rad: Of the heading, about either transverse axis.
        bevel_rad: Of the bevel's angle about the shaft.
    """

    position_mm: float
    heading_rad: float
    bevel_rad: float


@dataclass(frozen=True, slots=True)
class Around:
    """A plan, and how far a policy may deviate from it.

    Attributes:
        actions: The plan: 0 is a push, else a roll by that number of degrees.
        window: A roll may come so many pushes before or after its place in the plan. One before
            the first push stays there.
        most_pushes: So many pushes are made at most.
        inside_mm: The needle stops where the tip is seen so deep in the target.
        seen: How exactly the tip is seen.
    """

    actions: tuple[int, ...]
    window: int
    most_pushes: int
    inside_mm: float
    seen: Seen

    @property
    def pushes(self) -> int:
        """The pushes of the plan."""
        return self.actions.count(0)

    @property
    def rolls(self) -> tuple[tuple[int, int], ...]:
        """For each roll of the plan, after how many pushes it comes, and its angle in degrees."""
        return tuple(
            (self.actions[:place].count(0), action)
            for place, action in enumerate(self.actions)
            if action
        )

    @property
    def first(self) -> tuple[int, ...]:
        """For each roll, after how many pushes it may be made."""
        return tuple(max(1, place - self.window) if place else 0 for place, _ in self.rolls)

    @property
    def last(self) -> tuple[int, ...]:
        """For each roll, after how many pushes it must be made."""
        return tuple(place + self.window if place else 0 for place, _ in self.rolls)


@dataclass(frozen=True, slots=True)
class PolicyValues:
    """The numbers of the model in which a policy is learned, as texts of doubles.

    Attributes:
        seen_mm: The standard deviation of each coordinate of the tip that is seen.
        heading_rad: That of the heading.
        bevel_rad: That of the bevel's angle.
        most_pushes: So many pushes are made at most.
        apart: So many pushes must lie between two rolls.
        first: By roll: from how many pushes on it may be made.
        last: By roll: after how many it must be made.
        places: By roll: after how many the plan makes it.
        angles: By roll: that of the plan, in degrees.
        planned_pushes: The pushes of the plan.
        center: The centre of the target, in the model's frame.
        inside_mm: The needle stops where the tip is seen so deep in the target.
        touch_mm: A touch counts as such a miss.
    """

    seen_mm: str
    heading_rad: str
    bevel_rad: str
    most_pushes: int
    apart: int
    first: tuple[int, ...]
    last: tuple[int, ...]
    places: tuple[int, ...]
    angles: tuple[int, ...]
    planned_pushes: int
    center: str
    inside_mm: str
    touch_mm: str


@dataclass(frozen=True, slots=True)
class Chance:
    """The numbers of a tissue with chance, as texts of doubles.

    Attributes:
        curvature_spread: The standard deviation of the logarithm of the curvature.
        roll_spread_rad: That of the error of a roll.
        tip_spread_mm: That of each coordinate of the tip.
        radius_mm: The radius of the motion circle that is expected.
        push_mm: What a push inserts.
        parts: The way of a push is looked at in this number of parts, at the end of each.
        segments: Segments on one path, at most.
        position: The tip at the start, in the model's frame.
        heading: Its direction of travel.
        bevel: Its direction away from the centre of the motion circle.
        unseen: What distances are at the start, in mm.
        targets_unseen: The same for each target.
        has_unsafe: Whether there are regions that must not be touched.
        unsafe_solids: Shapes besides spheres that must not be touched: the kind, and the first and
            last row in its tables.
        target_forms: The kinds of targets that are no spheres, and their numbers.
        plan: What is done one after the other: 0 is a push, else a roll by that number of
            degrees; empty in a game.
        policy: What a policy sees and may do; None where none is learned.
    """

    curvature_spread: str
    roll_spread_rad: str
    tip_spread_mm: str
    radius_mm: str
    push_mm: str
    parts: int
    segments: int
    position: str
    heading: str
    bevel: str
    unseen: str
    targets_unseen: tuple[str, ...]
    has_unsafe: bool
    unsafe_solids: tuple[tuple[str, int, int], ...]
    target_forms: tuple[tuple[str, int], ...]
    plan: tuple[int, ...] = ()
    policy: PolicyValues | None = None


def chance(
    scene: Scene,
    solids: Solids,
    frame: Matrix,
    plan: Sequence[int] | None = None,
    around: Around | None = None,
) -> Chance | None:
    """The numbers of a scene with a stochastic tissue; None for another one.

    Raises:
        InputError: Regions move, or the plan is empty.
    """
    tissue, needle, limits = scene.tissue, scene.needle, scene.limits
    if not tissue.is_stochastic:
        return None
    if any(region.motion for region in scene.regions):
        raise InputError(
            "regions that move, and a tissue with chance, cannot be in one task\n"
            "hint: make the tissue static, or the regions as large as where they get"
        )
    if plan is not None and not plan:
        raise InputError("the plan has no actions")
    push_mm = needle.speed_mm_per_s * limits.step_s
    rolls = limits.max_rolls + limits.free_bevel
    if plan is not None:
        rolls = max(rolls, sum(1 for action in plan if action))

    def vector(value: Vector) -> str:
        return "{" + ", ".join(_double(part) for part in turned(frame, value)) + "}"

    return Chance(
        curvature_spread=_double(tissue.curvature_ratio),
        roll_spread_rad=_double(tissue.roll_rad),
        tip_spread_mm=_double(tissue.tip_mm),
        radius_mm=_double(needle.radius_mm),
        push_mm=_double(push_mm),
        parts=max(1, math.ceil(push_mm / SPACING_MM)),
        segments=rolls + 1,
        position=vector(needle.tip.position_mm),
        heading=vector(needle.tip.heading),
        bevel=vector(needle.tip.bevel),
        unseen=_double(UNSEEN_MM),
        targets_unseen=(_double(UNSEEN_MM),) * len(scene.targets),
        has_unsafe=has_unsafe(scene),
        unsafe_solids=tuple(_unsafe(scene, solids)),
        target_forms=tuple(_forms(scene.targets)),
        plan=tuple(plan or ()) if around is None else (),
        policy=None if around is None else _policy(scene, around, vector),
    )


def _policy(scene: Scene, around: Around, vector: Callable[[Vector], str]) -> PolicyValues:
    """What a policy sees and may do."""
    return PolicyValues(
        seen_mm=_double(around.seen.position_mm),
        heading_rad=_double(around.seen.heading_rad),
        bevel_rad=_double(around.seen.bevel_rad),
        most_pushes=around.most_pushes,
        apart=apart(scene),
        first=around.first,
        last=around.last,
        places=tuple(place for place, _ in around.rolls),
        angles=tuple(angle for _, angle in around.rolls),
        planned_pushes=around.pushes,
        center=vector(scene.targets[-1].center_mm),
        inside_mm=_double(around.inside_mm),
        touch_mm=_double(TOUCH_MM),
    )


def apart(scene: Scene) -> int:
    """So many pushes must lie between two rolls."""
    push_mm = scene.needle.speed_mm_per_s * scene.limits.step_s
    return max(1, math.ceil(scene.limits.min_roll_distance_mm / push_mm - _WHOLE))


def has_unsafe(scene: Scene) -> bool:
    """Whether the scene has regions that must not be touched."""
    return bool(scene.criticals or scene.unexplored)


def _unsafe(scene: Scene, solids: Solids) -> Iterator[tuple[str, int, int]]:
    """The rows of critical and unexplored shapes; those of detection regions lie between them."""
    for table in solids.tables:
        form = FORMS[table.form - 1]
        criticals, detections, unexplored = (
            sum(isinstance(region.shape, form) for region in regions)
            for regions in (scene.criticals, scene.detections, scene.unexplored)
        )
        if criticals:
            yield table.kind.lower(), 0, criticals - 1
        if unexplored:
            first = criticals + detections
            yield table.kind.lower(), first, first + unexplored - 1


def _forms(targets: Sequence[Region]) -> Iterator[tuple[str, int]]:
    """The kinds of targets that are no spheres, each once."""
    for number, form in enumerate(FORMS, start=1):
        if any(isinstance(target.shape, form) for target in targets):
            yield form.__name__.lower(), number


def _double(value: float) -> str:
    """A number as UPPAAL reads a double: without an exponent, and with a point."""
    text = repr(float(value))
    return f"{value:.25f}" if "e" in text else text
