"""How fast a lab may run."""

from __future__ import annotations

from typing import Final

SLOWEST: Final = 0.01
"""A lab runs at least so many times as fast as real time."""

FASTEST: Final = 100.0
"""A lab runs at most so many times as fast as real time."""
