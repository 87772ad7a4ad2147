"""Simulated needles that spin in a part of the way, and what the estimator makes of it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ntagen.drive.spinning import Spun
from ntagen.drive.torsion import Compensated, Lag
from ntagen.errors import DeviceError
from ntagen.needle.estimate import Estimator, Priors
from ntagen.needle.kinematics import push, roll
from ntagen.needle.phantom import PhantomNeedle
from ntagen.needle.phantom_parameters import (
    Fluctuation,
    PhantomParameters,
    Sensing,
    Shape,
    Torsion,
)
from ntagen.needle.vectors import distance, dot
from ntagen.needle.virtual import Errors, SimulatedClock, VirtualNeedle
from ntagen.scene import Needle
from tests.steering import ENTRY

NEEDLE = Needle(ENTRY, 30.0, 1.0)
TURN = 2.0 * math.pi

STILL = Fluctuation(0.0, 30.0, 0.5)
EVEN = Shape(0.0, STILL, 0.0, 10.0, 0.0, STILL)
"""A needle that bends evenly; what spinning leaves of its bend is drawn."""


def virtual() -> VirtualNeedle:
    return VirtualNeedle(NEEDLE, (), Errors(), 1, SimulatedClock())


def phantom(seed: int = 1, shape: Shape = EVEN, torsion: Torsion | None = None) -> PhantomNeedle:
    parameters = PhantomParameters(
        shape=shape,
        torsion=torsion or Torsion(lag_rad=0.0),
        sensing=Sensing(noise_mm=0.0, distortion_mm=STILL, lost_ratio=0.0, latency_s=0.0),
    )
    return PhantomNeedle(NEEDLE, (), seed, SimulatedClock(), parameters)


@pytest.mark.parametrize("spin", [0.2, 0.4, 0.6, 0.9])
@pytest.mark.parametrize("length_mm", [0.7, 10.0, 40.0])
def test_the_virtual_needle_ends_where_the_plan_says(spin: float, length_mm: float) -> None:
    needle = virtual()
    Spun(needle).spin(length_mm, spin)
    expected = push(ENTRY, 30.0 / (1.0 - spin), length_mm)
    assert distance(needle.true_tip.position_mm, expected.position_mm) < 1e-3
    assert dot(needle.true_tip.heading, expected.heading) == pytest.approx(1.0, abs=1e-9)
    assert dot(needle.true_tip.bevel, expected.bevel) == pytest.approx(1.0, abs=1e-9)


def test_the_way_of_the_virtual_needle_is_near_the_arc() -> None:
    needle = virtual()
    Spun(needle).spin(20.0, 0.5)
    arcs = needle.pierced
    places = [arc.pose_at(s).position_mm for arc in arcs for s in (0.0, 0.5 * arc.length_mm)]
    away = [abs(math.dist(place, (0.0, 0.0, -60.0)) - 60.0) for place in places]
    assert max(away) < 0.005


def test_a_turn_takes_its_time() -> None:
    needle = virtual()
    Spun(needle).spin(3.0, 0.5)
    # Three turns of two seconds each, and 1.5 mm that bend.
    assert needle.now_s() == pytest.approx(7.5)


def test_a_part_of_a_turn_bends_about_the_shaft() -> None:
    """Small steps of a frame of its own give the same end; half a turn is not straight."""
    needle = virtual()
    needle.screw(2.0, 0.5 * TURN)
    pose, count = ENTRY, 2000
    for _ in range(count):
        pose = push(roll(pose, 0.5 * TURN / count), 30.0, 2.0 / count)
    assert distance(needle.true_tip.position_mm, pose.position_mm) < 0.01
    assert dot(needle.true_tip.bevel, ENTRY.bevel) == pytest.approx(-1.0, abs=0.01)


@pytest.mark.parametrize("needle", [virtual(), phantom()])
def test_impossible_screw_motions_are_refused(needle: VirtualNeedle | PhantomNeedle) -> None:
    for length_mm, angle_rad in ((-1.0, TURN), (math.nan, TURN), (1.0, math.inf)):
        with pytest.raises(DeviceError):
            needle.screw(length_mm, angle_rad)


def curvature(needle: PhantomNeedle, spin: float) -> float:
    """The mean curvature of a push with a spin, relative to the needle's."""
    before = needle.true_tip.heading
    Spun(needle).spin(20.0, spin)
    turned = math.acos(min(1.0, dot(before, needle.true_tip.heading)))
    return turned / 20.0 * NEEDLE.radius_mm


