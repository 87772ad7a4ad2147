"""What a projection only seems to show: a path through a region that it passes in front of.

A projection has no depth, so the path of a plan may cross the outline of a region that it does not
touch. The note above a projection then has the true distance. It is that of the drawn points, which
are half a millimetre apart; the certificate of a plan has the exact one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from ntagen.scene import Region, Vector

if TYPE_CHECKING:
    from matplotlib.patches import Patch

_AXES: Final = "xyz"
_NAMED: Final = 2
"""A note names at most this many regions, the nearest ones."""


@dataclass(frozen=True, slots=True)
class Seeming:
    """A path that a projection seems to lead through a region.

    Attributes:
        region: The name of the region.
        distance_mm: The smallest distance of the path to the region.
        side: On which side of the region the path passes, along the axis that is not seen.
    """

    region: str
    distance_mm: float
    side: str


def seeming(
    curve: Sequence[Vector], region: Region, outline: Patch, shown: tuple[int, int]
) -> Seeming | None:
    """What a projection on the axes `shown` makes of a path and a region.

    Returns:
        None if the path does not cross the outline of the region, or truly touches the region, or
        if the region moves, so that its distance depends on the time.
    """
    import numpy as np

    if not curve or region.motion is not None or region.kind in ("target", "safe"):
        return None
    points = np.array(curve)
    drawn = outline.get_path().transformed(outline.get_patch_transform())
    inside = drawn.contains_points(points[:, list(shown)])
    distances_mm = region.shape.distance_mm(points)
    if not inside.any() or distances_mm.min() <= 0.0:
        return None
    along = next(axis for axis in range(3) if axis not in shown)
    nearest = points[inside][np.argmin(distances_mm[inside])]
    side = "+" if nearest[along] >= region.center_mm[along] else "-"
    return Seeming(region.name, float(distances_mm.min()), f"{side}{_AXES[along]}")


def note_of(found: Sequence[Seeming], label: str) -> str:
    """The note above a projection; empty without anything to note.

    Args:
        found: What seems to be crossed.
        label: What the path is called.
    """
    if not found:
        return ""
    nearest = sorted(found, key=lambda one: one.distance_mm)
    named = [
        f"{one.region} {one.distance_mm:.2f} mm away, on its {one.side} side" for one in nearest
    ]
    lines = [f"{label}: not through, but past", *named[:_NAMED]]
    if len(named) > _NAMED:
        lines.append(f"and past {len(named) - _NAMED} more, farther away")
    return "\n".join(lines)
