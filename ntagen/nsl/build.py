"""Makes a scene from a draft, and checks all rules on the values (`ntagen.rules`).

A rule reports a mistake with its place and goes on. The scene is made if there are no errors.

Sources: the model's declaration (paper, appendix), which computes in 32-bit integers scaled by the
resolution, checks regions at the ends of steps, and counts touching a region as being in it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final, Literal, cast

from ntagen import hardware, rules
from ntagen.hardware import Axis, GrblDevice, OpenIGTLinkTracker
from ntagen.nsl.diagnostics import Reporter, did_you_mean
from ntagen.nsl.draft import Draft, DraftDevice, DraftRegion, Placed
from ntagen.nsl.resolve import article
from ntagen.nsl.source import Span
from ntagen.parameters import Given
from ntagen.scene import (
    DEFAULT_LENGTH_MM,
    Limits,
    NamedQuery,
    Needle,
    Pose,
    Region,
    RegionKind,
    Scene,
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
DEFAULT_RESOLUTION_PER_MM: Final = 1000
"""The defaults: the values of the paper's declaration."""


_ABSURD_MM: Final = 1e100


@dataclass(frozen=True, slots=True)
class Built:
    """What a draft describes.

    Attributes:
        scene: The scene.
        given: The settings of the driver, in the order written.
        device: The device that moves the needle.
        tracker: What measures it.
    """

    scene: Scene
    given: tuple[Given, ...] = ()
    device: GrblDevice | None = None
    tracker: OpenIGTLinkTracker | None = None


def build(draft: Draft, reporter: Reporter) -> Built | None:
    """What the draft describes, or None after an error, which is reported."""
    builder = _Builder(draft, reporter)
    device, tracker = builder.device(), builder.tracker()
    scene = builder.scene()
    return None if scene is None else Built(scene, tuple(draft.given), device, tracker)


@dataclass(frozen=True, slots=True)
class _Sphere:
    """A region without mistakes, with its places in the file."""

    region: Region
    draft: DraftRegion


