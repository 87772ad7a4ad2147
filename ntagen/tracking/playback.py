"""A recorded run as a tracker: its samples come again at the times at which they were measured.

A recording begins with the first measurement that is asked for. From then on each measurement is
the newest sample up to the present moment, on the clock of the actuator. So a recording serves with
a simulated clock as well as with a real one. What is asked beyond its end is a fault: a needle that
moves on after the recording has ended would be steered blindly.
"""

from __future__ import annotations

import bisect
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from ntagen.drive.reading import read_log
from ntagen.drive.records import Measured
from ntagen.errors import DeviceError, InputError
from ntagen.needle.measurement import Measurement
from ntagen.needle.shape import Shape, measurement_of
from ntagen.needle.vectors import dot, unit
from ntagen.scene import Vector
from ntagen.tracking.frames import IDENTITY, Transform
from ntagen.tracking.points import axis_columns
from ntagen.tracking.tables import Row, Table, read_table, require_near, shown

HOLD_S: Final = 5.0
"""Within the recording, a sample counts for so long; the samples of a run are as far apart as its
motions."""

END_S: Final = 0.5
"""The last sample counts for so long after the end."""

_DIRECTIONS: Final = ("heading", "bevel")
_RIGHT_ANGLE: Final = 1e-2
_SAME_S: Final = 1e-6
"""Times that differ by less are equal: sums of floating-point numbers are not exact."""


class Playback:
    """A `ntagen.drive.device.Sensor` that repeats samples.

    Args:
        name: Where they come from, for messages.
        samples: The samples in the frame of the scene, in the order of time.
        now_s: The clock.
        measures_force: Whether the samples have a force; without it, it is always 0.

    Raises:
        InputError: There are no samples, or their times go back.
    """

    def __init__(
        self,
        name: str,
        samples: Sequence[Measurement],
        now_s: Callable[[], float],
        *,
        measures_force: bool = True,
    ) -> None:
        self.measures_force = measures_force
        if not samples:
            raise InputError(f"{name}: there are no measurements in this file")
        self._name = name
        self._samples = samples
        self._times = [sample.time_s for sample in samples]
        for earlier_s, later_s in zip(self._times, self._times[1:], strict=False):
            if later_s < earlier_s:
                raise InputError(
                    f"{name}: the time goes back, from {earlier_s:g} s to {later_s:g} s"
                )
        self._now_s = now_s
        self._began_s: float | None = None

    def measure(self) -> Measurement:
        """The sample of this moment, with the present time.

        Raises:
            DeviceError: The recording has ended, or has no sample for this moment.
        """
        now_s = self._now_s()
        if self._began_s is None:
            self._began_s = now_s
        first_s, last_s = self._times[0], self._times[-1]
        at_s = now_s - self._began_s + first_s
        if at_s > last_s + END_S:
            raise DeviceError(
                f"the recording {self._name} has ended: it has {last_s - first_s:.2f} s, and the "
                f"run is at {at_s - first_s:.2f} s\nhint: give a longer recording"
            )
        sample = self._samples[bisect.bisect_right(self._times, at_s + _SAME_S) - 1]
        age_s = max(0.0, at_s - sample.time_s)
        if age_s > HOLD_S:
            raise DeviceError(
                f"the recording {self._name} has a gap: no sample for {age_s:.2f} s, and "
                f"{HOLD_S:g} s is allowed"
            )
        return replace(sample, time_s=now_s - age_s)


def samples_of_log(path: Path) -> list[Measurement]:
    """The measurements of a run that `ntagen drive --log` wrote.

    Raises:
        InputError: The file is not such a log, or has no measurements.
    """
    log = read_log(path)
    found = [
        Measurement(
            record.time_s,
            record.position_mm,
            record.force_n,
            _optional(record.heading),
            _optional(record.bevel),
            record.shape,
        )
        for record in log.records
        if isinstance(record, Measured)
    ]
    if not found:
        cut = "" if log.torn_at_byte is None else f": it is cut off at byte {log.torn_at_byte}"
        raise InputError(f"{path}: there are no measurements in this log{cut}")
    return found


def samples_of_table(path: Path, transform: Transform) -> tuple[list[Measurement], bool]:
    """The measurements in a CSV file, in the frame of the scene, and whether they have a force.

    The first line names the columns: ``time_s``; ``x_mm``, ``y_mm``, ``z_mm`` for positions in the
    scene's frame, or ``tracker_x_mm``, … for another one; and, if they were measured, ``force_n``,
    ``heading_x``, …, ``bevel_x``, …, the latter in the frame of the positions.

    Args:
        path: The file.
        transform: The registration; the identity if there is none.

    Raises:
        InputError: The file has a mistake, or its frame is not that of the transform.
    """
    table = read_table(path)
    measurements = _Measurements(table, transform)
    return [measurements.of(row) for row in table.rows], "force_n" in table.names


