"""A picture of a scene: two projections and a view in space, with plans and paths.

Each projection shows the direction of insertion, from top to bottom, and one of the two other axes.
All lengths are in mm, and all axes have the same scale. A path that crosses a region in one
projection may pass in front of it: a note above the projection then has the true distance.

Nothing about needles is computed here: the curves are given as points.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, Literal

from ntagen.plot.arrange import cells, fit_planes, fit_space
from ntagen.plot.colours import EXPECTED, MEASURED, NEEDLE, OTHER, OUTLINES, REGIONS, TRUE
from ntagen.plot.names import write_names
from ntagen.plot.seeming import Seeming, note_of, seeming
from ntagen.scene import Region, Scene, Vector
from ntagen.shapes import UPRIGHT, Field, Sphere, directions, outline_mm, skin

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

_AXES: Final = "xyz"
_LEGEND_COLUMNS: Final = 6
_MANY_CURVES: Final = 400
_SHADOW_POINTS: Final = 160
_TITLE_WIDTH: Final = 122
_WIDTHS: Final = (1.0, 1.0, 1.15)
_MOST_TICKS: Final = 5

GAP_MM: Final = 1.0
"""Tip positions farther apart than this are on different lines: the tip was pulled back."""

Curve = Sequence[Vector]
Tube = Sequence[tuple[Vector, float]]
"""Places of a path, and how far the tip may be from each."""


@dataclass(frozen=True, slots=True)
class Moment:
    """A moment of a run.

    Attributes:
        time_s: The time on the clock of the run.
        true_mm: Where the tip truly is (simulation only).
        measured_mm: Where it was measured.
        tip_mm: Where the driver takes it to be.
        depth_mm: The insertion depth at the measurement.
        force_n: The force that was measured.
        off_mm: How far the measured tip was from the plan.
        state: The state of the driver from here on.
        said: What happened, in words.
    """

    time_s: float
    true_mm: Vector | None = None
    measured_mm: Vector | None = None
    tip_mm: Vector | None = None
    depth_mm: float | None = None
    force_n: float | None = None
    off_mm: float | None = None
    state: str = ""
    said: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Planned:
    """A plan from a moment of a run on, or how far the tip was expected around it.

    Attributes:
        time_s: The time on the clock of the run.
        bent: The parts of its path in which the needle does not spin; without any parts there was
            no plan any more.
        spun: The parts in which it spins.
        tube: How far the tip may be from the path.
    """

    time_s: float
    bent: Sequence[Curve] = ()
    spun: Sequence[Curve] = ()
    tube: Tube = ()


@dataclass(frozen=True, slots=True)
class Picture:
    """The contents of a picture.

    Attributes:
        scene: The regions and the needle's pose.
        best: The path of the best plan.
        bent: The parts of it in which the needle does not spin; none if it never does.
        spun: The parts of it in which the needle spins, which are dashed.
        tubes: How far the tip was expected around the plans that were followed, in order.
        tube_label: What they are in the legend.
        others: The paths of other plans.
        true_path: The true path of the tip (simulation only).
        measured: Measured positions of the tip.
        learned: Names of regions that the driver learned; they are hatched.
        unknown: Names of regions that the driver did not know.
        best_label: What the path of the best plan is in the legend.
        other_label: What the other paths are.
        title: The line above the picture.
        caption: The lines below the picture.
        moments: The moments of a run, in order; pages and animations go through them.
        appears_s: When a region was learned, by its name.
        plans: The plans of a run, in the order in which they were made.
        limits: The limits of the force, in N, and of the deviation, in mm, by their key (`Moment`).
        clock_s: The time on the clock of the breath at the time 0 of the run; where plans begin
            without a run.
    """

    scene: Scene
    best: Curve = ()
    others: Sequence[Curve] = ()
    true_path: Sequence[Curve] = ()
    measured: Curve = ()
    learned: frozenset[str] = frozenset()
    unknown: frozenset[str] = frozenset()
    best_label: str = "best plan"
    other_label: str = "other plans"
    title: str = ""
    caption: str = ""
    moments: Sequence[Moment] = ()
    appears_s: Mapping[str, float] = field(default_factory=dict)
    clock_s: float = 0.0
    bent: Sequence[Curve] = ()
    spun: Sequence[Curve] = ()
    tubes: Sequence[Planned] = ()
    tube_label: str = "tube"
    plans: Sequence[Planned] = ()
    limits: Mapping[str, float] = field(default_factory=dict)


def draw(picture: Picture) -> Figure:
    """The figure; the caller saves it (`save`)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 6.4), dpi=150)
    # It measures texts.
    FigureCanvasAgg(figure)
    depth = depth_axis(picture.scene)
    bounds = bounds_mm(picture)
    across = [axis for axis in range(3) if axis != depth]
    flat = [figure.add_subplot(1, 3, 1), figure.add_subplot(1, 3, 2)]
    drawn = [
        draw_projection(axes, picture, (axis, depth), bounds)
        for axes, axis in zip(flat, across, strict=True)
    ]
    space = figure.add_subplot(1, 3, 3, projection="3d")
    lengths = _set_scales(space, picture, depth, bounds)
    add_legend(figure, flat[:1])
    heading = figure.suptitle(heading_of(picture), fontsize=10.5, y=0.985)
    *left, right = cells(figure, heading, _WIDTHS)
    fit_planes(figure, flat, left)
    fit_space(figure, space, lengths, right)
    _draw_space(space, picture, depth)
    start, end = picture.scene.needle.tip.position_mm, picture.scene.targets[-1].center_mm
    path = picture.best or (start, end)
    for axes, axis, outlines in zip(flat, across, drawn, strict=True):
        write_names(axes, outlines, (axis, depth), path, REGIONS)
    return figure