class _Builder:
    """Applies the rules to one draft."""

    def __init__(self, draft: Draft, reporter: Reporter) -> None:
        self._draft = draft
        self._reporter = reporter
        self._report = reporter.report

    def device(self) -> GrblDevice | None:
        """The device that the file describes, or None without one or after an error."""
        draft = self._draft.devices.get("device")
        if draft is None or draft.address.value is None:
            return None
        axes = {}
        for word in ("insert", "roll"):
            axis = self._axis(word, draft)
            if axis is not None:
                axes[word] = axis
        if len(axes) < 2:
            return None
        return GrblDevice(draft.address.value, axes["insert"], axes["roll"])

    def _axis(self, word: str, draft: DraftDevice) -> Axis | None:
        """An axis of a device, or None after an error."""
        if word not in draft.axes:
            if f"axis {word}" not in self._draft.seen and not self._draft.has_gaps:
                form = "insert X 80 steps/mm" if word == "insert" else "roll A 8.89 steps/deg"
                self._report(
                    "axis-missing",
                    draft.address.span,
                    f"the device has no axis to {word}",
                    hint=f"add for example `{form}`",
                )
            return None
        letter, steps = draft.axes[word]
        if letter.value is None or steps.value is None:
            return None
        is_right = self._obeys(hardware.axis_letter(letter.value), letter.span)
        if not self._obeys(hardware.axis_steps(steps.value), steps.span) or not is_right:
            return None
        return Axis(letter.value, steps.value)

    def tracker(self) -> OpenIGTLinkTracker | None:
        """The tracker that the file describes, or None without one or after an error."""
        draft = self._draft.devices.get("tracker")
        if draft is None or draft.address.value is None:
            return None
        if not self._obeys(hardware.address(draft.address.value), draft.address.span):
            return None
        return OpenIGTLinkTracker(*hardware.host_and_port(draft.address.value), draft.name)

    def scene(self) -> Scene | None:
        """The scene, or None after an error."""
        draft = self._draft
        self._require_statements()
        tip = self._pose()
        needle = self._needle(tip)
        limits = self._limits()
        for name, query in draft.queries.items():
            self._obeys(rules.query(name, query.value or ""), query.span)
        resolution = self._resolution()
        spheres = self._spheres()
        # The next rules compute squares, which are infinite for absurdly large values.
        if self._check_range(resolution or 1, tip, needle, limits, spheres):
            if tip is not None:
                self._check_regions(tip, spheres)
            if needle is not None and limits is not None and resolution is not None:
                self._check_step(needle, limits, resolution, spheres)
        if self._reporter.has_errors or needle is None or limits is None or resolution is None:
            return None
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
            resolution_per_mm=resolution,
            safety=safety,
            queries=tuple(
                NamedQuery(name, query.value or "") for name, query in draft.queries.items()
            ),
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
        if position is None or heading is None or bevel is None:
            return None
        cosine = _dot(heading, bevel)
        breach = rules.right_angle(heading, bevel)
        if breach is not None:
            self._report_skew(heading, bevel, breach)
            return None
        # The rest of the skew, below the tolerance, goes into the bevel.
        bevel = _unit(_minus(bevel, _times(cosine, heading)))
        return Pose(position, heading, bevel)

    def _direction(self, keyword: str, default: Vector) -> Vector | None:
        """A direction of length 1."""
        placed = self._draft.vectors.get(keyword)
        if placed is None:
            return default if keyword not in self._draft.seen else None
        if placed.value is None:
            return None
        if max(map(abs, placed.value)) == 0.0:
            self._report(
                "direction-zero",
                placed.span,
                f"the {keyword} has no direction",
                hint=f"write for example `{keyword} {'-y' if keyword == 'heading' else '+z'}`",
            )
            return None
        return _unit(placed.value)

    def _obeys(self, breach: rules.Breach | None, span: Span) -> bool:
        """Whether a value obeys a rule; if not, reports it."""
        if breach is not None:
            self._report(breach.rule, span, breach.message, hint=breach.hint)
        return breach is None

    def _report_skew(self, heading: Vector, bevel: Vector, breach: rules.Breach) -> None:
        """Reports a bevel that is not at right angles to the heading, and proposes the nearest."""
        placed = self._draft.vectors.get("bevel") or self._draft.vectors["heading"]
        rest = _minus(bevel, _times(_dot(heading, bevel), heading))
        if math.hypot(*rest) < 1e-3:
            axes = ("x", "y", "z")
            smallest = min(range(3), key=lambda axis: abs(heading[axis]))
            hint = f"write for example `bevel +{axes[smallest]}`" if 0.0 in heading else None
        else:
            hint = f"write `bevel ({', '.join(f'{_rounded(c):g}' for c in _unit(rest))})`"
        self._obeys(replace(breach, hint=hint), placed.span)

    def _positive(self, keyword: str, kind: str, role: str) -> float | None:
        """A property of the needle or its motion that is greater than 0."""
        placed = self._draft.numbers.get(keyword)
        if placed is None or placed.value is None:
            return None
        return (
            placed.value
            if self._obeys(rules.positive(placed.value, role, kind), placed.span)
            else None
        )

    def _needle(self, tip: Pose | None) -> Needle | None:
        """The needle, or None after a mistake in it."""
        radius = self._positive("radius", "radius-not-positive", "the radius of the motion circle")
        speed = self._positive("speed", "speed-not-positive", "the insertion speed")
        length = (
            DEFAULT_LENGTH_MM
            if "length" not in self._draft.seen
            else self._positive("length", "length-not-positive", "the needle's length")
        )
        if tip is None or radius is None or speed is None or length is None:
            return None
        return Needle(tip, radius, speed, length)

    def _limits(self) -> Limits | None:
        """What the controller may do, or None after a mistake in it."""
        draft = self._draft
        step = (
            DEFAULT_STEP_S
            if "step" not in draft.seen
            else self._positive("step", "step-not-positive", "the step")
        )
        angles = self._roll_angles()
        count = DEFAULT_MAX_ROLLS if draft.max_rolls is None else draft.max_rolls.value
        distance = (
            DEFAULT_ROLL_DISTANCE_MM if draft.roll_distance is None else draft.roll_distance.value
        )
        if (
            draft.max_rolls is not None
            and count is not None
            and not self._obeys(rules.roll_count(count), draft.max_rolls.span)
        ):
            count = None
        if (
            draft.roll_distance is not None
            and distance is not None
            and not self._obeys(
                rules.not_negative(distance, "the distance between rolls"), draft.roll_distance.span
            )
        ):
            distance = None
        if step is None or angles is None or count is None or distance is None:
            return None
        return Limits(step, angles, count, distance)

    def _roll_angles(self) -> tuple[float, ...] | None:
        """The rolls in rad, exactly those of whole degrees."""
        if "roll" not in self._draft.seen:
            return tuple(map(rad_from_deg, DEFAULT_ROLLS_DEG))
        found: dict[int, Span] = {}
        for placed in self._draft.angles:
            degrees = self._whole_degrees(placed)
            if degrees is None:
                continue
            if degrees in found:
                self._report(
                    "roll-repeated", placed.span, f"the roll by {degrees} deg is written twice"
                )
            found.setdefault(degrees, placed.span)
        return tuple(rad_from_deg(float(degrees)) for degrees in found) or None

    def _whole_degrees(self, placed: Placed[float]) -> int | None:
        """A roll in degrees."""
        if placed.value is None:
            return None
        if not self._obeys(rules.roll(placed.value), placed.span):
            return None
        return round(deg_from_rad(placed.value))

    def _resolution(self) -> int | None:
        """Fixed-point units in a mm."""
        placed = self._draft.resolution
        if placed is None:
            return None if "resolution" in self._draft.seen else DEFAULT_RESOLUTION_PER_MM
        if placed.value is None:
            return None
        if not self._obeys(rules.resolution(placed.value), placed.span):
            return None
        return round(placed.value)

    # ------------------------------------------------------------------------------------ regions

    def _spheres(self) -> list[_Sphere]:
        """All regions without mistakes, in the order written."""
        spheres = []
        for draft in self._draft.regions.values():
            region = self._around(draft) if draft.around is not None else self._sphere(draft)
            if region is not None:
                spheres.append(_Sphere(region, draft))
        return spheres

    def _sphere(self, draft: DraftRegion) -> Region | None:
        """A region with its own geometry."""
        radius = draft.radius.value
        if radius is not None and not self._obeys(
            rules.positive(radius, f"the radius of `{draft.name}`"), draft.radius.span
        ):
            return None
        if radius is None or draft.center is None or draft.center.value is None:
            return None
        return Region(draft.name, draft.kind, draft.center.value, radius)

    def _around(self, draft: DraftRegion) -> Region | None:
        """A detection region around a critical one."""
        margin = draft.margin.value
        if margin is not None and not self._obeys(
            rules.not_negative(margin, f"the margin of `{draft.name}`", "margin-negative"),
            draft.margin.span,
        ):
            margin = None
        elif margin == 0.0:
            self._report(
                "margin-zero",
                draft.margin.span,
                f"the margin of `{draft.name}` is 0: nearness is never noticed before contact",
                hint="write for example `margin 3 mm`",
            )
        inner = self._critical_inside(draft)
        if inner is None or inner.center is None or inner.center.value is None or margin is None:
            return None
        radius = inner.radius.value
        if radius is None or radius <= 0.0:
            return None
        radius += margin
        if not self._obeys(
            rules.finite([radius], f"the radius of `{draft.name}`"), draft.margin.span
        ):
            return None
        return Region(draft.name, draft.kind, inner.center.value, radius, inner.name)

    def _critical_inside(self, draft: DraftRegion) -> DraftRegion | None:
        """The critical region that a detection region is written around."""
        around = draft.around
        if around is None or around.value is None:
            return None
        name = around.value
        inner = self._draft.regions.get(name)
        if inner is None:
            if name.split("[")[0] not in self._draft.broken_names:
                criticals = [r.name for r in self._draft.regions.values() if r.kind == "critical"]
                self._report(
                    "unknown-region",
                    around.span,
                    f"there is no critical region `{name}`",
                    hint=did_you_mean(name, criticals)
                    or "give the detection region a sphere of its own",
                )
            return None
        if inner.kind != "critical":
            self._report(
                "region-not-critical",
                around.span,
                f"`{name}` is {article(inner.kind)} {inner.kind} region, not a critical one",
                hint="detection regions lie around critical regions",
            )
            return None
        return inner

    # -------------------------------------------------------------------------------------- rules

    def _check_regions(self, tip: Pose, spheres: list[_Sphere]) -> None:
        """Checks the positions of regions relative to the tip and to each other."""
        targets = [sphere for sphere in spheres if sphere.region.kind == "target"]
        others = [s for s in spheres if s.region.kind not in ("target", "safe")]
        for target in targets:
            self._check_reachable(tip, target)
            for other in others:
                self._check_overlap(target, other)
        for other in others:
            self._check_start(tip, other)
        for safe in (sphere for sphere in spheres if sphere.region.kind == "safe"):
            for other in others:
                self._check_safe(safe, other)

    def _check_safe(self, safe: _Sphere, other: _Sphere) -> None:
        """A safe region should not reach into what plans avoid; a shell around it is no matter."""
        one, two = safe.region, other.region
        distance = math.dist(one.center_mm, two.center_mm)
        if two.kind == "detection" or distance >= one.radius_mm + two.radius_mm:
            return
        self._report(
            "safe-overlaps",
            _place_of(safe),
            f"the safe region `{one.name}` reaches into the {two.kind} region `{two.name}`",
            hint=f"move one of the two; plans avoid `{two.name}` all the same",
            notes=(f"the {two.kind} region is at {_place_of(other).place}",),
        )

    def _check_reachable(self, tip: Pose, target: _Sphere) -> None:
        """A target must not lie behind the tip, and should not contain it."""
        region, span = target.region, _place_of(target)
        offset = _minus(region.center_mm, tip.position_mm)
        ahead = _dot(offset, tip.heading)
        if ahead + region.radius_mm < 0.0:
            self._report(
                "target-behind-needle",
                span,
                f"`{region.name}` lies {-ahead - region.radius_mm:.3g} mm behind the needle's tip",
                hint="move it along the heading, or turn the heading round",
            )
        elif math.hypot(*offset) <= region.radius_mm:
            self._report(
                "tip-in-target",
                span,
                f"the tip lies in `{region.name}` already: there is nothing to steer",
            )

    def _check_overlap(self, target: _Sphere, other: _Sphere) -> None:
        """A target must not lie in a critical region, and its centre should not.

        A region may reach into a target, as a vessel at the surface of a tumour does.
        """
        inner, outer = target.region, other.region
        distance = math.dist(inner.center_mm, outer.center_mm)
        if distance >= inner.radius_mm + outer.radius_mm:
            return
        notes = (f"the {outer.kind} region is at {_place_of(other).place}",)
        if distance + inner.radius_mm <= outer.radius_mm:
            self._report(
                "target-in-critical",
                _place_of(target),
                f"`{inner.name}` lies inside the {outer.kind} region `{outer.name}`",
                hint="move one of the two, or make the target larger",
                notes=notes,
            )
        elif distance <= outer.radius_mm:
            self._report(
                "target-overlaps",
                _place_of(target),
                f"the centre of `{inner.name}` lies in the {outer.kind} region `{outer.name}`",
                hint="only the rest of the target can be reached",
                notes=notes,
            )

    def _check_start(self, tip: Pose, other: _Sphere) -> None:
        """The tip must not start in a critical region, and should not in a detection region."""
        region = other.region
        if math.dist(tip.position_mm, region.center_mm) > region.radius_mm:
            return
        self._report(
            "tip-in-critical" if region.kind == "critical" else "tip-in-detection",
            _place_of(other),
            f"the needle's tip lies in the {region.kind} region `{region.name}`",
            hint="move the tip or the region",
        )

    def _check_step(
        self, needle: Needle, limits: Limits, resolution: int, spheres: list[_Sphere]
    ) -> None:
        """Lengths must fit the model; a push must bend the needle and not jump over a region."""
        placed = self._draft.numbers.get("step")
        span = self._draft.span if placed is None else placed.span
        advance = needle.speed_mm_per_s * limits.step_s
        circle = rules.visible(needle.radius_mm, resolution, "the radius of the motion circle")
        if self._obeys(circle, self._draft.numbers["radius"].span):
            swept = self._draft.choices.get("safety") == "swept"
            speed, radius = needle.speed_mm_per_s, needle.radius_mm
            self._obeys(rules.motion(limits.step_s, speed, radius, resolution, swept=swept), span)
        seen = [sphere for sphere in spheres if self._is_visible(sphere, resolution)]
        checked = (sphere for sphere in seen if sphere.region.kind != "safe")
        smallest = min(checked, key=lambda s: s.region.radius_mm, default=None)
        if smallest is not None and advance > 2.0 * smallest.region.radius_mm:
            self._report(
                "step-too-long",
                span,
                f"a push of {advance:g} mm can jump over `{smallest.region.name}`,"
                f" which is {2.0 * smallest.region.radius_mm:g} mm wide",
                hint="make the step shorter",
                notes=("regions are checked at the ends of pushes only",),
            )

    def _is_visible(self, sphere: _Sphere, resolution: int) -> bool:
        """Whether the model can represent a region; if not, reports it."""
        breach = rules.visible(
            sphere.region.radius_mm, resolution, f"the radius of `{sphere.region.name}`"
        )
        # The critical region inside is even smaller.
        if sphere.draft.around is not None:
            return breach is None
        return self._obeys(breach, sphere.draft.radius.span)

    def _check_range(
        self,
        resolution: int,
        tip: Pose | None,
        needle: Needle | None,
        limits: Limits | None,
        spheres: list[_Sphere],
    ) -> bool:
        """Reports every length that does not fit into the model's numbers.

        Returns:
            Whether the square of each length is finite.
        """
        largest_mm = 0.0
        for what, length_mm, span in self._lengths(tip, needle, limits, spheres):
            self._obeys(rules.fits(length_mm, resolution, what), span)
            largest_mm = max(largest_mm, length_mm)
        return largest_mm < _ABSURD_MM

    def _lengths(
        self,
        tip: Pose | None,
        needle: Needle | None,
        limits: Limits | None,
        spheres: list[_Sphere],
    ) -> Iterator[tuple[str, float, Span]]:
        """The lengths in the model, with their names and their places in the file."""
        draft = self._draft
        if tip is not None and "tip" in draft.vectors:
            yield "the tip's position", math.hypot(*tip.position_mm), draft.vectors["tip"].span
        if needle is not None:
            # The centre of the motion circle lies one radius away from the tip.
            reach = needle.radius_mm + math.hypot(*needle.tip.position_mm)
            yield "the motion circle", reach, draft.numbers["radius"].span
            placed = draft.numbers.get("length", draft.resolution)
            yield (
                "the needle's length",
                needle.length_mm,
                draft.span if placed is None else placed.span,
            )
        if needle is not None and limits is not None:
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
            region = sphere.region
            # The model also contains the distance from the tip to the centre.
            reach = max(math.dist(start, region.center_mm), math.hypot(*region.center_mm))
            yield f"`{region.name}`", reach + region.radius_mm, _place_of(sphere)


