"""Finding a needle in its channel after a run was cut off: what counts, and what contradicts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest

from ntagen.drive.finding import LOOKS, Clues, Place, find
from ntagen.drive.records import Command
from ntagen.drive.settings import Settings
from ntagen.errors import DeviceError
from ntagen.needle.estimate import Estimator
from ntagen.needle.kinematics import roll
from ntagen.needle.measurement import Measurement
from ntagen.needle.path import Path
from ntagen.needle.vectors import add, combine
from ntagen.scene import Pose, Vector
from tests.steering import ENTRY

RADIUS_MM = 30.0
SETTINGS = Settings()
DEPTH_MM = 20.0
HALF = math.pi

CHANNEL = Path(ENTRY).push(RADIUS_MM, 8.0).roll(HALF).push(RADIUS_MM, 12.0)
"""The true channel: a roll by half a turn at 8 mm."""


def estimate() -> Estimator:
    """What the driver knew at the end of its log."""
    found, path = Estimator(ENTRY, RADIUS_MM, SETTINGS.priors), Path(ENTRY)
    for step in range(20):
        if step == 8:
            found.roll(HALF)
            path = path.roll(HALF)
        found.push(1.0)
        path = path.push(RADIUS_MM, 1.0)
        found.measure(Measurement(float(step), path.tip.position_mm, 0.0))
    return found


KNOWN = estimate().estimate()


def looks(tip: Pose, off_mm: Vector = (0.0, 0.0, 0.0), *, bevel: bool = False) -> list[Measurement]:
    """Readings of a needle at rest, with a little noise."""
    return [
        Measurement(
            float(number),
            add(add(tip.position_mm, off_mm), (0.0, 0.1 * (-1) ** number, 0.0)),
            0.0,
            tip.heading if bevel else None,
            tip.bevel if bevel else None,
        )
        for number in range(LOOKS)
    ]


def found(
    readings: Sequence[Measurement],
    pending: tuple[str, float] | None = None,
    counted: tuple[float, float] | None = None,
    lag_rad: float = 0.0,
) -> Place:
    command = None if pending is None else Command(0.0, *pending)
    return find(Clues(readings, KNOWN, command, counted, lag_rad), SETTINGS)


def test_a_needle_that_stood_is_where_the_log_left_it() -> None:
    place = found(looks(CHANNEL.tip), counted=(DEPTH_MM, 0.0))
    assert place.depth_mm == DEPTH_MM
    assert (place.turn_rad, place.wound_rad, place.lack) == (0.0, 0.0, "")
    assert place.off_mm < 0.2 < place.allowed_mm
    assert "by the count of the controller and by the tracker" in place.text


@pytest.mark.parametrize("made_mm", [0.0, 1.3, 4.0])
def test_any_part_of_the_last_push_may_have_been_made(made_mm: float) -> None:
    tip = CHANNEL.push(RADIUS_MM, made_mm).tip
    counted = found(looks(tip), ("push", 4.0), (DEPTH_MM + made_mm, 0.0))
    assert counted.depth_mm == pytest.approx(DEPTH_MM + made_mm)
    assert not counted.lack
    seen = found(looks(tip), ("push", 4.0))
    assert seen.depth_mm == pytest.approx(DEPTH_MM + made_mm, abs=0.2)


@pytest.mark.parametrize("made_mm", [0.0, 2.5, 6.0])
def test_any_part_of_the_last_pull_may_have_been_made(made_mm: float) -> None:
    place = found(looks(CHANNEL.pull(made_mm).tip), ("pull", 6.0), (DEPTH_MM - made_mm, 0.0))
    assert place.depth_mm == pytest.approx(DEPTH_MM - made_mm)
    assert not place.lack


@pytest.mark.parametrize(
    ("gone_deg", "turn_deg", "wound_deg"),
    [(0, 0, 0), (3, 0, 3), (50, 45, 5), (90, 90, 0), (93, 90, 3), (95, 90, 5)],
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_count_tells_how_far_a_roll_went_and_by_how_much_the_base_is_ahead(
    gone_deg: float, turn_deg: float, wound_deg: float, sign: float
) -> None:
    gone_rad, roll_rad = sign * math.radians(gone_deg), sign * 0.5 * math.pi
    place = found(
        looks(CHANNEL.tip), ("roll", roll_rad), (DEPTH_MM, gone_rad), lag_rad=math.radians(5.0)
    )
    assert place.turn_rad == pytest.approx(sign * math.radians(turn_deg))
    assert place.wound_rad == pytest.approx(sign * math.radians(wound_deg))
    assert not place.lack


@pytest.mark.parametrize("count_deg", [-20.0, 120.0])
def test_a_base_that_no_roll_explains_lets_nobody_go_on(count_deg: float) -> None:
    counted = (DEPTH_MM, math.radians(count_deg))
    assert "its base stands" in found(looks(CHANNEL.tip), ("roll", 0.5 * HALF), counted).lack
    assert "its base stands" in found(looks(CHANNEL.tip), None, counted).lack


def test_a_controller_that_lost_its_power_knows_nothing() -> None:
    place = found(looks(CHANNEL.tip), counted=(0.0, -HALF))
    assert place.depth_mm == DEPTH_MM
    assert "the controller counts 0.00 mm: it has lost its position" in place.text
    assert "nothing says how its bevel stands" in place.lack


def test_nothing_that_counts_and_nothing_that_sees_the_bevel_is_not_enough() -> None:
    assert "nothing says how its bevel stands" in found(looks(CHANNEL.tip)).lack


def test_a_bevel_that_is_seen_tells_how_the_needle_is_turned() -> None:
    tip = CHANNEL.tip
    assert not found(looks(tip, bevel=True)).lack
    assert not found(looks(tip, bevel=True), counted=(0.0, 0.0)).lack
    rolled = found(looks(roll(tip, 0.5 * HALF), bevel=True), ("roll", 0.5 * HALF))
    assert rolled.turn_rad == pytest.approx(0.5 * HALF)
    assert not rolled.lack
    turned = found(looks(roll(tip, math.radians(40.0)), bevel=True), ("roll", 0.5 * HALF))
    assert "its bevel is seen 40 deg from where the log left it" in turned.lack


def test_a_bevel_that_contradicts_the_count_lets_nobody_go_on() -> None:
    turned = looks(roll(CHANNEL.tip, 0.5 * HALF), bevel=True)
    assert "90 deg from where the controller counts it" in found(turned, None, (DEPTH_MM, 0.0)).lack


@pytest.mark.parametrize("back_mm", [0.8, 9.0])
def test_a_needle_that_was_pulled_back_since_is_found_on_its_channel(back_mm: float) -> None:
    tip = CHANNEL.pull(back_mm).tip
    place = found(looks(tip), counted=(DEPTH_MM - back_mm, 0.0))
    assert place.depth_mm == pytest.approx(DEPTH_MM - back_mm)
    assert f"{back_mm:.2f} mm less than the log tells: it was pulled back since" in place.text
    assert not place.lack


def test_a_needle_that_was_pulled_back_by_hand_may_only_be_pulled_farther() -> None:
    place = found(looks(CHANNEL.pull(9.0).tip))
    assert place.depth_mm == pytest.approx(11.0, abs=0.2)
    assert "as the tracker sees it, 9." in place.text
    assert "nothing says how its bevel stands" in place.lack


def test_a_needle_that_is_deeper_than_its_log_may_only_be_pulled_back() -> None:
    tip = CHANNEL.push(RADIUS_MM, 7.0).tip
    place = found(looks(tip), counted=(DEPTH_MM + 7.0, 0.0))
    assert place.depth_mm == pytest.approx(27.0)
    assert "7.00 mm deeper than the log tells" in place.lack


def test_the_tracker_alone_sees_that_the_end_of_a_log_is_missing() -> None:
    for counted in (None, (0.0, 0.0)):
        tip = CHANNEL.push(RADIUS_MM, 1.5).tip
        place = found(looks(tip, bevel=True), counted=counted)
        assert place.depth_mm == pytest.approx(21.5, abs=0.2)
        assert "deeper than the log tells" in place.lack
        with pytest.raises(DeviceError, match=r"2\.5 mm from the channel"):
            found(looks(CHANNEL.push(RADIUS_MM, 2.5).tip, bevel=True), counted=counted)
        near = found(looks(CHANNEL.push(RADIUS_MM, 0.3).tip, bevel=True), counted=counted)
        assert (near.depth_mm, near.lack) == (DEPTH_MM, "")


def test_a_needle_that_is_hardly_in_begins_anew() -> None:
    short = Estimator(ENTRY, RADIUS_MM, SETTINGS.priors)
    short.push(0.5)
    path = Path(ENTRY).push(RADIUS_MM, 0.5)
    short.measure(Measurement(0.0, path.tip.position_mm, 0.0))
    clues = Clues(looks(path.tip), short.estimate(), None, (0.5, 0.0))
    assert "begins anew at the entry" in find(clues, SETTINGS).lack


@pytest.mark.parametrize("counted", [None, (0.0, 0.0)])
def test_a_tip_off_the_channel_is_refused(counted: tuple[float, float] | None) -> None:
    with pytest.raises(DeviceError, match=r"5\.0 mm from the channel that the log tells"):
        found(looks(CHANNEL.tip, (5.0, 0.0, 0.0)), counted=counted)


def test_a_tip_that_is_not_where_the_controller_counts_is_refused() -> None:
    with pytest.raises(DeviceError, match=r"the controller counts 20\.00 mm, and the tracker sees"):
        found(looks(CHANNEL.pull(6.0).tip), counted=(DEPTH_MM, 0.0))


def test_readings_of_a_needle_that_moves_are_refused() -> None:
    readings = looks(CHANNEL.tip)
    last = readings[-1]
    moved = combine(1.0, last.position_mm, 3.0, (1.0, 0.0, 0.0))
    readings[-1] = replace(last, position_mm=moved)
    with pytest.raises(DeviceError, match="does not lie still"):
        found(readings, counted=(DEPTH_MM, 0.0))


def test_a_needle_that_points_elsewhere_is_refused() -> None:
    tip = CHANNEL.tip
    across = replace(tip, heading=tip.bevel, bevel=tip.heading)
    with pytest.raises(DeviceError, match="point 90 deg away from its channel"):
        found(looks(across, bevel=True), counted=(DEPTH_MM, 0.0))
