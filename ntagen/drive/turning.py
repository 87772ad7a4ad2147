"""How a needle is turned that was found in its channel: by a count, or by a bevel that is seen."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from ntagen.drive.records import Command
from ntagen.needle.measurement import Measurement
from ntagen.needle.vectors import cross, dot
from ntagen.scene import Pose
from ntagen.shapes import vector_of
from ntagen.units import deg_from_rad

_COUNT_RAD: Final = math.radians(1.0)
"""The count of a controller that was left alone fits the log by this; ours."""

_SEEN_RAD: Final = math.radians(5.0)
"""A bevel that is seen alone says how the needle is turned if it fits the log by this; ours."""

_CROSS_RAD: Final = math.radians(30.0)
"""A bevel that is seen may differ by this from where the controller counts it; ours."""


@dataclass(frozen=True, slots=True)
class Turn:
    """How a needle is turned since the last record.

    Attributes:
        turn_rad: By how much its tip was turned.
        wound_rad: By how much its base is ahead of the tip.
        text: What says so, in words.
        lack: Why nobody may go on from that; empty if one may.
    """

    turn_rad: float
    wound_rad: float
    text: str
    lack: str = ""


def turn_of(
    looks: Sequence[Measurement],
    expected: Pose,
    pending: Command | None,
    counted_rad: float | None,
    lag_rad: float,
) -> Turn:
    """How the needle is turned, by the controller or by the bevel that the tracker sees.

    Args:
        looks: The readings.
        expected: The tip as the log left it.
        pending: The motion in which the log was cut off.
        counted_rad: By how much its base is turned more than the log says; None if no controller
            has kept its count.
        lag_rad: By how much the base is ahead of the tip in a roll.
    """
    roll_rad = pending.value if pending is not None and pending.kind == "roll" else 0.0
    if pending is not None and pending.spin:
        return Turn(0.0, 0.0, "turned by nobody knows how much", "it was cut off while it spun")
    seen_rad = _seen_rad(looks, expected)
    if counted_rad is not None:
        found = _counted(counted_rad, roll_rad, lag_rad)
        if found.lack or seen_rad is None:
            return found
        off_deg = deg_from_rad(abs(math.remainder(seen_rad - found.turn_rad, math.tau)))
        if off_deg <= deg_from_rad(_CROSS_RAD):
            return found
        lack = f"the tracker sees its bevel {off_deg:.0f} deg from where the controller counts it"
        return Turn(found.turn_rad, found.wound_rad, found.text, lack)
    if seen_rad is None:
        return Turn(
            0.0,
            0.0,
            "turned by nobody knows how much",
            "nothing says how its bevel stands: the controller does not count it, or has lost its "
            "position, and the tracker does not see it",
        )
    turn_rad = min((0.0, roll_rad), key=lambda one: abs(math.remainder(seen_rad - one, math.tau)))
    off_rad = abs(math.remainder(seen_rad - turn_rad, math.tau))
    text = "turned as the tracker sees its bevel"
    if off_rad <= _SEEN_RAD:
        return Turn(turn_rad, 0.0, text)
    off_deg = deg_from_rad(off_rad)
    return Turn(0.0, 0.0, text, f"its bevel is seen {off_deg:.0f} deg from where the log left it")


def _counted(count_rad: float, roll_rad: float, lag_rad: float) -> Turn:
    """How the needle is turned by a count, if it may have been in a roll.

    The base goes too far by the lag, and comes back: meanwhile it is ahead of the tip.
    """
    text = "turned by the count of the controller"
    if abs(count_rad) <= _COUNT_RAD:
        return Turn(0.0, 0.0, text)
    if abs(count_rad - roll_rad) <= _COUNT_RAD:
        return Turn(roll_rad, 0.0, text)
    sign = math.copysign(1.0, roll_rad)
    gone_rad, whole_rad = sign * count_rad, abs(roll_rad)
    if not 0.0 < gone_rad <= whole_rad + lag_rad + _COUNT_RAD or not roll_rad:
        off_deg = deg_from_rad(count_rad)
        return Turn(0.0, 0.0, text, f"its base stands {off_deg:.0f} deg from where the log left it")
    wound_rad = min(gone_rad, lag_rad) if gone_rad < whole_rad else gone_rad - whole_rad
    turn_rad = gone_rad - wound_rad
    done = f"{text}: {deg_from_rad(sign * turn_rad):.0f} of {deg_from_rad(roll_rad):.0f} deg"
    return Turn(sign * turn_rad, sign * wound_rad, done)


def _seen_rad(looks: Sequence[Measurement], expected: Pose) -> float | None:
    """The angle about the heading from the expected bevel to the one that is seen, if it is."""
    seen = [one.bevel for one in looks if one.bevel is not None]
    if len(seen) < len(looks):
        return None
    bevel = vector_of(sum(axis) for axis in zip(*seen, strict=True))
    side = cross(expected.heading, expected.bevel)
    return math.atan2(dot(bevel, side), dot(bevel, expected.bevel))
