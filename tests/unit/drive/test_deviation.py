"""Deviation against noise: seldom by noise alone, and found when it is there."""

from __future__ import annotations

import numpy as np
import pytest

from ntagen.drive.deviation import DeviationMonitor, window
from ntagen.drive.settings import Settings
from ntagen.needle.estimate import Priors

LENGTH_MM = 60.0


def alarm_at(noise_mm: float, off_mm: float, seed: int) -> int | None:
    """The number of measurements until an alarm; the tip is off by a distance from the start."""
    settings = Settings(priors=Priors(noise_mm=noise_mm))
    monitor = DeviationMonitor(settings, LENGTH_MM)
    rng = np.random.default_rng(seed)
    for count in range(1, int(LENGTH_MM / settings.spacing_mm)):
        x, y, z = (float(c) for c in rng.normal(0.0, noise_mm, 3))
        if monitor.note((x + off_mm, y, z), (0.0, 0.0, 0.0)):
            return count
    return None


@pytest.mark.parametrize("noise_mm", [0.1, 0.5, 1.0, 2.0])
def test_noise_alone_is_no_deviation(noise_mm: float) -> None:
    assert sum(alarm_at(noise_mm, 0.0, seed) is not None for seed in range(100)) == 0


@pytest.mark.parametrize("noise_mm", [0.1, 0.5, 1.0, 2.0])
def test_a_tip_that_is_off_the_plan_is_noticed_in_one_window(noise_mm: float) -> None:
    long = window(Settings(priors=Priors(noise_mm=noise_mm)), LENGTH_MM)
    for seed in range(50):
        alarm = alarm_at(noise_mm, 3.0, seed)
        assert alarm is not None
        assert alarm <= long + 1


def test_the_window_grows_with_the_noise() -> None:
    lengths = [window(Settings(priors=Priors(noise_mm=noise)), LENGTH_MM) for noise in (0.1, 1, 2)]
    assert lengths[0] == Settings().deviation_count < lengths[1] < lengths[2]
