"""The scene: all that is known about a steering task, as immutable values in mm, rad and s.

A scene is made by the environment language (`ntagen.nsl`), turned into a model by `ntagen.render`,
and replaced by a new one whenever the driver learns something (a pose, a radius, a region).

Conventions (paper, section 2 and appendix; the code of the appendix wins over its comments):

* A pose has the tip's position, its *heading* (the direction of travel; `TIP_X` in the model) and
  its *bevel* direction (`TIP_Z`): the unit vector that points away from the centre of the motion
  circle. The centre lies at ``position - radius * bevel``.
* Heading and bevel are unit vectors at right angles. The third axis is ``bevel x heading``
  (`TIP_Y`).
* `Scene.axis` is the direction in which insertion makes progress: the heading written in the file.
  It stays the same when the tip's pose is measured again. The model calls this direction -y.

Each value is checked by the rules of `ntagen.rules` when it is made; a wrong one raises
`InputError`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import field, replace
from typing import Final, Literal

from ntagen import rules
from ntagen.errors import InputError
from ntagen.motion import Breath, Motion
from ntagen.shapes import UPRIGHT, Shape, Sphere
from ntagen.values import dataclass

Vector = tuple[float, float, float]
"""Three numbers along the axes x, y, z."""

DEFAULT_LENGTH_MM = 200.0
"""The default length of a needle: that of long biopsy needles. The longest path of the paper's
instance takes 190 mm, so this limit does not change its model."""

SHAFT_SPACING_MM = 0.5
"""The places of a shaft in a scene are at most so far apart."""

_KINDS = ("target", "critical", "detection", "unexplored", "safe")

RegionKind = Literal["target", "critical", "detection", "unexplored", "safe"]
"""The kinds of the paper: TR, CR, DR, UR and SR."""


@dataclass(frozen=True, slots=True)
class Region:
    """A solid shape with a name and a kind.

    Attributes:
        name: The name in the file, or one that the driver gave (``learned 1``).
        kind: ``target`` (to be reached), ``critical`` (never to be touched), ``detection``
            (the shell in which the needle senses a near critical region; plans avoid it too),
            ``unexplored`` (nobody knows what is there; plans avoid it) or ``safe`` (nothing
            critical is there, so none is expected there).
        shape: Where it is; a signed distance to its surface, and more.
        around: For a detection region that was written as ``around C1 margin …``, the name of C1.
        motion: How it moves with the breath; then the shape says where it is at rest.
    """

    name: str
    kind: RegionKind
    shape: Shape
    around: str | None = None
    motion: Motion | None = None

    @staticmethod
    def ball(
        name: str, kind: RegionKind, center_mm: Vector, radius_mm: float, around: str | None = None
    ) -> Region:
        """A sphere as a region."""
        return Region(name, kind, Sphere(center_mm, radius_mm), around)

    @property
    def center_mm(self) -> Vector:
        """The middle of the shape."""
        return self.shape.center_mm

    @property
    def radius_mm(self) -> float:
        """The radius of a sphere.

        Raises:
            TypeError: The shape is not a sphere.
        """
        if not isinstance(self.shape, Sphere):
            raise TypeError(f"`{self.name}` is no sphere, so it has no radius")
        return self.shape.radius_mm

    @property
    def moved_mm(self) -> float:
        """How far it moves from its place at rest; 0 if it keeps still."""
        return 0.0 if self.motion is None else self.motion.reach_mm

    def distance_mm(self, point_mm: Vector) -> float:
        """The signed distance of a point to the surface; negative inside."""
        return self.shape.distance_at_mm(point_mm)

    def distance_at_mm(self, point_mm: Vector, clock_s: float) -> float:
        """The signed distance of a point at a time of the breath."""
        if self.motion is None:
            return self.shape.distance_at_mm(point_mm)
        x, y, z = (a - b for a, b in zip(point_mm, self.motion.at_mm(clock_s), strict=True))
        return self.shape.distance_at_mm((x, y, z))

    def at(self, clock_s: float) -> Region:
        """The same region where it is at a time of the breath, and keeping still."""
        if self.motion is None:
            return self
        shape = self.shape.placed(UPRIGHT, self.motion.at_mm(clock_s))
        return replace(self, shape=shape, motion=None)

    def grown(self, by_mm: float) -> Region:
        """The same region, larger on all sides by a length."""
        return replace(self, shape=self.shape.grown(by_mm))

    def __post_init__(self) -> None:
        if self.kind not in _KINDS:
            raise InputError(f"`{self.name}` is a {self.kind} region\nhint: one of {_KINDS}")
        require(*self._breaches())
        if self.around is not None and self.kind != "detection":
            raise InputError(
                f"`{self.name}` is a {self.kind} region, and only a detection region has `around`"
            )

    def _breaches(self) -> Iterator[rules.Breach | None]:
        """The rules that its measures break."""
        for part, numbers, is_positive in self.shape.parts():
            what = f"the {part} of `{self.name}`"
            breach = rules.finite(numbers, what)
            if breach is None and is_positive:
                breach = rules.positive(min(numbers), what)
            yield breach


@dataclass(frozen=True, slots=True)
class Pose:
    """The position and the orientation of the tip; see the module's conventions.

    A path has thousands of poses, so the rules are checked only when a pose is given to a needle.
    """

    position_mm: Vector
    heading: Vector
    bevel: Vector


@dataclass(frozen=True, slots=True)
class Needle:
    """The needle as it is now.

    Attributes:
        tip: The pose of its tip.
        radius_mm: The radius of its motion circle.
        speed_mm_per_s: Its insertion speed.
        length_mm: How much of it can still be inserted. This limits every plan: a needle that has
            turned sideways could otherwise circle for ever.
    """

    tip: Pose
    radius_mm: float
    speed_mm_per_s: float
    length_mm: float = DEFAULT_LENGTH_MM

    def __post_init__(self) -> None:
        radius, speed = "the radius of the motion circle", "the insertion speed"
        length = "the needle's length"
        tip = self.tip
        require(
            rules.finite(tip.position_mm, "the tip's position"),
            rules.finite(tip.heading, "the heading")
            or rules.unit_vector(tip.heading, "the heading"),
            rules.finite(tip.bevel, "the bevel") or rules.unit_vector(tip.bevel, "the bevel"),
            rules.finite([self.radius_mm], radius) or rules.positive(self.radius_mm, radius),
            rules.finite([self.speed_mm_per_s], speed)
            or rules.positive(self.speed_mm_per_s, speed, "speed-not-positive"),
            # The length is 0 if the whole needle is inserted.
            rules.finite([self.length_mm], length)
            or rules.not_negative(self.length_mm, length, "length-not-positive"),
        )
        require(rules.right_angle(tip.heading, tip.bevel))


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits of the controller: its steps and its rolls.

    Attributes:
        step_s: Duration of one model step (`dt`).
        roll_angles_rad: The rolls that may be chosen, as whole degrees in the model.
        max_rolls: The maximum number of rolls in a plan (`MAX_ROT_COUNT`).
        min_roll_distance_mm: The minimum insertion between two rolls (`MIN_PROG_BETWEEN_ROTS`).
        free_bevel: Whether the direction of the bevel before the entry may be chosen: one roll
            before the first push is not counted.
        spins: The parts of the insertion in which the needle may spin about its shaft; the
            curvature is less by such a part (duty-cycled spinning). It may always not spin.
    """

    step_s: float
    roll_angles_rad: tuple[float, ...]
    max_rolls: int
    min_roll_distance_mm: float
    free_bevel: bool = False
    spins: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        step, distance = "the step", "the distance between rolls"
        require(
            rules.finite([self.step_s], step)
            or rules.positive(self.step_s, step, "step-not-positive"),
            *(rules.finite([a], "a roll") or rules.roll(a) for a in self.roll_angles_rad),
            rules.roll_count(self.max_rolls),
            rules.finite([self.min_roll_distance_mm], distance)
            or rules.not_negative(self.min_roll_distance_mm, distance),
            *(
                rules.finite([fraction], "a spun fraction")
                or rules.spin(fraction)
                or rules.spin_repeated(self.spins, index)
                for index, fraction in enumerate(self.spins)
            ),
        )

    @property
    def spun_fractions(self) -> tuple[float, ...]:
        """All fractions that a push may have: none of the way first, then `spins`."""
        return (0.0, *self.spins)


