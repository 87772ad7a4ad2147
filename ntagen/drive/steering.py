"""The needle in the driver's hands: every command and every reading goes through here.

A command reaches the journal first, then the device, then the estimator and the path. So nothing
moves that the log does not tell. A motion that failed counts as made: nobody knows how far the
needle got. A push that was ended early counts as far as it got.

Invariant: `Steering.path` is the channel in which the needle lies, by the last estimate and by all
commands after it.
"""

from __future__ import annotations

import itertools
import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from ntagen.drive.device import (
    Counts,
    Device,
    Halted,
    counts_of,
    lies,
    require_finite,
    rest,
    settle,
    spin_on,
)
from ntagen.drive.records import (
    Command,
    CutShort,
    Estimated,
    Journal,
    Looked,
    Measured,
    Stood,
)
from ntagen.drive.settings import Settings
from ntagen.drive.spinning import bent_last_mm, push_seconds
from ntagen.drive.torsion import Lag
from ntagen.errors import DeviceError
from ntagen.needle.estimate import Estimate, Estimator
from ntagen.needle.kinematics import Arc
from ntagen.needle.measurement import Measurement
from ntagen.needle.path import Path, sample_poses
from ntagen.needle.shape import Bounds
from ntagen.needle.vectors import distance
from ntagen.plan.actions import Push
from ntagen.scene import SHAFT_SPACING_MM, Needle, Vector

_ROLL_NEGLIGIBLE_RAD: Final = 1e-9

_ROLL_SMALL_RAD: Final = math.radians(10.0)
"""A tip whose bend differs by less from that of its channel follows the channel; ours."""


_KEPT: Final = 16
"""So many motions are kept: those of some seconds, and no tracker is believed that is so late."""


@dataclass(frozen=True, slots=True)
class _Motion:
    began_s: float
    from_mm: float
    to_mm: float
    speed_mm_per_s: float


class Lateness:
    """The last motions along the channel: where the tip was when a position was measured.

    A tracker is late: its values hold for `Measurement.time_s`, and the needle may have moved
    since. Only times are used that the log has, so that a replay finds the same.
    """

    def __init__(self) -> None:
        self._motions: deque[_Motion] = deque(maxlen=_KEPT)

    def note(self, began_s: float, from_mm: float, to_mm: float, speed_mm_per_s: float) -> None:
        """Notes a push or a pull from one depth to another, when it is over."""
        self._motions.append(_Motion(began_s, from_mm, to_mm, speed_mm_per_s))

    def depth_mm(self, time_s: float) -> float | None:
        """The depth of the tip at a time; None before the motions that are known."""
        for motion in reversed(self._motions):
            if time_s >= motion.began_s:
                went_mm = motion.speed_mm_per_s * (time_s - motion.began_s)
                if motion.to_mm > motion.from_mm:
                    return min(motion.to_mm, motion.from_mm + went_mm)
                return max(motion.to_mm, motion.from_mm - went_mm)
        return self._motions[0].from_mm if self._motions else None


_SIGMAS: Final = 8.0
"""The difference of two readings is longer than this by noise alone once in 10^6 runs: it has twice
the variance, in three directions."""

_TISSUE_MM: Final = 3.0
"""Tissue that is pressed or breathes carries the tip by this much between two readings; ours."""


