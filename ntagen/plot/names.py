"""The names of regions in a projection: beside or in their outlines, never on each other.

Names that would cover others are left out, and so are those of regions far away from the best plan
where there are many. What is left out in one projection may stand in the other one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from ntagen.scene import Region, Vector

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.patches import Patch
    from matplotlib.text import Text
    from matplotlib.transforms import Bbox
    from numpy.typing import NDArray

_SIZE: Final = 7
_GAP: Final = 3.0
"""The space between an outline and its name, in pixels."""

_MOST: Final = 20
"""A projection has at most this many names."""

_LONGEST: Final = 24
"""A longer name is cut off."""

_COVERS_PATH: Final = 100.0
"""How bad it is if a name covers the path of the best plan."""


def write_names(
    axes: Any,  # noqa: ANN401  matplotlib's own stubs leave axes open
    outlines: Sequence[tuple[Region, Patch]],
    shown: tuple[int, int],
    path: Sequence[Vector],
    colours: Mapping[str, str],
) -> list[Text]:
    """Writes the names of regions into a projection that has its final place.

    Args:
        axes: The projection.
        outlines: The regions, each with its outline.
        shown: The axes of space across and down the page.
        path: Points of the path of the best plan, or of the straight way without one.
        colours: The colour of each kind.

    Returns:
        The names that have a place.
    """
    import numpy as np

    frame = axes.get_window_extent()
    points = np.array(path)
    seen = axes.transData.transform(points[:, list(shown)])
    boxes = [patch.get_window_extent() for _, patch in outlines]
    near_mm = {id(one): float(one.shape.distance_mm(points).min()) for one, _ in outlines}

    def rank(one: tuple[Region, Patch]) -> tuple[bool, bool, float]:
        """Targets first, then what is near; the shell of a region comes after that."""
        return one[0].kind != "target", one[0].around is not None, near_mm[id(one[0])]

    written: list[Text] = []
    taken: list[Bbox] = []
    for region, patch in sorted(outlines, key=rank):
        text = _text(axes, region.name, colours[region.kind])
        size, own = text.get_window_extent(), patch.get_window_extent()
        best, least = None, math.inf if len(outlines) <= _MOST else _COVERS_PATH
        for x, y in _places(own, size.width, size.height):
            place = size.translated(x - size.x0, y - size.y0)
            if not _is_inside(place, frame) or any(place.overlaps(one) for one in taken):
                continue
            bad = _badness(place, seen, [one for one in boxes if one.bounds != own.bounds])
            if bad < least:
                best, least = place, bad
        if best is None or len(written) == _MOST:
            text.remove()
            continue
        taken.append(best)
        written.append(text)
        # From here on in the units of the data, so that it keeps its place in any format.
        text.set_position(axes.transData.inverted().transform(best.p0))
        text.set_transform(axes.transData)
    return written


def _text(axes: Any, name: str, colour: str) -> Text:  # noqa: ANN401
    """A name, somewhere."""
    from matplotlib.patheffects import withStroke
    from matplotlib.transforms import IdentityTransform

    text: Text = axes.text(
        0.0,
        0.0,
        name if len(name) <= _LONGEST else name[: _LONGEST - 1] + "…",
        fontsize=_SIZE,
        color=colour,
        transform=IdentityTransform(),
        ha="left",
        va="bottom",
        zorder=9,
        parse_math=False,
        path_effects=[withStroke(linewidth=1.5, foreground="white")],
    )
    return text


def _places(outline: Bbox, width: float, height: float) -> Iterator[tuple[float, float]]:
    """Lower left corners of a name, the best ones first: inside, beside, above and below."""
    middle_x = 0.5 * (outline.x0 + outline.x1 - width)
    middle_y = 0.5 * (outline.y0 + outline.y1 - height)
    right, left = outline.x1 + _GAP, outline.x0 - _GAP - width
    above, below = outline.y1 + _GAP, outline.y0 - _GAP - height
    if width <= 0.7 * outline.width and height <= 0.4 * outline.height:
        yield middle_x, middle_y
        yield middle_x, outline.y0 + 0.15 * outline.height
        yield middle_x, outline.y1 - 0.15 * outline.height - height
    yield right, middle_y
    yield left, middle_y
    yield middle_x, above
    yield middle_x, below
    for y in (above, below):
        yield right, y
        yield left, y
        # Of a wide outline, near an end.
        yield outline.x0, y
        yield outline.x1 - width, y


def _is_inside(place: Bbox, frame: Bbox) -> bool:
    return bool(
        frame.x0 <= place.x0
        and place.x1 <= frame.x1
        and frame.y0 <= place.y0
        and place.y1 <= frame.y1
    )


def _badness(place: Bbox, path: NDArray[np.float64], outlines: Sequence[Bbox]) -> float:
    """How much a name covers: the path, and other outlines."""
    inside = (path >= place.p0).all(axis=1) & (path <= place.p1).all(axis=1)
    covered = sum(1 for one in outlines if one.overlaps(place))
    return _COVERS_PATH * float(inside.any()) + min(covered, 0.9 * _COVERS_PATH)
