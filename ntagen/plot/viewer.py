"""A scene, its plans and a run as one HTML page: to turn, to step through, with regions on and off.

The page is `viewer.html` with the data of a picture in it. It needs no network: it loads nothing.
Positions are in mm with two decimals, times in s.
"""

from __future__ import annotations

import html
import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any, Final

from ntagen.files import write_files
from ntagen.needle.vectors import cross
from ntagen.plot.colours import MEASURED, NEEDLE, OTHER, OUTLINES, REGIONS, TRUE
from ntagen.plot.picture import GAP_MM, Curve, Picture, bounds_mm, depth_axis
from ntagen.scene import Region, Vector
from ntagen.shapes import triangles, vector_of

_DATA: Final = "/*DATA*/"
_HEIGHT_PX: Final = 620
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


def page_of(picture: Picture) -> Page:
    """The page of a picture."""
    template = resources.files("ntagen.plot").joinpath("viewer.html").read_text("utf-8")
    # A text in the data could end the element that the data stands in.
    data = json.dumps(data_of(picture), separators=(",", ":"), allow_nan=False)
    return Page(template.replace(_DATA, data.replace("<", "\\u003c"), 1))


def data_of(picture: Picture) -> dict[str, Any]:
    """What the page shows, as plain data."""
    bounds = bounds_mm(picture)
    down, right, away = _axes(picture)
    moments = [
        {"t": round(one.time_s, 3)}
        | ({"true": _point(one.true_mm)} if one.true_mm else {})
        | ({"measured": _point(one.measured_mm)} if one.measured_mm else {})
        for one in picture.moments
    ] or _breath(picture)
    return {
        "title": picture.title or picture.scene.name,
        "caption": picture.caption,
        "low": [round(low, 2) for low, _ in bounds],
        "high": [round(high, 2) for _, high in bounds],
        "down": down,
        "right": right,
        "away": away,
        "gap": GAP_MM,
        "clock": round(picture.clock_s, 3),
        "regions": [_region(region, picture) for region in picture.scene.regions],
        "paths": list(_paths(picture)),
        "tracks": _tracks(picture),
        "moments": moments,
        "log": [
            {"t": round(one.time_s, 3), "text": text}
            for one in picture.moments
            for text in one.said
        ],
    }


def _axes(picture: Picture) -> tuple[list[float], list[float], list[float]]:
    """Down the page (the direction of insertion), to the right, and away from who looks."""
    depth = depth_axis(picture.scene)
    sign = 1.0 if picture.scene.axis[depth] > 0.0 else -1.0
    across = min(axis for axis in range(3) if axis != depth)
    down = [sign if axis == depth else 0.0 for axis in range(3)]
    right = [1.0 if axis == across else 0.0 for axis in range(3)]
    # Right-handed: right x down points away.
    return down, right, list(cross(vector_of(right), vector_of(down)))


def _region(region: Region, picture: Picture) -> dict[str, Any]:
    points, faces = triangles(region.shape)
    note: str = region.kind
    if region.name in picture.learned:
        note += ", learned"
    elif region.name in picture.unknown:
        note += ", not known"
    if region.motion is not None:
        note += ", moves with the breath"
    return {
        "name": region.name,
        "note": note,
        "colour": REGIONS[region.kind],
        "alpha": 0.07 if region.kind in OUTLINES else 0.2,
        "from": picture.appears_s.get(region.name),
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
    if picture.best:
        best = picture.bent if picture.spun else [picture.best]
        yield _path(picture.best_label, best, NEEDLE, 3.0, 0.9)
    if picture.spun:
        yield _path(f"{picture.best_label}, spinning", picture.spun, NEEDLE, 1.5, 0.9)
    if not picture.moments and picture.true_path:
        yield _path("true path", picture.true_path, TRUE, 1.5, 1.0)


def _path(
    name: str, curves: Sequence[Curve], colour: str, width: float, alpha: float
) -> dict[str, Any]:
    lines = [[_point(point) for point in curve] for curve in curves]
    return {"name": name, "colour": colour, "width": width, "alpha": alpha, "lines": lines}


def _tracks(picture: Picture) -> list[dict[str, Any]]:
    """The paths that grow with time."""
    tracks = []
    if any(one.measured_mm for one in picture.moments):
        tracks.append({"name": "measured", "key": "measured", "colour": MEASURED, "dots": True})
    if any(one.true_mm for one in picture.moments):
        tracks.append({"name": "true path", "key": "true", "colour": TRUE, "dots": False})
    return [track | {"width": 1.8, "alpha": 1.0} for track in tracks]


def _point(point: Vector) -> list[float]:
    return [round(value, 2) for value in point]