@pytest.mark.parametrize("spin", [0.2, 0.4, 0.6])
def test_the_phantom_bends_less_by_about_the_spun_part(spin: float) -> None:
    errors = np.array([curvature(phantom(seed), spin) - (1.0 - spin) for seed in range(60)]) / spin
    assert abs(errors.mean()) < 0.015
    assert 0.02 < errors.std() < 0.04
    exact = phantom(shape=replace(EVEN, spin_ratio=0.0))
    assert curvature(exact, spin) == pytest.approx(1.0 - spin, abs=1e-4)


def test_the_error_of_the_effect_stays_in_one_insertion() -> None:
    needle = phantom(5)
    assert curvature(needle, 0.5) == pytest.approx(curvature(needle, 0.5), abs=1e-6)


def test_a_phantom_that_does_not_spin_is_as_before() -> None:
    """What spinning draws does not change what else is drawn."""
    one = PhantomNeedle(NEEDLE, (), 3, SimulatedClock())
    parameters = PhantomParameters(shape=Shape(spin_ratio=0.3))
    other = PhantomNeedle(NEEDLE, (), 3, SimulatedClock(), parameters)
    for needle in (one, other):
        needle.push(20.0)
        needle.roll(1.0)
        needle.push(20.0)
    assert one.true_tip == other.true_tip


def test_a_lag_that_is_made_up_for_changes_nothing() -> None:
    even = replace(EVEN, spin_ratio=0.0)
    torsion = Torsion(math.radians(45.0), 100.0, 0.0, STILL)
    needle, free = phantom(shape=even, torsion=torsion), phantom(shape=even)
    Spun(Compensated(needle, Lag(math.radians(45.0)))).spin(60.0, 0.5)
    Spun(free).spin(60.0, 0.5)
    assert distance(needle.true_tip.position_mm, free.true_tip.position_mm) < 0.1
    assert needle._base_rad == pytest.approx(needle.tip_rad, abs=0.02)


def test_the_shaft_does_not_wind_up() -> None:
    needle = phantom()
    Spun(needle).spin(9.0, 0.5)
    assert needle._base_rad == pytest.approx(TURN)
    Spun(needle)
    other = phantom()
    Spun(other).spin(10.0, 0.5)
    assert other._base_rad == pytest.approx(0.0, abs=1e-9)


# --------------------------------------------------------------------------------------- estimator


def estimated(radius_mm: float, priors: Priors) -> tuple[Estimator, VirtualNeedle]:
    """A needle that spins, stops spinning, is pulled back and leaves its channel by spinning."""
    true = replace(NEEDLE, radius_mm=radius_mm)
    needle = VirtualNeedle(true, (), Errors(), 1, SimulatedClock())
    estimator, spun = Estimator(ENTRY, 30.0, priors), Spun(needle)

    def pushed(length_mm: float, spin: float) -> None:
        for _ in range(round(length_mm)):
            if spin:
                spun.spin(1.0, spin)
            else:
                needle.push(1.0)
            estimator.push(1.0, spin)
            estimator.measure(needle.measure())

    pushed(8.0, 0.4)
    pushed(13.0, 0.0)
    needle.roll(1.2)
    estimator.roll(1.2)
    pushed(11.0, 0.6)
    pushed(5.0, 0.2)
    needle.pull(9.0)
    estimator.pull(9.0)
    pushed(6.0, 0.2)
    return estimator, needle


@pytest.mark.parametrize("radius_mm", [27.0, 30.0, 34.0])
def test_a_needle_that_spins_is_estimated_exactly(radius_mm: float) -> None:
    priors = Priors(curvature_ratio=0.2, noise_mm=0.001)
    estimator, needle = estimated(radius_mm, priors)
    estimate = estimator.estimate()
    assert estimate.radius_mm == pytest.approx(radius_mm, rel=2e-3)
    assert distance(estimate.tip.position_mm, needle.true_tip.position_mm) < 0.01
    assert dot(estimate.tip.bevel, needle.true_tip.bevel) == pytest.approx(1.0, abs=1e-3)
    assert estimate.path.depth_mm == pytest.approx(34.0)


