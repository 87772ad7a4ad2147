"""What no format but UPPAAL's has: refused before anything is written."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from ntagen import checker
from ntagen.convert.network import refuse

if TYPE_CHECKING:
    from ntagen import build

_SHARED: Final = frozenset(
    {
        *("broadcast-channels", "urgent-locations", "committed-locations", "select-bindings"),
        *("branch-points", "uncontrollable-edges", "clock-differences", "clock-copies"),
        *("strict-invariants", "clock-guards-on-receivers", "exponential-rates", "structs"),
    }
)
"""Features that a format has, or refuses where they are used."""

_WAYS_OUT: Final = {
    "priorities": "write them as guards, or delete the priorities",
    "urgent-channels": "use an urgent location before the synchronisation",
    "stopwatches": "use clocks that always run",
    "hybrid-clocks": "use integers, or check the model with ntagen only",
    "doubles": "use integers, or check the model with ntagen only",
    "scalars": "declare the type as int[0,N-1]",
    "meta-variables": "delete `meta`",
    "before-update": "write into each update what it does",
    "after-update": "write into each update what it does",
}


def require_exchangeable(model: checker.Model, written: build.Model, path: str, tool: str) -> None:
    """Refuses features that no other format has, each with its place if it has one.

    Raises:
        InputError: The model has one of them.
    """
    for feature in model.features:
        if feature not in _SHARED:
            words = feature.replace("-", " ")
            way_out = _WAYS_OUT.get(feature, "do without, or check the model with ntagen only")
            refuse(f"{path}{_place(model, feature)}", f"{tool} has no {words}", way_out)
    for one in model.variables:
        if "double" in one.type:
            refuse(f"{path}: variable {one.name}", f"{tool} has no doubles", _WAYS_OUT["doubles"])
    texts = {"": written.declarations}
    texts |= {f": template {one.name}": one.declarations for one in written.templates}
    for place, text in texts.items():
        plain = re.sub(r"//[^\n]*|/\*.*?\*/", " ", text, flags=re.DOTALL)
        if found := re.search(r"\bclock\b[^;=]*\b(\w+)\s*=", plain):
            refuse(
                f"{path}{place}, clock {found[1]}",
                f"clocks of {tool} begin with 0",
                "let the first edge, from a committed location, set it",
            )


def _place(model: checker.Model, feature: str) -> str:
    """Where a feature is used first; empty if it is used nowhere in particular."""
    named = {
        "urgent-channels": ("channel", [one.name for one in model.channels if one.urgent]),
        "hybrid-clocks": ("clock", [one.name for one in model.clocks if one.hybrid]),
        "scalars": ("variable", [one.name for one in model.variables if "scalar" in one.type]),
        "meta-variables": ("variable", [one.name for one in model.variables if one.meta]),
    }
    kind, names = named.get(feature, ("", []))
    return f": {kind} {names[0]}" if names else ""
