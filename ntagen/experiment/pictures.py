"""Pictures of an experiment; each is made of the table alone, and can be used without the report.

`document` is the table (`ntagen.experiment.table.document_of`), read from ``table.json`` or fresh.
A picture is a figure of matplotlib; `svg_of` makes text of it.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from ntagen.plot.colours import REGIONS
from ntagen.plot.picture import depth_axis, outline_of
from ntagen.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_REACHED: Final = "#2a9d4a"
_HIT: Final = REGIONS["critical"]
_PAPER: Final = "#6b7280"
_LINE: Final = "#1f5fbf"
_BAND: Final = "#9db9e6"
_FELT: Final = "#7a3e9d"
_GRID: Final = "#e6e8ec"
_SHELL: Final = {"facecolor": "none", "alpha": 0.5, "linestyle": "--"}
_WIDTH_IN: Final = 9.0
_BINS: Final = 30


def rates(document: Mapping[str, Any]) -> Figure:
    """How often each row reached the target and hit a region, with intervals; a diamond: paper."""
    rows = list(document["rows"])
    longest = max((len(row["id"]) for row in rows), default=0)
    figure = _figure(0.9 + 0.34 * len(rows), 0.3 + 0.085 * longest)
    reach, hit = figure.subplots(1, 2, sharey=True, width_ratios=(2.0, 1.0))
    for axes, name, colour in ((reach, "reach", _REACHED), (hit, "hit", _HIT)):
        for place, row in enumerate(rows):
            low, high = 100.0 * row[f"{name}_low"], 100.0 * row[f"{name}_high"]
            axes.plot([low, high], [place, place], color=colour, linewidth=2.0, alpha=0.6)
            if row[f"{name}_rate"] is not None:
                axes.plot(100.0 * row[f"{name}_rate"], place, "o", color=colour)
            if row["paper"]:
                value = 100.0 * row["paper"][f"{name}_rate"]
                axes.plot(value, place + 0.25, "D", color=_PAPER, markersize=4)
        axes.set_xlim(-3.0, 103.0)
        axes.grid(True, axis="x", color=_GRID)
    most = max((100.0 * row["hit_high"] for row in rows if row["runs"]), default=100.0)
    hit.set_xlim(-0.03 * most, 1.1 * most)
    reach.set_yticks(range(len(rows)), [row["id"] for row in rows])
    reach.set_ylim(len(rows) - 0.4, -0.6)
    reach.set_xlabel("target reached [%], 95 % interval")
    hit.set_xlabel("critical region hit [%]")
    return figure


def over_depth(document: Mapping[str, Any], row: str) -> Figure:
    """Clearance and deviation over the insertion depth: median, 5 to 95 %, and the worst run."""
    figure = _figure(2.9)
    clear, off = figure.subplots(1, 2)
    profiles = [run["profile"] for run in _runs(document, row)]
    for axes, name, worst in ((clear, "distance_mm", min), (off, "deviation_mm", max)):
        _draw_bands(axes, _by_depth(profiles, name), worst)
        axes.set_xlabel("insertion depth [mm]")
        axes.grid(True, color=_GRID)
    if clear.lines:
        clear.axhline(0.0, color=_HIT, linewidth=1.0)
    clear.set_ylabel("distance to critical regions [mm]")
    off.set_ylabel("deviation from the plan [mm]")
    off.set_ylim(bottom=0.0)
    return figure


def sensitivity(document: Mapping[str, Any], sweep: Mapping[str, Any]) -> Figure:
    """Rates and margins over a quantity.

    Args:
        document: The table.
        sweep: One of its ``sweeps``.
    """
    figure = _figure(5.2, 0.8)
    figure.subplots_adjust(hspace=0.12, wspace=0.22)
    (reach, hit), (clear, inside) = figure.subplots(2, 2, sharex=True)
    rows = {row["id"]: row for row in document["rows"]}
    places = list(zip(sweep["values"], sweep["rows"], strict=True))
    for axes, name in ((reach, "reach"), (hit, "hit")):
        found = [(x, rows[row]) for x, row in places if rows[row][f"{name}_rate"] is not None]
        lines = [[100.0 * row[f"{name}_{k}"] for _, row in found] for k in ("low", "high", "rate")]
        _draw_band(axes, [x for x, _ in found], lines[0], lines[1], "95 % interval")
        axes.plot([x for x, _ in found], lines[2], "o-", color=_LINE, label="runs")
        axes.legend(frameon=False, fontsize=8)
    reach.set_ylim(-3.0, 103.0)
    hit.set_ylim(bottom=-0.03 * hit.get_ylim()[1])
    runs = {row: _runs(document, row) for _, row in places}
    margins = {x: [one["clearance_mm"] for one in runs[row]] for x, row in places}
    depths = {x: [-one["target_mm"] for one in runs[row] if one["is_reached"]] for x, row in places}
    for axes, values in ((clear, margins), (inside, depths)):
        kept = {x: [one for one in found if one is not None] for x, found in values.items()}
        _draw_bands(axes, {x: found for x, found in kept.items() if found}, min, "o")
        axes.set_xlabel(sweep["over"])
        if axes.lines:
            axes.axhline(0.0, color=_HIT, linewidth=1.0)
    reach.set_ylabel("target reached [%]")
    hit.set_ylabel("critical region hit [%]")
    clear.set_ylabel("least distance to\ncritical regions [mm]")
    inside.set_ylabel("depth in the target,\nif it was reached [mm]")
    for axes in figure.axes:
        axes.grid(True, color=_GRID)
        axes.set_axisbelow(True)
    figure.align_ylabels()
    return figure


def felt(document: Mapping[str, Any], row: str, scene: Scene) -> Figure:
    """Where the force rose, in two projections."""
    figure = _figure(4.6)
    panels = figure.subplots(1, 2)
    places = [one["position_mm"] for run in _runs(document, row) for one in run["felt"]]
    depth = depth_axis(scene)
    for axes, across in zip(panels, [i for i in range(3) if i != depth], strict=True):
        for kind in ("detection", "target", "critical"):
            for region in scene.regions:
                if region.kind == kind:
                    body = {"facecolor": REGIONS[kind], "alpha": 0.25}
                    style = _SHELL if kind == "detection" else body
                    style = {**style, "edgecolor": REGIONS[kind]}
                    axes.add_patch(outline_of(region, (across, depth), style))
        x, y = [p[across] for p in places], [p[depth] for p in places]
        axes.plot(x, y, "x", color=_FELT, markersize=5, label=f"felt ({len(places)})", zorder=4)
        entry = scene.needle.tip.position_mm
        axes.plot(entry[across], entry[depth], "o", color="#0b2545", label="entry")
        axes.set_aspect("equal", adjustable="datalim")
        axes.autoscale_view()
        if scene.axis[depth] > 0.0:
            axes.invert_yaxis()
        axes.set_xlabel(f"{'xyz'[across]} [mm]")
        axes.set_ylabel(f"{'xyz'[depth]} [mm]")
        axes.grid(True, color=_GRID)
        axes.set_axisbelow(True)
    panels[0].legend(frameon=False, fontsize=8)
    return figure


def times(document: Mapping[str, Any], row: str) -> Figure:
    """How long syntheses took, and whole runs."""
    import numpy as np

    figure = _figure(2.5)
    short, long = figure.subplots(1, 2)
    runs = _runs(document, row)
    loops = [1e3 * one["loop_s"] for run in runs for one in run["syntheses"]]
    overall = [run["needle_s"] + sum(s["loop_s"] for s in run["syntheses"]) for run in runs]
    for axes, values, label in (
        (short, loops, "time of a synthesis, with all around the engine [ms]"),
        (long, overall, "overall time of a run [s]"),
    ):
        if values:
            # One outline is drawn much faster than thirty bars.
            counts, edges = np.histogram(values, _BINS)
            axes.stairs(counts, edges, fill=True, facecolor=_BAND, edgecolor=_LINE, linewidth=0.6)
        axes.set_xlabel(label)
        axes.grid(True, axis="y", color=_GRID)
        axes.set_axisbelow(True)
    short.set_ylabel("syntheses")
    long.set_ylabel("runs")
    return figure


def svg_of(figure: Figure) -> str:
    """A figure as SVG that can stand in a page; equal figures give equal texts."""
    import matplotlib as mpl

    text = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": "ntagen", "svg.fonttype": "none"}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    whole = text.getvalue()
    # A page has no place for the lines before the picture.
    return whole[whole.index("<svg") :]


def _figure(height_in: float, left_in: float = 0.65) -> Figure:
    """An empty figure with margins that are known: finding good ones takes as long as drawing."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_WIDTH_IN, height_in))
    figure.subplots_adjust(
        left=left_in / _WIDTH_IN,
        right=1.0 - 0.15 / _WIDTH_IN,
        bottom=0.5 / height_in,
        top=1.0 - 0.1 / height_in,
        wspace=0.18,
    )
    return figure