class Reach:
    """What the next measured position can be, by the motions that were commanded.

    Between two measurements the tip moves at most as far as the needle was pushed and pulled,
    whatever the tissue does. A position that is farther away than that, and than noise explains, is
    wrong: the tracker takes another tool for the needle, or its reference was moved. To steer by it
    would be to steer another needle.

    A tracker may show the needle as it was before its last motion, so the motions since the
    measurement before the last one count.

    Args:
        settings: The noise of the tracker, and the deviation that is allowed.
    """

    def __init__(self, settings: Settings) -> None:
        priors = settings.priors
        noise_mm = priors.noise_mm + priors.distortion_mm
        tissue_mm = max(_TISSUE_MM, settings.deviation_mm)
        self._spare_mm = tissue_mm + settings.overrun_mm + _SIGMAS * noise_mm
        self._last: Measurement | None = None
        self._way_mm = 0.0
        self._way_before_mm = 0.0

    def moved(self, length_mm: float) -> None:
        """Notes a push or a pull of at most this length."""
        self._way_mm += length_mm

    def require(self, found: Measurement) -> None:
        """Takes a measurement.

        Raises:
            DeviceError: The tip cannot be there.
        """
        last, self._last = self._last, found
        way_mm = self._way_mm + self._way_before_mm
        self._way_before_mm, self._way_mm = self._way_mm, 0.0
        if last is None:
            return
        jump_mm = distance(found.position_mm, last.position_mm)
        if not jump_mm <= way_mm + self._spare_mm:
            raise DeviceError(
                f"the measured tip jumped by {jump_mm:.1f} mm, but the needle was moved by "
                f"{way_mm:.2f} mm at most; {self._spare_mm:.1f} mm more is allowed\n"
                "hint: does the tracker take another tool for the needle, was its reference moved, "
                "or has it more noise than the settings say?"
            )


