"""Makes the regions of a draft, and checks how they lie to the tip and to each other.

Touching a region counts as being in it, as in the model's declaration (paper, appendix).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from ntagen import rules
from ntagen.nsl.diagnostics import Reporter, did_you_mean
from ntagen.nsl.draft import Draft, DraftRegion
from ntagen.nsl.images import ImageBuilder
from ntagen.nsl.moves import MotionBuilder
from ntagen.nsl.solids import SolidBuilder
from ntagen.nsl.source import Span
from ntagen.nsl.vectors import dot, minus
from ntagen.nsl.wording import article
from ntagen.scene import Needle, Pose, Region, Vector
from ntagen.shapes import Shape, Sphere, is_in, overlap, thickness_mm
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.imaging.grid import Wish

_FIELD_MARGIN_MM: Final = 4.0
"""How far around a shape from a file its distances are exact, besides margins around it."""


@dataclass(frozen=True, slots=True)
class PlacedRegion:
    """A region without mistakes, with its places in the file."""

    region: Region
    draft: DraftRegion

    @property
    def place(self) -> Span:
        """The place in the file of the region's position."""
        center = self.draft.center
        return self.draft.name_span if center is None else center.span


class Regions:
    """Applies the rules to the regions of one draft."""

    def __init__(self, draft: Draft, reporter: Reporter, motions: MotionBuilder) -> None:
        self._draft = draft
        self._motions = motions
        self._reporter = reporter
        self._report = reporter.report
        self._solids = SolidBuilder(reporter)
        self._images = ImageBuilder(draft, reporter)
        self._needle: Needle | None = None
        self._depth_mm = math.inf
        self._made: dict[str, Region | None] = {}

    def spheres(self, needle: Needle | None) -> list[PlacedRegion]:
        """All regions without mistakes, in the order written.

        Args:
            needle: The needle; shapes from files are as large as it can reach. None if it has a
                mistake: then such shapes are left out.
        """
        self._needle = needle
        self._images.is_placed()
        self._expand_marks()
        self._find_depth()
        spheres = []
        for draft in self._draft.regions.values():
            region = self._around(draft) if draft.around is not None else self._own(draft)
            if region is not None:
                spheres.append(PlacedRegion(region, draft))
        return spheres

    def _expand_marks(self) -> None:
        """Puts the shapes of markups in the place of the regions that name their files."""
        regions: dict[str, DraftRegion] = {}
        for name, draft in self._draft.regions.items():
            if draft.image is None or draft.image.form != "markups":
                regions[name] = draft
                continue
            for number, (own, shape) in enumerate(self._images.marks(draft)):
                made = replace(draft, name=own, image=None, made=shape)
                if regions.setdefault(own, made) is not made or (
                    number > 0 and own in self._draft.regions
                ):
                    self._report(
                        "duplicate-name",
                        draft.name_span,
                        f"there is a region `{own}` already",
                        hint="choose another name",
                    )
        self._draft.regions = regions

    def _find_depth(self) -> None:
        """How deep the targets reach along the heading: no plan goes deeper."""
        needle = self._needle
        if needle is None:
            return
        targets = [draft for draft in self._draft.regions.values() if draft.kind == "target"]
        depths = []
        for region in map(self._own, targets):
            if region is None:
                return
            ends = _corners(region.grown(region.moved_mm))
            depths += [dot(minus(end, needle.tip.position_mm), needle.tip.heading) for end in ends]
        self._depth_mm = max(0.0, *depths, 0.0) + _FIELD_MARGIN_MM

    def _wish(self, draft: DraftRegion) -> Wish | None:
        """What the scene says of the grid of a shape from a file."""
        from ntagen.imaging.grid import Wish, Workspace

        needle = self._needle
        if needle is None:
            return None
        margins = [
            other.margin.value or 0.0
            for other in self._draft.regions.values()
            if other.around is not None and other.around.value == draft.name
        ]
        tip = needle.tip
        depth_mm = math.inf if draft.kind == "target" else self._depth_mm
        space = Workspace(tip.position_mm, tip.heading, needle.length_mm, depth_mm)
        margin_mm = _FIELD_MARGIN_MM + max((0.0, *margins))
        motion = self._motions.motion(draft)
        if motion is not None:
            # Seen from a shape that moves, the needle is farther around.
            margin_mm += motion.reach_mm
        return Wish(space, margin_mm, is_inner=draft.kind == "target")

    def _own(self, draft: DraftRegion) -> Region | None:
        """A region with its own geometry; it is made once, since others may lie around it."""
        if draft.name not in self._made:
            made = self._sphere(draft)
            if made is not None:
                made = replace(made, motion=self._motions.motion(draft))
            self._made[draft.name] = made
        return self._made[draft.name]

    def _sphere(self, draft: DraftRegion) -> Region | None:
        """A region that is a sphere or another shape."""
        if draft.made is not None:
            return Region(draft.name, draft.kind, draft.made)
        if draft.image is not None:
            wish = self._wish(draft)
            field = None if wish is None else self._images.field(draft, wish)
            return None if field is None else Region(draft.name, draft.kind, field)
        if draft.solid is not None:
            shape = self._solids.shape(draft, draft.solid)
            return None if shape is None else Region(draft.name, draft.kind, shape)
        role = f"the radius of `{draft.name}`"
        radius = draft.radius.obeying(self._reporter, rules.positive, role)
        if radius is None or draft.center is None or draft.center.value is None:
            return None
        return Region.ball(draft.name, draft.kind, draft.center.value, radius)

    def _around(self, draft: DraftRegion) -> Region | None:
        """A detection region around a critical one."""
        role = f"the margin of `{draft.name}`"
        margin = draft.margin.obeying(self._reporter, rules.not_negative, role, "margin-negative")
        if margin == 0.0:
            self._report(
                "margin-zero",
                draft.margin.span,
                f"{role} is 0: nearness is never noticed before contact",
                hint="write for example `margin 3 mm`",
            )
        inner = self._critical_inside(draft)
        region = None if inner is None else self._own(inner)
        if region is None or margin is None:
            return None
        shape = region.shape.grown(margin)
        numbers = [number for _, numbers, _ in shape.parts() for number in numbers]
        breach = rules.finite(numbers, f"the radius of `{draft.name}`")
        if not self._reporter.obeys(breach, draft.margin.span):
            return None
        # A shell moves with what it lies around.
        motion = region.motion if draft.moves is None else self._motions.motion(draft)
        return Region(draft.name, draft.kind, shape, region.name, motion)

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

    def is_visible(self, sphere: PlacedRegion, resolution: int) -> bool:
        """Whether the model can represent a region; if not, reports it."""
        name = sphere.region.name
        is_ball = isinstance(sphere.region.shape, Sphere)
        what = f"the radius of `{name}`" if is_ball else f"half of the least width of `{name}`"
        depth_mm = sphere.region.shape.depth_mm
        breach = rules.visible(depth_mm, resolution, what) if math.isfinite(depth_mm) else None
        # The critical region inside is even smaller.
        if sphere.draft.around is not None:
            return breach is None
        return self._reporter.obeys(breach, sphere.draft.radius.span)

    def check(self, tip: Pose, spheres: list[PlacedRegion]) -> None:
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

    def _check_safe(self, safe: PlacedRegion, other: PlacedRegion) -> None:
        """A safe region should not reach into what plans avoid; a shell around it is no matter."""
        one, two = safe.region, other.region
        if two.kind == "detection":
            return
        if not any(overlap(a, b) for a, b in _together(one, two)):
            return
        self._report(
            "safe-overlaps",
            safe.place,
            f"the safe region `{one.name}` reaches into the {two.kind} region `{two.name}`",
            hint=f"move one of the two; plans avoid `{two.name}` all the same",
            notes=(f"the {two.kind} region is at {other.place.place}",),
        )

    def _check_reachable(self, tip: Pose, target: PlacedRegion) -> None:
        """A target must not lie behind the tip, and should not contain it."""
        region, span = target.region, target.place
        offset = minus(region.center_mm, tip.position_mm)
        ahead = dot(offset, tip.heading)
        reach_mm = region.shape.reach_mm() + region.moved_mm
        if ahead + reach_mm < 0.0:
            self._report(
                "target-behind-needle",
                span,
                f"`{region.name}` lies {-ahead - reach_mm:.3g} mm behind the needle's tip",
                hint="move it along the heading, or turn the heading round",
            )
        elif is_in(region.at(0.0).shape, tip.position_mm):
            self._report(
                "tip-in-target",
                span,
                f"the tip lies in `{region.name}` already: there is nothing to steer",
            )

    def _check_overlap(self, target: PlacedRegion, other: PlacedRegion) -> None:
        """A target must not lie in a critical region, and its centre should not.

        A region may reach into a target, as a vessel at the surface of a tumour does.
        """
        inner, outer = target.region, other.region
        if not any(overlap(a, b) for a, b in _together(inner, outer)):
            return
        notes = (f"the {outer.kind} region is at {other.place.place}",)
        # A target that moves out of it can be reached then.
        if all(thickness_mm(b, a) >= 0.0 for a, b in _together(inner, outer)):
            self._report(
                "target-in-critical",
                target.place,
                f"`{inner.name}` lies inside the {outer.kind} region `{outer.name}`",
                hint="move one of the two, or make the target larger",
                notes=notes,
            )
        elif all(is_in(b, a.center_mm) for a, b in _together(inner, outer)):
            self._report(
                "target-overlaps",
                target.place,
                f"the centre of `{inner.name}` lies in the {outer.kind} region `{outer.name}`",
                hint="only the rest of the target can be reached",
                notes=notes,
            )

    def _check_start(self, tip: Pose, other: PlacedRegion) -> None:
        """The tip must not start in a critical region, and should not in a detection region."""
        region = other.region
        if not is_in(region.at(0.0).shape, tip.position_mm):
            return
        self._report(
            "tip-in-critical" if region.kind == "critical" else "tip-in-detection",
            other.place,
            f"the needle's tip lies in the {region.kind} region `{region.name}`",
            hint="move the tip or the region",
        )


def _corners(region: Region) -> Iterator[Vector]:
    """The corners of the bounds of a region that has an end."""
    low, high = region.shape.bounds_mm()
    for x in (low[0], high[0]):
        for y in (low[1], high[1]):
            for z in (low[2], high[2]):
                if math.isfinite(x) and math.isfinite(y) and math.isfinite(z):
                    yield (x, y, z)


_MOMENTS: Final = 16
"""How regions that move lie to each other is looked at so often in a period."""


def _together(one: Region, other: Region) -> Iterator[tuple[Shape, Shape]]:
    """The shapes of two regions at moments of the breath; once if they keep their places."""
    if one.motion == other.motion:
        yield one.shape, other.shape
        return
    moving = one.motion or other.motion
    period_s = 1.0 if moving is None else moving.period_s
    for moment in range(_MOMENTS):
        time_s = moment * period_s / _MOMENTS
        yield one.at(time_s).shape, other.at(time_s).shape
