"""What measured positions can be true, by the motions that were commanded.

Between two measurements the tip moves at most as far as the needle was pushed and pulled, whatever
the tissue does. A position that is farther away than that, and than noise explains, is wrong: the
tracker takes another tool for the needle, or its reference was moved. To steer by it would be to
steer another needle.

A tracker may show the needle as it was before its last motion, so the motions since the measurement
before the last one count.
"""

from __future__ import annotations

from typing import Final

from ntagen.drive.settings import Settings
from ntagen.errors import DeviceError
from ntagen.needle.measurement import Measurement
from ntagen.needle.vectors import distance

_SIGMAS: Final = 8.0
"""The difference of two readings is longer than this by noise alone once in 10^6 runs: it has twice
the variance, in three directions."""

_TISSUE_MM: Final = 3.0
"""Tissue that is pressed or breathes carries the tip by this much between two readings; ours."""


class Reach:
    """What the next measured position can be.

    Args:
        settings: The noise of the tracker, and the deviation that is allowed.
    """

    def __init__(self, settings: Settings) -> None:
        priors = settings.priors
        noise_mm = priors.noise_mm + priors.distortion_mm
        tissue_mm = max(_TISSUE_MM, settings.deviation_mm)
        self._spare_mm = tissue_mm + settings.overrun_mm + _SIGMAS * noise_mm
        self._last: Measurement | None = None
        self._way_mm = 0.0
        self._way_before_mm = 0.0

    def moved(self, length_mm: float) -> None:
        """Notes a push or a pull of at most this length."""
        self._way_mm += length_mm

    def require(self, found: Measurement) -> None:
        """Takes a measurement.

        Raises:
            DeviceError: The tip cannot be there.
        """
        last, self._last = self._last, found
        way_mm = self._way_mm + self._way_before_mm
        self._way_before_mm, self._way_mm = self._way_mm, 0.0
        if last is None:
            return
        jump_mm = distance(found.position_mm, last.position_mm)
        if not jump_mm <= way_mm + self._spare_mm:
            raise DeviceError(
                f"the measured tip jumped by {jump_mm:.1f} mm, but the needle was moved by "
                f"{way_mm:.2f} mm at most; {self._spare_mm:.1f} mm more is allowed\n"
                "hint: does the tracker take another tool for the needle, was its reference moved, "
                "or has it more noise than the settings say?"
            )
