"""A measured trace made ready: outliers, the pull-out, and the thinning to chords of 1 mm.

What is done to a sample depends on those before it and, for outliers alone, on the two after it.
The insertion depth of a sample depends on earlier ones alone, so that the first part of a trace can
be told from the rest without looking at the rest (`first_part`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ntagen.errors import InputError
from ntagen.traces.chain import Array
from ntagen.tracking.tables import require_near

CHORD_MM: Final = 1.0
"""Points of a thinned trace are at least so far apart."""

OUTLIER_MM: Final = 1.0
"""A sample that is farther than this from the median of five samples around it is left out."""

JUMP_MM: Final = 5.0
"""Two samples that are farther apart than this, backwards, are the pull-out of the needle."""

SHORTEST_MM: Final = 10.0
"""A shorter trace tells nothing about a circle: at a radius of 75 mm it bends by 0.2 mm."""

_NODE_MM: Final = 5.0
"""Depth is measured along chords of this length: noise of 0.1 mm makes them 0.1 % longer, and a
circle of 30 mm makes them 0.1 % shorter."""

_BACK_MM: Final = 3.0
"""A needle that goes back by more than this turns back; less is noise."""

_WAY_MM: Final = 10.0

_MEDIAN_OF: Final = 5
_AHEAD: Final = 2
"""So many samples after one are needed for the median around it."""

_FORWARD: Final = 0.7
"""The least cosine between a jump that counts as progress and the way before it."""

_METRES_MM: Final = 1.0
"""An insertion of metres that are taken for mm is shorter than this."""


@dataclass(frozen=True, slots=True)
class Samples:
    """The positions of the tip in a file, in the order of time.

    Attributes:
        name: Where they come from, for messages.
        points_mm: One position a row.
        lines: The line of each in the file; without lines, its number in the order of time.
        missing: How many samples without a position were left out.
        word: What a line is called in messages: ``line`` or ``sample``.
        warnings: What the user should know about the file.
    """

    name: str
    points_mm: Array
    lines: tuple[int, ...]
    missing: int = 0
    word: str = "line"
    warnings: tuple[str, ...] = ()

    def part(self, begin: int, end: int | None = None) -> Samples:
        """The samples from one on, up to another, which is left out."""
        return replace(self, points_mm=self.points_mm[begin:end], lines=self.lines[begin:end])

    def place(self, index: int) -> str:
        """Where a sample stands, for messages."""
        separator = ":" if self.word == "line" else f": {self.word} "
        return f"{self.name}{separator}{self.lines[index]}"


@dataclass(frozen=True, slots=True)
class Trace:
    """A trace that is ready for a match.

    Attributes:
        samples: What was measured.
        indices: Which samples are left.
        points_mm: Their positions, at least `CHORD_MM` apart.
        depths_mm: Their insertion depths from the first one on.
        outliers: How many samples were left out since they are far from their neighbours.
        pulled_out_at: The sample with which the pull-out begins; None without one.
    """

    samples: Samples
    indices: tuple[int, ...]
    points_mm: Array
    depths_mm: Array
    outliers: int
    pulled_out_at: int | None

    @property
    def after_pull_out(self) -> int:
        """How many samples were left out since they come after the insertion."""
        last = self.pulled_out_at
        return 0 if last is None else len(self.samples.points_mm) - last

    @property
    def length_mm(self) -> float:
        """The insertion depth at the end."""
        return float(self.depths_mm[-1]) if len(self.depths_mm) else 0.0


def trace_of(samples: Samples, until_mm: float = math.inf, from_mm: float = 0.0) -> Trace:
    """Makes samples ready.

    Args:
        samples: The samples.
        until_mm: Samples from this depth on are left out.
        from_mm: Samples before the first one at this depth are left out; all other depths are
            counted from there.

    Raises:
        InputError: There are too few, they are no insertion, or the needle goes back.
    """
    _require_numbers(samples)
    trace = _prepared(_without_beginning(samples, from_mm) if from_mm > 0.0 else samples)
    trace = _shortened(trace, until_mm) if trace.length_mm > until_mm else trace
    _require_insertion(trace)
    _require_forward(trace)
    return trace


def first_part(trace: Trace, length_mm: float) -> tuple[Trace, float]:
    """The first part of a trace, made from its own samples alone, and the depth where it ends.

    Its last point is the first one at the given depth or deeper. Two more samples count as seen,
    since they say whether that point is an outlier.

    Raises:
        InputError: The trace is shorter.
    """
    kept = np.flatnonzero(~_outliers(trace.samples.points_mm))
    depths_mm = _depths(trace.samples.points_mm[kept])
    if trace.length_mm < length_mm:
        raise InputError(
            f"{trace.samples.name}: the trace has {trace.length_mm:.1f} mm, and "
            f"{length_mm:g} mm are asked for"
        )
    last = int(kept[np.argmax(depths_mm >= length_mm)])
    seen = trace.samples.part(0, last + 1 + _AHEAD)
    end_mm = float(depths_mm[kept < len(seen.points_mm)][-1])
    return _prepared(seen, last), end_mm


def _prepared(samples: Samples, last: int | None = None) -> Trace:
    """The trace without outliers and pull-out, thinned; with samples up to the last one."""
    points = samples.points_mm
    kept = np.flatnonzero(~_outliers(points))
    outliers = len(points) - len(kept)
    if last is not None:
        kept = kept[kept <= last]
    depths_mm = _depths(points[kept])
    end = _pull_out(points[kept])
    thinned: list[int] = []
    for index, point in enumerate(points[kept[:end]]):
        if not thinned or math.dist(point, points[kept[thinned[-1]]]) >= CHORD_MM:
            thinned.append(index)
    chosen = np.array(thinned, dtype=np.intp)
    return Trace(
        samples=samples,
        indices=tuple(kept[chosen].tolist()),
        points_mm=points[kept[chosen]],
        depths_mm=depths_mm[chosen],
        outliers=outliers,
        pulled_out_at=None if end is None else int(kept[end]),
    )


def _without_beginning(samples: Samples, from_mm: float) -> Samples:
    """The samples from the first one at a depth on.

    Raises:
        InputError: None is so deep.
    """
    kept = np.flatnonzero(~_outliers(samples.points_mm))
    depths_mm = _depths(samples.points_mm[kept])
    if depths_mm[-1] < from_mm:
        raise InputError(
            f"{samples.name}: the trace has {depths_mm[-1]:.1f} mm, and it should begin at a depth "
            f"of {from_mm:g} mm\nhint: give a smaller --from"
        )
    return samples.part(int(kept[np.argmax(depths_mm >= from_mm)]))


def _shortened(trace: Trace, until_mm: float) -> Trace:
    count = int(np.sum(trace.depths_mm <= until_mm))
    return replace(
        trace,
        indices=trace.indices[:count],
        points_mm=trace.points_mm[:count],
        depths_mm=trace.depths_mm[:count],
        pulled_out_at=None,
    )


def _outliers(points: Array) -> NDArray[np.bool_]:
    """Which samples are far from the median of five; the first and last two are none.

    Along a path that does not turn back, the middle one of five samples is their median, at any
    speed.
    """
    flags = np.zeros(len(points), dtype=np.bool_)
    if len(points) >= _MEDIAN_OF:
        windows = np.lib.stride_tricks.sliding_window_view(points, _MEDIAN_OF, axis=0)
        middle = np.median(windows, axis=-1)
        flags[_AHEAD:-_AHEAD] = np.linalg.norm(points[_AHEAD:-_AHEAD] - middle, axis=1) > OUTLIER_MM
    return flags


def _depths(points: Array) -> Array:
    """The insertion depth at each sample: chords of 5 mm, and from the last of them straight on.

    Each depth depends on earlier samples alone. A jump aside is no progress.
    """
    depths_mm = np.zeros(len(points))
    if not len(points):
        return depths_mm
    before, node, node_mm, previous = None, points[0], 0.0, points[0]
    for index, point in enumerate(points):
        jumps = math.dist(point, previous) > JUMP_MM
        if jumps and before is not None and _cosine(point - node, node - before) < _FORWARD:
            depths_mm[index] = depths_mm[index - 1]
        else:
            away_mm = math.dist(point, node)
            depths_mm[index] = node_mm + away_mm
            if away_mm >= _NODE_MM:
                before, node, node_mm = node, point, node_mm + away_mm
        previous = point
    return np.maximum.accumulate(depths_mm)


def _pull_out(points: Array) -> int | None:
    """How many samples come before the first jump backwards; None if there is no such jump."""
    steps_mm = np.linalg.norm(np.diff(points, axis=0), axis=1)
    for index in np.flatnonzero(steps_mm > JUMP_MM).tolist():
        away_mm = np.linalg.norm(points[: index + 1] - points[index], axis=1)
        far = np.flatnonzero(away_mm >= min(_NODE_MM, float(away_mm.max())))
        way = points[index] - points[far[-1]]
        if _cosine(points[index + 1] - points[index], way) < 0.0:
            return int(index) + 1
    return None


def _cosine(a: Array, b: Array) -> float:
    """The cosine of the angle between two directions; 1 if one has no length."""
    lengths = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / lengths if lengths > 0.0 else 1.0


# Mistakes.


def _require_numbers(samples: Samples) -> None:
    points = samples.points_mm
    if not len(points):
        raise InputError(
            f"{samples.name}: there are no positions in this trace\n"
            "hint: samples at (0, 0, 0) count as missing; is this the right file, and are these "
            "the right columns?"
        )
    wrong = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(wrong):
        raise InputError(
            f"{samples.place(int(wrong[0]))}: this position is not finite\n"
            "hint: leave the sample out, or write 0, 0, 0 for a missing one"
        )
    farthest = int(np.argmax(np.abs(points).max(axis=1)))
    require_near(points[farthest].tolist(), samples.place(farthest))


def _require_insertion(trace: Trace) -> None:
    """Refuses a trace that is too short, perhaps since its unit is another one."""
    samples, length_mm = trace.samples, trace.length_mm
    if length_mm >= SHORTEST_MM:
        return
    if trace.pulled_out_at is not None:
        raise InputError(
            f"{samples.place(trace.pulled_out_at)}: the tip jumps back by more than {JUMP_MM:g} mm "
            f"after {length_mm:.1f} mm, and at least {SHORTEST_MM:g} mm of insertion are needed\n"
            "hint: --from LENGTH leaves out what was measured before the insertion"
        )
    extent_mm = float(np.linalg.norm(samples.points_mm - samples.points_mm[0], axis=1).max())
    if 1e-3 * SHORTEST_MM <= extent_mm < _METRES_MM:
        raise InputError(
            f"{samples.name}: the tip moves by {extent_mm:.3g} mm in all; the values look like "
            f"metres, in which it would be {1e3 * extent_mm:.3g} mm\n"
            "hint: give --unit m, or name the columns x_m, y_m, z_m"
        )
    raise InputError(
        f"{samples.name}: the tip moves by {extent_mm:.3g} mm in {len(samples.points_mm)} samples, "
        f"and at least {SHORTEST_MM:g} mm of insertion are needed\n"
        "hint: give a trace of a whole insertion; --unit says another unit"
    )


def _require_forward(trace: Trace) -> None:
    """Refuses a trace in which the needle goes back.

    The way is that over the last 10 mm before the foremost point: a tracker that is off by a
    millimetre to the side does not turn it.
    """
    points, foremost, behind = trace.points_mm, 0, 0
    for index in range(1, len(points)):
        while behind < foremost and math.dist(points[behind + 1], points[foremost]) >= _WAY_MM:
            behind += 1
        way = points[foremost] - points[behind]
        length_mm = float(np.linalg.norm(way))
        if length_mm < 0.5 * _WAY_MM:
            foremost = index
            continue
        progress_mm = float((points[index] - points[foremost]) @ way) / length_mm
        if progress_mm > 0.0:
            foremost = index
        elif progress_mm < -_BACK_MM:
            depth_mm = trace.depths_mm[foremost]
            until = ""
            if depth_mm >= SHORTEST_MM:
                until = f"--until {math.floor(depth_mm):d}mm matches what comes before it, and "
            raise InputError(
                f"{trace.samples.place(trace.indices[foremost])}: the trace turns back at a depth "
                f"of {depth_mm:.1f} mm\n"
                f"hint: {until}a greater --from LENGTH matches what comes after it; or delete what "
                "is no insertion"
            )
