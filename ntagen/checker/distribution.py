"""How the values of random runs are distributed: when they reach a goal, or what they are worth.

Up to 100,000 different values are exact, after any number of runs. With more, values are counted in
at most 65,536 bins, and `Distribution.resolution` says how wide these are.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal

from ntagen.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ntagen.checker.picture.page import Svg

    Floats = NDArray[np.float64]
    Counts = NDArray[np.uint64]

Measured = Literal["time", "clock", "moves", "value"]

Points = Callable[[], tuple[bytes, bytes] | None]
"""Gives values as native doubles, and how often each came as native unsigned integers."""

MOST_BUCKETS: Final = 1_000_000
_MOST_DRAWN: Final = 600
"""More points than this cannot be told apart in a picture."""

_MOST_BARS: Final = 120
"""A picture with more bars is not smoother but more ragged."""


@dataclass(frozen=True, slots=True, eq=False)
class Histogram:
    """How many values lie in buckets.

    Attributes:
        edges: Where buckets begin and end: one more than there are buckets. A bucket has its lower
            edge; the last one also has its upper edge.
        counts: How many values lie in each.
        runs: How many runs there were.
    """

    edges: Floats
    counts: Counts
    runs: int

    @property
    def frequencies(self) -> Floats:
        """The share of all runs in each bucket."""
        frequencies: Floats = self.counts / self.runs
        return frequencies

    @property
    def densities(self) -> Floats:
        """The same by the width of the bucket: an estimate of the density."""
        import numpy as np

        densities: Floats = self.frequencies / np.diff(self.edges)
        return densities


@dataclass(frozen=True, slots=True, eq=False)
class Cumulative:
    """The share of runs whose value is at most so much.

    Attributes:
        at: The values.
        value: The share of the runs.
        lower: The lower end of the band.
        upper: The upper end of the band. It holds for all values at once (Dvoretzky, Kiefer,
            Wolfowitz, Massart): the risk that the true distribution leaves it anywhere is at most
            ``alpha``, if the number of runs was fixed beforehand.
    """

    at: Floats
    value: Floats
    lower: Floats
    upper: Floats


class Distribution:
    """How the values of runs are distributed. A notebook shows its picture.

    Attributes:
        of: What the values are: the ``time`` at which a run reached what is asked, the value of the
            ``clock`` that bounds runs or the number of ``moves`` then, or the ``value`` of the run.
        broken: Whether they are those of the runs that break what is asked: so for ``[] p``, whose
            satisfied runs are decided at their end only.
        runs: The number of runs.
        count: The number of values: runs that are never decided have none.
        mean: Their mean; ``None`` without values.
        min: The least value; ``None`` without values.
        max: The greatest value; ``None`` without values.
        resolution: 0 if all values are exact, else the width of the bins that they are counted in.
        band: How far the true cumulative distribution is from that of the runs at most, everywhere
            at once.
        label: What the values are, in words.
    """

    def __init__(self, known: dict[str, Any], points: Points, query: str) -> None:
        self._points = points
        self._query = query
        self.of: Measured = known["of"]
        self.broken: bool = known["broken"]
        self.runs: int = known["runs"]
        self.count: int = known["count"]
        self.mean: float | None = known["mean"]
        self.min: float | None = known["min"]
        self.max: float | None = known["max"]
        self.resolution: float = known["resolution"]
        self.band: float = known["band"]
        self.label = _label(self.of, query)
        self._known: dict[str, Any] = known

    def __repr__(self) -> str:
        if self.count == 0:
            return f"<Distribution: none of {self.runs} runs has a value>"
        return (
            f"<Distribution of {self.label}: {self.count} values of {self.runs} runs, "
            f"{self.min:g} to {self.max:g}, mean {self.mean:g}>"
        )

    def to_json(self) -> dict[str, Any]:
        """What ``ntagen check --json`` shows of it: summary, histogram, cumulative distribution.

        The cumulative distribution has at most 200 values; `cumulative` has all.
        """
        return dict(self._known)

    @property
    def values(self) -> Floats:
        """The different values in ascending order; with a `resolution`, the middles of bins."""
        import numpy as np

        points = self._points() or (b"", b"")
        return np.frombuffer(points[0], dtype=np.float64)

    @property
    def counts(self) -> Counts:
        """How often each of `values` came."""
        import numpy as np

        points = self._points() or (b"", b"")
        return np.frombuffer(points[1], dtype=np.uint64)

    def histogram(self, buckets: int | None = None, width: float | None = None) -> Histogram:
        """The values in buckets of the same width, from the least value on.

        Args:
            buckets: How many there are. By default, that is the square root of the number of
                values, rounded up, as in UPPAAL; buckets for whole numbers are whole numbers wide.
            width: How wide a bucket is, instead.

        Raises:
            InputError: There are no values, or the buckets cannot be made.
        """
        import numpy as np

        if self.count == 0 or self.min is None or self.max is None:
            raise InputError(f"none of {self.runs} runs has a value, so there is no histogram")
        span = self.max - self.min
        start: float = self.min
        if buckets is not None:
            if width is not None:
                raise InputError("give the number of buckets or their width, not both")
            if not 1 <= buckets <= MOST_BUCKETS:
                raise InputError(f"{buckets} buckets: there must be 1 to {MOST_BUCKETS}")
            number, width = buckets, span / buckets if span > 0 else 1.0
        elif width is None:
            known = self._known["histogram"]
            width, number = float(known["width"]), len(known["counts"])
        else:
            if not (math.isfinite(width) and width > 0):
                raise InputError(f"buckets cannot be {width} wide: give a positive number")
            # They begin at multiples of the width, so that their edges are round.
            start = math.floor(self.min / width) * width
            if (self.max - start) / width >= MOST_BUCKETS:
                raise InputError(
                    f"buckets of {width:g} would be more than {MOST_BUCKETS}\n"
                    f"hint: the values span {span:g}"
                )
            number = math.floor((self.max - start) / width) + 1
        places = np.floor((self.values - start) / width).astype(np.int64)
        places = np.clip(places, 0, number - 1)
        counts = np.zeros(number, dtype=np.uint64)
        np.add.at(counts, places, self.counts)
        edges = start + width * np.arange(number + 1, dtype=np.float64)
        return Histogram(edges, counts, self.runs)

    def cumulative(self, at: Any = None) -> Cumulative:  # noqa: ANN401  any array will do
        """The cumulative distribution with its band.

        Runs without a value count as if it were infinite: for a probability the curve ends at the
        estimate, and below it is the probability within less time.

        Args:
            at: The values at which it is computed; by default all that came.
        """
        import numpy as np

        values = self.values
        below = np.concatenate([[0], np.cumsum(self.counts, dtype=np.uint64)])
        places = values if at is None else np.asarray(at, dtype=np.float64)
        shares = below[np.searchsorted(values, places, side="right")] / self.runs
        return Cumulative(
            places,
            shares,
            np.maximum(shares - self.band, 0.0),
            np.minimum(shares + self.band, 1.0),
        )

    def to_frame(self) -> Any:  # noqa: ANN401  it depends on what is installed
        """A frame of pandas, or of polars: a row for each value, with its count and the band.

        Raises:
            InputError: Neither library is installed.
        """
        from ntagen.frames import frame_of

        found = self.cumulative()
        columns = {
            self.of: self.values,
            "count": self.counts,
            "cumulative": found.value,
            "lower": found.lower,
            "upper": found.upper,
        }
        names = list(columns)
        lists = zip(*(column.tolist() for column in columns.values()), strict=True)
        rows = [dict(zip(names, row, strict=True)) for row in lists]
        return frame_of(rows, "`values`, `counts` and `cumulative()` have the same")

    def chart(
        self,
        buckets: int | None = None,
        width: float | None = None,
        interval: tuple[float | None, float | None] = (None, None),
    ) -> Svg:
        """The histogram above the cumulative distribution with its band, as a picture.

        Args:
            buckets: As for `histogram`; by default at most 120.
            width: As for `histogram`.
            interval: An interval of the mean, which is marked.

        Raises:
            InputError: There are no values, or the buckets cannot be made.
        """
        from ntagen.checker.picture import chart

        automatic = len((self._known["histogram"] or {"counts": []})["counts"])
        if buckets is None and width is None and automatic > _MOST_BARS:
            buckets = _MOST_BARS
        histogram = self.histogram(buckets, width)
        per = f"share per bucket of {float(histogram.edges[1] - histogram.edges[0]):.3g}"
        edges = histogram.edges.tolist()
        if edges[1] - edges[0] == 1.0 and self._is_whole:
            # The bar of a whole number stands around it.
            edges = [edge - 0.5 for edge in edges]
        caption = (
            f"{self.count:,} values of {self.runs:,} runs, from {self.min:.6g} to {self.max:.6g}, "
            f"mean {self.mean:.6g}"
        )
        labels = (per, "cumulative share")
        figure, (above, below) = chart.panels(self._query, caption, self.label, labels)
        percent = f"{100 * (1 - self._alpha):g} %"
        heights = histogram.frequencies.tolist()
        filled = [bar for bar in zip(edges, edges[1:], heights, strict=False) if bar[2]]
        tips = chart.add_bars(above, filled, "share of the runs")
        if None not in interval:
            ends = [float(one) for one in interval if one is not None]
            label = f"interval of the mean, at {percent} confidence"
            above.axvspan(*ends, color=chart.DARK, alpha=chart.BAND, linewidth=0.0, label=label)
        if self.mean is not None:
            above.axvline(self.mean, color=chart.DARK, linewidth=1.0, linestyle="--", label="mean")
        above.set_ylim(0.0, 1.05 * max(heights))
        x, value, lower, upper = self._thinned(edges[0], edges[-1])
        label = f"band for all values at once, at {percent} confidence"
        chart.add_band(below, x, (lower, upper), label, step="post")
        label = "share of the runs up to there"
        below.plot(x, value, color=chart.BLUE, linewidth=1.0, drawstyle="steps-post", label=label)
        # A rare event is a flat line else.
        below.set_ylim(0.0, 1.0 if value[-1] >= 0.5 else min(1.0, 1.15 * upper[-1]))
        return chart.picture(figure, tips)

    def _repr_svg_(self) -> str | None:
        return None if self.count == 0 else self.chart().text

    @property
    def _alpha(self) -> float:
        """The risk of the band."""
        return 2.0 * math.exp(-2.0 * self.runs * self.band**2)

    @property
    def _is_whole(self) -> bool:
        """Whether all values are whole numbers."""
        return self.resolution == 0 and bool((self.values % 1.0 == 0.0).all())

    def _thinned(self, low: float, high: float) -> tuple[list[float], ...]:
        """The cumulative distribution from one place to another, at a few hundred values."""
        import numpy as np

        values = self.values
        if len(values) > _MOST_DRAWN:
            chosen = np.linspace(0, len(values) - 1, _MOST_DRAWN).astype(np.int64)
            values = values[chosen]
        found = self.cumulative(np.concatenate([[np.nextafter(low, -np.inf)], values, [high]]))
        places = [low, *found.at.tolist()[1:]]
        return places, found.value.tolist(), found.lower.tolist(), found.upper.tolist()


def _label(of: Measured, query: str) -> str:
    """What values are, in words."""
    match of:
        case "time":
            return "time [units of the model]"
        case "moves":
            return "number of moves"
        case "clock":
            found = re.search(r"\[\s*(.+?)\s*<=", query)
            return f"value of the clock {found[1]}" if found else "value of the clock"
        case _:
            found = re.search(
                r"\(\s*(min|max)\s*:\s*(.+?)\s*\)\s*(?:under\b.*)?$", query, re.DOTALL
            )
            if found is None:
                return "value of the run"
            kind = "least" if found[1] == "min" else "greatest"
            return f"{kind} value of {' '.join(found[2].split())}"
