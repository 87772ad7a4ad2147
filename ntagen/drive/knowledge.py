"""The knowledge of the driver, in three kinds that never mix (paper, section 3).

*Actual* knowledge is the truth; only a simulation has it, and it stays in the virtual needle.
*A-priori* knowledge is the scene that the driver is given. *Learned* knowledge comes from contacts
and is always an assumption. This module hides regions of a scene from the driver, and turns
contacts into learned regions.

Where the force begins to rise, the surface of a critical region is one sensing margin away, and
where it has risen, less. The region lies ahead, because there was no force before. The driver
assumes a ball straight ahead whose surface is as far away; its true size is unknown. Its shell is
as wide as the distance at which the needle may pass it. If its shell overlaps the shell of
an earlier ball, no plan can pass between the two, and one ball replaces them: the one that explains
all contacts and the channels that were cut (`ntagen.needle.contact`), else the smallest ball
around both. The shell of a learned region contains all its contacts, so the driver cannot try the
same path for ever. No learned region is put over a channel that was cut safely, or a safe region.

If no plan is left with the regions as they are assumed, smaller ones are assumed (`doubted`): only
contacts are facts, and the force is watched wherever the needle goes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from ntagen.drive.settings import Settings
from ntagen.drive.shells import sensing_margin_mm, shells_of
from ntagen.errors import InputError
from ntagen.needle.contact import Assumed, Contact, ball_of
from ntagen.needle.kinematics import Arc
from ntagen.needle.path import sample_poses
from ntagen.needle.vectors import add, combine, distance, scale
from ntagen.needle.virtual import Obstacle
from ntagen.scene import Pose, Region, Scene, Vector
from ntagen.shapes import Sphere, thickness_mm

_EXPLAINED_MM = 1.0
"""A contact farther than this from a known detection region is never explained by that region."""

_GROWTH_MM = 1.0
"""A contact near a known region makes its shell wider by this length."""


_SURELY_KNOWN_MM = 0.25
"""A tip that is measured without noise is known this well."""

EXPECTED_RISE_RATIO = 2.0
"""Near a known region, the force may rise by this much more than the least rise."""

_OUTSIDE_MM = 0.1
"""A shell in which the tip lies is made smaller until the tip is this far outside."""


def position_unsure_mm(settings: Settings) -> float:
    """How far the tip may be from where it seems to be, when a force is explained, in mm."""
    return min(_EXPLAINED_MM, _SURELY_KNOWN_MM + settings.priors.noise_mm)


def assumed_of(settings: Settings) -> Assumed:
    """What the settings say of regions that nobody told."""
    margin_mm = settings.sensing_margin_mm
    clearance_mm = min(margin_mm, settings.felt_clearance_mm)
    return Assumed(margin_mm, clearance_mm, settings.learned_radius_mm)


def obstacles_of(scene: Scene, otherwise_mm: float) -> tuple[Obstacle, ...]:
    """The critical regions for a simulated needle, with the distances at which it feels them.

    Args:
        scene: The actual scene.
        otherwise_mm: The distance for a region without a shell.
    """
    clock_s = 0.0 if scene.breath is None else scene.breath.clock_s
    return tuple(
        Obstacle(region, sensing_margin_mm(region, scene.detections, otherwise_mm), clock_s)
        for region in scene.criticals
    )


def told(scene: Scene, known: str) -> Scene:
    """The scene with only those critical regions that the driver knows.

    Args:
        scene: The actual scene.
        known: ``all``, ``none``, or names of critical regions, separated by commas.

    Raises:
        InputError: The scene has no critical region with one of the names.
    """
    if known == "all":
        return scene
    names = [] if known == "none" else [name.strip() for name in known.split(",")]
    existing = [region.name for region in scene.criticals]
    for name in names:
        if name not in existing:
            choice = ", ".join(["all", "none", *existing])
            raise InputError(
                f"unknown critical region '{name}' in --known\nhint: choose from {choice}"
            )
    kept_back = [region for region in scene.criticals if region.name not in names]
    hidden = {shell for region in kept_back for shell in shells_of(region, scene.detections)}
    return replace(
        scene,
        criticals=tuple(region for region in scene.criticals if region.name in names),
        detections=tuple(region for region in scene.detections if region not in hidden),
    )


@dataclass(frozen=True, slots=True)
class Knowledge:
    """A-priori and learned knowledge; immutable.

    Attributes:
        a_priori: The scene that the driver was given.
        learned: Critical and detection regions from contacts.
        visited: The number of targets that have been reached.
        contacts: The number of contacts.
        felt: For each learned critical region, its name and its contacts.
        reaches_mm: At which distance each known region is felt; filled when it is asked for.
    """

    a_priori: Scene
    learned: tuple[Region, ...] = ()
    visited: int = 0
    contacts: int = 0
    felt: tuple[tuple[str, tuple[Contact, ...]], ...] = ()
    # It follows from `a_priori`, which never changes, and is asked for at every measurement.
    reaches_mm: dict[tuple[str, float], float] = field(
        default_factory=dict, compare=False, repr=False
    )

    def scene(
        self, tip: Pose, radius_mm: float, depth_mm: float = 0.0, clock_s: float = 0.0
    ) -> Scene:
        """The known scene, for a needle with this pose and radius, inserted to this depth.

        The clock is that of the breath, if regions move.

        A shell in which the tip already lies gets smaller: a plan may leave it, but not lead deeper
        into it.
        """
        needle_known = self.a_priori.with_needle(tip, radius_mm, depth_mm)
        scene = needle_known.with_regions(*self.learned)
        scene = replace(
            scene,
            detections=tuple(
                smaller
                for shell in scene.detections
                if (smaller := _without(shell, tip.position_mm, clock_s)) is not None
            ),
        )
        return scene.with_targets(scene.targets[self.visited :]).at_clock(clock_s)

    def expected_force_n(self, tip_mm: Vector, settings: Settings, clock_s: float = 0.0) -> float:
        """The force that the known regions explain when the tip is here.

        Only regions that the driver was given count: where a learned one lies is a guess.
        """
        unsure_mm = position_unsure_mm(settings)
        gain = EXPECTED_RISE_RATIO * settings.force_rise_n_per_mm
        return max(
            (
                gain * max(0.0, self._reach_mm(region, settings) + unsure_mm - away_mm)
                for region in self.a_priori.criticals
                if (away_mm := region.distance_at_mm(tip_mm, clock_s)) > 0.0
            ),
            default=0.0,
        )

    def _reach_mm(self, region: Region, settings: Settings) -> float:
        """The distance from the surface of a known region at which it is felt."""
        key = (region.name, settings.sensing_margin_mm)
        if key not in self.reaches_mm:
            shells = shells_of(region, self.a_priori.detections)
            self.reaches_mm[key] = _felt_at_mm(region, shells, settings.sensing_margin_mm)
        return self.reaches_mm[key]

    def visiting(self) -> Knowledge:
        """The knowledge after one more target was reached."""
        return replace(self, visited=self.visited + 1)

    def with_contact(
        self,
        contact: Contact,
        assumed: Assumed,
        channels: tuple[Arc, ...] = (),
        unsure_mm: float = _EXPLAINED_MM,
        clock_s: float = 0.0,
    ) -> Knowledge:
        """The knowledge after the force rose.

        Args:
            contact: Where the needle stopped, or began to feel something.
            assumed: What is assumed of the region.
            channels: What was cut before safely: the safe region of the paper. No learned region
                is put over it.
            unsure_mm: A contact this near to the shell of a known region is explained by it.
            clock_s: The time of the breath.
        """
        contacts, place = self.contacts + 1, contact.position_mm
        felt = self._felt(place, assumed.margin_mm, unsure_mm, clock_s)
        if felt is not None:
            learned = self._with_wider_shell(felt, place, assumed.margin_mm, clock_s)
            return replace(self, learned=learned, contacts=contacts)
        ahead_mm = contact.away_mm + assumed.radius_mm
        center = combine(1.0, place, ahead_mm, contact.heading)
        ball = Region.ball(f"learned {contacts}", "critical", center, assumed.radius_mm)
        known = self._with_ball(_Felt(ball, (contact,)), assumed, channels)
        return replace(known, contacts=contacts)

    def doubted(self, assumed: Assumed, ratio: float = 0.5) -> Knowledge | None:
        """The knowledge with smaller learned regions; None if they are as small as can be.

        How large a region is, is a guess; only its contacts are facts.

        Args:
            assumed: What is assumed of regions that are felt.
            ratio: How large the radii become, relative to now; not less than the least guess.
        """
        contacts = dict(self.felt)
        balls = [region for region in self.learned if region.kind == "critical"]
        if all(ball.radius_mm <= _LEAST_GUESS_MM for ball in balls):
            return None
        smaller = []
        for ball in balls:
            felt = contacts.get(ball.name, ())
            radius_mm = min(ball.radius_mm, max(_LEAST_GUESS_MM, ratio * ball.radius_mm))
            center = ball.center_mm
            if len(felt) == 1:
                ahead_mm = felt[0].away_mm + radius_mm
                center = combine(1.0, felt[0].position_mm, ahead_mm, felt[0].heading)
            shape = Sphere(center, radius_mm)
            smaller.append(_Felt(replace(ball, shape=shape), felt))
        return self._with_felt(smaller, assumed)

    def _felt(
        self, place: Vector, margin_mm: float, unsure_mm: float, clock_s: float
    ) -> Region | None:
        """The a-priori critical region that explains a contact, if there is one."""
        for region in self.a_priori.criticals:
            shells = shells_of(region, self.a_priori.detections + self.learned)
            reach_mm = _felt_at_mm(region, shells, margin_mm) + unsure_mm
            if region.distance_at_mm(place, clock_s) <= reach_mm:
                return region
        return None

    def _with_wider_shell(
        self, felt: Region, place: Vector, margin_mm: float, clock_s: float
    ) -> tuple[Region, ...]:
        """Makes the shell of a known region wider: it was felt farther away than expected."""
        shells = shells_of(felt, self.a_priori.detections + self.learned)
        reach_mm = _felt_at_mm(felt, shells, margin_mm)
        reach_mm = max(reach_mm, felt.distance_at_mm(place, clock_s)) + _GROWTH_MM
        name = f"{felt.name} felt"
        shell = Region(name, "detection", felt.shape.grown(reach_mm), felt.name, felt.motion)
        return (*(region for region in self.learned if region.name != name), shell)

    def _with_ball(self, ball: _Felt, assumed: Assumed, channels: tuple[Arc, ...]) -> Knowledge:
        """Adds a ball and its shell; balls whose shells overlap become one.

        That one explains the contacts of all and the channels, if there is such a
        ball. Else it is the smallest ball around them; if that would cover what was cut safely,
        they stay apart.
        """
        contacts = dict(self.felt)
        balls = [
            _Felt(region, contacts.get(region.name, ()))
            for region in self.learned
            if region.kind == "critical"
        ]
        apart: list[_Felt] = []
        pending = [ball]
        while pending:
            current = pending.pop()
            reach_mm = assumed.clearance_mm
            near = [one for one in balls if _overlap(current.region, one.region, reach_mm)]
            joined = _joined([current, *near], assumed, channels) if near else None
            if joined is None:
                apart.append(current)
            else:
                balls = [one for one in balls if one not in near]
                pending.append(joined)
        return self._with_felt([*balls, *apart], assumed)

    def _with_felt(self, balls: Sequence[_Felt], assumed: Assumed) -> Knowledge:
        """The same with these learned balls, and their shells."""
        known = [r for r in self.learned if r.kind == "detection" and r.name.endswith(" felt")]
        kept = [one.clear_of(self.a_priori.safe) for one in balls]
        regions = [one.region for one in kept]
        shells = [
            Region.ball(
                f"{one.region.name} shell",
                "detection",
                one.region.center_mm,
                one.reach_mm(assumed.clearance_mm),
                one.region.name,
            )
            for one in kept
        ]
        return replace(
            self,
            learned=(*regions, *shells, *known),
            felt=tuple((one.region.name, one.contacts) for one in kept),
        )


@dataclass(frozen=True, slots=True)
class _Felt:
    """A learned critical region, its contacts, and how unsure its place is."""

    region: Region
    contacts: tuple[Contact, ...]
    unsure_mm: float = 0.0

    def clear_of(self, safe: Sequence[Region]) -> _Felt:
        """The same, so small that it reaches into no safe region."""
        radius_mm = min(
            [
                self.region.radius_mm,
                *(one.distance_mm(self.region.center_mm) for one in safe),
            ]
        )
        shape = Sphere(self.region.center_mm, max(_LEAST_RADIUS_MM, radius_mm))
        region = replace(self.region, shape=shape)
        return replace(self, region=region)

    def reach_mm(self, clearance_mm: float) -> float:
        """The radius of its shell, which contains all its contacts: none is tried again."""
        reach_mm = self.region.radius_mm + clearance_mm + min(_MOST_UNSURE_MM, self.unsure_mm)
        center_mm = self.region.center_mm
        return max([reach_mm, *(distance(one.position_mm, center_mm) for one in self.contacts)])


def _joined(balls: Sequence[_Felt], assumed: Assumed, channels: tuple[Arc, ...]) -> _Felt | None:
    """One ball in the place of several; None if they must stay apart."""
    contacts = tuple(contact for one in balls for contact in one.contacts)
    around = _around([one.region for one in balls])
    passed = [
        pose.position_mm
        for pose in sample_poses(channels, _PASSED_SPACING_MM)
        if all(distance(pose.position_mm, c.position_mm) > _NEAR_CONTACT_MM for c in contacts)
    ]
    found = ball_of(contacts, passed, assumed)
    if found is not None:
        region = replace(around, shape=Sphere(found.center_mm, found.radius_mm))
        return _Felt(region, contacts, found.center_std_mm)
    return None if _covers(around, channels) else _Felt(around, contacts)


def _without(shell: Region, point_mm: Vector, clock_s: float) -> Region | None:
    """A shell without a point: smaller on all sides if it contains it; None if nothing is left."""
    by_mm = shell.distance_at_mm(point_mm, clock_s) - _OUTSIDE_MM
    if by_mm >= 0.0:
        return shell
    shape = shell.shape.grown(by_mm)
    return replace(shell, shape=shape) if shape.depth_mm > 0.0 else None


def _felt_at_mm(region: Region, shells: Sequence[Region], otherwise_mm: float) -> float:
    """The greatest distance from the surface of a region at which its shells let it be felt."""
    if isinstance(region.shape, Sphere) and all(isinstance(s.shape, Sphere) for s in shells):
        # Shells about another centre count as if they lay about this one.
        widths = [shell.radius_mm - region.radius_mm for shell in shells]
    else:
        widths = [thickness_mm(shell.shape, region.shape) for shell in shells]
    return max(widths, default=otherwise_mm)


_PASSED_SPACING_MM = 2.0
"""Channels are sampled this densely for places that were passed."""

_LEAST_RADIUS_MM = 0.1
"""A learned region is at least this large, also if it was felt at a safe one."""

_LEAST_GUESS_MM = 0.5
"""No region is assumed smaller than this."""

_MOST_UNSURE_MM = 2.0
"""The shell of a learned region is made wider by its uncertainty, but not by more than this."""

_NEAR_CONTACT_MM = 1.0
"""Places this near to a contact may already belong to the rise."""


def _covers(ball: Region, channels: tuple[Arc, ...]) -> bool:
    """Whether a ball contains a point of a channel."""
    return any(arc.nearest_to(ball.center_mm).distance_mm <= ball.radius_mm for arc in channels)


def _overlap(one: Region, other: Region, clearance_mm: float) -> bool:
    reach_mm = one.radius_mm + other.radius_mm + 2.0 * clearance_mm
    return distance(one.center_mm, other.center_mm) < reach_mm


def _around(balls: Sequence[Region]) -> Region:
    """A ball around all of these, made by merging pairs; it has the name of the oldest."""
    result = balls[0]
    for ball in balls[1:]:
        result = replace(_around_two(result, ball), name=min(result.name, ball.name, key=_age))
    return result


def _age(name: str) -> int:
    return int(name.split()[-1])


def _around_two(one: Region, other: Region) -> Region:
    """The smallest ball around two."""
    apart_mm = distance(one.center_mm, other.center_mm)
    if apart_mm + other.radius_mm <= one.radius_mm:
        return one
    if apart_mm + one.radius_mm <= other.radius_mm:
        return other
    radius_mm = 0.5 * (apart_mm + one.radius_mm + other.radius_mm)
    share = (radius_mm - one.radius_mm) / apart_mm
    center = add(scale(1.0 - share, one.center_mm), scale(share, other.center_mm))
    return replace(one, shape=Sphere(center, radius_mm))
