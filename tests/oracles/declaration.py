"""The needle model of the paper in plain Python: an oracle for the generated model.

Written from the appendix of "Modeling R^3 Needle Steering in Uppaal" (arXiv 2203.09884); where the
paper is silent about guards it follows the table in templates/README.md. It shares no code with the
templates or the renderer, and takes nothing from them but the names of the variables.

Integers are Python's, so nothing overflows here; doubles are IEEE doubles on both sides, so equal
orders of operations give equal bits. `math.trunc` is UPPAAL's ``fint``.
"""

from __future__ import annotations

import copy
import enum
import math
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction

from ntagen.scene import Scene

Vec = list[int]
Mat = list[list[int]]

GLOBAL_X, GLOBAL_Y, GLOBAL_Z, TIP_X, TIP_Y, TIP_Z, TEMP_VEC_1, TEMP_VEC_2 = range(8)
ID, TIP_BASE, TIP_CIRCLE, TIP_ACTION, TIP, TEMP_MAT_1 = range(6)
PUSH_ACTION, ROLL_ROTATE_ACTION = 0, 1


class End(enum.Enum):
    """Where a path ends, by the name of the Checker's location."""

    PATH_INVALID = "Path_Invalid"
    FINAL_TR_REACHED = "Final_TR_Reached"
    TR_UNREACHABLE = "TR_Unreachable"
    UR_REACHED = "UR_Reached"


@dataclass(frozen=True)
class Sphere:
    """A region in units."""

    center: tuple[int, int, int]
    radius: int


Contains = Callable[[tuple[float, float, float]], bool]
"""Whether a solid that is no sphere contains a point in mm."""


@dataclass(frozen=True)
class Instance:
    """The constants of a model, all in its units.

    `solids` are to be avoided; `goals` are the targets if they are no spheres: the solid, and where
    it ends below in mm.
    """

    scale: int = 1000
    dt: int = 2
    velocity: int = 1000
    circle_r: int = 30_000
    min_progress: int = 2000
    max_progress: int = 200_000
    max_rolls: int = 2
    angles: tuple[int, ...] = (90, 180, 270)
    tip: tuple[int, int, int] = (0, 0, 0)
    base: tuple[tuple[int, int, int], ...] = ((0, 1000, 0), (-1000, 0, 0), (0, 0, 1000))
    targets: tuple[Sphere, ...] = (Sphere((0, -50_000, 0), 10_000),)
    criticals: tuple[Sphere, ...] = (Sphere((0, -25_000, 0), 2_000),)
    detections: tuple[Sphere, ...] = (Sphere((0, -25_000, 0), 5_000),)
    unexplored: tuple[Sphere, ...] = ()
    solids: tuple[Contains, ...] = ()
    goals: tuple[tuple[Contains, float], ...] = ()

    @property
    def max_actions(self) -> int:
        """Entries of the log."""
        return max(10, 2 * self.max_rolls + 2)

    @classmethod
    def of_scene(cls, scene: Scene) -> Instance:
        """The constants of a scene that is inserted along -y in steps of whole seconds."""
        if scene.axis != (0.0, -1.0, 0.0) or not scene.limits.step_s.is_integer():
            raise ValueError("the oracle knows scenes along -y in whole seconds only")

        def units(value: float) -> int:
            return round(Fraction(value) * scene.resolution_per_mm)

        def sphere(center: tuple[float, float, float], radius: float) -> Sphere:
            x, y, z = center
            return Sphere((units(x), units(y), units(z)), units(radius))

        tip = scene.needle.tip
        (hx, hy, hz), (bx, by, bz) = tip.heading, tip.bevel
        third = (by * hz - bz * hy, bz * hx - bx * hz, bx * hy - by * hx)
        columns = (tip.heading, third, tip.bevel)
        rows = [[units(column[i]) for column in columns] for i in range(3)]
        x, y, z = tip.position_mm
        return cls(
            scale=scene.resolution_per_mm,
            dt=int(scene.limits.step_s),
            velocity=units(scene.needle.speed_mm_per_s),
            circle_r=units(scene.needle.radius_mm),
            min_progress=units(scene.limits.min_roll_distance_mm),
            max_progress=units(scene.needle.length_mm),
            max_rolls=scene.limits.max_rolls,
            angles=tuple(round(math.degrees(angle)) for angle in scene.limits.roll_angles_rad),
            tip=(units(x), units(y), units(z)),
            base=tuple((row[0], row[1], row[2]) for row in rows),
            targets=tuple(sphere(r.center_mm, r.radius_mm) for r in scene.targets),
            criticals=tuple(sphere(r.center_mm, r.radius_mm) for r in scene.criticals),
            detections=tuple(sphere(r.center_mm, r.radius_mm) for r in scene.detections),
            unexplored=tuple(sphere(r.center_mm, r.radius_mm) for r in scene.unexplored),
        )