@dataclass(frozen=True, slots=True)
class Tissue:
    """How the tissue answers an action of the needle.

    Attributes:
        kind: ``static`` tissue changes nothing. The ``adversarial`` one picks, at the first push
            after the entry or a roll, how much the needle bends until the next roll, and by how
            much that roll went wrong. The ``stochastic`` one draws them at random instead: plans
            are made as in static tissue, and random runs say how often they succeed.
        curvature_ratio: The curvature may be greater or smaller by this part; of a stochastic
            tissue the standard deviation of its logarithm.
        roll_rad: A roll may be too large or too small by this angle, or its standard deviation.
        tip_mm: How far the tip may be off for other reasons: what must not be touched is larger by
            this length, and targets are smaller. Or the standard deviation of each coordinate.
    """

    kind: Literal["static", "adversarial", "stochastic"] = "static"
    curvature_ratio: float = 0.0
    roll_rad: float = 0.0
    tip_mm: float = 0.0

    def __post_init__(self) -> None:
        curvature, roll, tip = "the curvature error", "the roll error", "the tip error"
        require(
            rules.finite([self.curvature_ratio], curvature)
            or rules.part(self.curvature_ratio, curvature),
            rules.finite([self.roll_rad], roll) or rules.roll_error(self.roll_rad),
            rules.finite([self.tip_mm], tip) or rules.not_negative(self.tip_mm, tip),
        )

    @property
    def is_adversarial(self) -> bool:
        """Whether it is an opponent."""
        return self.kind == "adversarial"

    @property
    def is_stochastic(self) -> bool:
        """Whether its deviations are drawn at random."""
        return self.kind == "stochastic"

    @property
    def factors(self) -> tuple[float, ...]:
        """The factors of the curvature from which it picks, the least first."""
        x = 0.0 if self.is_stochastic else self.curvature_ratio
        return (1.0 - x, 1.0, 1.0 + x) if x > 0.0 else (1.0,)

    @property
    def roll_errors_rad(self) -> tuple[float, ...]:
        """The errors of a roll from which it picks, the least first."""
        y = 0.0 if self.is_stochastic else self.roll_rad
        return (-y, 0.0, y) if y > 0.0 else (0.0,)


