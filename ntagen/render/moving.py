"""The tables of moving regions: where they are at each time of the breath, as integers.

The model's unit of time is the greatest one of which the period, a push and a wait are whole
numbers, so time modulo the period stays exact. There is a row of displacements for each unit, but
at most `MOST_ROWS`: then a row stands for a stretch of time, and regions are larger by how far they
move in it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from ntagen import rules
from ntagen.errors import InputError
from ntagen.motion import Breath, Motion
from ntagen.render.fixed_point import fixed_point
from ntagen.render.frame import Matrix, turned
from ntagen.render.solids import FORMS
from ntagen.rounding import units_per_mm
from ntagen.scene import Region, Scene
from ntagen.shapes import HalfSpace, Sphere
from ntagen.values import dataclass

MOST_ROWS: Final = 240
"""There are at most so many rows of displacements."""

_TURN_RAD: Final = 2.0 * math.pi


@dataclass(frozen=True, slots=True)
class Course:
    """A motion: one row of displacements for each time, and how far off they may be, in units.

    Attributes:
        rows: The rows, as text.
        slack: How far a region is from its row at most.
        reach: How far it gets from its place at rest at most.
        span: How far apart two of its places are at most.
    """

    rows: tuple[str, ...]
    slack: int
    reach: int
    span: int


@dataclass(frozen=True, slots=True)
class Mover:
    """A region to avoid that moves: a ball around it, its shape, and its course."""

    center: str
    radius: int
    form: int
    place: int
    course: int
    is_critical: bool
    note: str


@dataclass(frozen=True, slots=True)
class Moving:
    """The values for models with moving regions; times are in the model's units.

    Attributes:
        unit: One unit of time, in words.
        period: The period.
        push: The duration of a push.
        wait: The duration of a wait.
        row_count: How many rows of displacements each course has.
        max_pauses: See `ntagen.motion.Breath`.
        gate_from: When the gate opens, since the start of the plan; None without a gate.
        gate_width: How long it is open.
        courses: The different motions.
        movers: The regions to avoid that move.
        target_courses: For each target the number of its course, or -1.
    """

    unit: str
    period: int
    push: int
    wait: int
    row_count: int
    max_pauses: int
    gate_from: int | None
    gate_width: int
    courses: tuple[Course, ...]
    movers: tuple[Mover, ...]
    target_courses: tuple[int, ...]

    @property
    def has_targets(self) -> bool:
        """Whether a target moves."""
        return any(course >= 0 for course in self.target_courses)

    @property
    def forms(self) -> tuple[int, ...]:
        """The kinds of shapes besides the sphere among the movers."""
        return tuple(sorted({mover.form for mover in self.movers if mover.form}))


def moving(scene: Scene, places: dict[int, int], frame: Matrix) -> Moving | None:
    """The values of a scene with moving regions; None if it has no breath.

    Args:
        scene: The scene.
        places: By region (`id`) its row in the tables of its shape.
        frame: The turn of the model.

    Raises:
        InputError: The times have no common unit, or a length does not fit the model's numbers.
    """
    breath = scene.breath
    if breath is None:
        return None
    unit_s = rules.common_time(breath.period_s, scene.limits.step_s, breath.wait_s)
    period, push, wait = (
        round(rules.rounded_time(time_s) / unit_s)
        for time_s in (breath.period_s, scene.limits.step_s, breath.wait_s)
    )
    gate_from, gate_width = _gate(breath, period, push)
    motions: list[Motion] = []
    for region in scene.regions:
        if region.motion is not None and region.kind != "safe" and region.motion not in motions:
            motions.append(region.motion)
    rows = min(period, MOST_ROWS)
    scale = units_per_mm(scene)
    # The ends of pushes are instants of the model; the swept check asks about all between them.
    shift = 0.5 if rows < period else 0.0
    off = 0.0 if rows == period and scene.safety == "sampled" else 0.5
    return Moving(
        unit=f"{float(unit_s):g} s",
        period=period,
        push=push,
        wait=wait,
        row_count=rows,
        max_pauses=breath.max_pauses,
        gate_from=gate_from,
        gate_width=gate_width,
        courses=tuple(_course(one, breath, rows, shift, off, scale, frame) for one in motions),
        movers=tuple(
            _mover(one, places, motions.index(one.motion), scale, frame)
            for one in scene.avoided
            if one.motion is not None
        ),
        target_courses=tuple(
            -1 if one.motion is None else motions.index(one.motion) for one in scene.targets
        ),
    )


def _gate(breath: Breath, period: int, push: int) -> tuple[int | None, int]:
    """When the gate opens and how long it is open: never longer than in truth."""
    if breath.gate is None or breath.gate.width_rad >= _TURN_RAD:
        return None, period
    share = breath.gate.from_rad / _TURN_RAD - breath.clock_s / breath.period_s
    opens = (share % 1.0) * period
    begin = math.ceil(opens - 1e-6)
    width = math.floor(opens + breath.gate.width_rad / _TURN_RAD * period + 1e-6) - begin
    if width < push:
        raise InputError(
            "the gate is never open long enough for a push\n"
            "hint: make it wider, or the step of the motion shorter"
        )
    return begin % period, width


def _course(
    motion: Motion, breath: Breath, rows: int, shift: float, off: float, scale: int, frame: Matrix
) -> Course:
    stretch_s = breath.period_s / rows
    texts = []
    for row in range(rows):
        # In the middle of its stretch, if it stands for one.
        at_s = (row + shift) * stretch_s
        place = turned(frame, motion.at_mm(breath.clock_s + at_s))
        units = (fixed_point(part, scale, "a displacement") for part in place)
        texts.append("{" + ", ".join(map(str, units)) + "}")
    off_mm = off * stretch_s * motion.speed_mm_per_s
    ends = motion.extremes_mm()
    return Course(
        rows=tuple(texts),
        # Rounding a place moves it by less than one unit; the tip's position is cut to units too.
        slack=math.ceil(off_mm * scale) + 2,
        reach=math.ceil(motion.reach_mm * scale) + 2,
        span=math.ceil(math.dist(*ends) * scale) + 2,
    )


def _mover(region: Region, places: dict[int, int], course: int, scale: int, frame: Matrix) -> Mover:
    shape, name = region.shape, region.name
    center = (
        fixed_point(part, scale, f"the centre of {name}") for part in turned(frame, shape.center_mm)
    )
    if isinstance(shape, HalfSpace):
        # No ball contains it; this one is passed by every question.
        radius = rules.LARGEST_UNITS
    else:
        radius = fixed_point(shape.reach_mm(), scale, f"the size of {name}") + 1
    return Mover(
        center="{" + ", ".join(map(str, center)) + "}",
        radius=radius - (1 if isinstance(shape, Sphere) else 0),
        form=0 if isinstance(shape, Sphere) else FORMS.index(type(shape)) + 1,
        place=places.get(id(region), 0),
        course=course,
        is_critical=region.kind == "critical",
        note=" ".join(name.split()),
    )


def still(regions: Sequence[Region]) -> list[Region]:
    """Those of some regions that keep still."""
    return [region for region in regions if region.motion is None]
