"""Random runs that ``simulate`` shows, and what many of them say together of each moment."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from ntagen.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ntagen.checker.picture.page import Svg

    Floats = NDArray[np.float64]

GRID: Final = 201
"""The number of moments of a grid if none is given."""

_MOST_LINES: Final = 40
"""More runs than this are one area of colour."""

_MOST_TOLD_APART: Final = 8
_MOST_PANELS: Final = 8
_MOST_POINTS: Final = 4000


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Trajectory:
    """A random run that ``simulate`` shows. A notebook shows its picture.

    Between two moments a value is linear in time; two values at one moment are those before and
    after a move.

    Attributes:
        run: The number of the run, from 0.
        query: The query that was asked.
    """

    run: int
    query: str
    _raw: Mapping[str, bytes]

    def __repr__(self) -> str:
        return f"<Trajectory of run {self.run}: {', '.join(self._raw)}>"

    @property
    def expressions(self) -> tuple[str, ...]:
        """The texts of what is shown."""
        return tuple(self._raw)

    @property
    def points(self) -> dict[str, list[tuple[float, float]]]:
        """For each expression, by its text, the moments in units of the model, with its values."""
        found = {}
        for text, data in self._raw.items():
            numbers: list[float] = memoryview(data).cast("d").tolist()  # type: ignore[assignment]
            found[text] = list(zip(numbers[::2], numbers[1::2], strict=True))
        return found

    @property
    def times(self) -> dict[str, Floats]:
        """The moments of `points` as an array for each expression."""
        return {text: self._pairs(text)[:, 0] for text in self._raw}

    @property
    def values(self) -> dict[str, Floats]:
        """The values of `points` as an array for each expression."""
        return {text: self._pairs(text)[:, 1] for text in self._raw}

    @property
    def end(self) -> float:
        """The time at which the run ends."""
        return max(memoryview(data).cast("d")[-2] for data in self._raw.values())

    def at(self, times: Any) -> dict[str, Floats]:  # noqa: ANN401  any array will do
        """The values at given times, for each expression; at a move, those after it.

        Args:
            times: The times. Before 0 and after the end of the run there is no value: NaN.
        """
        import numpy as np

        wanted = np.asarray(times, dtype=np.float64)
        return {text: _at(self._pairs(text), wanted) for text in self._raw}

    def to_frame(self) -> Any:  # noqa: ANN401  it depends on what is installed
        """A frame of pandas, or of polars: a row for each point of each expression.

        Raises:
            InputError: Neither library is installed.
        """
        return frame_of_trajectories((self,))

    def _repr_svg_(self) -> str:
        return runs_chart((self,), self.query).text

    def _pairs(self, text: str) -> Floats:
        import numpy as np

        return np.frombuffer(self._raw[text], dtype=np.float64).reshape(-1, 2)


def _at(pairs: Floats, wanted: Floats) -> Floats:
    """Values at times; at a time with two values, the last of them."""
    import numpy as np

    times, values = pairs[:, 0], pairs[:, 1]
    after = np.searchsorted(times, wanted, side="right")
    left = np.clip(after - 1, 0, len(times) - 1)
    right = np.clip(after, 0, len(times) - 1)
    spans = times[right] - times[left]
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = np.where(spans > 0, (wanted - times[left]) / spans, 0.0)
        found = values[left] + shares * (values[right] - values[left])
    # What is infinite between two moments is so without a difference.
    found = np.where(values[left] == values[right], values[left], found)
    outside = (wanted < times[0]) | (wanted > times[-1]) | np.isnan(wanted)
    result: Floats = np.where(outside, np.nan, found)
    return result


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class OverTime:
    """What runs say of each moment. A notebook shows its picture.

    A run counts until its end. For an expression that is 0 or 1 the mean is the share of runs in
    which it holds.

    Attributes:
        times: The moments.
        runs: At each moment, how many runs last until then.
        mean: For each expression the mean over runs, at each moment; NaN without runs.
        lower: The lower quantile over runs.
        upper: The upper quantile over runs.
        quantiles: Which quantiles these are.
        query: The query that was asked.
    """

    times: Floats
    runs: NDArray[np.int64]
    mean: dict[str, Floats]
    lower: dict[str, Floats]
    upper: dict[str, Floats]
    quantiles: tuple[float, float]
    query: str

    def __repr__(self) -> str:
        return f"<OverTime of {', '.join(self.mean)}: {len(self.times)} moments>"

    def to_json(self) -> dict[str, Any]:
        """What ``ntagen check --json`` shows of it; what is no finite number is null."""
        return {
            "time": _finite(self.times),
            "runs": self.runs.tolist(),
            "quantiles": list(self.quantiles),
            **{
                name: {text: _finite(values) for text, values in getattr(self, name).items()}
                for name in ("mean", "lower", "upper")
            },
        }

    def to_frame(self) -> Any:  # noqa: ANN401  it depends on what is installed
        """A frame of pandas, or of polars: a row for each expression and moment.

        Raises:
            InputError: Neither library is installed.
        """
        from ntagen.frames import frame_of

        names = ("time", "runs", "mean", "lower", "upper")
        rows = []
        for text in self.mean:
            arrays = (self.times, self.runs, self.mean[text], self.lower[text], self.upper[text])
            columns = [one.tolist() for one in arrays]
            for row in zip(*columns, strict=True):
                rows.append({"expression": text, **dict(zip(names, row, strict=True))})
        return frame_of(rows, "`times`, `mean`, `lower` and `upper` have the same")

    def chart(self) -> Svg:
        """A picture with a panel for each expression: the mean in the band of quantiles."""
        from ntagen.checker.picture.chart import BLUE, panels, picture

        most = int(self.runs.max(initial=0))
        caption = f"mean and quantiles of {most:,} runs"
        texts = list(self.mean)[:_MOST_PANELS]
        figure, made = panels(self.query, caption, _TIME, texts)
        for axes, text in zip(made, texts, strict=True):
            _draw_mean(axes, self, text, "mean over the runs", BLUE)
        return picture(figure)

    def _repr_svg_(self) -> str:
        return self.chart().text


_TIME: Final = "time [units of the model]"


def _finite(values: Floats) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in values.tolist()]


def over_time(
    runs: Sequence[Trajectory],
    times: Any,  # noqa: ANN401  any array will do
    quantiles: tuple[float, float],
    query: str,
) -> OverTime:
    """What runs say of each moment; see `OverTime`.

    Args:
        runs: The runs; at least one.
        times: The moments; ``None`` is a grid from 0 to the end of the longest run.
        quantiles: Which quantiles bound the band.
        query: The query that was asked.

    Raises:
        InputError: There are no runs, or the quantiles are none.
    """
    import numpy as np

    if not runs:
        raise InputError(
            "there are no runs to look at\nhint: ask for some: simulate[<=10; 100]{e, …}"
        )
    low, high = quantiles
    if not 0 <= low <= high <= 1:
        raise InputError(f"the quantiles {low} and {high} do not lie between 0 and 1 in this order")
    if times is None:
        times = np.linspace(0.0, max(one.end for one in runs), GRID)
    moments = np.atleast_1d(np.asarray(times, dtype=np.float64))
    values = [one.at(moments) for one in runs]
    found: dict[str, tuple[Floats, Floats, Floats]] = {}
    lasting = np.zeros(len(moments), dtype=np.int64)
    for text in runs[0].expressions:
        table = np.array([one[text] for one in values])
        is_there = ~np.isnan(table)
        lasting = np.maximum(lasting, is_there.sum(axis=0))
        some = is_there.any(axis=0)
        columns = np.full((3, len(moments)), np.nan)
        if some.any():
            # Between infinite values there is no quantile.
            with np.errstate(invalid="ignore"):
                columns[0, some] = np.nanmean(table[:, some], axis=0)
                columns[1:, some] = np.nanquantile(table[:, some], quantiles, axis=0)
        found[text] = (columns[0], columns[1], columns[2])
    mean, lower, upper = ({text: one[i] for text, one in found.items()} for i in range(3))
    return OverTime(moments, lasting, mean, lower, upper, quantiles, query)


def frame_of_trajectories(runs: Iterable[Trajectory]) -> Any:  # noqa: ANN401
    """A frame with a row for each point: run, expression, time and value."""
    from ntagen.frames import frame_of

    rows = [
        {"run": one.run, "expression": text, "time": time, "value": value}
        for one in runs
        for text, points in one.points.items()
        for time, value in points
    ]
    return frame_of(rows, "`Trajectory.times` and `Trajectory.values` have the same")


def runs_chart(runs: Sequence[Trajectory], query: str) -> Svg:
    """A panel for each expression: its value in each run over time, and the mean of many.

    Raises:
        InputError: There are no runs.
    """
    from ntagen.checker.picture.chart import DARK, PALE, SERIES, panels, picture

    if not runs:
        raise InputError("no run is shown, so there is nothing to draw")
    is_told_apart = len(runs) <= _MOST_TOLD_APART
    shown = runs[:_MOST_LINES]
    means = None if is_told_apart else over_time(runs, None, (0.05, 0.95), query)
    left_out = len(runs[0].expressions) - _MOST_PANELS
    more = f"; {left_out} expressions are left out" if left_out > 0 else ""
    number = "1 run" if len(runs) == 1 else f"{len(runs):,} runs"
    texts = runs[0].expressions[:_MOST_PANELS]
    figure, made = panels(query, f"{number} over time{more}", _TIME, texts)
    for axes, text in zip(made, texts, strict=True):
        for index, one in enumerate(shown):
            points = one.points[text]
            points = points[:: len(points) // _MOST_POINTS + 1]
            (line,) = axes.plot(*zip(*points, strict=True))
            if is_told_apart:
                line.set(color=SERIES[index], linewidth=1.1, label=f"run {one.run}")
            else:
                line.set(color=PALE, linewidth=0.6)
        if means is not None:
            line.set_label("runs" if len(shown) == len(runs) else f"the first {len(shown)} runs")
            _draw_mean(axes, means, text, f"mean of {len(runs):,} runs", DARK)
    return picture(figure)


def _draw_mean(axes: Any, found: OverTime, text: str, label: str, colour: str) -> None:  # noqa: ANN401
    """Draws the mean of an expression on axes of matplotlib, in the band of quantiles."""
    from ntagen.checker.picture.chart import add_band

    low, high = (f"{100 * one:g}" for one in found.quantiles)
    bounds = (found.lower[text].tolist(), found.upper[text].tolist())
    add_band(axes, found.times.tolist(), bounds, f"from {low} % to {high} % of the runs")
    axes.plot(found.times, found.mean[text], color=colour, linewidth=1.4, label=label)