@dataclass(frozen=True, slots=True)
class NamedQuery:
    """A query of the environment file: its name, and its text in UPPAAL's query language."""

    name: str
    text: str


@dataclass(frozen=True, slots=True)
class Scene:
    """All that is known of a task.

    Attributes:
        name: The name of the environment; also the stem of the generated files.
        needle: The needle as it is now.
        axis: Unit vector of insertion: the heading in the file; see the module's conventions.
        limits: What the controller may do.
        targets: Target regions in the order in which they are visited.
        criticals: Critical regions, known or learned.
        detections: Detection regions.
        unexplored: Unexplored regions.
        safe: Safe regions.
        tissue: How the tissue behaves.
        resolution_per_mm: Fixed-point units in one mm (`_SI_` of the model); None chooses what is
            fine enough (`ntagen.rounding`).
        safety: ``sampled`` checks regions at the ends of model steps as the paper does;
            ``swept`` also on the arc between them.
        queries: Named queries besides the two of the paper.
        breath: The breath with which regions move; None if all keep still.
        shaft_mm: Places of the shaft behind the tip, at most `SHAFT_SPACING_MM` apart; only where
            regions move, since others cannot come to it.
    """

    name: str
    needle: Needle
    axis: Vector
    limits: Limits
    targets: tuple[Region, ...]
    criticals: tuple[Region, ...] = ()
    detections: tuple[Region, ...] = ()
    unexplored: tuple[Region, ...] = ()
    safe: tuple[Region, ...] = ()
    tissue: Tissue = field(default_factory=Tissue)
    resolution_per_mm: int | None = None
    safety: Literal["sampled", "swept"] = "sampled"
    queries: tuple[NamedQuery, ...] = ()
    breath: Breath | None = None
    shaft_mm: tuple[Vector, ...] = ()

    def __post_init__(self) -> None:
        require(
            rules.finite(self.axis, "the axis") or rules.unit_vector(self.axis, "the axis"),
            None
            if self.resolution_per_mm is None
            else rules.finite([self.resolution_per_mm], "the resolution")
            or rules.resolution(self.resolution_per_mm),
        )
        if self.safety not in ("sampled", "swept"):
            raise InputError(f"there is no safety `{self.safety}`\nhint: write sampled or swept")
        kinds = (self.targets, self.criticals, self.detections, self.unexplored, self.safe)
        for kind, regions in zip(_KINDS, kinds, strict=True):
            if not isinstance(regions, tuple):
                raise InputError(
                    f"the {kind} regions are a {type(regions).__name__}, and a scene never "
                    "changes\nhint: write them in parentheses, `(region,)`, or make a tuple of it"
                )
            for region in regions:
                if region.kind != kind:
                    raise InputError(
                        f"`{region.name}` is a {region.kind} region among the {kind} regions"
                    )

        period_s = None if self.breath is None else self.breath.period_s
        for region in self.regions:
            if region.motion is not None and region.motion.period_s != period_s:
                raise InputError(f"`{region.name}` does not move with the period of the breath")

        if self.limits.spins:
            require(rules.spin_possible(self.tissue.kind, is_moving=self.breath is not None))

    @property
    def regions(self) -> tuple[Region, ...]:
        """Targets, critical, detection, unexplored and safe regions, in this order."""
        return self.targets + self.avoided + self.safe

    @property
    def avoided(self) -> tuple[Region, ...]:
        """The regions that no plan may enter: critical, detection and unexplored ones."""
        return self.criticals + self.detections + self.unexplored

    @property
    def radii_mm(self) -> tuple[float, ...]:
        """The radii of the motion circle that the tissue may pick, or that spinning gives."""
        return tuple(
            self.needle.radius_mm / (factor * (1.0 - spin))
            for spin in self.limits.spun_fractions
            for factor in self.tissue.factors
        )

    def with_tip_margin(self) -> Scene:
        """The same scene with its tip error as margins: regions to avoid larger, targets smaller.

        Raises:
            InputError: A target is not larger than the tip error.
        """
        by_mm = self.tissue.tip_mm
        if by_mm <= 0.0 or self.tissue.is_stochastic:
            return self
        for target in self.targets:
            if target.shape.depth_mm <= by_mm:
                raise InputError(
                    f"`{target.name}` is {target.shape.depth_mm:g} mm deep, so nothing of it "
                    f"is left when the tip may be off by {by_mm:g} mm\n"
                    "hint: make the target larger, or `tip` of the tissue smaller"
                )
        return replace(
            self,
            targets=tuple(region.grown(-by_mm) for region in self.targets),
            criticals=tuple(region.grown(by_mm) for region in self.criticals),
            detections=tuple(region.grown(by_mm) for region in self.detections),
            unexplored=tuple(region.grown(by_mm) for region in self.unexplored),
            tissue=replace(self.tissue, tip_mm=0.0),
        )

    def expected(self) -> Scene:
        """The scene for plans, which are sequences: the tissue does what is expected of it.

        The tip error of an adversarial one stays, as margins.
        """
        return replace(self.with_tip_margin(), tissue=Tissue())

    def with_needle(self, tip: Pose, radius_mm: float, inserted_mm: float = 0.0) -> Scene:
        """The same scene with a new measurement of the tip's pose and the motion circle's radius.

        Args:
            tip: The tip's pose.
            radius_mm: The radius of the motion circle.
            inserted_mm: How much more of the needle is inserted than before. In the tissue, no roll
                is free any more.
        """
        length_mm = max(0.0, self.needle.length_mm - inserted_mm)
        needle = replace(self.needle, tip=tip, radius_mm=radius_mm, length_mm=length_mm)
        is_free = self.limits.free_bevel and inserted_mm <= 0.0
        return replace(self, needle=needle, limits=replace(self.limits, free_bevel=is_free))

    def at_clock(self, clock_s: float) -> Scene:
        """The same scene with plans that begin at another time of the breath, if there is one."""
        if self.breath is None:
            return self
        clock_s %= self.breath.period_s
        return replace(self, breath=replace(self.breath, clock_s=clock_s))

    def with_shaft(self, places_mm: Sequence[Vector]) -> Scene:
        """The same scene with a shaft behind the tip, if regions move."""
        return self if self.breath is None else replace(self, shaft_mm=tuple(places_mm))

    def with_targets(self, targets: Sequence[Region]) -> Scene:
        """The same scene with other targets: those that are still to be visited."""
        return replace(self, targets=tuple(targets))

    def with_regions(self, *regions: Region) -> Scene:
        """The same scene with regions added that are no targets."""
        return replace(
            self,
            criticals=self.criticals + tuple(r for r in regions if r.kind == "critical"),
            detections=self.detections + tuple(r for r in regions if r.kind == "detection"),
            unexplored=self.unexplored + tuple(r for r in regions if r.kind == "unexplored"),
            safe=self.safe + tuple(r for r in regions if r.kind == "safe"),
        )


def require(*breaches: rules.Breach | None) -> None:
    """Refuses values that break rules.

    Raises:
        InputError: It breaks at least one rule; the message names all of them.
    """
    found = [breach for breach in breaches if breach is not None]
    if found:
        raise InputError(
            "\n".join(f"{b.message}\nhint: {b.hint}" if b.hint else b.message for b in found)
        )


MEASURED_TISSUE: Final = Tissue("stochastic", 0.04, math.radians(10.0), 0.2)
"""The spreads that were measured in phantoms; docs/chance.md says on what and how.

The radius of the fitted circle varied by 3.9 % between insertions. The bend planes of two halves of
an insertion differed by 9.8 deg in the median, so each errs by 9.8 / (0.6745 * sqrt 2) = 10.3 deg.
The mean distance from the circle was 0.24 mm, so each coordinate has 0.24 / 1.253 = 0.19 mm.
"""