def add_legend(
    figure: Figure,
    views: Iterable[Any],
    columns: int = _LEGEND_COLUMNS,
    place: Literal["lower center", "outside lower center"] = "lower center",
) -> None:
    """Adds the legend of some views below all of them; equal texts stand there once."""
    entries: dict[str, Any] = {}
    for axes in views:
        handles, labels = axes.get_legend_handles_labels()
        entries |= dict(zip(labels, handles, strict=True))
    figure.legend(
        entries.values(),
        entries.keys(),
        loc=place,
        ncols=min(len(entries), columns),
        frameon=False,
        fontsize=9,
    )


def heading_of(picture: Picture) -> str:
    """The title and the caption, in lines."""
    title = picture.title or picture.scene.name
    lines = [title, *picture.caption.splitlines()]
    return "\n".join(part for line in lines for part in textwrap.wrap(line, _TITLE_WIDTH))


def depth_axis(scene: Scene) -> int:
    """The coordinate axis along which insertion makes most progress."""
    return max(range(3), key=lambda i: abs(scene.axis[i]))


def bounds_mm(picture: Picture) -> list[tuple[float, float]]:
    """The range of each coordinate that contains everything, with a little space."""
    room_mm = 2.0
    curves = [picture.best, *picture.others, *picture.true_path]
    points = [point for curve in curves for point in curve]
    points += [*picture.measured, picture.scene.needle.tip.position_mm]
    bounds = []
    for axis in range(3):
        low = min(point[axis] for point in points)
        high = max(point[axis] for point in points)
        shown = picture.scene.regions
        for region in [*shown, *(ghost for one in shown for ghost in _ghosts(one))]:
            least, most = (bound[axis] for bound in _seen_bounds(region))
            low = min(low, least) if math.isfinite(least) else low
            high = max(high, most) if math.isfinite(most) else high
        bounds.append((low - room_mm, high + room_mm))
    across = [i for i in range(3) if i != depth_axis(picture.scene)]
    # Both projections have the same width, so that they fit side by side on one scale.
    half = max(bounds[i][1] - bounds[i][0] for i in across) / 2.0
    for i in across:
        middle = sum(bounds[i]) / 2.0
        bounds[i] = (middle - half, middle + half)
    return bounds


def _seen_bounds(region: Region) -> tuple[Vector, Vector]:
    """The bounds of what is drawn: of a field only what lies in its grid."""
    if isinstance(region.shape, Field):
        points, _ = skin(region.shape)
        if len(points):
            a, b, c = map(float, points.min(axis=0))
            d, e, f = map(float, points.max(axis=0))
            return (a, b, c), (d, e, f)
    return region.shape.bounds_mm()


