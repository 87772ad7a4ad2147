"""Deviation against noise: seldom by noise alone, and found when it is there."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ntagen.drive.deviation import DeviationMonitor, require_explained, window
from ntagen.drive.settings import Settings
from ntagen.errors import DeviceError
from ntagen.needle.estimate import RECENT, Estimate, Estimator, Priors
from ntagen.needle.kinematics import push
from ntagen.needle.measurement import Measurement
from tests.steering import ENTRY

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


def after(commanded_mm: float, moved_mm: float, count: int) -> Estimate:
    """The estimate after pushes of a needle that moves by another length than commanded."""
    estimator = Estimator(ENTRY, 30.0, Priors(noise_mm=0.1))
    for number in range(1, count + 1):
        estimator.push(commanded_mm)
        tip_mm = push(ENTRY, 30.0, number * moved_mm).position_mm
        estimator.measure(Measurement(0.0, tip_mm, 0.0))
    return estimator.estimate()


@pytest.mark.parametrize("radius_mm", [15.0, 30.0, 60.0])
def test_a_needle_that_moves_as_commanded_is_explained(radius_mm: float) -> None:
    estimate = after(0.25, 0.25, 60)
    assert estimate.misfit_mm < 1e-6
    require_explained(estimate, Settings(), radius_mm)


@pytest.mark.parametrize(
    ("moved_mm", "words"),
    [
        (0.15, r"the last positions are \d\.\d mm off, and 1\.7 mm is allowed"),
        # At one place, the estimate goes round in a small circle.
        (0.0, r"a radius of \d\.\d mm, and 30 mm was expected"),
    ],
)
def test_a_needle_that_loses_steps_is_not(moved_mm: float, words: str) -> None:
    with pytest.raises(DeviceError, match=words) as caught:
        require_explained(after(0.25, moved_mm, 60), Settings(), 30.0)
    assert "hint: does an axis jam or lose steps?" in str(caught.value)


def test_few_measurements_are_no_misfit() -> None:
    assert after(0.25, 0.0, RECENT - 1).misfit_mm == 0.0
    assert after(0.25, 0.0, RECENT).misfit_mm > 0.0


def test_a_tolerance_that_is_set_counts_for_the_estimate_too() -> None:
    require_explained(after(0.25, 0.15, 60), Settings(deviation_mm=10.0), 30.0)


def test_the_radius_of_a_straight_needle_is_not_judged() -> None:
    require_explained(after(0.25, 0.25, 60), Settings(), math.inf)