def _runs(document: Mapping[str, Any], row: str) -> list[Mapping[str, Any]]:
    return [run for run in document["runs"] if run["row"] == row]


def _by_depth(profiles: Iterable[Mapping[str, Any]], name: str) -> dict[int, list[float]]:
    """The values of all runs at each depth."""
    found: dict[int, list[float]] = {}
    for profile in profiles:
        for depth, value in zip(profile["depth_mm"], profile[name], strict=False):
            if value is not None:
                found.setdefault(depth, []).append(value)
    return dict(sorted(found.items()))


def _draw_bands(
    axes: Any,  # noqa: ANN401  matplotlib's own stubs leave axes open
    values: Mapping[int, Sequence[float]],
    worst: Any,  # noqa: ANN401  min or max
    marker: str = "",
) -> None:
    if not values:
        axes.text(0.5, 0.5, "nothing to show", transform=axes.transAxes, ha="center", color=_PAPER)
        return
    import numpy as np

    depths = list(values)
    low, middle, high = zip(
        *(np.percentile(values[depth], (5.0, 50.0, 95.0)) for depth in depths), strict=True
    )
    _draw_band(axes, depths, low, high, "5 to 95 %")
    axes.plot(depths, middle, marker=marker, color=_LINE, label="median")
    axes.plot(depths, [worst(values[d]) for d in depths], ":", color=_HIT, label="worst run")
    axes.legend(frameon=False, fontsize=8)


def _draw_band(
    axes: Any,  # noqa: ANN401
    x: Sequence[float],
    low: Sequence[float],
    high: Sequence[float],
    label: str,
) -> None:
    axes.fill_between(x, low, high, color=_BAND, alpha=0.6, linewidth=0, label=label)
