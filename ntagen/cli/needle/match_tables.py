"""The tables of `ntagen match`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean, median
from typing import TYPE_CHECKING

from ntagen.cli.terminal import echo, print_table
from ntagen.units import deg_from_rad

if TYPE_CHECKING:
    from ntagen.scene import Scene
    from ntagen.traces.matching import Match, Options
    from ntagen.traces.prediction import Prediction


@dataclass(frozen=True, slots=True)
class Matched:
    """A file and its match.

    Attributes:
        path: The file.
        match: The match.
        predictions: The predictions; None if they were not asked for.
    """

    path: Path
    match: Match
    predictions: Sequence[Prediction] | None


def show(scene: Scene, options: Options, found: Sequence[Matched]) -> None:
    """Prints the matches, and the predictions if there are any."""
    from ntagen.plan.extract import step_length_mm

    limits, needle = scene.limits, scene.needle
    angles = ", ".join(f"{deg_from_rad(angle):.4g}" for angle in limits.roll_angles_rad)
    radius = "fitted, expected" if options.radius == "fit" else "fixed:"
    rolls = f"at most {limits.max_rolls} rolls by {angles} deg" if angles else "no rolls"
    echo(
        f"{scene.name}: pushes of {step_length_mm(scene):g} mm, {rolls}, "
        f"radius {radius} {needle.radius_mm:g} mm"
    )
    heads = ("points", "length", "min", "avg", "max", "radius")
    print_table(("trace", *heads, "rolls"), _match_rows(found), heads)
    left_out = sum(one.match.trace.outliers for one in found)
    missing = sum(one.match.trace.samples.missing for one in found)
    later = sum(one.match.trace.after_pull_out for one in found)
    notes = [
        *([f"{left_out} outliers left out"] if left_out else []),
        *([f"{missing} samples are missing"] if missing else []),
        *([f"{later} samples after a jump back left out"] if later else []),
    ]
    if notes:
        echo("; ".join(notes))
    if found[0].predictions is not None:
        _show_predictions(found)


def _match_rows(found: Sequence[Matched]) -> Iterable[list[str]]:
    for one in found:
        match = one.match
        deviations = (match.min_mm, match.avg_mm, match.max_mm)
        yield [
            one.path.name,
            str(len(match.trace.points_mm)),
            f"{match.trace.length_mm:.1f}",
            *(f"{number:.2f}" for number in deviations),
            f"{match.needle.radius_mm:.4g}",
            match.rolls_in_words or "none",
        ]
    if len(found) > 1:
        matches = [one.match for one in found]
        yield [
            f"all {len(found)}: least min, mean of avg, greatest max",
            "",
            "",
            f"{min(one.min_mm for one in matches):.2f}",
            f"{fmean(one.avg_mm for one in matches):.2f}",
            f"{max(one.max_mm for one in matches):.2f}",
            "",
            "",
        ]


def _show_predictions(found: Sequence[Matched]) -> None:
    """The greatest deviations over the next 10, 20 and 40 mm."""
    from ntagen.traces.prediction import AHEAD_MM, FROM_MM

    cells = {
        (one.path, prediction.from_mm, ahead.ahead_mm): ahead.max_mm
        for one in found
        for prediction in one.predictions or ()
        for ahead in prediction.ahead
    }
    rows = []
    for from_mm in FROM_MM:
        for one in found:
            texts = [
                f"{cells[key]:.2f}" if (key := (one.path, from_mm, ahead_mm)) in cells else "-"
                for ahead_mm in AHEAD_MM
            ]
            rows.append([one.path.name, f"{from_mm:g}", *texts])
        if len(found) > 1:
            columns = [
                [value for key, value in cells.items() if key[1:] == (from_mm, ahead_mm)]
                for ahead_mm in AHEAD_MM
            ]
            texts = [f"{median(column):.2f}" if column else "-" for column in columns]
            rows.append(["median", f"{from_mm:g}", *texts])
    echo("\npredicted from the first part alone: greatest deviation in mm over the next")
    heads = ("from", *(f"{ahead_mm:g} mm" for ahead_mm in AHEAD_MM))
    print_table(("trace", *heads), rows, heads)
