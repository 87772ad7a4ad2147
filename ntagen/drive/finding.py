"""Finds a needle in the channel that an earlier run has cut, and says what that relies on.

Nothing moves here. There are four sources, and none is believed alone where another can contradict:

* the log: the channel, how deep the needle was, and the motion that it may have been in. That
  motion was recorded before it began, so any part of it may have been made;
* the tracker: several readings of the tip, which must agree with each other. They must lie on the
  channel, within the `deviation` that is allowed, three standard deviations of the estimated tip,
  and noise: tissue relaxes while nobody pushes;
* the count of the controller: how deep the needle is, and how its base is turned. A controller that
  lost its power has lost its count, too: then the count does not fit the log, or the tracker;
* the bevel, if the tracker sees it.

If a source contradicts, nothing is moved (`DeviceError`). If nothing says how the bevel stands, or
the log does not know the channel, the needle may only be pulled back.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from ntagen.drive.deviation import allowed_misfit_mm
from ntagen.drive.device import Counts
from ntagen.drive.records import Command
from ntagen.drive.settings import Settings
from ntagen.drive.turning import turn_of
from ntagen.errors import DeviceError
from ntagen.needle.estimate import Estimate
from ntagen.needle.kinematics import orthonormal
from ntagen.needle.measurement import Measurement
from ntagen.needle.path import Path
from ntagen.needle.vectors import distance, dot
from ntagen.plan.actions import Push
from ntagen.scene import Pose, Vector
from ntagen.shapes import vector_of
from ntagen.units import deg_from_rad

LOOKS: Final = 8
"""So many readings are taken before the operator is asked, and as many after the answer."""

_TUBE_SIGMAS: Final = 3.0
_NOISE_SIGMAS: Final = 6.0
_STILL_MM: Final = 0.5
"""Readings of a needle at rest differ by this and by noise: tissue creeps; ours."""

_ROUNDING_MM: Final = 1e-6

_COUNT_MM: Final = 0.1
"""The count of a controller that was left alone fits the log by this; ours."""

_LEAST_MM: Final = 1.0
"""Less than this is nothing, where the tracker alone tells how deep the needle is; and a needle
that is less deep is as good as at the entry: a run begins there anew; ours."""

_ASKEW_RAD: Final = math.radians(30.0)
"""A heading that is seen may differ by this from that of the channel; ours."""

_BY_HAND: Final = (
    "hint: pull the needle back by hand, along the way that it came, and begin anew at the entry"
)


@dataclass(frozen=True, slots=True)
class Clues:
    """What is known of a needle that lies in the tissue.

    Attributes:
        looks: The readings.
        estimate: Where it was before the motion in which the log was cut off.
        pending: That motion; None if the log ends between two motions.
        counted: The count of the controller since the entry: how deep the needle is, and by how
            much its base is turned more than the log says. None if it does not count.
        lag_rad: By how much the base is ahead of the tip in a roll.
    """

    looks: Sequence[Measurement]
    estimate: Estimate
    pending: Command | None
    counted: Counts | None
    lag_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class Place:
    """Where a needle was found.

    Attributes:
        depth_mm: The insertion depth.
        turn_rad: By how much the tip was turned since the last record.
        wound_rad: By how much its base is ahead of the tip.
        tip_mm: The mean of the readings.
        off_mm: How far that is from the channel.
        allowed_mm: How far it may be.
        text: What this relies on, in words.
        lack: Why the driver may not go on from here; empty if it may.
    """

    depth_mm: float
    turn_rad: float
    wound_rad: float
    tip_mm: Vector
    off_mm: float
    allowed_mm: float
    text: str
    lack: str


@dataclass(frozen=True, slots=True)
class _Depth:
    """How deep the needle is, and whether the controller has kept its count."""

    depth_mm: float
    is_counted: bool
    text: str
    lack: str = ""


def find(clues: Clues, settings: Settings) -> Place:
    """Where the needle is.

    Raises:
        DeviceError: The readings do not agree with each other, with the channel, or with what the
            controller counts.
    """
    tip_mm = mean_mm(clues.looks)
    require_still(clues.looks, tip_mm, settings)
    span = _Span.of(clues, settings)
    depth = span.depth_at(tip_mm, clues.counted)
    end = span.upto(depth.depth_mm)
    off_mm = end.nearest_to(tip_mm).distance_mm
    counted_rad = clues.counted[1] if clues.counted is not None and depth.is_counted else None
    expected = orthonormal(end.tip)
    turn = turn_of(clues.looks, expected, clues.pending, counted_rad, clues.lag_rad)
    _require_heading(clues.looks, expected, off_mm)
    lack = "; ".join(filter(None, (depth.lack, turn.lack)))
    if not lack and depth.depth_mm < _LEAST_MM:
        lack = f"it is {depth.depth_mm:.2f} mm deep: a run begins anew at the entry"
    return Place(
        depth_mm=depth.depth_mm,
        turn_rad=turn.turn_rad,
        wound_rad=turn.wound_rad,
        tip_mm=tip_mm,
        off_mm=off_mm,
        allowed_mm=span.allowed_mm,
        text=f"{depth.text}; {turn.text}",
        lack=lack,
    )


def mean_mm(looks: Sequence[Measurement]) -> Vector:
    """The mean position of some readings."""
    axes = zip(*(one.position_mm for one in looks), strict=True)
    return vector_of(sum(axis) / len(looks) for axis in axes)


def require_still(looks: Sequence[Measurement], place_mm: Vector, settings: Settings) -> None:
    """Refuses readings that are not those of a needle at rest at a place.

    Raises:
        DeviceError: One is too far away.
    """
    allowed_mm = _STILL_MM + _NOISE_SIGMAS * settings.priors.noise_mm
    off_mm = max(distance(one.position_mm, place_mm) for one in looks)
    if not off_mm <= allowed_mm:
        raise DeviceError(
            f"the needle does not lie still, or the tracker does not see it well: readings of the "
            f"tip are {off_mm:.1f} mm apart, and {allowed_mm:.1f} mm is allowed\n"
            "hint: wait until nothing moves, and resume the log again"
        )


@dataclass(frozen=True, slots=True)
class _Span:
    """The part of the channel in which the needle may be by the log.

    Attributes:
        path: The channel up to its far end.
        beyond: The same and a little more: a log may lack its end.
        low_mm: The least depth.
        high_mm: The greatest depth.
        allowed_mm: How far the tip may be from the channel.
    """

    path: Path
    beyond: Path
    low_mm: float
    high_mm: float
    allowed_mm: float

    @staticmethod
    def of(clues: Clues, settings: Settings) -> _Span:
        """The part of a channel, by the log."""
        known, pending = clues.estimate, clues.pending
        path, here_mm, length_mm = known.path, known.path.depth_mm, 0.0
        low_mm = here_mm
        if pending is not None and pending.kind == "push":
            length_mm = pending.value
            path = path.push(Push(length_mm, pending.spin).radius_mm(known.radius_mm), length_mm)
        elif pending is not None and pending.kind == "pull":
            low_mm = max(0.0, here_mm - pending.value)
        tube_mm = _TUBE_SIGMAS * known.position_std_mm(length_mm)
        allowed_mm = tube_mm + allowed_misfit_mm(settings)
        beyond = path.push(known.radius_mm, allowed_mm)
        return _Span(path, beyond, low_mm, here_mm + length_mm, allowed_mm)

    def upto(self, depth_mm: float) -> Path:
        """The channel up to a depth, or as far as it is known."""
        path = self.path if depth_mm <= self.path.depth_mm else self.beyond
        return path.pull(max(0.0, path.depth_mm - depth_mm))

    def depth_at(self, tip_mm: Vector, counted: Counts | None) -> _Depth:
        """The depth of a tip that is seen there.

        Raises:
            DeviceError: It is not on the channel, or not where the controller says.
        """
        count_mm = None if counted is None else counted[0]
        if count_mm is not None:
            if self.low_mm - _COUNT_MM <= count_mm <= self.high_mm + _COUNT_MM:
                return self._counted(count_mm, tip_mm)
            if self._is_deeper(count_mm, tip_mm):
                text = f"{count_mm:.2f} mm deep by the count of the controller"
                return _Depth(count_mm, True, text, _deeper(count_mm - self.high_mm))
        near = self.beyond.nearest_to(tip_mm)
        is_farther = near.at_mm >= self.beyond.depth_mm - _ROUNDING_MM
        self._require_on(math.inf if is_farther else near.distance_mm, tip_mm)
        agrees = count_mm is not None and abs(count_mm - near.at_mm) <= self.allowed_mm
        if count_mm is not None and count_mm < self.low_mm and agrees:
            return self._drawn_out(max(0.0, count_mm), is_counted=True)
        if near.at_mm < self.low_mm - self.allowed_mm:
            return self._drawn_out(near.at_mm, is_counted=False)
        depth_mm, lack = max(self.low_mm, min(self.high_mm, near.at_mm)), ""
        if near.at_mm > self.high_mm + _LEAST_MM:
            depth_mm, lack = near.at_mm, _deeper(near.at_mm - self.high_mm)
        text = f"{depth_mm:.2f} mm deep as the tracker sees it; no controller counts its axes"
        if count_mm is not None:
            text = (
                f"{depth_mm:.2f} mm deep as the tracker sees it; the controller counts "
                f"{count_mm:.2f} mm: it has lost its position"
            )
        return _Depth(depth_mm, False, text, lack)

    def _counted(self, count_mm: float, tip_mm: Vector) -> _Depth:
        """The depth by the controller, if the tracker sees the tip there."""
        depth_mm = max(self.low_mm, min(self.high_mm, count_mm))
        here = self.path.pull(self.path.depth_mm - depth_mm)
        off_mm = distance(here.tip.position_mm, tip_mm)
        if off_mm > self.allowed_mm:
            raise DeviceError(
                f"the controller counts {count_mm:.2f} mm, and the tracker sees the tip "
                f"{off_mm:.1f} mm from there; {self.allowed_mm:.1f} mm is allowed\n"
                "hint: does the tracker see this needle, and is its registration the same? Did "
                f"the motors lose steps?\n{_BY_HAND}"
            )
        return _Depth(
            depth_mm,
            True,
            f"{depth_mm:.2f} mm deep by the count of the controller and by the tracker",
        )

    def _require_on(self, off_mm: float, tip_mm: Vector) -> None:
        """Refuses a tip that is not on the channel.

        Raises:
            DeviceError: It is not.
        """
        if off_mm <= self.allowed_mm:
            return
        place = ", ".join(f"{one:.1f}" for one in tip_mm)
        away_mm = self.path.nearest_to(tip_mm).distance_mm
        raise DeviceError(
            f"the tracker sees the tip at ({place}) mm, {away_mm:.1f} mm from the channel that the "
            f"log tells; {self.allowed_mm:.1f} mm is allowed\n"
            "hint: is this the last log of this needle, and the registration that of this tracker? "
            f"Was the needle moved since?\n{_BY_HAND}"
        )

    def _is_deeper(self, count_mm: float, tip_mm: Vector) -> bool:
        """Whether the tip can be so deep that the log lacks the end of its way: it may bend."""
        beyond_mm = count_mm - self.high_mm
        away_mm = distance(tip_mm, self.path.tip.position_mm)
        is_near = 0.5 * beyond_mm - self.allowed_mm <= away_mm <= beyond_mm + self.allowed_mm
        return beyond_mm > 0.0 and is_near

    def _drawn_out(self, depth_mm: float, *, is_counted: bool) -> _Depth:
        """The depth of a needle that is less deep than the log says: somebody pulled it back."""
        back_mm = self.low_mm - depth_mm
        counted = "by the count of the controller and by the tracker"
        by = counted if is_counted else "as the tracker sees it"
        since = f"{back_mm:.2f} mm less than the log tells: it was pulled back since"
        return _Depth(depth_mm, is_counted, f"{depth_mm:.2f} mm deep {by}, {since}")


def _deeper(beyond_mm: float) -> str:
    """Why nobody goes on from a needle that is deeper than its log tells."""
    return (
        f"it is {beyond_mm:.2f} mm deeper than the log tells: the end of the log is missing, and "
        "nobody knows the channel there"
    )


def _require_heading(looks: Sequence[Measurement], expected: Pose, off_mm: float) -> None:
    """Refuses a needle on its channel that points elsewhere.

    Raises:
        DeviceError: It does.
    """
    seen = [one.heading for one in looks if one.heading is not None]
    if not seen or off_mm > _LEAST_MM:
        return
    heading = vector_of(sum(axis) / len(seen) for axis in zip(*seen, strict=True))
    length = math.sqrt(dot(heading, heading))
    cosine = dot(heading, expected.heading) / length if length > 0.0 else -1.0
    angle_rad = math.acos(max(-1.0, min(1.0, cosine)))
    if angle_rad > _ASKEW_RAD:
        raise DeviceError(
            f"the tracker sees the needle point {deg_from_rad(angle_rad):.0f} deg away from its "
            f"channel\nhint: check axis=… of the tracker and the registration\n{_BY_HAND}"
        )
