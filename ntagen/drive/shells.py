"""The shells of critical regions: the detection regions in which the needle feels them."""

from __future__ import annotations

from collections.abc import Iterable

from ntagen.scene import Region
from ntagen.shapes import thickness_mm


def shells_of(critical: Region, detections: Iterable[Region]) -> tuple[Region, ...]:
    """The detection regions of a critical region: written around it, or containing it."""
    return tuple(
        shell
        for shell in detections
        if shell.around == critical.name or thickness_mm(shell.shape, critical.shape) >= 0.0
    )


def sensing_margin_mm(critical: Region, detections: Iterable[Region], otherwise_mm: float) -> float:
    """The distance at which a critical region is felt: the depth of its thinnest shell."""
    return min(
        (thickness_mm(shell.shape, critical.shape) for shell in shells_of(critical, detections)),
        default=otherwise_mm,
    )