def test_drifts_do_not_disturb_spins() -> None:
    priors = Priors(curvature_ratio=0.2, noise_mm=0.01, curvature_drift=0.1, turn_drift_rad=0.1)
    estimator, needle = estimated(30.0, priors)
    estimate = estimator.estimate()
    assert distance(estimate.tip.position_mm, needle.true_tip.position_mm) < 0.05
    assert estimate.radius_mm == pytest.approx(30.0, rel=0.02)


@pytest.mark.parametrize("priors", [Priors(), Priors(curvature_drift=0.1, turn_drift_rad=0.1)])
def test_a_spin_changes_what_is_expected_and_no_unknown(priors: Priors) -> None:
    """Each stretch of 5 mm has its unknowns once, also if the spin changes in it."""
    even, spun = Estimator(ENTRY, 30.0, priors), Estimator(ENTRY, 30.0, priors)
    for length_mm, spin in ((3.0, 0.4), (2.0, 0.0), (4.0, 0.0), (3.0, 0.6)):
        even.push(length_mm)
        spun.push(length_mm, spin)
    assert spun._stds == even._stds
    stretches = spun._channels[0].stretches
    inner = [5.0, 9.0, 10.0] if priors.curvature_drift else [9.0]
    assert [one.offset_mm for one in stretches] == [0.0, 3.0, *inner]
    assert [one.spin for one in stretches][:2] == [0.4, 0.0]
    assert stretches[-1].spin == 0.6
    assert spun.estimate().radius_mm == pytest.approx(30.0)
    depths_mm = [arc.length_mm for arc in spun.estimate().path.arcs]
    radii_mm = [arc.radius_mm for arc in spun.estimate().path.arcs]
    assert sum(depths_mm) == pytest.approx(12.0)
    assert radii_mm[:2] == pytest.approx([50.0, 30.0])
    assert radii_mm[-1] == pytest.approx(75.0)


def test_a_needle_at_the_end_of_its_channel_has_none_to_leave() -> None:
    """Rounding of the lengths does not count."""
    estimator = Estimator(ENTRY, 30.0, Priors(bite_mm=2.0))
    estimator.push(0.7)
    estimator.pull(0.6)
    for _ in range(3):
        estimator.push(0.6 / 3.0)
    assert 0.0 < 0.7 - estimator.depth_mm < 1e-9
    estimator.push(10.0, 0.4)
    assert len(estimator._channels) == 1


def test_what_a_bite_takes_away_is_less_by_the_spin() -> None:
    """A length without bend, at the beginning of a channel that leaves another one by spinning."""
    priors = Priors(bite_mm=2.0)
    estimator = Estimator(ENTRY, 30.0, priors)
    estimator.push(20.0)
    estimator.pull(8.0)
    estimator.push(10.0, 0.4)
    headings = [pose.heading for pose in (ENTRY, estimator.estimate().tip)]
    assert math.acos(dot(*headings)) == pytest.approx((12.0 + 0.6 * (10.0 - 2.0)) / 30.0)


@pytest.mark.parametrize("bite_mm", [0.0, 1.5])
def test_the_derivatives_of_a_spun_channel_are_right(bite_mm: float) -> None:
    from ntagen.needle.channels import place, positions

    priors = Priors(curvature_drift=0.1, turn_drift_rad=0.1, first_ratio=0.2, bite_mm=bite_mm)
    estimator, _ = estimated(31.0, priors)
    channels = estimator._channels
    count = len(estimator._stds)
    numbers = np.random.default_rng(1)
    unknowns = 0.02 * numbers.standard_normal(count)

    def at(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        _, placed = place(channels, ENTRY, 1.0 / 30.0, values)
        return positions([placed[-1][-1]], np.zeros(1, dtype=np.intp), np.array([2.0]))

    slopes = at(unknowns)[1][0]
    for index in range(count):
        step = np.zeros(count)
        step[index] = 1e-6
        numeric = (at(unknowns + step)[0][0] - at(unknowns - step)[0][0]) / 2e-6
        assert slopes[:, index] == pytest.approx(numeric, abs=1e-5)
