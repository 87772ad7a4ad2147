"""The names that UPPAAL's XML has for the labels of locations and edges."""

from __future__ import annotations

from typing import Final

from ntagen.build.parts import LabelKind

LOCATION_LABELS: Final[dict[str, LabelKind]] = {
    "invariant": "invariant",
    "exponentialrate": "rate",
    "comments": "comment",
}

EDGE_LABELS: Final[dict[str, LabelKind]] = {
    "select": "select",
    "guard": "guard",
    "synchronisation": "sync",
    "assignment": "update",
    "probability": "weight",
    "comments": "comment",
}
