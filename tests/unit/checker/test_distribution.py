"""How the values of random runs are distributed: against closed forms, and as arrays and pictures.

Seeds are fixed, so a test that passes passes always.
"""

from __future__ import annotations

import json
import sys
import xml.etree.ElementTree as ET
from itertools import pairwise
from types import ModuleType

import numpy as np
import pytest

from ntagen import checker
from ntagen.checker import Distribution, Model
from ntagen.errors import InputError

MODEL = """
clock x, c; int n;
process P() { state A { ; 1:2 }, B; init A; trans A -> B { }; }
process Q() { state A { x <= 4 && c' == 3 }, B { c' == 3 }; init A;
  trans A -> B { guard x >= 2; }; }
process R() { state A { ; 5 }; init A; trans A -> A { guard n < 1000; assign n++; }; }
system P, Q, R;
"""


@pytest.fixture(scope="module")
def model() -> Model:
    return checker.load(MODEL)


def distribution(model: Model, query: str, **options: object) -> Distribution:
    found = model.check(query, **options).distribution  # type: ignore[arg-type]
    assert found is not None
    return found


def test_times_follow_the_true_distribution_within_the_band(model: Model) -> None:
    found = distribution(model, "Pr[<=10](<> P.B)", runs=5000)
    cumulative = found.cumulative()
    true = 1 - np.exp(-cumulative.at / 2)
    assert (cumulative.lower <= true).all()
    assert (true <= cumulative.upper).all()
    assert found.band == pytest.approx(np.sqrt(np.log(40) / 10_000))
    assert (found.of, found.broken, found.runs, found.resolution) == ("time", False, 5000, 0)
    # The curve of a probability ends at its estimate.
    assert cumulative.value[-1] == found.count / 5000


def test_the_band_fails_no_more_often_than_promised(model: Model) -> None:
    misses = 0
    for seed in range(300):
        found = distribution(model, "Pr[<=4](<> Q.B)", runs=40, seed=seed, alpha=0.2)
        true = (found.values - 2) / 2
        after = found.cumulative().value
        # On both sides of every step.
        before = np.concatenate([[0], after[:-1]])
        farthest = max(np.abs(after - true).max(), np.abs(before - true).max())
        misses += farthest > found.band
    # At the promised rate there are 60, with a deviation of 7.
    assert misses <= 60 + 3 * 7
    assert misses >= 20, "the band is not far wider than it must be"


def test_values_are_what_bounds_the_runs(model: Model) -> None:
    clock = distribution(model, "Pr[c<=12](<> Q.B)", runs=300)
    assert (clock.of, clock.label) == ("clock", "value of the clock c")
    assert clock.values[0] >= 6
    assert clock.values[-1] <= 12
    moves = distribution(model, "Pr[#<=60](<> Q.B)", runs=300)
    assert moves.of == "moves"
    assert (moves.values % 1 == 0).all()
    assert 1 <= moves.values[0] <= moves.values[-1] <= 60
    broken = distribution(model, "Pr[<=4]([] !Q.B)", runs=300)
    assert broken.broken
    assert (broken.values >= 2).all()
    mean = distribution(model, "E[<=2; 200](max: n)")
    assert (mean.of, mean.label, mean.count) == ("value", "greatest value of n", 200)
    assert mean.mean == pytest.approx(np.average(mean.values, weights=mean.counts))


def test_times_are_those_of_runs_with_the_same_seed(model: Model) -> None:
    found = distribution(model, "Pr[<=4](<> Q.B)", runs=20, seed=3)
    runs = model.check("simulate[<=4; 20]{Q.B}", seed=3).trajectories
    reached = sorted(one.times["Q.B"][one.values["Q.B"] == 1][0] for one in runs)
    assert found.values.tolist() == pytest.approx(reached, rel=1e-12)


def test_nothing_depends_on_threads(model: Model) -> None:
    some = [
        distribution(model, "Pr[<=10](<> P.B)", runs=3000, threads=threads).to_json()
        for threads in (1, 2, 3)
    ]
    assert some[0] == some[1] == some[2]


