"""Which insertions calibrate a needle, and whether those that were made can tell what is asked.

Five insertions begin alike, and differ in how they are rolled on the way: not at all, and by 180
and 90 deg in both directions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from ntagen.errors import InputError
from ntagen.needle.vectors import distance
from ntagen.scene import Needle, Pose
from ntagen.tracking.insertions import Insertion, Turn
from ntagen.units import deg_from_rad

ANGLES_DEG: Final = (0, 180, -180, 90, -90)
"""By how much the base is rolled in each insertion."""

_DEEPEST_MM: Final = 100.0
_RADII: Final = 2.0
"""The insertions are at most so many radii long: the needle then points a little sideways."""

_SHORTEST_MM: Final = 50.0
_ROLL_SHARE: Final = 0.7
"""Rolls are at this part of the depth. The lag grows with the square of the depth, and what comes
after a roll shows it: on phantoms, with 0.5 the lag is known half as well, and with 0.8 as well."""

LEAST_INSERTIONS: Final = 5
"""Three numbers are looked for: two more insertions show whether one of them is bad, and let their
spread be seen. More gain with the root of their number."""

MOST_INSERTIONS: Final = 100

LEAST_PLACES: Final = 20
LEAST_DEPTH_MM: Final = 30.0
"""Bends of windows of 20 mm spread by a third in the tissue; those of whole insertions by 4 %."""

LEAST_AFTER_MM: Final = 15.0
"""After a roll, the needle must go on by so much: its new bend plane shows in how far it bends."""

LEAST_ROLL_MM: Final = 20.0
"""Above this depth, the lag of a roll is a twenty-fifth of that at 100 mm, and cannot be seen."""

LEAST_ANGLE_RAD: Final = math.radians(30.0)
"""A roll by less may turn nothing at all: the tip turns only when the base is ahead by the lag."""

START_MM: Final = 10.0
"""An insertion begins within this distance of the entry."""

LONGER_RATIO: Final = 1.1
"""The tip is at most this much farther from the entry than it was inserted, and 5 mm."""


def recipe(needle: Needle) -> tuple[float, float]:
    """How deep to insert a needle, and where to roll it, in mm.

    Raises:
        InputError: The needle is too short.
    """
    deepest_mm = min(_DEEPEST_MM, needle.length_mm, max(_SHORTEST_MM, _RADII * needle.radius_mm))
    depth_mm = 5.0 * math.floor(deepest_mm / 5.0)
    if depth_mm < _SHORTEST_MM:
        raise InputError(
            f"the needle is {needle.length_mm:g} mm long, and insertions for a calibration are "
            f"{_SHORTEST_MM:g} mm deep or deeper\nhint: correct its length in needle {{ … }}"
        )
    return depth_mm, float(round(_ROLL_SHARE * depth_mm))


def require_recipe(insertions: Sequence[Insertion]) -> None:
    """Refuses insertions that leave something open, whatever was measured in them."""
    count = len(insertions)
    if not LEAST_INSERTIONS <= count <= MOST_INSERTIONS:
        raise InputError(
            f"there are {count} insertions, and {LEAST_INSERTIONS} to {MOST_INSERTIONS} are "
            "needed\nhint: `ntagen calibrate needle ENV.nsl` prints which ones"
        )
    for one in insertions:
        if len(one.places_mm) < LEAST_PLACES:
            raise InputError(
                f"{one.name}: there are {len(one.places_mm)} positions, and {LEAST_PLACES} are "
                "the least\nhint: measure at least every 2 mm"
            )
        if one.depth_mm < LEAST_DEPTH_MM:
            raise InputError(
                f"{one.name}: the insertion is {one.depth_mm:.1f} mm deep, and "
                f"{LEAST_DEPTH_MM:g} mm is the least\nhint: on a short way the tissue hides how "
                "the needle bends; is depth_mm in mm?"
            )
    turns = [(one, turn) for one in insertions for turn in one.turns]
    if not turns:
        raise InputError(
            "in none of the insertions the needle is rolled, so nothing shows the lag of rolls\n"
            "hint: `ntagen calibrate needle ENV.nsl` prints at which depth to roll, and by how much"
        )
    seen = [turn for one, turn in turns if is_seen(one, turn)]
    if not seen:
        one, turn = max(turns, key=lambda pair: pair[1].depth_mm)
        raise InputError(
            f"no roll shows its lag: the deepest one, by {deg_from_rad(turn.angle_rad):.0f} deg, "
            f"is at {turn.depth_mm:.1f} mm of {one.depth_mm:.1f} mm\nhint: roll at least by "
            f"{deg_from_rad(LEAST_ANGLE_RAD):.0f} deg, {LEAST_ROLL_MM:g} mm deep or deeper, and "
            f"push on by {LEAST_AFTER_MM:g} mm or more"
        )
    if len({math.copysign(1.0, turn.angle_rad) for turn in seen}) < 2:
        direction = "positive" if seen[0].angle_rad > 0.0 else "negative"
        raise InputError(
            f"all rolls are in one direction ({direction}): tissue that turns the bend plane would "
            "be taken for a lag\nhint: roll by the opposite angle in half of the insertions"
        )


def is_seen(insertion: Insertion, turn: Turn) -> bool:
    """Whether a roll is deep, large and long enough to show its lag."""
    after_mm = insertion.depth_mm - turn.depth_mm
    is_deep = turn.depth_mm >= LEAST_ROLL_MM and after_mm >= LEAST_AFTER_MM
    return is_deep and abs(turn.angle_rad) >= LEAST_ANGLE_RAD


def require_plausible(insertion: Insertion, entry: Pose) -> None:
    """Refuses positions that no needle has that enters here."""
    first_mm = distance(insertion.places_mm[0], entry.position_mm)
    allowed_mm = START_MM + insertion.depths_mm[0]
    if first_mm > allowed_mm:
        raise InputError(
            f"{insertion.name}: the first position is {first_mm:.1f} mm from the entry, and the "
            f"needle was inserted by {insertion.depths_mm[0]:.1f} mm\n"
            "hint: is the registration that of this tracker, and does the scene begin where the "
            "needle entered?"
        )
    for depth_mm, place_mm in zip(insertion.depths_mm, insertion.places_mm, strict=True):
        away_mm = distance(place_mm, entry.position_mm)
        if away_mm > LONGER_RATIO * depth_mm + START_MM:
            raise InputError(
                f"{insertion.name}: at {depth_mm:.1f} mm deep, the tip is {away_mm:.1f} mm from "
                "the entry\nhint: are depth and positions in the units that the columns say?"
            )
    ahead_mm = np.subtract(insertion.places_mm[-1], entry.position_mm) @ np.array(entry.heading)
    if ahead_mm < 0.0:
        raise InputError(
            f"{insertion.name}: the needle goes against its heading, by {-ahead_mm:.1f} mm\n"
            "hint: check the registration, and the heading in needle { … }"
        )


def measured_noise_mm(insertions: Sequence[Insertion]) -> float:
    """The noise of each coordinate, from third differences of neighbouring positions.

    A smooth path has nearly none, and those of noise have the variance 20. The median of their
    sizes leaves out what a roll adds.
    """
    found: list[float] = []
    for one in insertions:
        depths_mm, places = np.array(one.depths_mm), np.array(one.places_mm)
        is_new = np.append(True, np.diff(depths_mm) > 1e-6)
        places = places[is_new]
        if len(places) > 3:
            found += np.abs(np.diff(places, 3, axis=0)).ravel().tolist()
    if not found:
        raise InputError("no insertion has four positions at different depths")
    return max(_LEAST_NOISE_MM, float(np.median(found)) / _MEDIAN_OF_NORMAL / math.sqrt(20.0))


_MEDIAN_OF_NORMAL: Final = 0.6745
_LEAST_NOISE_MM: Final = 0.01