def draw_projection(
    axes: Any,  # noqa: ANN401  matplotlib's own stubs leave axes open
    picture: Picture,
    shown: tuple[int, int],
    bounds: list[tuple[float, float]],
    regions: Sequence[Region] | None = None,
) -> list[tuple[Region, Patch]]:
    """Draws what is seen along the axis that is not among those `shown`.

    Args:
        axes: Where it is drawn.
        picture: What is drawn.
        shown: The axes of space across and down the page.
        bounds: The range of each axis of space.
        regions: These regions only; by default all.

    Returns:
        The regions with their outlines.
    """
    across, depth = shown
    seen: list[Seeming | None] = []
    outlines = []
    for region in _back_to_front(picture.scene.regions if regions is None else regions):
        for ghost in _ghosts(region):
            axes.add_patch(outline_of(ghost, shown, _ghost_style(region)))
        outline = axes.add_patch(outline_of(region, shown, face_of(region, picture)))
        outlines.append((region, outline))
        seen.append(seeming(picture.best, region, outline, shown))
    if picture.tubes:
        axes.add_patch(_band(picture, shown))
    for style, curves in _curves(picture):
        for curve in _few(curves):
            axes.plot([p[across] for p in curve], [p[depth] for p in curve], **style)
            style = {**style, "label": None}
    entry = picture.scene.needle.tip.position_mm
    axes.plot(entry[across], entry[depth], **_TIP_STYLE)
    axes.set_xlim(bounds[across])
    low, high = bounds[depth]
    # Insertion always goes down the page.
    axes.set_ylim((low, high) if picture.scene.axis[depth] <= 0.0 else (high, low))
    axes.set_aspect("equal")
    axes.set_xlabel(f"{_AXES[across]} [mm]")
    axes.set_ylabel(f"{_AXES[depth]} [mm]")
    axes.grid(True, color="#e6e8ec", linewidth=0.6)
    axes.set_axisbelow(True)
    note = note_of([one for one in seen if one is not None], picture.best_label)
    axes.set_title(note, fontsize=7.5, color="#404040")
    return outlines


def _ghosts(region: Region) -> list[Region]:
    """A moving region at the two ends of its way, without its place at rest."""
    if region.motion is None:
        return []
    places = [place for place in region.motion.extremes_mm() if any(place)]
    return [replace(region, shape=region.shape.placed(UPRIGHT, place)) for place in places]


def _ghost_style(region: Region) -> dict[str, Any]:
    """A thin outline without a face."""
    colour = (REGIONS[region.kind], 0.6)
    label = f"{region.kind}, end of its way"
    return {
        **{"edgecolor": colour, "facecolor": "none", "linewidth": 0.7},
        **{"linestyle": (0, (1, 1.5)), "zorder": 2, "label": label},
    }


def outline_of(region: Region, shown: tuple[int, int], style: dict[str, Any]) -> Any:  # noqa: ANN401
    """What a region looks like along an axis: a circle, or the hull of points of its surface."""
    import numpy as np
    from matplotlib.patches import Circle, Polygon

    if isinstance(region.shape, Sphere):
        center = [region.center_mm[axis] for axis in shown]
        return Circle((center[0], center[1]), region.radius_mm, **style)
    if isinstance(region.shape, Field):
        return _shadow(region.shape, shown, style)
    points = outline_mm(region.shape, directions().reshape(-1, 3))[:, list(shown)]
    angles = np.linspace(0.0, 2.0 * math.pi, 240, endpoint=False)
    farthest = np.argmax(points @ np.array([np.cos(angles), np.sin(angles)]), axis=0)
    return Polygon(points[farthest], **style)