def test_the_histogram_counts_what_lies_in_its_buckets(model: Model) -> None:
    found = distribution(model, "Pr[<=10](<> P.B)", runs=1000)
    histogram = found.histogram()
    assert len(histogram.counts) == np.ceil(np.sqrt(found.count))
    expected, _ = np.histogram(found.values, histogram.edges, weights=found.counts)
    # An edge that is computed in two ways may lie on either side of a value.
    assert np.abs(histogram.counts.astype(int) - expected.astype(int)).sum() <= 2
    assert histogram.counts.sum() == found.count
    assert histogram.frequencies.sum() == pytest.approx(found.count / found.runs)
    assert (histogram.densities * np.diff(histogram.edges)).sum() == pytest.approx(
        found.count / found.runs
    )
    assert json.dumps(found.to_json()["histogram"]["counts"]) == json.dumps(
        histogram.counts.tolist()
    ), "two computations of the same buckets"
    assert len(found.histogram(buckets=7).counts) == 7
    wide = found.histogram(width=0.5)
    assert (wide.edges % 0.5 == 0).all()
    assert wide.counts.sum() == found.count


def test_a_number_that_takes_few_values_is_exact_after_many_runs(model: Model) -> None:
    found = distribution(model, "E[#<=3; 120000](max: n)", threads=2)
    assert found.resolution == 0
    assert found.count == 120_000
    assert found.values.tolist() == [1.0, 2.0, 3.0]


def test_many_different_values_are_counted_in_bins(model: Model) -> None:
    found = distribution(model, "Pr[<=4](<> Q.B)", runs=110_000)
    assert 0 < found.resolution < 1e-3
    assert found.counts.sum() == found.count == 110_000
    cumulative = found.cumulative([2.5, 3.0, 3.5])
    assert cumulative.value == pytest.approx([0.25, 0.5, 0.75], abs=found.band)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"buckets": 0}, "0 buckets: there must be 1 to"),
        ({"width": -1.0}, "give a positive number"),
        ({"width": float("nan")}, "give a positive number"),
        ({"width": 1e-12}, "would be more than"),
        ({"buckets": 3, "width": 1.0}, "not both"),
    ],
)
def test_buckets_that_cannot_be_made_are_refused(
    model: Model, arguments: dict[str, float], says: str
) -> None:
    found = distribution(model, "Pr[<=10](<> P.B)", runs=100)
    with pytest.raises(InputError, match=says):
        found.histogram(**arguments)  # type: ignore[arg-type]


def test_runs_without_a_value_have_no_histogram(model: Model) -> None:
    found = distribution(model, "Pr[<=1](<> n > 900)")
    assert (found.count, found.mean, found.min, found.max) == (0, None, None, None)
    assert found._repr_svg_() is None
    assert "none of 72 runs" in repr(found)
    with pytest.raises(InputError, match="there is no histogram"):
        found.histogram()
    assert model.check("E<> P.B").distribution is None


def test_a_notebook_shows_the_picture(model: Model) -> None:
    answer = model.check("E[<=2; 200](max: n)")
    svg = answer._repr_svg_()
    assert svg is not None
    texts = [one.text for one in ET.fromstring(svg).iter("{http://www.w3.org/2000/svg}text")]
    assert "E[<=2; 200](max: n)" in texts
    assert "greatest value of n" in texts
    assert "interval of the mean, at 95 % confidence" in texts
    assert "band for all values at once, at 95 % confidence" in texts
    assert model.check("E<> P.B")._repr_svg_() is None


def test_steps_of_the_picture_rise_to_the_estimate(model: Model) -> None:
    answer = model.check("Pr[<=10](<> Q.B && x <= 3)", runs=500)
    chart = answer.chart()
    assert chart is not None
    assert chart.figure is not None
    (line,) = chart.figure.axes[1].lines
    shares = np.asarray(line.get_ydata())
    assert all(one <= two for one, two in pairwise(shares))
    assert (shares[0], shares[-1]) == (0, answer.value)


def test_a_frame_has_a_row_for_each_value(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    answer = model.check("E[<=2; 50](max: n)")
    pandas = ModuleType("pandas")
    pandas.DataFrame = dict  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "pandas", pandas)
    frame = answer.to_frame()
    assert list(frame) == ["value", "count", "cumulative", "lower", "upper"]
    assert sum(frame["count"]) == 50
    with pytest.raises(InputError, match="has no random runs"):
        model.check("E<> P.B").to_frame()
    monkeypatch.setitem(sys.modules, "pandas", None)
    monkeypatch.setitem(sys.modules, "polars", None)
    with pytest.raises(InputError, match="pandas or polars"):
        answer.to_frame()
