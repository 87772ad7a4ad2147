"""Where the tip was when a late tracker saw it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ntagen.drive.device import Assembly
from ntagen.drive.settings import Settings
from ntagen.drive.spinning import Spun
from ntagen.drive.steering import Lateness, Steering
from ntagen.needle.kinematics import push
from ntagen.needle.phantom import PhantomNeedle
from ntagen.needle.phantom_parameters import (
    Fluctuation,
    PhantomParameters,
    Sensing,
    Shape,
    Torsion,
)
from ntagen.needle.priors import Priors
from ntagen.needle.vectors import distance
from ntagen.needle.virtual import SimulatedClock
from ntagen.plan.actions import Push
from ntagen.scene import Needle
from tests.drive.runs import Diary
from tests.steering import ENTRY


def test_nothing_is_known_before_the_first_motion() -> None:
    assert Lateness().depth_mm(1.0) is None


def test_the_tip_was_where_its_speed_had_brought_it() -> None:
    lateness = Lateness()
    lateness.note(1.0, 0.0, 5.0, 1.0)
    lateness.note(20.0, 5.0, 7.0, 1.0)
    lateness.note(30.0, 7.0, 2.0, 5.0)
    expected = {0.0: 0.0, 1.5: 0.5, 6.0: 5.0, 15.0: 5.0, 21.5: 6.5, 25.0: 7.0, 30.5: 4.5, 40.0: 2.0}
    for time_s, depth_mm in expected.items():
        assert lateness.depth_mm(time_s) == pytest.approx(depth_mm)


def test_a_late_tracker_does_not_hold_the_estimate_of_a_needle_that_spins_back() -> None:
    """Of each millimetre 0.2 mm come after the turn, and the tracker is 0.15 s late."""
    none = Fluctuation(0.0, 30.0, 0.2)
    shape = Shape(0.0, none, 0.0, 10.0, 0.0, none, spin_ratio=0.0)
    sensing = Sensing(0.0, none, 0.0, latency_s=0.15, lost_ratio=0.0)
    torsion = Torsion(0.0, 100.0, 0.0, none)
    parameters = replace(PhantomParameters(), shape=shape, sensing=sensing, torsion=torsion)
    needle = Needle(ENTRY, 30.0, 1.0)
    device = PhantomNeedle(needle, (), 1, SimulatedClock(), parameters)
    settings = Settings(priors=Priors(noise_mm=0.01, position_mm=1.0))
    steering = Steering(needle, Assembly(Spun(device), device), settings, Diary(), lambda: None)
    for _ in range(20):
        steering.push(Push(1.0, 0.6))
        steering.measure()
    assert distance(steering.estimated().tip.position_mm, device.true_tip.position_mm) < 0.01
    assert steering.known.radius_mm == pytest.approx(30.0, rel=2e-3)
    for _ in range(8):
        steering.push(Push(1.0))
        steering.measure()
    assert distance(steering.estimated().tip.position_mm, device.true_tip.position_mm) < 0.01


def test_a_late_tracker_does_not_hold_the_estimate_back() -> None:
    """In a phantom that does nothing else, also after a pull, which is five times as fast."""
    none = Fluctuation(0.0, 30.0, 0.2)
    shape = Shape(0.0, none, 0.0, 10.0, 0.0, none)
    sensing = Sensing(0.0, none, 0.0, latency_s=0.2, lost_ratio=0.0)
    parameters = replace(PhantomParameters(), shape=shape, sensing=sensing)
    needle = Needle(ENTRY, 30.0, 1.0)
    device = PhantomNeedle(needle, (), 1, SimulatedClock(), parameters)
    settings = Settings(priors=Priors(noise_mm=0.01, position_mm=1.0))
    steering = Steering(needle, device, settings, Diary(), lambda: None)
    for _ in range(40):
        steering.push(Push(0.25))
        steering.measure()
    estimate = steering.estimated()
    assert distance(estimate.tip.position_mm, device.true_tip.position_mm) < 1e-3
    late_mm = push(estimate.tip, 30.0, -0.2).position_mm
    assert distance(steering.measure().position_mm, late_mm) < 1e-3
    steering.pull(4.0)
    steering.measure()
    assert distance(steering.estimated().tip.position_mm, device.true_tip.position_mm) < 1e-3
    assert np.isfinite(steering.known.radius_mm)
    assert math.isclose(steering.known.rms_mm, 0.0, abs_tol=1e-3)
