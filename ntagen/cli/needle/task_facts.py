"""What `ntagen info` says of a task: its regions, the precision of its model, its settings.

Of regions it says shape, volume, bounds, and the distance to the straight way.
The straight way leads from the tip to the middle of the last target. A needle bends, so a plan may
come nearer or stay away; but what lies on the straight way is what plans must get around.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

from ntagen.cli.terminal import aligned
from ntagen.drive.configure import configure
from ntagen.motion import Motion
from ntagen.needle.kinematics import Arc
from ntagen.needle.nearest import nearest_to
from ntagen.nsl import Task
from ntagen.parameters import PARAMETERS
from ntagen.rounding import MOST_ERROR_MM, least_margin, precision_of
from ntagen.scene import Pose, Region, Scene
from ntagen.shapes import Field, Vector
from ntagen.units import deg_from_rad

_MM3_PER_CM3: Final = 1000.0


def task_facts(task: Task) -> dict[str, object]:
    """The entries for JSON; what is infinite is null."""
    configuration = configure(task.given, task.scene)
    return {
        **_precision_facts(task.scene),
        "spins": list(task.scene.limits.spins),
        "settings": {
            parameter.words: {
                "field": parameter.field,
                "value": configuration.value(parameter),
                "shown": parameter.shown(configuration.value(parameter)),
                "origin": configuration.origin(parameter),
            }
            for parameter in PARAMETERS
        },
        "regions": _region_facts(task.scene),
    }


def task_lines(task: Task, most: int) -> Iterator[str]:
    """Regions, precision and devices of a task for people; `most` limits the list of regions."""
    kinds = [region.kind for region in task.scene.regions]
    counts = [f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds)]
    yield f"\nregions: {', '.join(counts)}"
    yield from (f"  {row}" for row in _region_rows(task.scene, most))
    yield _precision_line(task.scene)
    if task.scene.limits.spins:
        yield _spins_line(task.scene)
    yield from (str(device) for device in (task.device, task.tracker) if device is not None)


def _precision_facts(scene: Scene) -> dict[str, object]:
    """The entries for JSON; what is infinite is null."""
    found = precision_of(scene)
    return {
        "resolution_per_mm": found.per_mm,
        "resolution_origin": "chosen" if scene.resolution_per_mm is None else "file",
        "path_error_mm": _finite(found.path_error_mm),
        "depth_mm": found.depth_mm,
        "circle_error_mm": _finite(found.circle_error_mm),
        "least_margin_mm": _finite(least_margin(scene)[0]),
    }


def _precision_line(scene: Scene) -> str:
    """The line for people."""
    found, is_chosen = precision_of(scene), scene.resolution_per_mm is None
    origin = "written in the file"
    if is_chosen:
        is_fine = found.path_error_mm <= MOST_ERROR_MM
        origin = "chosen" if is_fine else "the best one that fits into the model's integers"
    depth = f"down to {found.depth_mm:g} mm"
    return f"resolution: {found.per_mm} per mm, {origin}: {found.bound}, {depth}"


def _spins_line(scene: Scene) -> str:
    """The spins with their radii, for people."""
    circles = (
        f"{100.0 * spin:g} % (radius {scene.needle.radius_mm / (1.0 - spin):.4g} mm)"
        for spin in scene.limits.spins
    )
    return f"the needle may spin for {', '.join(circles)} of a push"


def _region_facts(scene: Scene) -> list[dict[str, object]]:
    """The regions for JSON; what is infinite is null. Lengths are in mm, volumes in mm^3."""
    way = _straight_way(scene)
    return [
        {
            "name": region.name,
            "kind": region.kind,
            "shape": _word(region),
            "volume_mm3": _finite(region.shape.volume_mm3()),
            "low_mm": [_finite(part) for part in region.shape.bounds_mm()[0]],
            "high_mm": [_finite(part) for part in region.shape.bounds_mm()[1]],
            "from_straight_way_mm": _away_mm(region, way),
            "error_mm": region.shape.error_mm,
            **({} if region.motion is None else {"moves": _motion(region.motion)}),
        }
        for region in scene.regions
    ]


def _region_rows(scene: Scene, most: int) -> Iterator[str]:
    """The first regions as lines of a table with aligned columns, `most` of them at most."""
    regions = scene.regions[:most]
    way = _straight_way(scene)
    rows = [["region", "kind", "shape", "volume", "x mm", "y mm", "z mm", "from the straight way"]]
    rows += [
        [
            " ".join(region.name.split()),
            region.kind,
            _word(region),
            _volume(region.shape.volume_mm3()),
            *_ranges(region),
            f"{_away_mm(region, way):.2f} mm",
        ]
        for region in regions
    ]
    yield from aligned(rows)
    for region in regions:
        if isinstance(region.shape, Field):
            yield f"{' '.join(region.name.split())}: {_exactness(region.shape)}"
    for region in regions:
        if region.motion is not None:
            yield f"{' '.join(region.name.split())}: at rest above; {_motion(region.motion)}"
    if len(scene.regions) > most:
        yield f"… {len(scene.regions) - most} more (all of them: --json)"


def _motion(motion: Motion) -> str:
    """How a region moves, in words."""
    every = f"every {motion.period_s:g} s, at most {motion.speed_mm_per_s:.3g} mm/s"
    if motion.table:
        return f"moves up to {motion.reach_mm:.3g} mm, by a table, {every}"
    way = ", ".join(f"{part:.3g}" for part in motion.way_mm)
    phase_deg = deg_from_rad(motion.phase_rad)
    return f"moves by ({way}) mm and back {every}; phase {phase_deg:.4g} deg"


def _exactness(shape: Field) -> str:
    """How fine a field is, and how far its distances may be off."""
    size = " x ".join(map(str, shape.counts))
    steps = " x ".join(f"{step:.2g}" for step in shape.steps_mm)
    return (
        f"a grid of {size} points, {steps} mm apart; distances are at most"
        f" {shape.error_mm:.2f} mm too {'great' if shape.is_inner else 'small'}, never too"
        f" {'small' if shape.is_inner else 'great'}"
    )


def _straight_way(scene: Scene) -> Sequence[Arc]:
    """From the tip to the middle of the last target; nothing if the tip is there already."""
    start = scene.needle.tip.position_mm
    end = scene.targets[-1].center_mm
    length_mm = math.dist(start, end)
    if length_mm <= 0.0:
        return [Arc(scene.needle.tip, math.inf, 0.0)]
    x, y, z = ((b - a) / length_mm for a, b in zip(start, end, strict=True))
    # A straight way has no bevel.
    return [Arc(Pose(start, (x, y, z), (0.0, 0.0, 0.0)), math.inf, length_mm)]


def _away_mm(region: Region, way: Sequence[Arc]) -> float:
    start: Vector = way[0].start.position_mm
    return nearest_to(way, start, region.shape).distance_mm


def _word(region: Region) -> str:
    return type(region.shape).__name__.lower()


def _volume(volume_mm3: float) -> str:
    if math.isinf(volume_mm3):
        return "infinite"
    if volume_mm3 < _MM3_PER_CM3:
        return f"{volume_mm3:.4g} mm^3"
    return f"{volume_mm3 / _MM3_PER_CM3:.4g} cm^3"


def _ranges(region: Region) -> list[str]:
    low, high = region.shape.bounds_mm()
    return [f"{_end(a)} to {_end(b)}" for a, b in zip(low, high, strict=True)]


def _end(value_mm: float) -> str:
    if math.isinf(value_mm):
        return "infinity" if value_mm > 0.0 else "-infinity"
    return f"{round(value_mm, 2) + 0.0:g}"


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
