"""An animation of a run, or of regions that move with the breath: two projections over time.

What does not move is drawn once. Each frame adds the path until then, the tip, regions that were
learned by then, and moving regions where they are. Equal pictures give equal files.
"""

from __future__ import annotations

import base64
import io
import math
import os
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from ntagen.errors import InputError
from ntagen.files import write_files
from ntagen.plot.arrange import cells, fit_planes
from ntagen.plot.colours import MEASURED, TRUE
from ntagen.plot.picture import (
    GAP_MM,
    Picture,
    add_legend,
    bounds_mm,
    depth_axis,
    draw_projection,
    face_of,
    heading_of,
    outline_of,
)
from ntagen.scene import Region, Vector

_FRAMES: Final = 120
"""Frames of a run; of a breath, half as many."""

_FRAME_MS: Final = 80
_LEGEND_COLUMNS: Final = 4
_LAST_MS: Final = 2000
"""The last frame of a run stays this long."""


@dataclass(frozen=True, slots=True)
class Animation:
    """An animation; a notebook shows it, and `save` writes it.

    Attributes:
        data: The GIF file.
    """

    data: bytes

    def __repr__(self) -> str:
        return f"<Animation of {len(self.data)} bytes>"

    def _repr_html_(self) -> str:
        return f'<img src="data:image/gif;base64,{base64.b64encode(self.data).decode()}">'

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the GIF to a file, whole or not at all.

        Raises:
            InputError: The file cannot be written.
        """
        write_files({Path(path): self.data})


def animation_of(picture: Picture) -> Animation:
    """The animation of a run; of a scene with moving regions, one breath.

    Raises:
        InputError: Nothing moves in the picture.
    """
    times_s, last_ms = _times(picture)
    frames = list(_frames(picture, times_s))
    # One palette for all frames: colours do not flicker.
    first = frames[-1].quantize(128)
    indexed = [frame.quantize(palette=first, dither=0) for frame in frames]
    data = io.BytesIO()
    indexed[0].save(
        data,
        format="GIF",
        save_all=True,
        append_images=indexed[1:],
        duration=[_FRAME_MS] * (len(frames) - 1) + [last_ms],
        loop=0,
        optimize=False,
    )
    return Animation(data.getvalue())


def _times(picture: Picture) -> tuple[list[float], int]:
    """The times of the frames, and how long the last one stays, in ms."""
    if picture.moments:
        first_s, last_s = picture.moments[0].time_s, picture.moments[-1].time_s
        step_s = (last_s - first_s) / (_FRAMES - 1)
        return [first_s + step_s * index for index in range(_FRAMES)], _LAST_MS
    motions = [one.motion for one in picture.scene.regions if one.motion is not None]
    if not motions:
        raise InputError(
            "nothing moves here, so there is no animation\n"
            "hint: draw the log of a run or a scene with moving regions, or choose a file name "
            "that ends in .png or .html"
        )
    count = _FRAMES // 2
    # The period's end looks like its beginning, so the animation goes round without a jump.
    return [motions[0].period_s * index / count for index in range(count)], _FRAME_MS


def _frames(picture: Picture, times_s: Sequence[float]) -> Iterator[Any]:
    """The frames as images of Pillow."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from PIL import Image

    figure = Figure(figsize=(8.4, 5.8), dpi=100)
    canvas: Any = FigureCanvasAgg(figure)
    depth, bounds = depth_axis(picture.scene), bounds_mm(picture)
    changing = [one for one in picture.scene.regions if _changes(one, picture)]
    still = [one for one in picture.scene.regions if not _changes(one, picture)]
    fixed = replace(picture, true_path=(), measured=())
    views = []
    across = [axis for axis in range(3) if axis != depth]
    for place, axis in enumerate(across):
        axes = figure.add_subplot(1, 2, place + 1)
        draw_projection(axes, fixed, (axis, depth), bounds, still)
        views.append(_View(axes, (axis, depth), picture, changing))
    add_legend(figure, [views[0].axes], _LEGEND_COLUMNS)
    heading = figure.suptitle(heading_of(picture), fontsize=8.5, y=0.985)
    fit_planes(figure, [one.axes for one in views], [*cells(figure, heading, (1.0, 1.0))])
    corner = views[0].axes
    clock = corner.text(0.03, 0.97, "", va="top", transform=corner.transAxes, animated=True)
    canvas.draw()
    background = canvas.copy_from_bbox(figure.bbox)
    for time_s in times_s:
        canvas.restore_region(background)
        for view in views:
            view.show(time_s)
        clock.set_text(f"{time_s:.1f} s")
        corner.draw_artist(clock)
        size = canvas.get_width_height()
        yield Image.frombuffer("RGBA", size, bytes(canvas.buffer_rgba())).convert("RGB")


