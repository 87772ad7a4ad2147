"""Runs that ``simulate`` shows: as arrays, at given times, together over time, and as pictures."""

from __future__ import annotations

import json
import sys
import xml.etree.ElementTree as ET
from types import ModuleType

import numpy as np
import pytest

from ntagen import checker
from ntagen.checker import Model, Trajectory
from ntagen.checker.trajectories import over_time
from ntagen.errors import InputError

MODEL = """
clock x, c; int n;
process P() { state A { ; 1:2 && c' == 2 }, B { c' == 0 }; init A; trans A -> B { }; }
process Q() { state A { x <= 4 }, B; init A; trans A -> B { guard x >= 2; assign n = 5; }; }
system P, Q;
"""


@pytest.fixture(scope="module")
def model() -> Model:
    return checker.load(MODEL.replace("; 1:2 && c' == 2", "c' == 2 ; 1:2"))


def test_arrays_have_the_points(model: Model) -> None:
    one = model.check("simulate[<=6; 3]{n, c}").trajectories[2]
    assert (one.run, one.expressions, one.end) == (2, ("n", "c"), 6.0)
    for text in ("n", "c"):
        pairs = list(zip(one.times[text].tolist(), one.values[text].tolist(), strict=True))
        assert pairs == one.points[text]
    assert repr(one) == "<Trajectory of run 2: n, c>"


def test_values_at_times_are_linear_and_those_after_a_move(model: Model) -> None:
    one = model.check("simulate[<=6; 1]{n, c}").trajectories[0]
    jump = one.times["n"][one.values["n"] == 5][0]
    found = one.at([0, jump - 1e-9, jump, 6, -1, 7, np.nan])
    assert found["n"][:4].tolist() == [0, 0, 5, 5]
    assert np.isnan(found["n"][4:]).all()
    stop = one.times["c"][np.argmax(one.values["c"])]
    times = np.linspace(0, 6, 50)
    assert one.at(times)["c"] == pytest.approx(2 * np.minimum(times, stop))


def test_infinite_values_stay_infinite() -> None:
    points = np.array([[0.0, np.inf], [2.0, np.inf], [2.0, 1.0], [3.0, 2.0]])
    one = Trajectory(0, "", {"v": points.tobytes()})
    assert one.at([1.0, 2.0, 2.5])["v"].tolist() == [np.inf, 1.0, 1.5]


@pytest.mark.slow
def test_the_share_of_runs_over_time_is_the_probability(model: Model) -> None:
    answer = model.check("simulate[<=6; 4000]{Q.B, n}")
    found = answer.frequency_over_time(times=[0, 1, 2.5, 3, 3.5, 5], quantiles=(0.1, 0.9))
    assert found.mean["Q.B"] == pytest.approx([0, 0, 0.25, 0.5, 0.75, 1], abs=0.04)
    assert found.runs.tolist() == [4000] * 6
    assert found.lower["n"].tolist() == [0, 0, 0, 0, 0, 5]
    assert found.upper["n"].tolist() == [0, 0, 5, 5, 5, 5]
    assert answer.frequency_over_time(3.0).mean["Q.B"] == found.mean["Q.B"][3]
    whole = answer.frequency_over_time()
    assert (whole.times[0], whole.times[-1], len(whole.times)) == (0, 6, 201)
    assert "from 5 % to 95 % of the runs" in whole._repr_svg_()


def test_runs_count_until_their_end(model: Model) -> None:
    answer = model.check("simulate[<=6; 1000]{n} : 50 : Q.B")
    found = answer.frequency_over_time(times=[0, 3, 5])
    assert found.runs[0] == 50
    assert 0 < found.runs[1] < 50
    assert (found.runs[2], np.isnan(found.mean["n"][2])) == (0, True)


def test_json_has_the_same_numbers(model: Model) -> None:
    found = model.check("simulate[<=6; 1000]{Q.B, n} : 50 : Q.B").frequency_over_time()
    shown = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert list(shown) == ["time", "runs", "quantiles", "mean", "lower", "upper"]
    assert (shown["time"], shown["runs"]) == (found.times.tolist(), found.runs.tolist())
    assert shown["quantiles"] == [0.05, 0.95]
    for name in ("mean", "lower", "upper"):
        values = getattr(found, name)
        assert list(shown[name]) == list(values) == ["Q.B", "n"]
        for text, line in values.items():
            assert shown[name][text] == line.tolist()


def test_what_is_infinite_is_null_in_json() -> None:
    points = [np.array([[0.0, start], [2.0, start]]) for start in (np.inf, 1.0)]
    runs = [Trajectory(number, "", {"v": one.tobytes()}) for number, one in enumerate(points)]
    shown = over_time(runs, [1.0, 3.0], (0.0, 1.0), "").to_json()
    assert shown["runs"] == [2, 0]
    assert shown["mean"] == {"v": [None, None]}


@pytest.mark.parametrize("quantiles", [(0.9, 0.1), (-0.1, 0.5), (0.5, float("nan"))])
def test_quantiles_that_are_none_are_refused(model: Model, quantiles: tuple[float, float]) -> None:
    with pytest.raises(InputError, match="do not lie between 0 and 1"):
        model.check("simulate[<=6; 3]{n}").frequency_over_time(quantiles=quantiles)


def test_without_runs_there_is_nothing_to_look_at(model: Model) -> None:
    with pytest.raises(InputError, match="there are no runs to look at"):
        model.check("simulate[<=6; 3]{n} : 1 : n > 7").frequency_over_time()


def test_a_notebook_shows_runs(model: Model) -> None:
    few = model.check("simulate[<=6; 3]{n, c}")
    svg = few._repr_svg_()
    assert svg is not None
    texts = [one.text for one in ET.fromstring(svg).iter("{http://www.w3.org/2000/svg}text")]
    assert {"n", "c", "run 0", "run 1", "run 2", "time [units of the model]"} <= set(texts)
    many = model.check("simulate[<=6; 60]{n}")._repr_svg_()
    assert many is not None
    assert "the first 40 runs" in many
    assert "mean of 60 runs" in many
    assert "run 1" in few.trajectories[1]._repr_svg_()


def test_frames_have_a_row_for_each_point(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    pandas = ModuleType("pandas")
    pandas.DataFrame = dict  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "pandas", pandas)
    answer = model.check("simulate[<=6; 3]{n, c}")
    frame = answer.to_frame()
    assert list(frame) == ["run", "expression", "time", "value"]
    points = sum(len(line) for one in answer.trajectories for line in one.points.values())
    assert len(frame["time"]) == points
    over = answer.frequency_over_time().to_frame()
    assert list(over) == ["expression", "time", "runs", "mean", "lower", "upper"]
    assert len(over["time"]) == 2 * 201
