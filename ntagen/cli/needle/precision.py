"""What `ntagen info` says of the resolution of a task's model, and of its rounding."""

from __future__ import annotations

import math

from ntagen.rounding import MOST_ERROR_MM, least_margin, precision_of
from ntagen.scene import Scene


def precision_facts(scene: Scene) -> dict[str, object]:
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


def precision_line(scene: Scene) -> str:
    """The line for people."""
    found, is_chosen = precision_of(scene), scene.resolution_per_mm is None
    origin = "written in the file"
    if is_chosen:
        is_fine = found.path_error_mm <= MOST_ERROR_MM
        origin = "chosen" if is_fine else "the best one that fits into the model's integers"
    depth = f"down to {found.depth_mm:g} mm"
    return f"resolution: {found.per_mm} per mm, {origin}: {found.bound}, {depth}"


def spins_line(scene: Scene) -> str | None:
    """The spins with their radii, for people; None without one."""
    if not scene.limits.spins:
        return None
    circles = (
        f"{100.0 * spin:g} % (radius {scene.needle.radius_mm / (1.0 - spin):.4g} mm)"
        for spin in scene.limits.spins
    )
    return f"the needle may spin for {', '.join(circles)} of a push"


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