def _of_kind(spheres: list[_Sphere], kind: RegionKind) -> tuple[Region, ...]:
    """The regions of one kind, in their order."""
    return tuple(sphere.region for sphere in spheres if sphere.region.kind == kind)


def _place_of(sphere: _Sphere) -> Span:
    """The place in the file of a region's position."""
    center = sphere.draft.center
    return sphere.draft.name_span if center is None else center.span


def _dot(a: Vector, b: Vector) -> float:
    """The scalar product."""
    return math.fsum(p * q for p, q in zip(a, b, strict=True))


def _minus(a: Vector, b: Vector) -> Vector:
    """The difference."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _times(factor: float, a: Vector) -> Vector:
    """The multiple."""
    return factor * a[0], factor * a[1], factor * a[2]


def _unit(a: Vector) -> Vector:
    """The vector of length 1 in the same direction; exact for directions along an axis."""
    # Scaling first keeps the squares of very large and very small components in range.
    largest = max(map(abs, a))
    scaled = (a[0] / largest, a[1] / largest, a[2] / largest)
    length = math.hypot(*scaled)
    # Adding 0.0 turns a negative zero into a positive one.
    return scaled[0] / length + 0.0, scaled[1] / length + 0.0, scaled[2] / length + 0.0


def _rounded(component: float) -> float:
    """A component as a hint shows it, without a negative zero."""
    return round(component, 6) + 0.0
