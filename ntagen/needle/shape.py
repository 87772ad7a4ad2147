"""The whole shape of a needle as a measurement: places along its shaft up to its tip.

A fibre with Bragg gratings tells where all of a needle lies, and so do images. The shaft lies in
the channel that the tip has cut. So each place of a shape says where the tip was at that depth, and
one shape tells direction and curvature, which tips tell only one after the other.

What reconstructs a shape knows a few numbers of it and tells many places, so places near to each
other share their error. Those on `Priors.shape_spacing_mm` therefore count as one.

`measurement_of` is what a tracker calls; it refuses what is no shape of any needle.
`Bounds.require` refuses what is none of this needle.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ntagen.errors import DeviceError
from ntagen.needle.measurement import Measurement
from ntagen.scene import Needle, Pose, Vector
from ntagen.shapes import vector_of

_Array = NDArray[np.float64]

ANCHOR_MM: Final = 5.0
"""Lengths along a shape are added up over lines of this length, and kinks are seen on it; ours."""

LEAST_PLACES: Final = 3
MOST_PLACES: Final = 10_000

LEAST_MM: Final = 10.0
"""A shape is at least this long: with the part outside of the tissue, at the start, too."""

GAP_MM: Final = 25.0
"""Neighbours are at most so far from each other: slices of images are up to 10 mm apart; ours."""

ENTRY_MM: Final = 10.0
"""The needle passes the entry within this distance, as the tip does at the start."""

LONGER_RATIO: Final = 1.05
"""Noise makes a line through the places longer than the needle; ours."""

TIGHTER_RATIO: Final = 3.0
"""A needle may bend this much more than expected before its shape has a kink; ours."""

SIGMAS: Final = 6.0
"""Noise makes a kink of a needle once in 10^8 places."""


@dataclass(frozen=True, eq=False)
class Shape:
    """The shape of a needle.

    Attributes:
        positions_mm: Places along the needle from its base to its tip, in the frame of the scene:
            an array (places, 3). The last one is the tip.
        stamp_s: The time for which they hold, on the device's clock.
    """

    positions_mm: _Array
    stamp_s: float


def measurement_of(shape: Shape, force_n: float = 0.0) -> Measurement:
    """What the estimator takes of a shape: its tip and all of its places.

    Args:
        shape: The shape.
        force_n: The axial force that was measured with it; 0 if none was.

    Raises:
        DeviceError: It is no shape of a needle: a place is no number, there are too few or too
            many, two neighbours are too far apart, or all of it is too short.
    """
    places = np.asarray(shape.positions_mm, dtype=np.float64)
    if places.ndim != 2 or places.shape[1] != 3:
        raise DeviceError(
            f"a shape is an array (places, 3), and this one has the form {places.shape}\n"
            "hint: give x, y and z of each place in mm, from the base to the tip"
        )
    count = len(places)
    if not LEAST_PLACES <= count <= MOST_PLACES:
        raise DeviceError(
            f"the shape has {count} places; {LEAST_PLACES} to {MOST_PLACES} are allowed\n"
            "hint: does the sensor see all of the needle?"
        )
    wrong = np.flatnonzero(~np.isfinite(places).all(axis=1))
    if len(wrong):
        raise DeviceError(
            f"place {wrong[0] + 1} of the {count} of the shape is {_words(places[wrong[0]])}, "
            "which is not a number\nhint: is a part of the needle out of view, or a fibre broken?"
        )
    steps_mm = np.linalg.norm(np.diff(places, axis=0), axis=1)
    widest = int(np.argmax(steps_mm))
    if steps_mm[widest] > GAP_MM:
        raise DeviceError(
            f"the shape jumps by {steps_mm[widest]:.1f} mm between its places {widest + 1} and "
            f"{widest + 2}; {GAP_MM:g} mm is allowed\n"
            "hint: is it in mm, are its places in order along the needle, and are any missing?"
        )
    length_mm = float(_along_from_tip(places)[0])
    if length_mm < LEAST_MM:
        raise DeviceError(
            f"the shape is {length_mm:.3g} mm long, and {LEAST_MM:g} mm is the least\n"
            "hint: is it in mm and not in m? At the start, the part outside of the tissue counts"
        )
    return Measurement(
        shape.stamp_s, vector_of(places[-1]), force_n, shape=tuple(map(vector_of, places))
    )


def thinned(places_mm: tuple[Vector, ...], spacing_mm: float) -> list[tuple[float, Vector]]:
    """The places of a shape that count, without its tip: means of those that are near together.

    Args:
        places_mm: The places from the base to the tip.
        spacing_mm: One place counts on each such length.

    Returns:
        How far each is behind the tip along the needle, in mm, and where it is; from the tip on.
    """
    from_tip = np.array(places_mm[::-1])
    behind_mm = _along_from_tip(np.array(places_mm))[::-1]
    begins, least_mm = [], _NEAR_RATIO * spacing_mm
    begun_mm = 0.0
    for index, at_mm in enumerate(behind_mm.tolist()):
        if at_mm - begun_mm >= least_mm:
            begins.append(index)
            begun_mm = at_mm
    if not begins:
        return []
    counts = np.diff([*begins, len(from_tip)])
    means = np.add.reduceat(from_tip, begins) / counts[:, None]
    means_mm = np.add.reduceat(behind_mm, begins) / counts
    return list(zip(means_mm.tolist(), map(vector_of, means), strict=True))


def _along_from_tip(places: _Array) -> _Array:
    """How far each place is behind the tip along the needle, in mm.

    Lines between all neighbours would be too long, by the noise of each. So only places that are
    `ANCHOR_MM` from each other are counted on; those between them lie there as they follow.
    """
    anchors, lengths_mm = [0], [0.0]
    from_tip = places[::-1]
    for index in range(1, len(places)):
        away_mm = float(np.linalg.norm(from_tip[index] - from_tip[anchors[-1]]))
        if away_mm >= ANCHOR_MM - _NOTHING_MM or index == len(places) - 1:
            anchors.append(index)
            lengths_mm.append(lengths_mm[-1] + away_mm)
    return np.interp(np.arange(len(places)), anchors, lengths_mm)[::-1]


_NOTHING_MM: Final = 1e-6
_NEAR_RATIO: Final = 0.75
"""Noise brings places nearer together: those that are a spacing apart must not count as one."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """What shapes this needle can have.

    Attributes:
        entry: Where it enters the tissue.
        radius_mm: The expected radius of its motion circle.
        length_mm: Its whole length: that inside of the tissue and the free length outside.
        noise_mm: The standard deviation of each coordinate of a place.
    """

    entry: Pose
    radius_mm: float
    length_mm: float
    noise_mm: float

    @staticmethod
    def of(needle: Needle, noise_mm: float) -> Bounds:
        """Those of the needle of a scene, before anything of it is inserted."""
        return Bounds(needle.tip, needle.radius_mm, needle.length_mm, noise_mm)

    def require(self, found: Measurement) -> None:
        """Takes a measurement with a shape, or without one.

        Raises:
            DeviceError: This needle cannot lie so: the shape begins at the tip, is longer than the
                needle, does not pass the entry, or has a kink.
        """
        if not found.shape:
            return
        line = [(0.0, found.position_mm), *thinned(found.shape, ANCHOR_MM)]
        behind_mm, places = np.array([at for at, _ in line]), np.array([one for _, one in line])
        self._require_order(places)
        self._require_length(float(behind_mm[-1]))
        self._require_entry(places)
        # One place that is wrong does not show in a mean, and a slow bend not between neighbours.
        self._require_smooth(np.array(found.shape[::-1]))
        self._require_smooth(places)

    def _require_order(self, places: _Array) -> None:
        """Refuses a shape that begins at the tip: there it would run out of the tissue."""
        towards = places[max(0, len(places) - 3)] - places[-1]
        if float(towards @ np.array(self.entry.heading)) < 0.0:
            raise DeviceError(
                f"the shape runs out of the tissue, from {_words(places[-1])} mm to "
                f"{_words(places[0])} mm\nhint: its places go from the base to the tip; is the tip "
                "the first one?"
            )

    def _require_length(self, length_mm: float) -> None:
        most_mm = LONGER_RATIO * self.length_mm + ANCHOR_MM
        if length_mm > most_mm:
            raise DeviceError(
                f"the shape is {length_mm:.1f} mm long, and the needle {self.length_mm:g} mm: the "
                f"inserted depth and the free length\nhint: is the shape in mm? write the length "
                "of the needle in needle { … }, or leave places out that are far from the entry"
            )

    def _require_entry(self, places: _Array) -> None:
        entry_mm = np.array(self.entry.position_mm)
        away_mm = min(
            _distance_mm(entry_mm, one, other) for one, other in itertools.pairwise(places)
        )
        if away_mm > ENTRY_MM:
            raise DeviceError(
                f"the shape passes the entry at {_words(entry_mm)} mm in a distance of "
                f"{away_mm:.1f} mm; {ENTRY_MM:g} mm is allowed\n"
                "hint: is the registration that of this sensor, and is the shape in mm?"
            )

    def _require_smooth(self, places: _Array) -> None:
        """Refuses a place that is farther beside its neighbours than any bend explains."""
        before, here, after = places[:-2], places[1:-1], places[2:]
        first_mm = np.linalg.norm(here - before, axis=1)
        second_mm = np.linalg.norm(after - here, axis=1)
        share = (second_mm / (first_mm + second_mm))[:, None]
        off_mm = np.linalg.norm(here - share * before - (1.0 - share) * after, axis=1)
        # The error of the place and half of those of its neighbours, in three coordinates.
        noise_mm = SIGMAS * self.noise_mm * np.sqrt(1.5)
        allowed_mm = TIGHTER_RATIO * first_mm * second_mm / (2.0 * self.radius_mm) + noise_mm
        worst = int(np.argmax(off_mm - allowed_mm)) if len(off_mm) else 0
        if len(off_mm) and off_mm[worst] > allowed_mm[worst]:
            raise DeviceError(
                f"the shape has a kink at {_words(here[worst])} mm: this place is "
                f"{off_mm[worst]:.1f} mm beside its neighbours, and {allowed_mm[worst]:.1f} mm is "
                "allowed\nhint: has a place of another tool been taken, is the needle bent, or has "
                "the sensor more noise than `prior noise` says?"
            )


def _distance_mm(point: _Array, one: _Array, other: _Array) -> float:
    """The distance of a point from the line between two others."""
    along = other - one
    share = float(np.clip((point - one) @ along / max(float(along @ along), _NOTHING_MM), 0.0, 1.0))
    return float(np.linalg.norm(point - one - share * along))


def _words(place: _Array) -> str:
    return "(" + ", ".join(f"{number:.1f}" for number in place) + ")"
