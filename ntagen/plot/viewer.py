"""A scene, its plans and a run as one HTML page: to turn, to step through, with regions on and off.

The page is `viewer.html` with the data of a picture in it. It needs no network: it loads nothing.
While a run goes on, the same page asks `ntagen.watch` for what is new.
Positions are in mm with two decimals, times in s.
"""

from __future__ import annotations

import html
import json
import math
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any, Final

from ntagen.drive.states import ENDS, State
from ntagen.files import write_files
from ntagen.needle.vectors import cross
from ntagen.plot.colours import (
    DARK,
    EXPECTED,
    MEASURED,
    NEEDLE,
    OTHER,
    OUTLINES,
    REGIONS,
    SHAFT,
    TRUE,
)
from ntagen.plot.picture import (
    GAP_MM,
    Curve,
    Moment,
    Picture,
    Planned,
    bounds_mm,
    depth_axis,
)
from ntagen.scene import Region, Vector
from ntagen.shapes import triangles, vector_of

_DATA: Final = "/*DATA*/"
_LOADS_NOTHING: Final = "default-src 'none'"
_HEIGHT_PX: Final = 620
_CHARTS: Final = {"force_n": ("force", "N", "f"), "off_mm": ("distance from the plan", "mm", "off")}
"""What a page shows over time, by the fields of `Moment`: its name, unit and key."""

_STEPS: Final = 64
"""A period of the breath is shown in so many steps; between them, regions go straight."""