def samples_of_shapes(path: Path, transform: Transform) -> tuple[list[Measurement], bool]:
    """The shapes in a CSV file, in the frame of the scene, and whether they have a force.

    Each line is a place of the needle, with the columns of `samples_of_table`. Lines that follow
    each other with the same time are a shape, from the base of the needle to its tip.

    Args:
        path: The file.
        transform: The registration; the identity if there is none.

    Raises:
        InputError: The file has a mistake, its frame is not that of the transform, or a shape is
            none of a needle.
    """
    table = read_table(path)
    measurements = _Measurements(table, transform)
    found = []
    for _, group in itertools.groupby(table.rows, measurements.time_s):
        rows = list(group)
        places = [measurements.of(row) for row in rows]
        shape = Shape(np.array([one.position_mm for one in places]), places[0].time_s)
        try:
            found.append(measurement_of(shape, places[-1].force_n))
        except DeviceError as error:
            raise InputError(f"{rows[0].place}: {error}") from error
    return found, "force_n" in table.names


class _Measurements:
    """The columns of a table of measurements."""

    def __init__(self, table: Table, transform: Transform) -> None:
        self._table = table
        self._transform = transform
        path, head = table.path, table.names
        self._columns = {name: index for index, name in enumerate(head)}
        frames = axis_columns(path, head)
        if len(frames) != 1:
            raise InputError(f"{path}:1: there are positions in {len(frames)} frames, not in one")
        (frame, self._axes), *_ = frames.items()
        if "time_s" not in head:
            raise InputError(f"{path}:1: there is no column time_s")
        expected = transform.source if transform != IDENTITY else ""
        if frame.lower() != expected.lower():
            raise InputError(other_frame(path, frame, expected))

    def time_s(self, row: Row) -> float:
        """The time of a row."""
        return self._number(row, self._columns["time_s"])

    def of(self, row: Row) -> Measurement:
        """The measurement in a row."""
        x, y, z = (self._number(row, column) * factor for column, factor in self._axes)
        require_near((x, y, z), row.place)
        heading, bevel = (self._direction(row, name) for name in _DIRECTIONS)
        if heading and bevel and abs(dot(heading, bevel)) > _RIGHT_ANGLE:
            raise InputError(f"{row.place}: heading and bevel are not at a right angle")
        force = self._columns.get("force_n")
        return Measurement(
            time_s=self.time_s(row),
            position_mm=self._transform.point((x, y, z)),
            force_n=0.0 if force is None else self._number(row, force),
            heading=heading,
            bevel=bevel,
        )

    def _direction(self, row: Row, name: str) -> Vector | None:
        """A direction of length 1; none without columns, or with empty cells."""
        columns = [self._columns.get(f"{name}_{axis}") for axis in "xyz"]
        known = [column for column in columns if column is not None]
        if not any(row.cells[column] for column in known):
            return None
        if len(known) != len(columns):
            raise InputError(f"{self._table.path}:1: there are not all of {name}_x, …, {name}_z")
        x, y, z = (self._number(row, column) for column in known)
        try:
            return self._transform.direction(unit((x, y, z)))
        except ValueError:
            raise InputError(f"{row.place}: the {name} has no direction") from None

    def _number(self, row: Row, column: int) -> float:
        number = self._table.number(row, column)
        if not math.isfinite(number):
            raise InputError(f"{row.place}: '{shown(row.cells[column])}' is not a number")
        return number


def other_frame(path: Path, frame: str, expected: str) -> str:
    """The message about positions in a frame that is not that of the registration."""
    if not frame:
        return (
            f"{path}: the columns x_mm, … are positions in the scene's frame, but there is a "
            f"registration from {expected}\nhint: leave it out, or name the columns {expected}_x_mm"
        )
    if not expected:
        return (
            f"{path}: the positions are in the frame {frame}, and nothing says how the scene lies "
            "in it\nhint: give --registration FILE; `ntagen calibrate` makes one"
        )
    return (
        f"{path}: the positions are in the frame {frame}, but the registration is from {expected}"
    )


def _optional(numbers: tuple[float, ...]) -> Vector | None:
    return (numbers[0], numbers[1], numbers[2]) if len(numbers) == 3 else None
