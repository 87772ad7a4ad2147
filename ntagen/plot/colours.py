"""The colours of regions and paths, the same in all pictures."""

from __future__ import annotations

from typing import Final

NEEDLE: Final = "#1f5fbf"
OTHER: Final = "#8a94a6"
TRUE: Final = "#0b2545"
EXPECTED: Final = "#ffc93c"
MEASURED: Final = "#7a3e9d"
SHAFT: Final = "#56657a"

DARK: Final = {
    NEEDLE: "#7fb0ff",
    TRUE: "#e3ebf7",
    EXPECTED: "#b58900",
    MEASURED: "#cf9df0",
    SHAFT: "#aab6c6",
}
"""What is drawn in the dark instead of colours that are hard to see there."""

REGIONS: Final = {
    "target": "#2a9d4a",
    "critical": "#c8283c",
    "detection": "#e8890c",
    "unexplored": "#5b6472",
    "safe": "#3fa7a0",
}
"""The colours of the kinds of regions."""
OUTLINES: Final = {"detection": (0, (4, 2)), "safe": (0, (1, 2))}
"""The kinds that are drawn as outlines, and their dashes."""
