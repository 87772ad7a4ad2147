"""The values for the templates: a scene's numbers in the model's frame and units.

The templates have the text and the arithmetic; this module makes every decision about a number:

* **Frame**: the whole scene is rotated so that insertion runs along -y (`ntagen.render.frame`).
* **Units**: lengths, and components of directions, become integers (`ntagen.render.fixed_point`).
* **Time**: the model's unit of time is 1 s if the step is a whole number of seconds, otherwise the
  step itself (and `dt` is 1). So `dt` is an integer, as in the paper, and the insertion of one push
  is not rounded twice.
* **Start pose**: the columns of the base matrix are heading, bevel x heading and bevel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ntagen import rules
from ntagen.errors import InputError
from ntagen.render.chance import Around, Chance, chance
from ntagen.render.fixed_point import c_literal, fixed_point
from ntagen.render.frame import Matrix, cross, model_frame, turned
from ntagen.render.moving import Moving, moving, still
from ntagen.render.solids import Solids, solids
from ntagen.rounding import units_per_mm
from ntagen.scene import Region, Scene, Vector, require
from ntagen.shapes import Sphere
from ntagen.units import deg_from_rad
from ntagen.values import dataclass

MIN_ACTIONS = 10
"""The number of log entries in the paper (`MAX_ACT_COUNT`); there are more only if more rolls are
allowed."""


@dataclass(frozen=True, slots=True)
class Row:
    """One row of an initialiser, and its comment."""

    text: str
    note: str


@dataclass(frozen=True, slots=True)
class Spheres:
    """The spheres of one kind of region; a target that is no sphere has a ball around it.

    If there are none, `centers` and `radii` have one row of zeros.
    """

    count: int
    centers: tuple[Row, ...]
    radii: tuple[Row, ...]


@dataclass(frozen=True, slots=True)
class Adversary:
    """What the tissue picks from, as texts: radii of the motion circle, and errors of rolls.

    Attributes:
        radii: From the strongest bend to the weakest.
        nominal_bend: The index of the radius without an error.
        twists: The errors of a roll, in units of ``1 / scale`` rad.
        nominal_twist: The index of no error.
    """

    radii: tuple[str, ...]
    nominal_bend: int
    twists: tuple[str, ...]
    nominal_twist: int


@dataclass(frozen=True, slots=True)
class Features:
    """What the automata of a model depend on; all else stands in its declaration."""

    swept: bool
    moving: bool
    adversary: bool
    spins: bool
    chance: bool


@dataclass(frozen=True, slots=True)
class ModelValues:
    """All values for the templates; lengths are texts in units of ``1 / scale`` mm.

    `spins` are the radii of the motion circle without a spin, and with each one.
    """

    name: str
    frame_note: str
    time_unit: str
    scale: int
    dt: int
    velocity: str
    min_progress: str
    max_progress: str
    max_rolls: int
    max_actions: int
    free_bevel: bool
    angles: tuple[int, ...]
    tip_position: str
    base_matrix: str
    circle_radius: str
    targets: Spheres
    criticals: Spheres
    detections: Spheres
    unexplored: Spheres
    safe: Spheres
    swept: bool
    sweep_margin: int
    only_plans: bool
    solids: Solids
    moving: Moving | None
    adversary: Adversary | None
    spins: tuple[str, ...] = ()
    chance: Chance | None = None

    @property
    def features(self) -> Features:
        """What the automata of this model depend on."""
        return Features(
            self.swept,
            self.moving is not None,
            self.adversary is not None,
            bool(self.spins),
            self.chance is not None,
        )


@dataclass(frozen=True, slots=True)
class _Writer:
    """Converts values of one scene to texts of the declaration."""

    scale: int
    frame: Matrix

    def number(self, value: float, what: str) -> str:
        return c_literal(fixed_point(value, self.scale, what), self.scale)

    def vector(self, value: Vector, what: str) -> str:
        parts = (self.number(part, what) for part in turned(self.frame, value))
        return "{" + ", ".join(parts) + "}"

    def matrix(self, columns: Sequence[Vector], what: str) -> str:
        in_frame = [turned(self.frame, column) for column in columns]
        rows = (
            "{" + ", ".join(self.number(column[i], what) for column in in_frame) + "}"
            for i in range(3)
        )
        return "{" + ", ".join(rows) + "}"

    def spheres(self, regions: Sequence[Region]) -> Spheres:
        if not regions:
            return Spheres(0, (Row("{0, 0, 0}", ""),), (Row("0", ""),))
        centers = tuple(
            Row(self.vector(r.center_mm, f"the centre of {r.name}"), _one_line(r.name))
            for r in regions
        )
        radii = tuple(
            Row(self.number(r.shape.reach_mm(), f"the radius of {r.name}"), _one_line(r.name))
            for r in regions
        )
        return Spheres(len(regions), centers, radii)


def model_values(
    scene: Scene,
    *,
    only_plans: bool = False,
    plan: Sequence[int] | None = None,
    around: Around | None = None,
) -> ModelValues:
    """The values of a scene for the templates.

    Args:
        scene: The scene.
        only_plans: As in `ntagen.render.render`.
        plan: As in `ntagen.render.render_plan`.
        around: As in `ntagen.render.render_policy`.

    Raises:
        InputError: A value does not fit the model's numbers, or the model would not move.
    """
    scene = scene.with_tip_margin()
    if not scene.targets:
        raise InputError("the scene has no target\nhint: add a line such as `target T1 sphere …`")
    if not scene.limits.roll_angles_rad:
        raise InputError("no roll is given\nhint: to forbid rolls, allow them `at most 0 times`")
    scale = units_per_mm(scene)
    scene = replace(scene, resolution_per_mm=scale)
    frame = model_frame(scene.axis)
    writer = _Writer(scale, frame)
    needle, limits = scene.needle, scene.limits
    tip = needle.tip
    _check_motion(scene)
    if scene.tissue.is_adversarial and any(region.motion for region in scene.regions):
        raise InputError(
            "regions that move, and a tissue that answers, cannot be in one task\n"
            "hint: make the tissue static, or the regions as large as where they get"
        )
    tables = solids(scene.avoided, scene.targets, scale, frame)
    breathing = moving(scene, tables.places, frame)
    dt, velocity_mm, unit_s = rules.time_units(limits.step_s, needle.speed_mm_per_s)
    return ModelValues(
        name=_one_line(scene.name),
        frame_note="" if _is_identity(frame) else "The scene was turned so that this is so.",
        time_unit=_time_unit(unit_s, breathing),
        scale=scale,
        dt=dt,
        velocity=writer.number(velocity_mm, "the insertion per unit of time"),
        min_progress=writer.number(limits.min_roll_distance_mm, "the distance between rolls"),
        max_progress=writer.number(needle.length_mm, "the needle's length"),
        max_rolls=limits.max_rolls,
        max_actions=max(MIN_ACTIONS, 2 * (limits.max_rolls + limits.free_bevel) + 2),
        free_bevel=limits.free_bevel,
        # A roll by 0 changes the spin alone.
        angles=tuple(
            _whole_degrees(angle) for angle in limits.roll_angles_rad + (0.0,) * bool(limits.spins)
        ),
        tip_position=writer.vector(tip.position_mm, "the tip's position"),
        base_matrix=writer.matrix(
            (tip.heading, cross(tip.bevel, tip.heading), tip.bevel), "the tip's direction"
        ),
        circle_radius=writer.number(needle.radius_mm, "the radius of the motion circle"),
        targets=writer.spheres(scene.targets),
        criticals=writer.spheres(_balls(still(scene.criticals))),
        detections=writer.spheres(_balls(still(scene.detections))),
        unexplored=writer.spheres(_balls(still(scene.unexplored))),
        safe=writer.spheres(_balls(scene.safe)),
        swept=scene.safety == "swept",
        sweep_margin=_sweep_margin(scale, max(scene.radii_mm)),
        only_plans=only_plans,
        solids=tables,
        moving=breathing,
        adversary=_adversary(scene, writer),
        spins=tuple(
            writer.number(radius_mm, "the radius of the motion circle of a needle that spins")
            for radius_mm in (scene.radii_mm if limits.spins else ())
        ),
        chance=chance(scene, tables, frame, plan, around),
    )


def _adversary(scene: Scene, writer: _Writer) -> Adversary | None:
    """What an adversarial tissue picks from; None for a static one."""
    tissue = scene.tissue
    if tissue.kind != "adversarial":
        return None
    factors, errors = tissue.factors[::-1], tissue.roll_errors_rad
    return Adversary(
        radii=tuple(
            writer.number(scene.needle.radius_mm / factor, "the radius of the motion circle")
            for factor in factors
        ),
        nominal_bend=factors.index(1.0),
        twists=tuple(writer.number(error, "the error of a roll") for error in errors),
        nominal_twist=errors.index(0.0),
    )


def _time_unit(unit_s: float, breathing: Moving | None) -> str:
    """One unit of the clocks, in words."""
    if breathing is not None:
        return breathing.unit
    return "1 s" if unit_s == 1.0 else f"one push: {unit_s:g} s"


def _balls(regions: Sequence[Region]) -> list[Region]:
    """The spheres among some regions; other shapes have tables of their own."""
    return [region for region in regions if isinstance(region.shape, Sphere)]


def _check_motion(scene: Scene) -> None:
    """Refuses a step that the model's numbers cannot represent.

    Raises:
        InputError: The radius or the angle of one step is less than one unit, or a step is too
        long.
    """
    needle, limits, per_mm = scene.needle, scene.limits, units_per_mm(scene)
    push_mm = needle.speed_mm_per_s * limits.step_s
    for radius_mm in scene.radii_mm:
        require(
            rules.fits(radius_mm, per_mm, "the radius of the motion circle")
            or rules.visible(radius_mm, per_mm, "the radius of the motion circle")
            or rules.fits(push_mm, per_mm, "a push")
            or rules.motion(
                limits.step_s,
                needle.speed_mm_per_s,
                radius_mm,
                per_mm,
                swept=scene.safety == "swept",
            )
        )


def _sweep_margin(scale: int, radius_mm: float) -> int:
    """By how many units regions are enlarged for the swept check.

    The rounding of a position on the motion circle is less than 11 units of a direction, times the
    radius, plus 2 units; templates/uppaal/sweep.c.jinja derives it.
    """
    radius = fixed_point(radius_mm, scale, "the radius of the motion circle")
    return -(-11 * radius // scale) + 2


def _whole_degrees(angle_rad: float) -> int:
    """An angle as a whole number of degrees, for the model.

    Raises:
        InputError: It is not a whole number of degrees.
    """
    angle_deg = deg_from_rad(angle_rad)
    whole = round(angle_deg)
    if abs(angle_deg - whole) > rules.WHOLE_TOLERANCE * 360.0:
        raise InputError(
            f"a roll of {angle_deg:g} deg is not a whole number of degrees\nhint: use whole degrees"
        )
    return whole


def _is_identity(frame: Matrix) -> bool:
    return frame == ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def _one_line(text: str) -> str:
    """A name in a form that is safe in a line comment."""
    return " ".join(text.split())
