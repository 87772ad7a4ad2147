"""The phantom needle: its motion does not depend on how it is commanded or watched."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ntagen.drive.torsion import Compensated, Lag
from ntagen.errors import DeviceError
from ntagen.needle.path import nearest_on
from ntagen.needle.phantom import PhantomNeedle
from ntagen.needle.phantom_parameters import (
    Fluctuation,
    Forces,
    PhantomParameters,
    Sensing,
    Shape,
    Torsion,
)
from ntagen.needle.sweep import BOUND_MM
from ntagen.needle.vectors import distance, dot
from ntagen.needle.virtual import Errors, Obstacle, SimulatedClock, VirtualNeedle
from ntagen.scene import Needle
from tests.benchmarks.phantom import drawn, lags_deg, spreads
from tests.steering import ENTRY, sphere

Moves = list[tuple[str, float]]

STILL = Fluctuation(0.0, 20.0, 0.5)
IDEAL = PhantomParameters(
    shape=Shape(0.0, STILL, 0.0, 10.0, 0.0, STILL),
    torsion=Torsion(0.0, 100.0, 0.0, STILL),
    sensing=Sensing(0.0, STILL, 0.0, 0.0, 0.0, 0.0, 0.025, 0.0),
)
"""Without any error, but with forces."""

WINDING: Moves = [
    ("push", 17.3),
    ("roll", math.pi),
    ("push", 12.1),
    ("pull", 9.05),
    ("push", 6.02),
    ("pull", 4.0),
    ("roll", -math.pi / 2),
    ("push", 31.4),
    ("roll", 3.0),
    ("push", 5.0),
]
AHEAD = Obstacle(sphere("C1", "critical", (0.0, -10.0, 0.0), 2.0), margin_mm=3.0)


def phantom(
    parameters: PhantomParameters | None = None,
    seed: int = 1,
    obstacles: tuple[Obstacle, ...] = (),
    radius_mm: float = 30.0,
) -> PhantomNeedle:
    needle = Needle(ENTRY, radius_mm, 1.0)
    return PhantomNeedle(needle, obstacles, seed, SimulatedClock(), parameters)


def moved(needle: PhantomNeedle | VirtualNeedle, moves: Moves, step: float = math.inf) -> None:
    """Makes these moves in pieces, none greater than the step."""
    for kind, value in moves:
        count = max(1, math.ceil(abs(value) / step)) if step < math.inf else 1
        for _ in range(count):
            getattr(needle, kind)(value / count)


@pytest.mark.parametrize("step", [0.01, 0.1, 0.7])
def test_small_increments_make_the_same_path(step: float) -> None:
    obstacles = (Obstacle(sphere("C1", "critical", (3.0, -30.0, 3.0), 2.0), 3.0),)
    once, often = phantom(obstacles=obstacles), phantom(obstacles=obstacles)
    moved(once, WINDING)
    moved(often, WINDING, step)
    assert distance(once.true_tip.position_mm, often.true_tip.position_mm) < 1e-6
    assert dot(once.true_tip.bevel, often.true_tip.bevel) > 1.0 - 1e-9
    assert once.tip_rad == pytest.approx(often.tip_rad, abs=1e-9)
    assert once.true_clearance_mm() == pytest.approx(often.true_clearance_mm(), abs=2 * BOUND_MM)


def test_measuring_does_not_change_the_motion() -> None:
    quiet, watched = phantom(), phantom()
    moved(quiet, WINDING)
    for kind, value in WINDING:
        getattr(watched, kind)(value)
        for _ in range(50):
            watched.measure()
    assert quiet.true_tip == watched.true_tip
    assert quiet.pierced == watched.pierced


def test_a_tracker_that_sees_directions_changes_neither_motion_nor_positions() -> None:
    plain = phantom()
    seeing = PhantomNeedle(Needle(ENTRY, 30.0, 1.0), (), 1, SimulatedClock(), reports_pose=True)
    for needle in (plain, seeing):
        moved(needle, WINDING)
    measured, seen = plain.measure(), seeing.measure()
    assert (measured.heading, measured.bevel) == (None, None)
    assert replace(seen, heading=None, bevel=None) == measured
    assert seen.heading is not None
    assert seen.bevel is not None
    heading, bevel = seeing.true_tip.heading, seeing.true_tip.bevel
    assert 0.999 < dot(seen.heading, heading) < 1.0
    assert abs(dot(seen.heading, seen.bevel)) < 1e-9
    # The tissue turns the bend plane away from the bevel that is seen.
    assert 0.5 < dot(seen.bevel, bevel) < 0.999


def test_frames_show_the_needle_lost_or_not_and_take_no_time() -> None:
    needle = phantom()
    needle.push(5.0)
    before_s = needle.now_s()
    frames = [needle.frame() for _ in range(3000)]
    assert needle.now_s() == before_s
    lost = sum(frame.is_lost for frame in frames) / len(frames)
    # A share of 1 % begins a loss, which goes on with a probability of one half.
    assert lost == pytest.approx(0.02, abs=0.012)
    positions = np.array([frame.measurement.position_mm for frame in frames])
    assert positions.std(axis=0) == pytest.approx([0.08] * 3, rel=0.1)


def test_without_errors_it_is_the_virtual_needle() -> None:
    ideal = phantom(replace(IDEAL, reinsertion=replace(IDEAL.reinsertion, bite_ratio=1.0)))
    virtual = VirtualNeedle(Needle(ENTRY, 30.0, 1.0), (), Errors(), 1, SimulatedClock())
    moves: Moves = [("push", 14.0), ("roll", math.pi), ("push", 10.0), ("roll", 1.0), ("push", 9.0)]
    moved(ideal, moves)
    moved(virtual, moves)
    assert distance(ideal.true_tip.position_mm, virtual.true_tip.position_mm) < 1e-9
    assert ideal.measure().position_mm == pytest.approx(virtual.true_tip.position_mm, abs=1e-9)
    assert ideal.now_s() == pytest.approx(virtual.now_s())


def test_the_seed_decides_everything() -> None:
    def walked(seed: int) -> tuple[object, object]:
        needle = phantom(seed=seed)
        moved(needle, WINDING)
        return needle.measure(), needle.true_tip

    assert walked(7) == walked(7)
    assert walked(7) != walked(8)


def test_the_first_centimetre_bends_more() -> None:
    arcs = phantom_arcs(PhantomParameters(shape=replace(IDEAL.shape, first_ratio=0.16)))
    curvatures = [30.0 / arc.radius_mm for arc in arcs]
    assert curvatures[:40] == pytest.approx([1.16] * 40)
    assert curvatures[40:] == pytest.approx([1.0] * len(curvatures[40:]))


def phantom_arcs(parameters: PhantomParameters) -> tuple:
    needle = phantom(parameters)
    needle.push(20.0)
    return needle.pierced


def test_the_tip_lags_behind_the_base_and_catches_up_only_beyond_the_lag() -> None:
    needle = phantom(replace(IDEAL, torsion=Torsion(math.radians(45.0), 100.0, 0.0, STILL)))
    needle.push(100.0)
    needle.roll(math.radians(30.0))
    assert needle.tip_rad == 0.0
    needle.roll(math.radians(150.0))
    assert math.degrees(needle.tip_rad) == pytest.approx(135.0)
    needle.roll(math.radians(-80.0))
    assert math.degrees(needle.tip_rad) == pytest.approx(135.0), "the base has 100 now: within 45"
    needle.pull(50.0)
    assert math.degrees(needle.tip_rad) == pytest.approx(100.0 + 45.0 / 4.0)


def test_the_compensation_brings_the_tip_to_the_angle() -> None:
    parameters = replace(IDEAL, torsion=Torsion(math.radians(45.0), 100.0, 0.0, STILL))
    needle = phantom(parameters)
    actuator = Compensated(needle, Lag(math.radians(45.0)))
    for angle in (180.0, -90.0, 270.0):
        actuator.push(25.0)
        before = needle.tip_rad
        actuator.roll(math.radians(angle))
        assert math.degrees(needle.tip_rad - before) == pytest.approx(angle)
        assert needle._base_rad == pytest.approx(needle.tip_rad)


def test_a_push_after_a_pull_follows_the_old_channel() -> None:
    needle = phantom()
    needle.push(30.0)
    end = needle.true_tip
    needle.pull(12.0)
    middle = needle.true_tip
    needle.push(12.0)
    tolerance_mm = needle.parameters.reinsertion.tolerance_mm
    assert 0.0 < distance(needle.true_tip.position_mm, end.position_mm) <= tolerance_mm
    needle.pull(12.0)
    assert distance(needle.true_tip.position_mm, middle.position_mm) <= tolerance_mm
    needle.roll(math.pi)
    needle.push(12.0)
    # Half a turn leaves the channel: 12 mm on the two sides of circles of 30 mm.
    assert distance(needle.true_tip.position_mm, end.position_mm) > 3.0
    assert sum(arc.length_mm for arc in needle.pierced) == pytest.approx(30.0 + 12.0)


def test_the_clearance_is_that_of_all_arcs() -> None:
    regions = (sphere("C1", "critical", (0.0, -26.0, -9.0), 2.0),)
    needle = phantom(obstacles=tuple(Obstacle(region, 2.0) for region in regions))
    for move in WINDING:
        moved(needle, [move])
        exact_mm = nearest_on(needle.pierced, ENTRY.position_mm, regions[0].center_mm).distance_mm
        # Arcs of a channel that was entered again lie a little beside the old ones.
        assert needle.true_clearance_mm() <= exact_mm - 2.0 + 1e-9
        assert needle.true_clearance_mm() >= exact_mm - 2.0 - 2.0 * BOUND_MM - 0.15
    assert phantom().true_clearance_mm() == math.inf


def test_a_pierced_region_stays_pierced() -> None:
    needle = phantom(obstacles=(AHEAD,), radius_mm=1e6)
    needle.push(10.0)
    needle.pull(10.0)
    assert needle.true_clearance_mm() < -1.0


def test_the_force_is_the_total_axial_force() -> None:
    even = Forces(layer_ratio=0.0, friction_ratio=0.0, puncture_n=0.0)
    needle = phantom(replace(IDEAL, forces=replace(even)), radius_mm=1e6)
    needle.push(10.0)
    shallow_n = needle.measure().force_n
    needle.push(40.0)
    deep_n = needle.measure().force_n
    assert shallow_n == pytest.approx(even.cutting_n + 10.0 * even.friction_n_per_mm, abs=0.01)
    assert deep_n - shallow_n == pytest.approx(40.0 * even.friction_n_per_mm, abs=1e-6)
    needle.pull(5.0)
    assert needle.measure().force_n == pytest.approx(-45.0 * even.friction_n_per_mm, abs=1e-6)
    needle.push(2.0)
    reentered_n = needle.measure().force_n
    assert reentered_n == pytest.approx(47.0 * even.friction_n_per_mm, abs=1e-6), "nothing to cut"


def test_the_force_rises_near_a_region_and_before_the_boundary_of_a_layer() -> None:
    def forces_n(obstacles: tuple[Obstacle, ...]) -> np.ndarray:
        needle = phantom(IDEAL, obstacles=obstacles, radius_mm=1e6)
        found = []
        for _ in range(70):
            needle.push(0.1)
            found.append(needle.measure().force_n)
        return np.array(found)

    rise_n = forces_n((AHEAD,)) - forces_n(())
    depths_mm = 0.1 * np.arange(1, 71)
    expected_n = np.maximum(0.0, depths_mm - 5.0)
    assert rise_n == pytest.approx(expected_n, abs=1e-6)
    layered = phantom(replace(IDEAL, forces=Forces(layer_mm=5.0, layer_ratio=0.3)), radius_mm=1e6)
    steps_n = []
    for _ in range(300):
        layered.push(0.1)
        steps_n.append(layered.measure().force_n)
    assert np.diff(steps_n).min() < -0.04, "a boundary breaks"


def test_a_measurement_shows_the_needle_as_it_was() -> None:
    late = replace(IDEAL, sensing=replace(IDEAL.sensing, latency_s=0.5))
    needle = phantom(late)
    needle.push(3.0)
    before = needle.true_tip
    needle.push(0.5)
    measured = needle.measure()
    assert measured.time_s == pytest.approx(3.0)
    assert measured.position_mm == pytest.approx(before.position_mm, abs=1e-6)
    needle.roll(math.pi)
    assert needle.measure().position_mm == pytest.approx(needle.true_tip.position_mm, abs=1e-6)


def test_noise_and_rounding_have_their_sizes() -> None:
    sensing = replace(IDEAL.sensing, noise_mm=0.08, step_mm=0.01, noise_n=0.02, step_n=0.005)
    needle = phantom(replace(IDEAL, sensing=sensing))
    needle.push(5.0)
    measured = [needle.measure() for _ in range(2000)]
    positions = np.array([m.position_mm for m in measured])
    assert positions.std(axis=0) == pytest.approx([0.08] * 3, rel=0.1)
    assert np.abs(positions / 0.01 - np.round(positions / 0.01)).max() < 1e-6
    assert np.std([m.force_n for m in measured]) == pytest.approx(0.02, rel=0.1)


def test_a_lost_reading_is_waited_for() -> None:
    sensing = replace(IDEAL.sensing, lost_ratio=0.2, found_ratio=0.5)
    needle = phantom(replace(IDEAL, sensing=sensing))
    for _ in range(2000):
        needle.measure()
    # A loss begins at every fifth reading and lasts two readings on average.
    assert needle.now_s() == pytest.approx(2000 * 0.2 * 2.0 * 0.025, rel=0.15)


def test_a_tracker_that_is_gone_is_a_fault() -> None:
    sensing = replace(IDEAL.sensing, lost_ratio=1.0, found_ratio=0.0)
    needle = phantom(replace(IDEAL, sensing=sensing))
    with pytest.raises(DeviceError, match=r"no reading for 1\.0 s"):
        needle.measure()
    assert needle.now_s() == pytest.approx(1.0, abs=0.03)


@pytest.mark.slow
def test_many_phantoms_spread_as_real_needles_do() -> None:
    """The bounds are three standard errors of 100 insertions around the published figures.

    The quantiles of windows also have an uncertainty of the 12 measured insertions, of about 8 %.
    """
    found = spreads(drawn(100, first_seed=1000))
    assert found.whole_std == pytest.approx(3.9, abs=0.9)
    assert found.turn_median == pytest.approx(9.8, abs=3.0)
    assert found.window_low == pytest.approx(-27.0, abs=8.0)
    assert found.window_high == pytest.approx(35.0, abs=8.0)
    assert found.residual == pytest.approx(0.16, abs=0.03)


@pytest.mark.slow
def test_the_lag_at_10_cm_is_the_published_one() -> None:
    assert np.median(lags_deg(60, 1)) == pytest.approx(45.0, abs=3.0)
    left = np.abs(lags_deg(60, 1, compensated=True))
    assert np.percentile(left, 95) < 20.0


@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_impossible_commands_are_refused(value: float) -> None:
    needle = phantom()
    with pytest.raises(DeviceError):
        needle.push(value)
    with pytest.raises(DeviceError):
        needle.pull(value)
    with pytest.raises(DeviceError):
        needle.roll(math.nan)
