"""The force as a signal: false alarms, what is felt in time, where a rise began."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ntagen.drive.force import ForceMonitor, PageTest, fitting_spacing_mm, stop_force_n
from ntagen.drive.settings import Settings
from ntagen.errors import InputError

LENGTH_MM = 100.0
SETTINGS = Settings(force_noise_n=0.05, false_alarm=0.05)


def readings(seed: int, friction_n_per_mm: float, start_mm: float = 1e9) -> np.ndarray:
    """Forces of an insertion: an offset, friction, noise, and a rise of 1 N/mm from a depth on."""
    depths = np.arange(0.0, LENGTH_MM, SETTINGS.spacing_mm)
    noise = np.random.default_rng(seed).normal(0.0, SETTINGS.force_noise_n, len(depths))
    return 0.3 + friction_n_per_mm * depths + np.maximum(0.0, depths - start_mm) + noise


def first_alarm(forces: np.ndarray) -> tuple[float, float] | None:
    """Where a rise is felt for sure, and where it began."""
    monitor = ForceMonitor(SETTINGS, LENGTH_MM)
    for index, force_n in enumerate(forces):
        rise = monitor.note(index * SETTINGS.spacing_mm, float(force_n))
        if rise is not None:
            return rise.felt_mm, rise.began_mm
    return None


@pytest.mark.slow
@pytest.mark.parametrize("friction_n_per_mm", [0.0, 0.02])
def test_noise_and_friction_alone_alarm_as_seldom_as_stated(friction_n_per_mm: float) -> None:
    runs = 400
    alarms = sum(first_alarm(readings(seed, friction_n_per_mm)) is not None for seed in range(runs))
    # Five standard deviations above the stated rate.
    rate = SETTINGS.false_alarm
    assert alarms <= runs * rate + 5.0 * (runs * rate * (1.0 - rate)) ** 0.5


@pytest.mark.parametrize("start_mm", [20.0, 61.0])
def test_a_rise_is_felt_soon_and_its_beginning_is_found(start_mm: float) -> None:
    for seed in range(50):
        alarm = first_alarm(readings(seed, 0.02, start_mm))
        assert alarm is not None
        felt_mm, began_mm = alarm
        # The sum may have left 0 by noise a few readings before.
        assert start_mm - 3.0 <= began_mm <= felt_mm <= start_mm + 1.0


def test_the_bound_gives_the_false_alarms_of_a_simulation() -> None:
    test = PageTest.of(replace(SETTINGS, false_alarm=1.0), LENGTH_MM)
    rng = np.random.default_rng(1)
    lengths = []
    for _ in range(300):
        total, count = 0.0, 0
        while total <= test.bound:
            total = max(0.0, total + rng.normal() - test.slack)
            count += 1
        lengths.append(count)
    wanted = LENGTH_MM / SETTINGS.spacing_mm
    assert 0.7 * wanted <= np.mean(lengths) <= 1.4 * wanted


def test_a_rise_that_is_allowed_is_no_alarm_and_teaches_nothing() -> None:
    monitor = ForceMonitor(Settings(), LENGTH_MM)
    for index in range(40):
        assert monitor.note(0.25 * index, 0.0) is None
    for index in range(40, 60):
        assert monitor.note(0.25 * index, 1.0, allowed_n=1.5) is None
    assert monitor.expected_n(15.0) == pytest.approx(0.0)
    assert monitor.note(15.0, 1.0) is not None


def test_cutting_after_an_old_channel_is_no_rise() -> None:
    """20 mm of cutting, 10 mm back, then the open channel to 20 mm, and cutting again."""
    forces = readings(3, 0.02)
    cutting_n = 0.8
    monitor = ForceMonitor(SETTINGS, LENGTH_MM)
    depths = np.arange(0.0, 20.0, SETTINGS.spacing_mm)
    for depth_mm, force_n in zip(depths, forces, strict=False):
        assert monitor.note(depth_mm, float(force_n) + cutting_n) is None
    for depth_mm in np.arange(10.0, 40.0, SETTINGS.spacing_mm):
        force_n = float(forces[round(depth_mm / SETTINGS.spacing_mm)])
        force_n += 0.0 if depth_mm < 20.0 else cutting_n
        assert monitor.note(depth_mm, force_n) is None
    assert monitor.note(40.0, float(forces[160]) + cutting_n + 1.0) is not None, "a real rise"


def test_softer_tissue_is_learned_where_the_needle_has_not_been() -> None:
    monitor = ForceMonitor(SETTINGS, LENGTH_MM)
    for depth_mm in np.arange(0.0, 60.0, SETTINGS.spacing_mm):
        assert monitor.note(depth_mm, 1.0 if depth_mm < 10.0 else 0.2) is None
    assert monitor.expected_n(60.0) < 0.4


PASSING = replace(SETTINGS, force_rise_n_per_mm=1.0, sensing_margin_mm=3.0, felt_clearance_mm=1.0)
"""The needle stops at a rise of 2 N."""


@pytest.mark.parametrize("most_n", [1.5, 3.0])
def test_a_region_is_passed_unless_it_may_be_too_near(most_n: float) -> None:
    assert stop_force_n(PASSING) == pytest.approx(2.0)
    monitor = ForceMonitor(PASSING, LENGTH_MM)
    forces = readings(3, 0.02)
    for index, plain_n in enumerate(forces):
        depth_mm = index * PASSING.spacing_mm
        rise_n = max(0.0, most_n - abs(depth_mm - 50.0))
        rise = monitor.note(depth_mm, float(plain_n) + rise_n)
        if rise is not None:
            assert rise_n == pytest.approx(2.0, abs=0.5)
            assert rise.force_n == pytest.approx(rise_n, abs=0.3)
            assert rise.felt_mm == depth_mm
            assert rise.began_mm == pytest.approx(50.0 - most_n, abs=1.0)
            break
    assert (rise is not None) == (most_n > 2.0)
    # What was felt in the margin tells nothing about plain insertion.
    assert monitor.expected_n(80.0) == pytest.approx(0.3 + 0.02 * 80.0, abs=0.2)


def test_a_tip_that_has_left_its_old_channel_is_noticed() -> None:
    monitor = ForceMonitor(PASSING, LENGTH_MM)
    for index, force_n in enumerate(readings(3, 0.02)[:100]):
        assert monitor.note(index * PASSING.spacing_mm, float(force_n)) is None
    assert monitor.note_in_channel(20.0, 0.4) is None
    assert monitor.note_in_channel(20.25, 2.0) is None
    rise = monitor.note_in_channel(20.5, 3.0)
    assert rise is not None
    assert rise.force_n == pytest.approx(3.0 - 0.3 - 0.41, abs=0.1)
    # A needle that stops as soon as it feels a region does not get deep enough for that.
    assert ForceMonitor(SETTINGS, LENGTH_MM).note_in_channel(20.5, 3.0) is None


def test_the_way_after_a_stop_counts_as_clearance() -> None:
    assert stop_force_n(replace(PASSING, overrun_mm=0.5)) == pytest.approx(1.5)
    assert stop_force_n(SETTINGS) == 0.0
    assert fitting_spacing_mm(PASSING, 3.0, LENGTH_MM) == PASSING.spacing_mm
    near = replace(PASSING, felt_clearance_mm=0.3)
    assert fitting_spacing_mm(near, 3.0, LENGTH_MM) < PASSING.spacing_mm


def test_thin_margins_need_short_pushes_and_too_thin_ones_are_refused() -> None:
    settings = Settings()
    assert fitting_spacing_mm(settings, 3.0, LENGTH_MM) == settings.spacing_mm
    assert fitting_spacing_mm(settings, 0.2, LENGTH_MM) < settings.spacing_mm
    with pytest.raises(InputError, match="could be pierced before it is felt"):
        fitting_spacing_mm(settings, 0.05, LENGTH_MM)
    # The way that the needle moves on after a stop counts.
    with pytest.raises(InputError, match="stops"):
        fitting_spacing_mm(replace(settings, overrun_mm=0.8), 0.8, LENGTH_MM)
