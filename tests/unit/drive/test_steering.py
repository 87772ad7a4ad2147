"""What the driver knows of the channels that its needle has cut."""

from __future__ import annotations

import math

import pytest

from ntagen.drive.device import Assembly
from ntagen.drive.settings import Settings
from ntagen.drive.spinning import Spun
from ntagen.drive.steering import Steering
from ntagen.needle.errors import Errors
from ntagen.needle.virtual import SimulatedClock, VirtualNeedle
from ntagen.plan.actions import Push
from tests.drive.runs import Diary
from tests.steering import PAPER


def steering() -> Steering:
    needle = PAPER.needle
    device = VirtualNeedle(needle, (), Errors(), 1, SimulatedClock())
    return Steering(needle, Assembly(Spun(device), device), Settings(), Diary(), lambda: None)


def pushed(needle: Steering, length_mm: float) -> list[bool]:
    """Whether each mm of a push cuts."""
    cuts = []
    for _ in range(round(length_mm)):
        cuts.append(needle.cuts)
        needle.push(Push(1.0))
    return cuts


def test_a_push_in_the_old_channel_cuts_nothing() -> None:
    needle = steering()
    assert all(pushed(needle, 10.0))
    needle.pull_back_to(4.0)
    assert pushed(needle, 8.0) == [False] * 6 + [True] * 2
    assert needle.cut_mm == pytest.approx(12.0)


def test_a_needle_leaves_its_channel_where_a_roll_was_undone() -> None:
    needle = steering()
    pushed(needle, 10.0)
    needle.roll(math.pi)
    pushed(needle, 5.0)
    needle.pull_back_to(8.0)
    assert needle.path.pending_roll_rad == pytest.approx(0.0)
    # The channel turns at 10 mm, and the needle does not.
    assert pushed(needle, 6.0) == [False] * 2 + [True] * 4
    assert needle.cut_mm == pytest.approx(19.0)


def test_a_roll_in_the_old_channel_leaves_it_at_once() -> None:
    needle = steering()
    pushed(needle, 10.0)
    needle.pull_back_to(5.0)
    needle.roll(0.5 * math.pi)
    assert all(pushed(needle, 3.0))
    assert needle.cut_mm == pytest.approx(13.0)


def test_a_spin_in_the_old_channel_leaves_it_at_once() -> None:
    needle = steering()
    pushed(needle, 10.0)
    needle.pull_back_to(5.0)
    needle.push(Push(2.0, 0.5))
    assert needle.cuts
    assert needle.cut_mm == pytest.approx(12.0)