@dataclass(frozen=True, slots=True)
class Page:
    """A page; a notebook shows it, and `save` writes it.

    Attributes:
        text: The HTML document.
    """

    text: str

    def __repr__(self) -> str:
        return f"<Page of {len(self.text)} characters>"

    def _repr_html_(self) -> str:
        # A frame keeps the page's styles and names apart from those of the notebook.
        return (
            f'<iframe srcdoc="{html.escape(self.text)}" width="100%" height="{_HEIGHT_PX}" '
            'style="border:0" sandbox="allow-scripts"></iframe>'
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the document to a file, whole or not at all.

        Raises:
            InputError: The file cannot be written.
        """
        write_files({Path(path): self.text})


def page_of(picture: Picture, *, is_live: bool = False) -> Page:
    """The page of a picture.

    Args:
        picture: The picture.
        is_live: The page asks the server that it comes from for the moments of the run.
    """
    template = resources.files("ntagen.plot").joinpath("viewer.html").read_text("utf-8")
    if is_live:
        template = template.replace(_LOADS_NOTHING, f"{_LOADS_NOTHING}; connect-src 'self'", 1)
    # A text in the data could end the element that the data stands in.
    document = data_of(picture) | {"live": is_live}
    data = json.dumps(document, separators=(",", ":"), allow_nan=False)
    return Page(template.replace(_DATA, data.replace("<", "\\u003c"), 1))


def data_of(picture: Picture) -> dict[str, Any]:
    """What the page shows, as plain data."""
    bounds = bounds_mm(picture)
    down, right, away = _axes(picture)
    run = run_data(picture.moments, picture.plans, picture.tubes)
    return {
        "title": picture.title or picture.scene.name,
        "caption": picture.caption,
        "low": [round(low, 2) for low, _ in bounds],
        "high": [round(high, 2) for _, high in bounds],
        "down": down,
        "right": right,
        "away": away,
        "gap": GAP_MM,
        "ends": sorted(state.value for state in ENDS),
        "goal": State.TARGET_REACHED.value,
        "clock": round(picture.clock_s, 3),
        "regions": [
            region_data(region, _note(region, picture), picture.appears_s.get(region.name))
            for region in picture.scene.regions
        ],
        "paths": list(_paths(picture)),
        "tracks": _TRACKS,
        "tube": {"name": picture.tube_label} | _ink(EXPECTED),
        "plan": {"name": "plan"} | _ink(NEEDLE),
        "charts": [
            {"name": name, "unit": unit, "key": key, "limit": picture.limits.get(field)}
            for field, (name, unit, key) in _CHARTS.items()
        ],
    } | (run if run["moments"] else run | {"moments": _breath(picture)})


def run_data(
    moments: Sequence[Moment], plans: Sequence[Planned], tubes: Sequence[Planned]
) -> dict[str, Any]:
    """What the page shows of a run, or of a part of it, as plain data."""
    return {
        "moments": [_moment(one) for one in moments],
        "log": [{"t": round(one.time_s, 3), "text": text} for one in moments for text in one.said],
        "plans": [
            {"t": round(one.time_s, 3), "bent": _lines(one.bent), "spun": _lines(one.spun)}
            for one in plans
        ],
        "tubes": [
            {
                "t": round(one.time_s, 3),
                "points": [_point(place) for place, _ in one.tube],
                "radii": [round(radius_mm, 3) for _, radius_mm in one.tube],
            }
            for one in tubes
        ],
    }


def _moment(moment: Moment) -> dict[str, Any]:
    shown: dict[str, Any] = {"t": round(moment.time_s, 3)}
    for key, place in (
        ("true", moment.true_mm),
        ("measured", moment.measured_mm),
        ("tip", moment.tip_mm),
    ):
        if place is not None:
            shown[key] = _point(place)
    for key, number in (("d", moment.depth_mm), ("f", moment.force_n), ("off", moment.off_mm)):
        if number is not None and math.isfinite(number):
            shown[key] = round(number, 4)
    return shown | ({"state": moment.state} if moment.state else {})


def _axes(picture: Picture) -> tuple[list[float], list[float], list[float]]:
    """Down the page (the direction of insertion), to the right, and away from who looks."""
    depth = depth_axis(picture.scene)
    sign = 1.0 if picture.scene.axis[depth] > 0.0 else -1.0
    across = min(axis for axis in range(3) if axis != depth)
    down = [sign if axis == depth else 0.0 for axis in range(3)]
    right = [1.0 if axis == across else 0.0 for axis in range(3)]
    # Right-handed: right x down points away.
    return down, right, list(cross(vector_of(right), vector_of(down)))


def _note(region: Region, picture: Picture) -> str:
    if region.name in picture.learned:
        return "learned"
    return "not known" if region.name in picture.unknown else ""


def region_data(region: Region, note: str, from_s: float | None) -> dict[str, Any]:
    """A region as plain data.

    Args:
        region: The region.
        note: What to say of it besides its kind; may be empty.
        from_s: The time of the run from which on it is shown; None for always.
    """
    points, faces = triangles(region.shape)
    moves = "moves with the breath" if region.motion is not None else ""
    return {
        "name": region.name,
        "note": ", ".join(filter(None, (region.kind, note, moves))),
        "colour": REGIONS[region.kind],
        "alpha": 0.07 if region.kind in OUTLINES else 0.2,
        "from": from_s,
        "points": [_point(vector_of(point)) for point in points],
        "faces": faces,
        "motion": _motion(region),
    }


def _motion(region: Region) -> dict[str, Any] | None:
    """Where a region is during a period: times and displacements, with straight lines between."""
    motion = region.motion
    if motion is None:
        return None
    sampled = tuple((time_s, motion.at_mm(time_s)) for time_s in _steps(motion.period_s))
    rows = motion.rows if motion.table else sampled
    return {
        "period": motion.period_s,
        "places": [[round(time_s, 4), *_point(place)] for time_s, place in rows],
    }


def _steps(period_s: float) -> list[float]:
    return [period_s * index / _STEPS for index in range(_STEPS + 1)]


def _breath(picture: Picture) -> list[dict[str, Any]]:
    """The moments of one breath, for a scene with moving regions; else none."""
    periods = [one.motion.period_s for one in picture.scene.regions if one.motion is not None]
    return [{"t": round(time_s, 3)} for time_s in _steps(periods[0])] if periods else []


def _paths(picture: Picture) -> Iterable[dict[str, Any]]:
    if picture.others:
        yield _path(picture.other_label, picture.others, OTHER, 1.0, 0.5)
    if picture.best and not picture.plans:
        best = picture.bent if picture.spun else [picture.best]
        yield _path(picture.best_label, best, NEEDLE, 3.0, 0.9)
    if picture.spun and not picture.plans:
        yield _path(f"{picture.best_label}, spinning", picture.spun, NEEDLE, 1.5, 0.9)
    if not picture.moments and picture.true_path:
        yield _path("true path", picture.true_path, TRUE, 1.5, 1.0)


def _path(
    name: str, curves: Sequence[Curve], colour: str, width: float, alpha: float
) -> dict[str, Any]:
    return {"name": name, "width": width, "alpha": alpha, "lines": _lines(curves)} | _ink(colour)


def _lines(curves: Sequence[Curve]) -> list[list[list[float]]]:
    return [[_point(point) for point in curve] for curve in curves]


def _ink(colour: str) -> dict[str, str]:
    return {"colour": colour, "dark": DARK.get(colour, colour)}


def _point(point: Vector) -> list[float]:
    return [round(value, 2) for value in point]


_TRACKS: Final = [
    {"name": "needle", "key": "tip", "kind": "needle", "width": 3.5, "alpha": 1.0} | _ink(SHAFT),
    {"name": "measured", "key": "measured", "kind": "dots", "width": 1.6, "alpha": 1.0}
    | _ink(MEASURED),
    {"name": "true path", "key": "true", "kind": "line", "width": 1.8, "alpha": 1.0} | _ink(TRUE),
]
"""What grows with time: the needle as it lies in the tissue, and the places where its tip was."""
