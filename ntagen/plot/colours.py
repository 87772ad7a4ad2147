"""The colours of paths, the same in all pictures."""

from __future__ import annotations

from typing import Final

NEEDLE: Final = "#1f5fbf"
OTHER: Final = "#8a94a6"
TRUE: Final = "#0b2545"
EXPECTED: Final = "#ffc93c"
MEASURED: Final = "#7a3e9d"
