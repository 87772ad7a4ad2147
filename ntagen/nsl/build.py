"""Makes a scene from a draft, and checks all rules on the values (`ntagen.rules`).

A rule reports a mistake with its place and goes on. The scene is made if there are no errors.

Sources: the model's declaration (paper, appendix), which computes in 32-bit integers scaled by the
resolution, checks regions at the ends of steps, and counts touching a region as being in it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, Final, Literal, cast

from ntagen import rules
from ntagen.motion import Breath
from ntagen.nsl import Task, build_devices
from ntagen.nsl.build_regions import PlacedRegion, Regions
from ntagen.nsl.diagnostics import Reporter
from ntagen.nsl.draft import Draft, kept
from ntagen.nsl.moves import MotionBuilder
from ntagen.nsl.source import Span
from ntagen.nsl.vectors import ROUNDING, dot, minus, times, unit
from ntagen.rounding import (
    COARSEST_PER_MM,
    USUAL_PER_MM,
    chosen,
    farthest_mm,
    least_margin,
    precision_of,
    units_per_mm,
)
from ntagen.scene import (
    DEFAULT_LENGTH_MM,
    MEASURED_TISSUE,
    Limits,
    NamedQuery,
    Needle,
    Pose,
    Region,
    RegionKind,
    Scene,
    Tissue,
    Vector,
)
from ntagen.units import deg_from_rad, rad_from_deg

DEFAULT_TIP_MM: Final[Vector] = (0.0, 0.0, 0.0)
DEFAULT_HEADING: Final[Vector] = (0.0, -1.0, 0.0)
DEFAULT_BEVEL: Final[Vector] = (0.0, 0.0, 1.0)
DEFAULT_STEP_S: Final = 2.0
DEFAULT_ROLLS_DEG: Final = (90.0, 180.0, 270.0)
DEFAULT_MAX_ROLLS: Final = 2
DEFAULT_ROLL_DISTANCE_MM: Final = 2.0
"""The defaults: the values of the paper's declaration. That of the resolution is chosen by
`ntagen.rounding`."""


_ABSURD_MM: Final = 1e100


def build(draft: Draft, reporter: Reporter) -> Task | None:
    """What the draft describes, or None after an error, which is reported."""
    device = build_devices.grbl_device(draft, reporter)
    tracker = build_devices.tracker(draft, reporter)
    scene = _Builder(draft, reporter).scene()
    return None if scene is None else Task(scene, tuple(draft.given), device, tracker)


_TISSUE_RULES: Final[dict[str, tuple[str, Callable[[float], rules.Breach | None]]]] = {
    "curvature": ("curvature_ratio", lambda value: rules.part(value, "the curvature error")),
    "roll": ("roll_rad", rules.roll_error),
    "tip": ("tip_mm", lambda value: rules.not_negative(value, "the tip error")),
}
"""The bounds or spreads of a tissue: their fields, and the rules for them."""


class _Builder:
    """Applies the rules to one draft."""

    def __init__(self, draft: Draft, reporter: Reporter) -> None:
        self._draft = draft
        self._reporter = reporter
        self._report = reporter.report
        self._motions = MotionBuilder(draft, reporter)
        self._regions = Regions(draft, reporter, self._motions)

    def scene(self) -> Scene | None:
        """The scene, or None after an error."""
        draft = self._draft
        self._require_statements()
        tip = self._pose()
        needle = self._needle(tip)
        limits = self._limits()
        for name, query in draft.queries.items():
            self._reporter.obeys(rules.query(name, query.value or ""), query.span)
        tissue = self._tissue()
        spheres = self._regions.spheres(needle)
        breath = None if limits is None else self._motions.breath(limits)
        self._check_spins(tissue, breath)
        written = self._resolution()
        is_wrong = written is None and "resolution" in draft.seen
        made = None
        if needle is not None and limits is not None and not self._reporter.has_errors:
            made = self._made(needle, limits, tissue, spheres, breath, written)
        resolution = _units_per_mm(made, written)
        # The next rules compute squares, which are infinite for absurdly large values.
        least = 1 if is_wrong else min(resolution, written or COARSEST_PER_MM)
        if self._check_range(least, tip, needle, limits, spheres):
            if tip is not None:
                self._regions.check(tip, spheres)
            self._check_targets(tissue, spheres)
            if needle is not None and limits is not None and not is_wrong:
                self._check_step(needle, limits, resolution, spheres)
        if self._reporter.has_errors or made is None:
            return None
        self._check_rounding(made)
        return made

    def _made(
        self,
        needle: Needle,
        limits: Limits,
        tissue: Tissue,
        spheres: list[PlacedRegion],
        breath: Breath | None,
        resolution: int | None,
    ) -> Scene:
        """The scene, before the rules that depend on its resolution."""
        draft = self._draft
        safety = cast('Literal["sampled", "swept"]', draft.choices.get("safety", "sampled"))
        return Scene(
            name=draft.name,
            needle=needle,
            axis=needle.tip.heading,
            limits=limits,
            targets=_of_kind(spheres, "target"),
            criticals=_of_kind(spheres, "critical"),
            detections=_of_kind(spheres, "detection"),
            unexplored=_of_kind(spheres, "unexplored"),
            safe=_of_kind(spheres, "safe"),
            tissue=tissue,
            resolution_per_mm=resolution,
            safety=safety,
            queries=tuple(
                NamedQuery(name, query.value or "") for name, query in draft.queries.items()
            ),
            breath=breath,
        )

    # ------------------------------------------------------------------------------ what must be

    def _require_statements(self) -> None:
        """Every environment has a needle with radius and speed, and a target."""
        draft = self._draft
        if draft.has_gaps and not {"needle", "target"} <= draft.seen.keys():
            return  # A statement that seems to be missing may be one with a mistake.
        if "needle" not in draft.seen:
            self._report(
                "needle-missing",
                draft.span,
                f"`{draft.name}` has no needle",
                hint="add `needle { radius 30 mm speed 1 mm/s }`",
            )
        else:
            for keyword, value in (("radius", "30 mm"), ("speed", "1 mm/s")):
                if keyword not in draft.seen:
                    self._report(
                        "setting-missing",
                        draft.seen["needle"],
                        f"the needle has no {keyword}",
                        hint=f"add for example `{keyword} {value}`",
                    )
        if "target" not in draft.seen:
            self._report(
                "target-missing",
                draft.span,
                f"`{draft.name}` has no target",
                hint="add for example `target T1 sphere (0, -50, 0) mm radius 10 mm`",
            )

    # --------------------------------------------------------------------------- needle, motion

    def _pose(self) -> Pose | None:
        """The tip's pose, with heading and bevel of length 1."""
        tip = self._draft.vectors.get("tip")
        position = DEFAULT_TIP_MM if tip is None else tip.value
        heading = self._direction("heading", DEFAULT_HEADING)
        bevel = self._direction("bevel", DEFAULT_BEVEL)
        if self._draft.is_bevel_free and heading is not None:
            bevel = _across(heading)
        if position is None or heading is None or bevel is None:
            return None
        cosine = dot(heading, bevel)
        breach = rules.right_angle(heading, bevel)
        if breach is not None:
            self._report_skew(heading, bevel, breach)
            return None
        # The rest of the skew, below the tolerance, goes into the bevel.
        if abs(cosine) > ROUNDING:
            bevel = unit(minus(bevel, times(cosine, heading)))
        return Pose(position, heading, bevel)

    def _direction(self, keyword: str, default: Vector) -> Vector | None:
        """A direction of length 1."""
        placed = self._draft.vectors.get(keyword)
        if placed is None:
            return default if keyword not in self._draft.seen else None
        hint = f"write for example `{keyword} {'-y' if keyword == 'heading' else '+z'}`"
        value = placed.obeying(self._reporter, rules.direction, f"the {keyword}", hint)
        return None if value is None else unit(value)

    def _report_skew(self, heading: Vector, bevel: Vector, breach: rules.Breach) -> None:
        """Reports a bevel that is not at right angles to the heading, and proposes the nearest."""
        placed = self._draft.vectors.get("bevel") or self._draft.vectors["heading"]
        rest = minus(bevel, times(dot(heading, bevel), heading))
        if math.hypot(*rest) < 1e-3:
            axes = ("x", "y", "z")
            smallest = min(range(3), key=lambda axis: abs(heading[axis]))
            hint = f"write for example `bevel +{axes[smallest]}`" if 0.0 in heading else None
        else:
            hint = f"write `bevel ({', '.join(f'{_rounded(c):g}' for c in unit(rest))})`"
        self._reporter.obeys(replace(breach, hint=hint), placed.span)

    def _positive(
        self, keyword: str, kind: str, role: str, otherwise: float | None = None
    ) -> float | None:
        """A property of the needle or its motion that is greater than 0."""
        placed = self._draft.numbers.get(keyword)
        if placed is None:
            return None if keyword in self._draft.seen else otherwise
        return placed.obeying(self._reporter, rules.positive, role, kind)

    def _needle(self, tip: Pose | None) -> Needle | None:
        """The needle, or None after a mistake in it."""
        radius = self._positive("radius", "radius-not-positive", "the radius of the motion circle")
        speed = self._positive("speed", "speed-not-positive", "the insertion speed")
        role = "the needle's length"
        length = self._positive("length", "length-not-positive", role, DEFAULT_LENGTH_MM)
        if tip is None or radius is None or speed is None or length is None:
            return None
        return Needle(tip, radius, speed, length)

    def _limits(self) -> Limits | None:
        """What the controller may do, or None after a mistake in it."""
        draft, reporter = self._draft, self._reporter
        step = self._positive("step", "step-not-positive", "the step", DEFAULT_STEP_S)
        angles = self._roll_angles()
        count = kept(draft.max_rolls, DEFAULT_MAX_ROLLS, reporter, rules.roll_count)
        role = "the distance between rolls"
        distance = kept(
            draft.roll_distance, DEFAULT_ROLL_DISTANCE_MM, reporter, rules.not_negative, role
        )
        if step is None or angles is None or count is None or distance is None:
            return None
        return Limits(step, angles, count, distance, draft.is_bevel_free, self._spins())

    def _roll_angles(self) -> tuple[float, ...] | None:
        """The rolls in rad, exactly those of whole degrees."""
        if "roll" not in self._draft.seen:
            return tuple(map(rad_from_deg, DEFAULT_ROLLS_DEG))
        found: dict[int, Span] = {}
        for placed in self._draft.angles:
            angle_rad = placed.obeying(self._reporter, rules.roll)
            if angle_rad is None:
                continue
            degrees = round(deg_from_rad(angle_rad))
            if degrees in found:
                self._report(
                    "roll-repeated", placed.span, f"the roll by {degrees} deg is written twice"
                )
            found.setdefault(degrees, placed.span)
        return tuple(rad_from_deg(float(degrees)) for degrees in found) or None

    def _spins(self) -> tuple[float, ...]:
        """The fractions of the insertion in which the needle may spin; those without a mistake."""
        found: list[float] = []
        for placed in self._draft.spins:
            spin = placed.obeying(self._reporter, rules.spin)
            if spin is None:
                continue
            repeated = rules.spin_repeated([*found, spin], len(found))
            if self._reporter.obeys(repeated, placed.span):
                found.append(spin)
        return tuple(found)

    def _check_spins(self, tissue: Tissue, breath: Breath | None) -> None:
        """The needle may spin only where plans do not depend on the tissue's answer or on time."""
        if "spin" in self._draft.seen:
            is_moving = breath is not None
            self._reporter.obeys(
                rules.spin_possible(tissue.kind, is_moving=is_moving), self._draft.seen["spin"]
            )

    def _tissue(self) -> Tissue:
        """How the tissue behaves; static after a mistake."""
        kind = self._draft.choices.get("tissue", "static")
        if kind == "static":
            return Tissue()
        # What is not given of a stochastic tissue is as it was measured.
        tissue = MEASURED_TISSUE if kind == "stochastic" else Tissue("adversarial")
        values: dict[str, Any] = {}
        for word, (field_name, rule) in _TISSUE_RULES.items():
            value = kept(self._draft.tissue.get(word), None, self._reporter, rule)
            if value is not None:
                values[field_name] = value
        return replace(tissue, **values)

    def _resolution(self) -> int | None:
        """Fixed-point units in a mm if they are written, and rightly."""
        value = kept(self._draft.resolution, None, self._reporter, rules.resolution)
        return None if value is None else round(value)

    # -------------------------------------------------------------------------------------- rules

    def _check_targets(self, tissue: Tissue, spheres: list[PlacedRegion]) -> None:
        """Something is left of each target when the tip may be off."""
        for one in spheres:
            depth_mm = one.region.shape.depth_mm
            is_left = tissue.is_stochastic or depth_mm > tissue.tip_mm
            if one.region.kind == "target" and depth_mm > 0.0 and not is_left:
                self._report(
                    "tip-error-too-large",
                    self._draft.tissue["tip"].span,
                    f"`{one.region.name}` is {depth_mm:g} mm deep, and the tip may be off by as "
                    "much",
                    hint="make the target larger, or the error smaller",
                )

    def _check_step(
        self, needle: Needle, limits: Limits, resolution: int, spheres: list[PlacedRegion]
    ) -> None:
        """Lengths must fit the model; a push must bend the needle and not jump over a region."""
        placed = self._draft.numbers.get("step")
        span = self._draft.span if placed is None else placed.span
        advance = needle.speed_mm_per_s * limits.step_s
        swept = self._draft.choices.get("safety") == "swept"
        circle = rules.visible(needle.radius_mm, resolution, "the radius of the motion circle")
        if self._reporter.obeys(circle, self._draft.numbers["radius"].span):
            speed = needle.speed_mm_per_s
            for index, (_, radius, place) in enumerate(self._circles(needle, limits)):
                breach = rules.motion(limits.step_s, speed, radius, resolution, swept=swept)
                if not self._reporter.obeys(breach, place if index else span):
                    break
        seen = [sphere for sphere in spheres if self._regions.is_visible(sphere, resolution)]
        # The swept check sees critical regions between the ends of pushes, but no targets.
        jumped = ("target",) if swept else ("target", "critical", "detection", "unexplored")
        checked = (sphere for sphere in seen if sphere.region.kind in jumped)
        smallest = min(checked, key=lambda s: s.region.shape.depth_mm, default=None)
        if smallest is not None and advance > 2.0 * smallest.region.shape.depth_mm:
            self._report(
                "step-too-long",
                span,
                f"a push of {advance:g} mm can jump over `{smallest.region.name}`,"
                f" which is {2.0 * smallest.region.shape.depth_mm:g} mm wide",
                hint="make the step shorter",
                notes=("regions are checked at the ends of pushes only",),
            )

    def _circles(self, needle: Needle, limits: Limits) -> Iterator[tuple[str, float, Span]]:
        """The motion circles of the needle: in words, their radii, and what they come from."""
        yield "the motion circle", needle.radius_mm, self._draft.numbers["radius"].span
        spans = {placed.value: placed.span for placed in self._draft.spins}
        for spin in limits.spins:
            what = f"the motion circle of a needle that spins for {100.0 * spin:g} % of the way"
            yield what, needle.radius_mm / (1.0 - spin), spans[spin]

    def _check_rounding(self, scene: Scene) -> None:
        """Rounding moves the path on a circle by less than the least margin of the task."""
        found, (margin_mm, whose) = precision_of(scene), least_margin(scene)
        if found.circle_error_mm <= margin_mm:
            return
        placed, best = self._draft.resolution, chosen(scene)
        shorter = "write the `length` of the needle that the task needs, so that plans are shorter"
        is_best = found.per_mm == best.per_mm
        self._report(
            "resolution-coarse",
            self._draft.span if placed is None else placed.span,
            f"at {found.per_mm} per mm rounding may move the model's path by more than"
            f" {margin_mm:.4g} mm, {whose}",
            hint=shorter if is_best else f"write `{best.per_mm} per mm`, or leave it out",
            notes=(
                f"on a single circle it is up to {found.circle_error_mm:.3g} mm; with all rolls "
                f"{found.bound}",
            ),
        )

    def _check_range(
        self,
        resolution: int,
        tip: Pose | None,
        needle: Needle | None,
        limits: Limits | None,
        spheres: list[PlacedRegion],
    ) -> bool:
        """Reports every length that does not fit into the model's numbers.

        Returns:
            Whether the square of each length is finite.
        """
        largest_mm = 0.0
        for what, length_mm, span in self._lengths(tip, needle, limits, spheres):
            self._reporter.obeys(rules.fits(length_mm, resolution, what), span)
            largest_mm = max(largest_mm, length_mm)
        return largest_mm < _ABSURD_MM

    def _lengths(
        self,
        tip: Pose | None,
        needle: Needle | None,
        limits: Limits | None,
        spheres: list[PlacedRegion],
    ) -> Iterator[tuple[str, float, Span]]:
        """The lengths in the model, with their names and their places in the file."""
        draft = self._draft
        if tip is not None and "tip" in draft.vectors:
            yield "the tip's position", math.hypot(*tip.position_mm), draft.vectors["tip"].span
        if needle is not None:
            # The centre of the motion circle lies one radius away from the tip.
            away = math.hypot(*needle.tip.position_mm)
            yield "the motion circle", needle.radius_mm + away, draft.numbers["radius"].span
            placed = draft.numbers.get("length", draft.resolution)
            yield (
                "the needle's length",
                needle.length_mm,
                draft.span if placed is None else placed.span,
            )
        if needle is not None and limits is not None:
            for what, radius, span in list(self._circles(needle, limits))[1:]:
                yield what, radius + math.hypot(*needle.tip.position_mm), span
            span = draft.numbers["step" if "step" in draft.numbers else "speed"].span
            yield "a push", needle.speed_mm_per_s * limits.step_s, span
        if limits is not None and draft.roll_distance is not None:
            yield (
                "the distance between rolls",
                limits.min_roll_distance_mm,
                draft.roll_distance.span,
            )
        start = DEFAULT_TIP_MM if tip is None else tip.position_mm
        for sphere in spheres:
            length_mm = farthest_mm(sphere.region, start)
            yield f"`{sphere.region.name}`", length_mm, sphere.place


def _units_per_mm(scene: Scene | None, written: int | None) -> int:
    """The resolution with which the rules reckon; without a scene, a usual one."""
    if scene is not None:
        return units_per_mm(scene)
    return USUAL_PER_MM if written is None else written


def _of_kind(spheres: list[PlacedRegion], kind: RegionKind) -> tuple[Region, ...]:
    """The regions of one kind, in their order."""
    return tuple(sphere.region for sphere in spheres if sphere.region.kind == kind)


def _across(heading: Vector) -> Vector:
    """The usual bevel if it is at right angles to the heading, else the axis that is most so."""
    axes = (DEFAULT_BEVEL, (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
    axis = min(axes, key=lambda axis: abs(dot(axis, heading)))
    return unit(minus(axis, times(dot(axis, heading), heading)))


def _rounded(component: float) -> float:
    """A component as a hint shows it, without a negative zero."""
    return round(component, 6) + 0.0
