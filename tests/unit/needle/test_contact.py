"""Where a felt region lies: found from contacts on several sides, and from silence."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ntagen.needle.contact import Assumed, Ball, Contact, ball_of
from ntagen.needle.vectors import distance
from ntagen.scene import Vector

CENTER: Vector = (3.0, -28.0, -8.0)
RADIUS_MM = 2.0
MARGIN_MM = 3.0
ASSUMED = Assumed(MARGIN_MM, clearance_mm=MARGIN_MM, radius_mm=RADIUS_MM)


def contact_from(
    direction: Vector, noise_mm: float = 0.0, seed: int = 0, away_mm: float = MARGIN_MM
) -> Contact:
    """A contact with the region from this side, with the needle travelling along -y."""
    length = math.hypot(*direction)
    rng = np.random.default_rng(seed)
    x, y, z = (
        float(c + (RADIUS_MM + away_mm) * d / length + rng.normal(0.0, noise_mm))
        for c, d in zip(CENTER, direction, strict=True)
    )
    return Contact((x, y, z), (0.0, -1.0, 0.0), away_mm)


def found(contacts: list[Contact], passed: list[Vector]) -> Ball:
    ball = ball_of(contacts, passed, ASSUMED)
    assert ball is not None
    return ball


def test_one_contact_means_straight_ahead() -> None:
    ball = found([contact_from((0.0, 1.0, 0.0))], [])
    assert ball.center_mm == pytest.approx(CENTER, abs=1e-4)
    assert ball.radius_mm == pytest.approx(RADIUS_MM, abs=1e-4)


@pytest.mark.parametrize("away_mm", [0.5, 2.0])
def test_a_contact_in_the_margin_says_how_near_the_region_is(away_mm: float) -> None:
    sides: list[Vector] = [(0.6, 1.0, 0.2), (-0.7, 1.0, 0.3), (0.1, 1.0, -0.9)]
    ball = found([contact_from(side, away_mm=away_mm) for side in sides], [])
    assert distance(ball.center_mm, CENTER) < 0.5
    assert ball.radius_mm == pytest.approx(RADIUS_MM, abs=0.3)


def test_contacts_from_several_sides_place_the_region() -> None:
    sides: list[Vector] = [(0.6, 1.0, 0.2), (-0.7, 1.0, 0.3), (0.1, 1.0, -0.9), (0.0, 1.0, 0.8)]
    errors = []
    for seed in range(20):
        contacts = [contact_from(side, 0.1, seed + 100 * i) for i, side in enumerate(sides)]
        errors.append(distance(found(contacts, []).center_mm, CENTER))
    assert np.median(errors) < 0.6
    unsure = [
        found([contact_from(side) for side in sides[:count]], []).center_std_mm
        for count in (2, 3, 4)
    ]
    assert unsure[0] > unsure[1] > unsure[2]


def test_places_that_were_passed_push_the_region_away() -> None:
    contact = contact_from((0.8, 1.0, 0.0))
    x, y, z = contact.position_mm
    # What lies straight ahead of the contact was passed on one side.
    passed: list[Vector] = [(x + 2.0, y - step, z) for step in range(10)]
    ball = found([contact], passed)
    assert ball.center_mm[0] < x - 1.0
    for place in passed:
        assert distance(ball.center_mm, place) >= ball.radius_mm + MARGIN_MM - 1.0


def test_contacts_that_no_ball_explains_have_none() -> None:
    near, far = (
        contact_from((0.0, 1.0, 0.0)),
        Contact((60.0, -23.0, -8.0), (0.0, -1.0, 0.0), MARGIN_MM),
    )
    assert ball_of([near, far], [], ASSUMED) is not None
    # A needle that went deep between the two.
    between: list[Vector] = [
        (30.0 + side, -depth, -8.0 + across)
        for depth in range(0, 80, 2)
        for side in (-15.0, 0.0, 15.0)
        for across in (-30.0, -15.0, 0.0, 15.0, 30.0)
    ]
    assert ball_of([near, far], between, ASSUMED) is None
