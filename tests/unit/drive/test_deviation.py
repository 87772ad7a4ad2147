"""Deviation against noise: seldom by noise alone, and found when it is there."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ntagen.drive.deviation import (
    DeviationMonitor,
    DivergenceMonitor,
    require_explained,
    window,
)
from ntagen.drive.records import Command, Estimated
from ntagen.drive.settings import Settings
from ntagen.drive.states import State
from ntagen.errors import DeviceError
from ntagen.needle.estimate import RECENT, Estimate, Estimator, Priors
from ntagen.needle.kinematics import push
from ntagen.needle.measurement import Measurement
from tests.drive.runs import drive
from tests.steering import ENTRY, PAPER

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


def test_a_misfit_that_stays_is_a_divergence() -> None:
    monitor = DivergenceMonitor(Settings())
    off = replace(after(0.25, 0.25, 60), misfit_mm=1.2)
    # Once is the tissue, and what came before an estimate that fits does not count.
    for estimate in (off, off, replace(off, misfit_mm=0.8), off, off):
        require_explained(estimate, Settings(), 30.0)
        monitor.note(estimate)
    with pytest.raises(
        DeviceError, match=r"in 3 of them in a row .* 1\.2 mm or 34 standard"
    ) as found:
        monitor.note(off)
    assert "hint: does an axis jam or lose steps?" in str(found.value)


def test_noise_is_no_divergence() -> None:
    monitor = DivergenceMonitor(Settings(priors=Priors(noise_mm=1.0)))
    for _ in range(10):
        monitor.note(replace(after(0.25, 0.25, 60), misfit_mm=1.7))


def negative(covariance: NDArray[np.float64]) -> None:
    covariance[0, 0] = -1e-6


def correlated(covariance: NDArray[np.float64]) -> None:
    covariance[0, 1] = covariance[1, 0] = 2.0 * math.sqrt(covariance[0, 0] * covariance[1, 1])


def endless(covariance: NDArray[np.float64]) -> None:
    covariance[6, 6] = math.inf


def unknown(covariance: NDArray[np.float64]) -> None:
    covariance[2, 3] = math.nan


@pytest.mark.parametrize("damage", [negative, correlated, endless, unknown])
def test_a_covariance_that_is_none_is_refused(
    damage: Callable[[NDArray[np.float64]], None],
) -> None:
    estimate = after(0.25, 0.25, 60)
    covariance = np.array(estimate.covariance)
    damage(covariance)
    broken = replace(estimate, covariance=tuple(tuple(row) for row in covariance.tolist()))
    with pytest.raises(DeviceError, match="does not say how much it errs"):
        require_explained(broken, Settings(), 30.0)


def test_nothing_moves_after_an_estimate_without_a_covariance(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = Estimator.estimate

    def broken(estimator: Estimator) -> Estimate:
        estimate = made(estimator)
        endless_rows = ((math.inf,) * 7,) * 7
        return replace(estimate, covariance=endless_rows) if estimator.depth_mm > 9.0 else estimate

    monkeypatch.setattr(Estimator, "estimate", broken)
    result, diary = drive(PAPER)
    assert result.ended.outcome == State.FAULTED.value
    assert "does not say how much it errs" in result.ended.reason
    kinds = [command.kind for command in diary.of(Command)]
    last = max(i for i, one in enumerate(diary.records) if isinstance(one, Estimated))
    after_it = [one.kind for one in diary.records[last:] if isinstance(one, Command)]
    assert after_it == ["stop"] == kinds[-1:]


def test_measurements_that_leave_no_estimate_are_told() -> None:
    estimator = Estimator(ENTRY, 30.0, Priors(noise_mm=1e-12))
    estimator.push(1.0)
    for _ in range(3):
        estimator.measure(Measurement(0.0, ENTRY.position_mm, 0.0))
    with pytest.raises(DeviceError, match=r"no needle can be estimated(.|\n)*hint: are they in mm"):
        estimator.estimate()
