"""How a run ended: the error to the target, the deviation, the margins, and what was measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

from ntagen.drive.log import ACTUAL
from ntagen.drive.reading import RunLog
from ntagen.drive.records import Ended, Estimated, Measured, Predicted, Truth
from ntagen.plot.run import clock_at_start_s, last_scene
from ntagen.report.task import finite
from ntagen.scene import Region, Vector

_NO_REGION_MM: Final = 1e9

Place = tuple[float, Vector]
"""A time in s, and where the tip was then, in mm."""


def ending_of(log: RunLog) -> dict[str, Any] | None:
    """How the run ended, as the driver said; None if the log is cut off before the end."""
    ends = [record for record in log.records if isinstance(record, Ended)]
    if not ends:
        return None
    ended = ends[-1]
    return {
        "outcome": ended.outcome,
        "reason": ended.reason,
        "time_s": ended.time_s,
        "depth_mm": ended.depth_mm,
        "adjustments": ended.adjustments,
        "syntheses": ended.syntheses,
        "cut_mm": ended.cut_mm,
        "confidence": ended.confidence or None,
        "tip_known_to_mm": ended.error_mm or None,
    }


def errors_of(log: RunLog) -> list[dict[str, Any]]:
    """How far the tip is from the last target: the true, the measured and the estimated one.

    ``to_middle_mm`` is the distance to the middle of the target, ``outside_mm`` that to its
    surface, which is negative inside. ``time_s`` says when the tip was there: if a log is cut off,
    the last estimate may be much older than the last measurement.
    """
    target, start_s = log.actual.targets[-1], clock_at_start_s(log)
    measured = places_of(log, Measured)
    # The driver decides by its last look; a target that moves goes on while the needle is stopped.
    clock_s = start_s + (measured[-1][0] if measured else 0.0)
    at_rest = target.at(clock_s)
    return [
        {
            "tip": name,
            "target": target.name,
            "time_s": places[-1][0],
            "to_middle_mm": math.dist(places[-1][1], at_rest.center_mm),
            "outside_mm": at_rest.distance_mm(places[-1][1]),
        }
        for name, places in (
            ("true", places_of(log, Truth)),
            ("measured", measured),
            ("estimated", places_of(log, Estimated)),
        )
        if places
    ]


def deviation_of(log: RunLog) -> dict[str, Any] | None:
    """The greatest distance of a measured tip from the expected one; None if none was expected."""
    predicted = [record for record in log.records if isinstance(record, Predicted)]
    if not predicted:
        return None
    worst = max(predicted, key=lambda one: one.deviation_mm)
    return {
        "greatest_mm": worst.deviation_mm,
        "time_s": worst.time_s,
        "allowed_mm": log.settings.deviation_mm,
        "mean_of": log.settings.deviation_count,
    }


def margins_of(log: RunLog) -> list[dict[str, Any]]:
    """The least distance of the tip to each critical region, and when the tip was there.

    The tip is the true one in a simulation (``true``), else the measured one (``measured``), at the
    places where it was looked at. Of a region that was learned, its place is a guess.
    """
    is_true = ACTUAL in log.attachments and bool(places_of(log, Truth))
    places = places_of(log, Truth if is_true else Measured)
    if not places:
        return []
    names = {region.name for region in log.actual.regions}
    learned = [one for one in last_scene(log).criticals if one.name not in names]
    start_s = clock_at_start_s(log)
    rows = []
    for region in [*log.actual.criticals, *learned]:
        margin_mm, time_s = _nearest(region, places, start_s)
        rows.append(
            {
                "region": region.name,
                "margin_mm": margin_mm,
                "time_s": time_s,
                "by": "true" if is_true else "measured",
                "learned": region.name not in names,
            }
        )
    return rows


def true_clearance_mm(log: RunLog) -> float | None:
    """The least distance of all that was cut to any critical region, in mm (simulation only)."""
    truths = [record.clearance_mm for record in log.records if isinstance(record, Truth)]
    return truths[-1] if truths and truths[-1] < _NO_REGION_MM else None


def _nearest(region: Region, places: Sequence[Place], start_s: float) -> tuple[float, float]:
    """The least distance to a region, in mm, and the time of the run, in s."""
    if region.motion is None:
        import numpy as np

        away_mm = region.shape.distance_mm(np.array([place for _, place in places]))
        first = int(np.argmin(away_mm))
        return float(away_mm[first]), places[first][0]
    return min((region.distance_at_mm(place, start_s + at_s), at_s) for at_s, place in places)


def places_of(log: RunLog, kind: type[Truth | Measured | Estimated]) -> list[Place]:
    """Where the tip was, by all records of a kind, in order."""
    return [(one.time_s, one.position_mm) for one in log.records if isinstance(one, kind)]


def series_of(log: RunLog) -> dict[str, Any]:
    """What was measured over time, as columns: depth and force, and the deviation."""
    measured = [record for record in log.records if isinstance(record, Measured)]
    predicted = [record for record in log.records if isinstance(record, Predicted)]
    return {
        "measured": {
            "time_s": [one.time_s for one in measured],
            "depth_mm": [one.depth_mm for one in measured],
            "force_n": [one.force_n for one in measured],
        },
        "deviation": {
            "time_s": [one.time_s for one in predicted],
            "deviation_mm": [one.deviation_mm for one in predicted],
        },
    }


def last_estimate_of(log: RunLog) -> dict[str, Any] | None:
    """The last estimate of the needle; None if there was none."""
    estimates = [record for record in log.records if isinstance(record, Estimated)]
    if not estimates:
        return None
    last = estimates[-1]
    return {
        "time_s": last.time_s,
        "position_mm": list(last.position_mm),
        "radius_mm": last.radius_mm,
        "radius_std_mm": finite(last.radius_std_mm),
        "rms_mm": last.rms_mm,
    }