def _shadow(shape: Field, shown: tuple[int, int], style: dict[str, Any]) -> Any:  # noqa: ANN401
    """The outline of a field along an axis: where the least distance along the axis is 0."""
    import numpy as np
    from contourpy import contour_generator
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    points, _ = skin(shape)
    if not len(points):
        return PathPatch(Path(np.zeros((0, 2))), **style)
    room_mm = max(shape.steps_mm)
    low, high = points.min(axis=0) - room_mm, points.max(axis=0) + room_mm
    spacing_mm = max(0.6 * min(shape.steps_mm), float((high - low).max()) / _SHADOW_POINTS)
    lines = [np.arange(a, b + spacing_mm, spacing_mm) for a, b in zip(low, high, strict=True)]
    away = np.full([len(lines[axis]) for axis in shown], np.inf)
    along = next(axis for axis in range(3) if axis not in shown)
    layer = np.zeros((*away.shape, 3))
    layer[..., shown[0]] = lines[shown[0]][:, None]
    layer[..., shown[1]] = lines[shown[1]][None, :]
    for place in lines[along]:
        layer[..., along] = place
        found = shape.interpolated_mm(layer.reshape(-1, 3)).reshape(away.shape)
        away = np.minimum(away, found)
    found_rims: Any = contour_generator(lines[shown[0]], lines[shown[1]], away.T).lines(0.0)
    rims: list[Any] = list(found_rims)
    codes = [[Path.MOVETO] + [Path.LINETO] * (len(rim) - 1) for rim in rims]
    if not rims:
        return PathPatch(Path(np.zeros((0, 2))), **style)
    return PathPatch(Path(np.concatenate(rims), np.concatenate(codes)), **style)


_TIP_STYLE: Final[dict[str, Any]] = {
    "marker": "o",
    "markersize": 5,
    "color": NEEDLE,
    "markeredgecolor": "white",
    "linestyle": "none",
    "label": "start",
    "zorder": 8,
}


def _back_to_front(regions: Sequence[Region]) -> list[Region]:
    """The regions in the order of drawing: targets first, large ones first, to hide nothing."""
    return sorted(regions, key=lambda r: (r.kind != "target", -r.shape.reach_mm()))


def face_of(region: Region, picture: Picture) -> dict[str, Any]:
    """The style of a region's disc."""
    colour = REGIONS[region.kind]
    label: str = region.kind
    style: dict[str, Any] = {"edgecolor": colour, "linewidth": 1.2, "zorder": 2}
    if region.kind in OUTLINES:
        style |= {"facecolor": "none", "linestyle": OUTLINES[region.kind], "zorder": 3}
    else:
        style |= {"facecolor": (colour, 0.22)}
    if region.kind == "unexplored":
        style |= {"hatch": "...."}
    if region.name in picture.learned:
        label += " (learned)"
        style |= {"hatch": "//////" if region.kind == "critical" else None, "linewidth": 0.9}
    elif region.name in picture.unknown:
        label += " (not known)"
        style |= {"linestyle": ":"}
    return style | {"label": label}


def _curves(picture: Picture) -> list[tuple[dict[str, Any], Sequence[Curve]]]:
    """The curves in the order of drawing, with their style."""
    count = len(picture.others)
    # Curves that are joined do not darken each other.
    alpha = 0.6 if count > _MANY_CURVES else max(0.25, min(0.6, 15.0 / max(1, count)))
    measured = [picture.measured] if picture.measured else []
    best = [picture.best] if picture.best and not picture.spun else picture.bent
    dots = {"marker": ".", "markersize": 2.5, "linestyle": "none"}
    other = {"color": OTHER, "linewidth": 0.7, "alpha": alpha, "label": picture.other_label}
    plan = {"color": NEEDLE, "linewidth": 2.2, "label": picture.best_label}
    true = {"color": TRUE, "linewidth": 1.0, "label": "true path"}
    if picture.true_path:
        # The plan is a light band under the true path, so that both are visible.
        plan |= {"linewidth": 4.0, "alpha": 0.45}
    spun = plan | {"linestyle": (0, (1.6, 0.8)), "label": f"{picture.best_label}, spinning"}
    return [
        (other | {"zorder": 4}, picture.others),
        (plan | {"zorder": 5}, best),
        (spun | {"zorder": 5}, picture.spun),
        ({"color": MEASURED, **dots, "label": "measured", "zorder": 6}, measured),
        (true | {"zorder": 7}, picture.true_path),
    ]