def _changes(region: Region, picture: Picture) -> bool:
    return region.motion is not None or region.name in picture.appears_s


class _View:
    """What changes in a projection."""

    def __init__(
        self,
        axes: Any,  # noqa: ANN401  matplotlib's own stubs leave axes open
        shown: tuple[int, int],
        picture: Picture,
        changing: Sequence[Region],
    ) -> None:
        self.axes = axes
        self._shown = shown
        self._picture = picture
        self._patches = [(region, self._patch(region)) for region in changing]
        said = picture.moments
        self._true = _Track([(one.time_s, one.true_mm) for one in said if one.true_mm])
        self._measured = _Track([(one.time_s, one.measured_mm) for one in said if one.measured_mm])
        dots = {"marker": ".", "markersize": 3, "linestyle": "none", "color": MEASURED}
        self._dots = self._line(self._measured, label="measured", zorder=6, **dots)
        self._path = self._line(self._true, label="true path", zorder=7, color=TRUE, linewidth=1.4)
        self._tip = self._line(self._true, zorder=9, color=TRUE, marker="o", markersize=6)

    def _line(self, track: _Track, **style: Any) -> Any:  # noqa: ANN401
        """A line that is drawn in each frame; None without points."""
        if not track.points:
            return None
        return self.axes.plot([], [], animated=True, **style)[0]

    def _patch(self, region: Region) -> Any:  # noqa: ANN401
        """The outline of a region at rest; motions only shift it."""
        resting = replace(region, motion=None)
        patch = outline_of(resting, self._shown, face_of(region, self._picture))
        patch.set_animated(True)
        return self.axes.add_patch(patch)

    def show(self, time_s: float) -> None:
        """Draws what is to be seen at a time."""
        from matplotlib.transforms import Affine2D

        picture = self._picture
        for region, patch in self._patches:
            if picture.appears_s.get(region.name, time_s) > time_s:
                continue
            if region.motion is not None:
                by = region.motion.at_mm(picture.clock_s + time_s)
                across, down = (by[axis] for axis in self._shown)
                patch.set_transform(Affine2D().translate(across, down) + self.axes.transData)
            self.axes.draw_artist(patch)
        for line, points in (
            (self._dots, self._measured.until(time_s)),
            (self._path, self._true.until(time_s)),
            (self._tip, self._true.until(time_s)[-1:]),
        ):
            if line is not None:
                line.set_data(*([point[axis] for point in points] for axis in self._shown))
                self.axes.draw_artist(line)


class _Track:
    """Places with their times; a jump is a gap."""

    def __init__(self, places: Sequence[tuple[float, Vector]]) -> None:
        self._times: list[float] = []
        self.points: list[Vector] = []
        for time_s, point in places:
            if self.points and math.dist(self.points[-1], point) > GAP_MM:
                self._times.append(time_s)
                self.points.append((math.nan, math.nan, math.nan))
            self._times.append(time_s)
            self.points.append(point)

    def until(self, time_s: float) -> list[Vector]:
        """The points until a time."""
        return self.points[: bisect_right(self._times, time_s)]
