"""The virtual needle: seeded, honest about its path, silent about its regions."""

from __future__ import annotations

import math
import statistics

import numpy as np
import pytest

from ntagen.errors import DeviceError
from ntagen.needle.answering import drawn
from ntagen.needle.virtual import Errors, Obstacle, SimulatedClock, VirtualNeedle
from ntagen.scene import Needle, Tissue
from tests.steering import ENTRY, sphere

AHEAD = Obstacle(sphere("C1", "critical", (0.0, -10.0, 0.0), 2.0), margin_mm=3.0)


def virtual(errors: Errors | None = None, seed: int = 1) -> VirtualNeedle:
    return VirtualNeedle(
        Needle(ENTRY, 30.0, 2.0), (AHEAD,), errors or Errors(), seed, SimulatedClock()
    )


def test_the_force_rises_with_the_depth_in_the_sensing_margin() -> None:
    needle = virtual()
    forces = []
    for _ in range(16):
        needle.push(0.5)
        forces.append(needle.measure().force_n)
    first = next(i for i, force in enumerate(forces) if force > 0.0)
    surface_mm = math.dist(needle.true_tip.position_mm, (0.0, -10.0, 0.0)) - 2.0
    assert 0.5 * (first + 1) == pytest.approx(5.0, abs=0.5)
    assert forces[-1] == pytest.approx(3.0 - surface_mm)
    assert forces == sorted(forces)


def test_the_true_clearance_counts_channels_that_were_left() -> None:
    needle = virtual()
    needle.push(9.0)
    assert needle.true_clearance_mm() < 0.0
    needle.pull(9.0)
    needle.roll(math.pi)
    assert needle.true_clearance_mm() < 0.0
    assert len(needle.pierced) == 1


def test_a_pull_in_pieces_is_the_same_pull() -> None:
    whole, pieces = virtual(), virtual()
    for needle in (whole, pieces):
        needle.push(9.0)
        needle.roll(1.0)
        needle.push(3.0)
    whole.pull(5.0)
    for _ in range(500):
        pieces.pull(0.01)
    assert pieces.true_tip.position_mm == pytest.approx(whole.true_tip.position_mm, abs=1e-9)
    assert pieces.true_clearance_mm() == pytest.approx(whole.true_clearance_mm(), abs=1e-9)
    # Looking at it while it moves must not make every later look slower.
    assert len(pieces.pierced) < 600


def test_a_roll_that_goes_on_has_one_error() -> None:
    errors = Errors(roll_rad=0.1)
    whole, pieces = virtual(errors), virtual(errors)
    whole.roll(1.0)
    pieces.roll(0.25)
    for _ in range(3):
        pieces.roll_on(0.25)
    assert pieces.true_tip.bevel == pytest.approx(whole.true_tip.bevel, abs=1e-12)
    assert pieces.now_s() == pytest.approx(whole.now_s())


def test_motions_take_simulated_time() -> None:
    needle = virtual()
    needle.push(6.0)
    needle.roll(math.pi)
    needle.pull(10.0)
    assert needle.now_s() == pytest.approx(3.0 + 1.0 + 1.0)


def test_noise_has_the_size_that_was_asked_for() -> None:
    needle = virtual(Errors(noise_mm=0.1))
    positions = np.array([needle.measure().position_mm for _ in range(2000)])
    assert positions.std(axis=0) == pytest.approx([0.1] * 3, rel=0.1)
    assert positions.mean(axis=0) == pytest.approx([0.0] * 3, abs=0.01)


def test_the_seed_decides_everything() -> None:
    errors = Errors(noise_mm=0.1, roll_rad=0.1)

    def walked(seed: int) -> tuple[object, object]:
        needle = virtual(errors, seed)
        needle.roll(1.0)
        needle.push(5.0)
        return needle.measure(), needle.true_tip

    assert walked(7) == walked(7)
    assert walked(7) != walked(8)


@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_impossible_commands_are_refused(value: float) -> None:
    needle = virtual()
    with pytest.raises(DeviceError):
        needle.push(value)
    with pytest.raises(DeviceError):
        needle.pull(value)
    with pytest.raises(DeviceError):
        needle.roll(math.nan)


def test_a_tissue_with_chance_draws_by_its_spreads() -> None:
    tissue = Tissue("stochastic", 0.1, 0.2, 0.3)
    picks = [next(drawn(tissue, seed)) for seed in range(4000)]
    factors = [math.log(factor) for factor, _ in picks]
    errors = [error for _, error in picks]
    for values, spread in ((factors, 0.1), (errors, 0.2)):
        # Five standard deviations of each, for normal numbers.
        assert abs(statistics.fmean(values)) < 5.0 * spread / math.sqrt(4000.0)
        assert abs(statistics.pstdev(values) - spread) < 5.0 * spread / math.sqrt(8000.0)
    for seed in range(5):
        # Before the first roll there is none that errs.
        true, answers = Needle(ENTRY, 30.0, 2.0), drawn(tissue, seed)
        needle = VirtualNeedle(true, (), Errors(), seed, SimulatedClock(), answers=answers)
        needle.push(1.0)
        assert needle.pierced[0].start == ENTRY