class Steering:
    """A needle that is steered, and what is known of where it is.

    Args:
        needle: The needle at the entry, as the scene describes it.
        device: The needle.
        settings: How to drive.
        journal: Records commands, measurements and estimates.
        listen: Raises `KeyboardInterrupt` if somebody wants the run to end.
    """

    def __init__(
        self,
        needle: Needle,
        device: Device,
        settings: Settings,
        journal: Journal,
        listen: Callable[[], None],
    ) -> None:
        self._device = device
        self._journal = journal
        self._listen = listen
        self._estimator = Estimator(needle.tip, needle.radius_mm, settings.priors)
        self._settings = settings
        self._reach = Reach(settings)
        noise_mm = settings.priors.noise_mm + settings.priors.distortion_mm
        self._bounds = Bounds.of(needle, noise_mm)
        self._lateness = Lateness()
        self._speed_mm_per_s = needle.speed_mm_per_s
        self._pull_speed_mm_per_s = settings.pull_speed_ratio * needle.speed_mm_per_s
        self._roll_rad_per_s = settings.roll_rad_per_s
        self._lag = Lag(settings.compensated_lag_rad)
        self._radius_mm = needle.radius_mm
        self._cut_mm = self._all_cut_mm = 0.0
        self._left: tuple[Arc, ...] = ()
        # Whether the channel is longer than it was at the last pull.
        self._has_grown = False
        self.path = Path(needle.tip)
        self.seen_s = 0.0
        # The sum of all rolls: so far the base stands from where it stood at the entry.
        self.turned_rad = 0.0
        self.estimate: Estimate | None = None

    @property
    def depth_mm(self) -> float:
        """The commanded insertion depth."""
        return self.path.depth_mm

    @property
    def cut_mm(self) -> float:
        """The length of all channels that were cut, by the commands."""
        return self._all_cut_mm

    @property
    def cuts(self) -> bool:
        """Whether the tip is at the end of its channel, so that the next push cuts."""
        return self.path.depth_mm >= self._cut_mm - 1e-9

    @property
    def known(self) -> Estimate:
        """The last estimate, which comes before anything else needs it."""
        if self.estimate is None:
            raise AssertionError("the estimate comes before this")
        return self.estimate

    def now_s(self) -> float:
        """The time on the device's clock."""
        return self._device.now_s()

    def push(self, action: Push) -> bool:
        """Inserts the needle; returns whether it went all the way (`Halted`)."""
        length_mm, spin = action.length_mm, action.spin
        began_s = self._command("push", length_mm, spin)
        self._reach.moved(length_mm)
        made_mm = length_mm
        if spin:
            # A tip that turns does not follow an old channel.
            self._cut_mm = min(self._cut_mm, self.path.depth_mm)
        try:
            if spin:
                spin_on(self._device, length_mm, spin)
            else:
                self._device.push(length_mm)
        except Halted as halted:
            made_mm *= halted.part
            self._journal.record(CutShort(self.now_s(), made_mm, str(halted)))
            return False
        finally:
            self._inserted(began_s, action, made_mm)
        return True

    def _inserted(self, began_s: float, action: Push, made_mm: float) -> None:
        """Notes how much of a push was made."""
        from_mm = self._estimator.depth_mm
        self._estimator.push(made_mm, action.spin)
        self._note(began_s, from_mm, action)
        self.path = self.path.push(action.radius_mm(self._radius_mm), made_mm)
        self._all_cut_mm += max(0.0, self.path.depth_mm - self._cut_mm)
        self._cut_mm = max(self._cut_mm, self.path.depth_mm)
        self._has_grown = True

    def _note(self, began_s: float, from_mm: float, action: Push) -> None:
        """Notes a push for late measurements: turns take time, and what comes after them less."""
        to_mm, speed_mm_per_s = self._estimator.depth_mm, self._speed_mm_per_s
        if action.spin:
            lag_rad = self._lag.at_rad(self.path.depth_mm)
            last_mm = bent_last_mm(action)
            seconds = push_seconds(action, speed_mm_per_s, self._roll_rad_per_s, lag_rad)
            seconds -= last_mm / speed_mm_per_s
            first_mm = action.length_mm - last_mm
            turned_mm = min(to_mm, from_mm + first_mm)
            self._lateness.note(began_s, from_mm, turned_mm, first_mm / seconds)
            began_s, from_mm = began_s + seconds, turned_mm
        self._lateness.note(began_s, from_mm, to_mm, speed_mm_per_s)

    def settle(self) -> None:
        """Ends a turn in which a push with a spin was ended early."""
        settle(self._device)

    def roll(self, angle_rad: float) -> None:
        """Turns the needle: the next push leaves the old channel, if it lies in one."""
        self._turn(angle_rad)
        self._cut_mm = min(self._cut_mm, self.path.depth_mm)

    def _turn(self, angle_rad: float) -> None:
        self._command("roll", angle_rad)
        self._turned(angle_rad)
        self._device.roll(angle_rad)

    def _turned(self, angle_rad: float) -> None:
        """Notes a roll."""
        self._estimator.roll(angle_rad)
        self.path = self.path.roll(angle_rad)
        self.turned_rad += angle_rad

    @property
    def channels(self) -> tuple[Arc, ...]:
        """All arcs that were cut, by the estimates at their times, also those that were left."""
        return (*self._left, *self.path.arcs)

    def shaft_mm(self, depth_mm: float) -> tuple[Vector, ...]:
        """Places of the shaft when the tip is at this depth, `SHAFT_SPACING_MM` apart."""
        arcs = self.path.pull(max(0.0, self.depth_mm - depth_mm)).arcs
        return tuple(pose.position_mm for pose in sample_poses(arcs, SHAFT_SPACING_MM))

    def pull(self, length_mm: float) -> None:
        """Pulls the needle back along its channel."""
        began_s, from_mm = self._command("pull", length_mm), self._estimator.depth_mm
        self._reach.moved(length_mm)
        self._drawn(length_mm)
        self._lateness.note(began_s, from_mm, self._estimator.depth_mm, self._pull_speed_mm_per_s)
        self._device.pull(length_mm)

    def _drawn(self, length_mm: float) -> None:
        """Notes a pull."""
        if self._has_grown:
            self._left += self.path.arcs
            self._has_grown = False
        self._estimator.pull(length_mm)
        self.path = self.path.pull(length_mm)

    def withdraw(self) -> None:
        """Pulls the needle out to the entry along its channel, and never turns it."""
        while self.path.stretches:
            self.pull(self.path.stretches[-1].arc.length_mm)

    def undo_roll(self) -> None:
        """Undoes the rolls at or beyond this place, so that the tip fits its channel again."""
        angle_rad = math.remainder(self.path.pending_roll_rad, 2.0 * math.pi)
        if abs(angle_rad) > _ROLL_NEGLIGIBLE_RAD:
            self._turn(-angle_rad)
        if abs(angle_rad) > _ROLL_SMALL_RAD:
            # Without the roll, a push beyond this place leaves the channel.
            self._cut_mm = min(self._cut_mm, self.path.depth_mm)

    def pull_back_to(self, depth_mm: float) -> None:
        """Pulls the needle back to this depth in its channel, and undoes rolls where they were."""
        while self.path.depth_mm > depth_mm + 1e-9:
            self.undo_roll()
            last_mm = self.path.stretches[-1].arc.length_mm
            self.pull(min(last_mm, self.path.depth_mm - depth_mm))
        self.undo_roll()

    def wait(self, seconds: float) -> None:
        """Rests for a time where the needle is."""
        self._command("wait", seconds)
        rest(self._device, seconds)

    def measure(self) -> Measurement:
        """Measures the needle now.

        Raises:
            DeviceError: There is no reading, or it cannot be true.
        """
        measurement = self._device.measure()
        require_finite(measurement)
        self._bounds.require(measurement)
        self._reach.require(measurement)
        self._estimator.measure(measurement, self._lateness.depth_mm(measurement.time_s))
        self.seen_s = measurement.time_s
        self._journal.record(
            Measured(
                time_s=measurement.time_s,
                depth_mm=self.path.depth_mm,
                position_mm=measurement.position_mm,
                force_n=measurement.force_n,
                heading=measurement.heading or (),
                bevel=measurement.bevel or (),
                shape_mm=tuple(itertools.chain.from_iterable(measurement.shape)),
            )
        )
        return measurement

    def estimated(self) -> Estimate:
        """Estimates pose and circle from all commands and measurements, and records that."""
        estimate = self._estimator.estimate()
        self.estimate = estimate
        self.path = estimate.path
        self._radius_mm = estimate.radius_mm
        tip = estimate.tip
        self._journal.record(
            Estimated(
                self.now_s(),
                tip.position_mm,
                tip.heading,
                tip.bevel,
                estimate.radius_mm,
                estimate.radius_std_mm,
                estimate.rms_mm,
            )
        )
        return estimate

    def counts(self) -> Counts | None:
        """Where the axes stand by the count of what moves them, which is recorded if it counts."""
        counts = counts_of(self._device)
        if counts is not None:
            self._journal.record(Stood(self.now_s(), *counts))
        return counts

    def look(self) -> Measurement:
        """A reading of a needle of which nobody knows how deep it lies; no estimate takes it.

        Raises:
            DeviceError: There is no reading, or it is no number.
        """
        found = self._device.measure()
        require_finite(found)
        heading, bevel = found.heading or (), found.bevel or ()
        self.seen_s = found.time_s
        self._journal.record(Looked(found.time_s, found.position_mm, found.force_n, heading, bevel))
        return found

    def lies(self, depth_mm: float, turn_rad: float, wound_rad: float) -> None:
        """Notes where the needle was found: what was moved without a record is made up for.

        Args:
            depth_mm: The insertion depth.
            turn_rad: By how much the tip was turned since the last record.
            wound_rad: By how much its base is ahead of the tip.
        """
        if turn_rad:
            self._turned(turn_rad)
            self._cut_mm = min(self._cut_mm, self.path.depth_mm)
        way_mm = depth_mm - self.path.depth_mm
        if way_mm > 0.0:
            self._inserted(self.now_s(), Push(way_mm), way_mm)
        elif way_mm < 0.0:
            self._drawn(-way_mm)
        # The clock of this run is not that of the run before.
        self._reach, self._lateness = Reach(self._settings), Lateness()
        lies(self._device, depth_mm, wound_rad)

    def believe(self, path: Path) -> None:
        """Takes another channel of the same depth for the one in which the needle lies."""
        self.path = path

    def glance(self) -> Estimate:
        """An estimate now that changes nothing: path, record and radius stay."""
        return self._estimator.estimate()

    def stop(self) -> None:
        """Records the stop, and stops the needle even if that cannot be recorded."""
        try:
            self._journal.record(Command(self.now_s(), "stop", 0.0))
        finally:
            self._device.stop()

    def stop_at_once(self) -> None:
        """Stops the needle without a record: for ends in which the journal may fail."""
        self._device.stop()

    def _command(self, kind: str, value: float, spin: float = 0.0) -> float:
        """Records a motion that begins now, unless somebody wants the run to end; when it began."""
        self._listen()
        began_s = self.now_s()
        self._journal.record(Command(began_s, kind, value, spin))
        return began_s
