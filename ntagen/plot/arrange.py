"""Where the parts of a figure stand: the heading above, the legend below, the views between them.

No part covers another one: each view has a cell of its own, and is as large as its scales, labels
and note leave it room in there. Lengths are in pixels of the figure.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.text import Text
    from matplotlib.transforms import Bbox

_GAP: Final = 0.01
"""The space around a view, as a part of the height of the figure."""

_FITS: Final = 0.02
"""A view in space is large enough if it lacks at most this part of its cell."""

_TRIES: Final = 6


def cells(figure: Figure, heading: Text, widths: Sequence[float]) -> Iterator[Bbox]:
    """The cells of views, from left to right, between the heading and the legend.

    Args:
        figure: The figure with its legend.
        heading: What stands above the views.
        widths: How wide the cells are, relative to each other.
    """
    from matplotlib.transforms import Bbox

    gap = _GAP * figure.bbox.height
    top = heading.get_window_extent().y0
    bottom = max((one.get_window_extent().y1 for one in figure.legends), default=figure.bbox.y0)
    left = figure.bbox.x0
    for width in widths:
        right = left + figure.bbox.width * width / sum(widths)
        yield Bbox.from_extents(left + gap, bottom + gap, right - gap, top - gap)
        left = right


def fit_planes(figure: Figure, views: Sequence[Any], places: Sequence[Bbox]) -> None:
    """Makes plane views as large as scales, labels and notes leave room, all of them equally.

    Args:
        figure: The figure.
        views: The axes; a note is the title of one.
        places: Their cells.
    """
    for axes, cell in zip(views, places, strict=True):
        _put(figure, axes, cell)
    # A view of another size may have wider numbers on its scales, so once is not enough.
    for _ in range(2):
        margins = [_margins(axes) for axes in views]
        left, bottom, right, top = (max(one) for one in zip(*margins, strict=True))
        for axes, cell in zip(views, places, strict=True):
            room = cell.from_extents(
                cell.x0 + left, cell.y0 + bottom, cell.x1 - right, cell.y1 - top
            )
            _put(figure, axes, room)


def _margins(axes: Any) -> tuple[float, float, float, float]:  # noqa: ANN401
    """What stands around a plane view: on its left, below it, on its right, above it."""
    axes.apply_aspect()
    inner = axes.get_window_extent()
    scales = [one.get_tightbbox() for one in (axes.xaxis, axes.yaxis)]
    around = inner.union([inner, *(one for one in scales if one is not None)])
    # A note may be wider than a narrow view.
    top = max(around.y1, axes.title.get_window_extent().y1 if axes.get_title() else 0.0)
    return inner.x0 - around.x0, inner.y0 - around.y0, around.x1 - inner.x1, top - inner.y1


def fit_space(figure: Figure, axes: Any, aspect: Sequence[float], cell: Bbox) -> None:  # noqa: ANN401
    """Zooms a view in space so that it fills its cell with its scales, and moves it there.

    Args:
        figure: The figure.
        axes: The view, with its limits and labels; what is drawn in it does not matter.
        aspect: The lengths of its axes.
        cell: Where it is to be.
    """
    zoom, place = 1.0, cell
    for _ in range(_TRIES):
        axes.set_box_aspect(aspect, zoom=zoom)
        _put(figure, axes, place)
        # The labels find their places only when they are drawn.
        figure.draw_without_rendering()
        around = axes.get_tightbbox()
        room = min(cell.width / around.width, cell.height / around.height)
        x = 0.5 * (cell.x0 + cell.x1 - around.x0 - around.x1)
        y = 0.5 * (cell.y0 + cell.y1 - around.y0 - around.y1)
        if 1.0 <= room <= 1.0 + _FITS and max(abs(x), abs(y)) < 1.0:
            return
        place = place.translated(x, y)
        zoom *= room * (1.0 - 0.25 * _FITS) if not 1.0 <= room <= 1.0 + _FITS else 1.0
    axes.set_box_aspect(aspect, zoom=zoom)
    _put(figure, axes, place)


def _put(figure: Figure, axes: Any, place: Bbox) -> None:  # noqa: ANN401
    axes.set_position(place.transformed(figure.transFigure.inverted()))