@dataclass
class Needle:
    """The variables of the declaration, under its names, and the functions that change them."""

    instance: Instance
    actions: list[Vec] = field(default_factory=list)
    curr_ACT_index: int = 0  # noqa: N815  the declaration's name
    ROT_counter: int = 0
    prev_ROT_index: int = -1  # noqa: N815
    sel_rot_angle: int = 0
    curr_TR_index: int = 0  # noqa: N815
    needle_progress: int = 0
    tip_pos: Vec = field(default_factory=list)
    tip_roll: int = 0
    motion_circle_center: Vec = field(default_factory=lambda: [0, 0, 0])
    motion_circle_yaw: int = 0
    vectors: list[Vec] = field(default_factory=list)
    matrices: list[Mat] = field(default_factory=list)
    CR_reached: bool = False
    TR_reached: bool = False
    TR_reachable: bool = False
    path_valid: bool = False

    @classmethod
    def start(cls, instance: Instance) -> Needle:
        """The needle after the User's first move: ``initialize()``."""
        one = instance.scale
        needle = cls(instance)
        needle.actions = [[0, 0, 0] for _ in range(instance.max_actions)]
        needle.tip_pos = list(instance.tip)
        needle.vectors = [[one if i == axis else 0 for i in range(3)] for axis in range(3)]
        needle.vectors += [[0, 0, 0] for _ in range(5)]
        needle.matrices = [
            [[one if i == j else 0 for j in range(3)] for i in range(3)] for _ in range(5)
        ]
        needle.matrices.append([[0, 0, 0] for _ in range(3)])
        needle.matrices[TIP_BASE] = [list(row) for row in instance.base]
        needle._update_circle_center()
        return needle

    def copy(self) -> Needle:
        """A needle that can move on alone."""
        twin = copy.copy(self)
        twin.actions = [list(entry) for entry in self.actions]
        twin.tip_pos = list(self.tip_pos)
        twin.motion_circle_center = list(self.motion_circle_center)
        twin.vectors = [list(vector) for vector in self.vectors]
        twin.matrices = [[list(row) for row in matrix] for matrix in self.matrices]
        return twin

    def variables(self) -> dict[str, object]:
        """The variables by name, nested as they are declared."""
        return {name: value for name, value in vars(self).items() if name != "instance"}

    # Moves: what the Needle does when it is told to.

    def push(self) -> None:
        """``step()``."""
        scale = float(self.instance.scale)
        delta = math.trunc(self.instance.velocity / scale * self.instance.dt * scale)
        yaw = math.trunc(delta / scale / (self.instance.circle_r / scale) * scale)
        self.needle_progress += delta
        self.motion_circle_yaw += yaw
        self._update_tip_pos()

    def roll(self, angle_deg: int) -> None:
        """The choice of an angle, both entries of the log, and ``rotate_deg()``."""
        self.sel_rot_angle = angle_deg
        before = self.actions[self.curr_ACT_index - 1][0] if self.curr_ACT_index else 0
        self._log(before, PUSH_ACTION, self.needle_progress - before)
        self.prev_ROT_index = self.curr_ACT_index
        self._log(self.needle_progress, ROLL_ROTATE_ACTION, angle_deg)
        self.tip_roll = math.trunc(angle_deg / 180.0 * math.pi * self.instance.scale)
        self.fold()
        self.ROT_counter += 1

    def fold(self) -> None:
        """What ``rotate_rad()`` and ``pick()`` do with ``tip_roll``."""
        self._rotation(TIP_X, self.tip_roll, TIP_ACTION)
        self._update_circle_center()
        self._update_tip_rotation()
        self.matrices[TIP_BASE] = [list(row) for row in self.matrices[TIP]]
        self.matrices[TIP_CIRCLE] = [list(row) for row in self.matrices[ID]]
        self.matrices[TIP_ACTION] = [list(row) for row in self.matrices[ID]]
        self.motion_circle_yaw = 0

    def may_roll(self) -> bool:
        """Whether rolls are left, and the last one lies far enough behind."""
        if self.ROT_counter >= self.instance.max_rolls:
            return False
        if self.prev_ROT_index < 0:
            return True
        since = self.needle_progress - self.actions[self.prev_ROT_index][0]
        return since >= self.instance.min_progress

    # Checks: what the Checker does, in its order.

    def check(self) -> End | None:
        """One round of the Checker: the end of the path, or nothing if it may go on."""
        is_in_reach = self.needle_progress <= self.instance.max_progress
        self.path_valid = self.vectors[TIP_X][1] <= 0 and is_in_reach
        if not self.path_valid:
            return End.PATH_INVALID
        target = self.instance.targets[self.curr_TR_index]
        squares = (math.pow(c - p, 2) for c, p in zip(target.center, self.tip_pos, strict=True))
        self.TR_reached = math.sqrt(_sum(squares)) - target.radius <= 0
        x, y, z = (part / self.instance.scale for part in self.tip_pos)
        goals = self.instance.goals
        if goals:
            self.TR_reached = goals[self.curr_TR_index][0]((x, y, z))
        if self.TR_reached:
            self.curr_TR_index += 1
            if self.curr_TR_index == len(self.instance.targets):
                return End.FINAL_TR_REACHED
            target = self.instance.targets[self.curr_TR_index]
        self.TR_reachable = self.tip_pos[1] >= target.center[1] - target.radius
        if goals:
            self.TR_reachable = y >= goals[self.curr_TR_index][1]
        if not self.TR_reachable:
            return End.TR_UNREACHABLE
        instance = self.instance
        harmful = (*instance.criticals, *instance.unexplored, *instance.detections)
        self.CR_reached = any(self._touches(sphere) for sphere in harmful)
        self.CR_reached |= any(contains((x, y, z)) for contains in instance.solids)
        return End.UR_REACHED if self.CR_reached else None

    def _touches(self, sphere: Sphere) -> bool:
        scale = float(self.instance.scale)
        squares = (
            math.pow(c / scale - p / scale, 2)
            for c, p in zip(sphere.center, self.tip_pos, strict=True)
        )
        return math.trunc(math.sqrt(_sum(squares)) * scale) - sphere.radius <= 0

    # Arithmetic: the appendix, operation by operation.

    def _log(self, *entry: int) -> None:
        self.actions[self.curr_ACT_index] = list(entry)
        self.curr_ACT_index += 1

    def _matrix_matrix(self, left: int, right: int, out: int) -> None:
        a, b, scale = self.matrices[left], self.matrices[right], float(self.instance.scale)
        self.matrices[out] = [
            [
                sum(math.trunc(((a[i][k] / scale) * (b[k][j] / scale)) * scale) for k in range(3))
                for j in range(3)
            ]
            for i in range(3)
        ]

    def _matrix_vector(self, matrix: int, vector: int, out: int) -> None:
        m, v, scale = self.matrices[matrix], self.vectors[vector], float(self.instance.scale)
        self.vectors[out] = [
            sum(math.trunc(((m[i][k] / scale) * (v[k] / scale)) * scale) for k in range(3))
            for i in range(3)
        ]

    def _normalise(self, vector: int) -> None:
        v, scale = self.vectors[vector], float(self.instance.scale)
        length = math.trunc(math.sqrt(_sum(math.pow(part / scale, 2) for part in v)) * scale)
        if length:
            self.vectors[vector] = [
                math.trunc((part / scale) / (length / scale) * scale) for part in v
            ]

    def _rotation(self, axis: int, angle: int, out: int) -> None:
        scale = float(self.instance.scale)
        x, y, z = (part / scale for part in self.vectors[axis])
        c, s = math.cos(angle / scale), math.sin(angle / scale)
        rows = (
            (c + math.pow(x, 2) * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s),
            (y * x * (1 - c) + z * s, c + math.pow(y, 2) * (1 - c), y * z * (1 - c) - x * s),
            (z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + math.pow(z, 2) * (1 - c)),
        )
        self.matrices[out] = [[math.trunc(entry * scale) for entry in row] for row in rows]

    def _update_tip_rotation(self) -> None:
        self._matrix_matrix(TIP_CIRCLE, TIP_BASE, TEMP_MAT_1)
        self._matrix_matrix(TIP_ACTION, TEMP_MAT_1, TIP)

    def _update_axes(self) -> None:
        for world, tip in ((GLOBAL_X, TIP_X), (GLOBAL_Y, TIP_Y), (GLOBAL_Z, TIP_Z)):
            self._matrix_vector(TIP, world, tip)
            self._normalise(tip)

    def _update_circle_center(self) -> None:
        self._update_tip_rotation()
        self._update_axes()
        scale = float(self.instance.scale)
        radius = self.instance.circle_r / scale
        self.motion_circle_center = [
            math.trunc((p / scale - radius * (z / scale)) * scale)
            for p, z in zip(self.tip_pos, self.vectors[TIP_Z], strict=True)
        ]

    def _update_tip_pos(self) -> None:
        self._matrix_vector(TIP_BASE, GLOBAL_Y, TEMP_VEC_1)
        self._normalise(TEMP_VEC_1)
        self._rotation(TEMP_VEC_1, self.motion_circle_yaw, TIP_CIRCLE)
        self._matrix_vector(TIP_BASE, GLOBAL_Z, TEMP_VEC_1)
        self._matrix_vector(TIP_CIRCLE, TEMP_VEC_1, TEMP_VEC_2)
        scale = float(self.instance.scale)
        radius = self.instance.circle_r / scale
        self.tip_pos = [
            math.trunc((c / scale + (v / scale) * radius) * scale)
            for c, v in zip(self.motion_circle_center, self.vectors[TEMP_VEC_2], strict=True)
        ]
        self._update_tip_rotation()
        self._update_axes()


def _sum(values: Iterator[float]) -> float:
    """A sum from left to right; the built-in one compensates rounding from Python 3.12 on."""
    total = 0.0
    for value in values:
        total += value
    return total


@dataclass
class Census:
    """What an enumeration of all paths found.

    Attributes:
        nodes: States at which a decision is due or a path ends.
        ends: How many paths ended where.
    """

    nodes: int = 0
    ends: Counter[End] = field(default_factory=Counter)

    @property
    def plans(self) -> int:
        """Paths to the final target."""
        return self.ends[End.FINAL_TR_REACHED]


def enumerate_paths(instance: Instance) -> Census:
    """Walks every sequence of pushes and rolls that the guards allow."""
    census = Census()
    waiting = [Needle.start(instance)]
    while waiting:
        needle = waiting.pop()
        census.nodes += 1
        end = needle.check()
        if end is not None:
            census.ends[end] += 1
            continue
        if needle.may_roll():
            for angle in instance.angles:
                rolled = needle.copy()
                rolled.roll(angle)
                waiting.append(rolled)
        needle.push()
        waiting.append(needle)
    return census