def _band(picture: Picture, shown: tuple[int, int]) -> Any:  # noqa: ANN401
    """What all tubes look like along an axis: one patch, so that parts do not darken each other."""
    import numpy as np
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    angles = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    rims = []
    for tube in (one.tube for one in picture.tubes):
        discs = [np.array([place[axis] for axis in shown]) + by * circle for place, by in tube]
        # From each place to the next, the band is the hull of two discs.
        for pair in pairwise(discs):
            points = np.concatenate(pair)
            farthest = np.argmax(points @ circle.T, axis=0)
            rims.append(points[[*farthest, farthest[0]]])
    path = Path.make_compound_path(*(Path(rim) for rim in rims))
    style = {"facecolor": (EXPECTED, 0.8), "edgecolor": "none", "zorder": 6.5}
    return PathPatch(path, label=picture.tube_label, **style)


def _few(curves: Sequence[Curve]) -> Sequence[Curve]:
    """The same curves, joined to one with gaps if there are so many that drawing takes long."""
    if len(curves) <= _MANY_CURVES:
        return curves
    gap = (math.nan, math.nan, math.nan)
    return [[point for curve in curves for point in (*curve, gap)]]


def _order(depth: int) -> list[int]:
    """The axes of the view in space; its vertical one is the direction of insertion."""
    return [*(i for i in range(3) if i != depth), depth]


def _draw_space(axes: Any, picture: Picture, depth: int) -> None:  # noqa: ANN401
    """Draws regions and paths into the view in space."""
    order = _order(depth)
    for region in picture.scene.regions:
        _draw_solid(axes, region, order)
    for style, curves in _curves(picture):
        for curve in _few(curves):
            axes.plot(*([p[i] for p in curve] for i in order), **style)
    entry = picture.scene.needle.tip.position_mm
    axes.plot(*([entry[i]] for i in order), **_TIP_STYLE)


def _set_scales(
    axes: Any,  # noqa: ANN401
    picture: Picture,
    depth: int,
    bounds: list[tuple[float, float]],
) -> list[float]:
    """Gives the view in space its scales; returns the lengths of its axes."""
    order = _order(depth)
    # What is drawn later does not change them.
    axes.set_autoscale_on(False)
    limits = [bounds[i] for i in order]
    axes.set_xlim(limits[0])
    axes.set_ylim(limits[1])
    axes.set_zlim(limits[2] if picture.scene.axis[depth] <= 0.0 else limits[2][::-1])
    for name, i in zip("xyz", order, strict=True):
        # The numbers of the upright axis stand beside it, where its label is.
        pad = 16 if name == "z" else 8
        getattr(axes, f"set_{name}label")(f"{_AXES[i]} [mm]", fontsize=8, labelpad=pad)
    axes.tick_params(labelsize=6.5, pad=0)
    lengths = [high - low for low, high in limits]
    for pane, length_mm in zip((axes.xaxis, axes.yaxis, axes.zaxis), lengths, strict=True):
        pane.set_pane_color((0.97, 0.975, 0.98, 1.0))
        pane.set_major_locator(_ticks(length_mm, max(lengths)))
    axes.view_init(elev=14.0, azim=-58.0)
    return lengths


def _ticks(length_mm: float, longest_mm: float) -> Any:  # noqa: ANN401
    """Ticks at round numbers, fewer of them on a short axis, and none where two axes meet."""
    from matplotlib.ticker import MaxNLocator

    most = max(3, round(_MOST_TICKS * length_mm / longest_mm))
    return MaxNLocator(most, steps=(1, 2, 5, 10), prune="both")


def _draw_solid(axes: Any, region: Region, order: list[int]) -> None:  # noqa: ANN401
    if isinstance(region.shape, Field):
        points, triangles = skin(region.shape)
        if len(triangles):
            mesh = [points[:, i] for i in order]
            face = REGIONS[region.kind]
            alpha = 0.08 if region.kind in OUTLINES else 0.25
            axes.plot_trisurf(
                *mesh[:2], mesh[2], triangles=triangles, color=face, alpha=alpha, linewidth=0
            )
        return
    grid = directions()
    points = outline_mm(region.shape, grid.reshape(-1, 3)).reshape(grid.shape)
    surface = [points[..., i] for i in order]
    colour = REGIONS[region.kind]
    if region.kind in OUTLINES:
        axes.plot_wireframe(*surface, color=colour, linewidth=0.35, alpha=0.45, linestyle="--")
    else:
        axes.plot_surface(*surface, color=colour, alpha=0.22, linewidth=0, shade=True)
