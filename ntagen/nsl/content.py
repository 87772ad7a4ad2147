"""Resolves the statements about the environment itself: regions, needle, motion, queries, choices.

`ntagen.nsl.resolve` goes through a file and gives each of them to a `ContentResolver`, which adds
it to the draft.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Final

from ntagen.nsl import tree
from ntagen.nsl.diagnostics import Reporter
from ntagen.nsl.draft import Draft, DraftRegion, Placed
from ntagen.nsl.driving import DriverResolver, is_choice
from ntagen.nsl.evaluate import Evaluator, Scope
from ntagen.nsl.image_content import ImageResolver
from ntagen.nsl.moves import MovesResolver
from ntagen.nsl.quantity import ANGLE, LENGTH, NUMBER, SPEED, TIME
from ntagen.nsl.solids import EXTENTS, SolidResolver
from ntagen.nsl.wording import article

MAX_REGIONS: Final = 10_000
"""An environment has at most this many regions."""

MAX_TARGETS: Final = 100
"""An environment has at most this many targets."""

NUMBERS: Final = {
    "radius": (LENGTH, "the radius of the motion circle"),
    "speed": (SPEED, "the insertion speed"),
    "length": (LENGTH, "the needle's length"),
    "step": (TIME, "the step"),
}
VECTORS: Final = {
    "tip": (LENGTH, "the tip's position"),
    "heading": (NUMBER, "the heading"),
    "bevel": (NUMBER, "the bevel"),
}
"""The settings of needle and motion: their dimension, and what they are."""

TISSUE: Final = {
    "curvature": (NUMBER, "the curvature error"),
    "roll": (ANGLE, "the roll error"),
    "tip": (LENGTH, "the tip error"),
}
"""The bounds of an adversarial tissue, or the spreads of a stochastic one: their dimension, and
what they are."""

FREE: Final = "free"
"""The word for a bevel whose direction the strategy chooses; older files may use it as a name."""


class ContentResolver:
    """Adds single statements to a draft."""

    def __init__(
        self,
        reporter: Reporter,
        evaluator: Evaluator,
        driver: DriverResolver,
        folders: Sequence[str],
    ) -> None:
        self._reporter = reporter
        self._evaluator = evaluator
        self._solids = SolidResolver(evaluator)
        self._images = ImageResolver(reporter, evaluator)
        self._moves = MovesResolver(reporter, evaluator, folders)
        self._adders: dict[type, Callable[[Any, Scope, Draft], None]] = {
            tree.Query: self._query,
            tree.Setting: self._setting,
            tree.Roll: self._roll,
            tree.Spin: self._spin,
            tree.Wait: self._moves.wait,
            tree.Gate: self._moves.gate,
            tree.Choice: self._choice,
            tree.Tissue: self._tissue,
            tree.Parameter: driver.add_parameter,
            tree.Axis: driver.axis,
            tree.Tracker: driver.tracker,
            tree.Transform: self._images.transform,
            tree.Resolution: self._resolution,
        }

    def add(
        self, statement: tree.Statement, scope: Scope, draft: Draft, *, is_in_loop: bool
    ) -> None:
        """Resolves a statement about the environment itself."""
        if isinstance(statement, tree.Region):
            self._region(statement, scope, draft, is_in_loop=is_in_loop)
        else:
            self._adders[type(statement)](statement, scope, draft)

    def _region(
        self, statement: tree.Region, scope: Scope, draft: Draft, *, is_in_loop: bool
    ) -> None:
        """Adds a region to the draft, even if it has mistakes."""
        name = self._region_name(statement.name, scope)
        region = self._shape(statement, name or statement.name.identifier.text, scope)
        draft.seen.setdefault(statement.keyword, statement.span)
        if name is None or region is None:
            draft.has_gaps = True
            draft.broken_names.add(statement.name.identifier.text)
            return
        if statement.moves is not None:
            region = replace(region, moves=self._moves.moves(statement.moves, name, scope))
        if is_in_loop and not statement.name.indices:
            self._reporter.report(
                "name-without-index",
                statement.name.span,
                f"`{name}` is made once for each round of the loop and needs an index",
                hint=f"write for example `{name}[i]`, with the variable of your loop",
            )
            return
        if self._is_full(statement, draft):
            return
        first = draft.regions.setdefault(name, region)
        if first is not region:
            other = "another name or another index" if statement.name.indices else "another name"
            self._reporter.taken(statement.name.span, f"a region `{name}`", first.name_span, other)

    def _is_full(self, statement: tree.Region, draft: Draft) -> bool:
        """Whether the environment has the maximum number of regions; if so, reports it."""
        is_last_target = statement.keyword == "target" and draft.target_count == MAX_TARGETS
        if len(draft.regions) < MAX_REGIONS and not is_last_target:
            draft.target_count += statement.keyword == "target"
            return False
        limit = f"{MAX_TARGETS} targets" if is_last_target else f"{MAX_REGIONS:,} regions"
        self._reporter.report(
            "too-many-regions",
            statement.name.span,
            f"an environment can have at most {limit}",
            hint="describe fewer and larger ones",
        )
        return True

    def _shape(self, statement: tree.Region, name: str, scope: Scope) -> DraftRegion | None:
        """A region with its sphere, or with the region that it lies around."""
        keyword, span, shape = statement.keyword, statement.name.span, statement.shape
        if isinstance(shape, tree.Sphere):
            center = self._evaluator.vector(shape.center, scope, LENGTH, f"the centre of `{name}`")
            radius = self._evaluator.number(shape.radius, scope, LENGTH, f"the radius of `{name}`")
            return DraftRegion(keyword, name, span, center, radius)
        if isinstance(shape, tree.Solid):
            solid = self._solids.solid(shape, name, scope)
            extent: Placed[float] = Placed(None, shape.measures[EXTENTS[shape.form]].span)
            return DraftRegion(keyword, name, span, solid.vectors[0], extent, solid=solid)
        if isinstance(shape, tree.Image):
            image = self._images.image(shape, name, scope)
            place: Placed[float] = Placed(None, shape.path.span)
            if image is None:
                return None
            return DraftRegion(keyword, name, span, None, place, image=image)
        around = self._region_name(shape.region, scope)
        margin = self._evaluator.number(shape.margin, scope, LENGTH, f"the margin of `{name}`")
        if keyword != "detection":
            self._reporter.report(
                "around-misused",
                shape.span,
                f"{article(keyword)} {keyword} region is not written with `around`",
                hint="give it a sphere, or make it a `detection` region",
            )
            return None
        inner = Placed(around, shape.region.span)
        return DraftRegion(keyword, name, span, None, margin, inner)

    def _region_name(self, name: tree.RegionName, scope: Scope) -> str | None:
        """A region's name with the values of its indices: ``Ring[3]``."""
        text = name.identifier.text
        for index in name.indices:
            number = self._evaluator.whole(index, scope, "an index").value
            if number is None:
                return None
            text += f"[{number}]"
        return text

    def _query(self, statement: tree.Query, _: Scope, draft: Draft) -> None:
        """A named query; the engine checks its text later."""
        name = statement.name
        first = draft.queries.setdefault(name.text, Placed(statement.text, name.span))
        if first.span is not name.span:
            self._reporter.taken(name.span, f"a query `{name.text}`", first.span)

    def _setting(self, statement: tree.Setting, scope: Scope, draft: Draft) -> None:
        """A property of the needle or of its motion."""
        value = statement.value
        is_free = isinstance(value, tree.Name) and value.text == FREE and FREE not in scope
        if statement.keyword == "bevel" and is_free:
            draft.is_bevel_free = True
        elif statement.keyword in VECTORS:
            dimension, role = VECTORS[statement.keyword]
            vector = self._evaluator.vector(value, scope, dimension, role)
            draft.vectors[statement.keyword] = vector
        else:
            dimension, role = NUMBERS[statement.keyword]
            number = self._evaluator.number(value, scope, dimension, role)
            draft.numbers[statement.keyword] = number

    def _roll(self, statement: tree.Roll, scope: Scope, draft: Draft) -> None:
        """The rolls that may be chosen, and their limits."""
        evaluator = self._evaluator
        draft.angles = evaluator.list_of(statement.angles, scope, ANGLE, "a roll")
        for limits, words in ((statement.at_most, "at most"), (statement.at_least, "at least")):
            for repeated in limits[1:]:
                self._reporter.repeated(repeated.span, words)
        for limit in statement.at_most[:1]:
            draft.max_rolls = evaluator.whole(limit, scope, "the number of rolls")
        for limit in statement.at_least[:1]:
            role = "the distance between rolls"
            draft.roll_distance = evaluator.number(limit, scope, LENGTH, role)

    def _spin(self, statement: tree.Spin, scope: Scope, draft: Draft) -> None:
        """The fractions of the insertion in which the needle may spin."""
        draft.spins = [
            self._evaluator.number(one, scope, NUMBER, "a spun fraction")
            for one in statement.fractions
        ]

    def _choice(self, statement: tree.Choice, _: Scope, draft: Draft) -> None:
        """A property that is one of a few words."""
        if is_choice(statement.word, statement.keyword, self._reporter):
            draft.choices[statement.keyword] = statement.word.text
        else:
            draft.has_gaps = True

    def _tissue(self, statement: tree.Tissue, scope: Scope, draft: Draft) -> None:
        """How the tissue behaves, with its bounds or spreads."""
        if not is_choice(statement.word, "tissue", self._reporter):
            draft.has_gaps = True
            return
        draft.choices["tissue"] = statement.word.text
        if statement.word.text == "static" and statement.bounds:
            self._reporter.report(
                "tissue-bound-misused",
                statement.bounds[0].word.span,
                "static tissue has no bounds: it changes nothing",
                hint="remove them, or write `tissue adversarial` or `tissue stochastic`",
            )
        if statement.word.text == "adversarial" and not statement.bounds:
            self._reporter.report(
                "tissue-bound-misused",
                statement.span,
                "nothing says what an adversarial tissue may do",
                hint="write for example `tissue adversarial curvature 10 % roll 5 deg tip 0.5 mm`",
            )
        for bound in statement.bounds:
            word = bound.word.text
            if word in draft.tissue:
                self._reporter.repeated(bound.word.span, word)
            dimension, role = TISSUE[word]
            draft.tissue[word] = self._evaluator.number(bound.value, scope, dimension, role)

    def _resolution(self, statement: tree.Resolution, scope: Scope, draft: Draft) -> None:
        """The fixed-point scale, as units per mm."""
        count = self._evaluator.number(statement.count, scope, NUMBER, "the resolution").value
        unit = self._evaluator.unit(statement.unit)
        value: float | None = None
        if unit is not None and unit[1] != LENGTH:
            self._reporter.report(
                "wrong-dimension",
                statement.unit.span,
                f"the resolution is per length, but this is {unit[1]}",
                hint="write for example `resolution 1000 per mm`",
            )
        elif unit is not None and count is not None:
            value = count / unit[0]
            if not math.isfinite(value):
                self._reporter.report(
                    "not-a-number", statement.count.span, "the result is too large for a number"
                )
                value = None
        draft.resolution = Placed(value, statement.count.span.to(statement.unit.span))
