"""What no format but UPPAAL's has: refused before anything is written."""

from __future__ import annotations

from typing import Final

from ntagen import checker
from ntagen.convert.network import refuse

_REFUSED: Final = {
    "priorities": ("priorities", "write them as guards, or delete the priorities"),
    "urgent-channels": ("urgent channels", "use an urgent location before the synchronisation"),
    "stopwatches": ("stopwatches", "use clocks that always run"),
    "hybrid-clocks": ("hybrid clocks", "use integers, or check the model with ntagen only"),
    "doubles": ("doubles", "use integers, or check the model with ntagen only"),
}
"""Features of a model that no format here has, with what to do."""


def require_exchangeable(model: checker.Model, path: str) -> None:
    """Refuses features that no other format has, each with its place if it has one.

    Raises:
        InputError: The model has one of them.
    """
    for feature in model.features:
        if feature not in _REFUSED:
            continue
        words, way_out = _REFUSED[feature]
        place = path
        if feature == "urgent-channels":
            place = f"{path}: channel {next(one.name for one in model.channels if one.urgent)}"
        elif feature == "hybrid-clocks":
            place = f"{path}: clock {next(one.name for one in model.clocks if one.hybrid)}"
        refuse(place, f"the format has no {words}", way_out)
    for one in model.variables:
        if "double" in one.type:
            refuse(f"{path}: variable {one.name}", "the format has no doubles", "use integers")
        if "scalar" in one.type:
            refuse(
                f"{path}: variable {one.name}",
                "the format has no scalar sets",
                "declare the type as int[0,N-1]",
            )
        if one.meta:
            refuse(
                f"{path}: variable {one.name}", "the format has no meta variables", "delete `meta`"
            )
