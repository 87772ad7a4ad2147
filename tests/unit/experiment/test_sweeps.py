"""Sweeps: which rows are one, what they show, and how one is asked for."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from ntagen.errors import InputError
from ntagen.experiment import pictures
from ntagen.experiment.description import Experiment, Row
from ntagen.experiment.one_sweep import listed_values, quantity_of, sweep_of_task
from ntagen.experiment.reading import read_experiment
from ntagen.experiment.report import report_of
from ntagen.experiment.sweeps import conclusions_of, sweeps_of
from ntagen.experiment.table import document_of, rate_of
from ntagen.experiment.writing import csv_of
from ntagen.parameters import BY_WORDS
from tests.unit.experiment.files import SCENARIOS, written
from tests.unit.experiment.test_report import drawn, run

TASK = SCENARIOS / "small_mid_cr.nsl"


def row(name: str, seeds: Sequence[int] = (1, 2, 3, 4), **values: float) -> Row:
    fields = {f"needle.{field}": value for field, value in values.items()}
    return Row(name, TASK, "all", "phantom", fields, tuple(seeds))


def test_rows_that_differ_in_one_quantity_are_a_sweep() -> None:
    rows = [row("b", radius_ratio=0.1), row("a", radius_ratio=-0.2), row("other", noise_mm=0.1)]
    (sweep,) = sweeps_of(rows)
    assert (sweep.over, sweep.values, sweep.rows) == ("radius error [%]", (-20.0, 10.0), ("a", "b"))
    assert sweep.name == "small_mid_cr, known: all, needle: phantom"


def test_each_line_of_a_grid_is_a_sweep() -> None:
    rows = [
        row(f"{noise_mm}-{late_s}", noise_mm=noise_mm, latency_s=late_s)
        for noise_mm in (0.0, 0.5)
        for late_s in (0.0, 0.1, 0.2)
    ]
    found = {(sweep.over, sweep.rows) for sweep in sweeps_of(rows)}
    assert found == {
        *(("delay [s]", tuple(f"{n}-{s}" for s in (0.0, 0.1, 0.2))) for n in (0.0, 0.5)),
        *(("noise [mm]", tuple(f"{n}-{s}" for n in (0.0, 0.5))) for s in (0.0, 0.1, 0.2)),
    }
    assert {sweep.name.rpartition(", ")[2] for sweep in sweeps_of(rows)} == {
        *("noise 0 mm", "noise 0.5 mm", "delay 0 s", "delay 0.1 s", "delay 0.2 s")
    }


def test_labs_of_two_speeds_are_two_sweeps() -> None:
    rows = [
        dataclasses.replace(row(f"{speed}-{noise_mm}", noise_mm=noise_mm), speed=speed)
        for speed in (1.0, 5.0)
        for noise_mm in (0.1, 0.2)
    ]
    assert [sweep.rows for sweep in sweeps_of(rows)] == [
        ("1.0-0.1", "1.0-0.2"),
        ("5.0-0.1", "5.0-0.2"),
    ]


@pytest.mark.parametrize(
    "rows",
    [
        [row("a", noise_mm=0.1)],
        [row("a", noise_mm=0.1), row("b", latency_s=0.1)],
        [row("a", noise_mm=0.1), row("b", noise_mm=0.2, latency_s=0.1)],
        [row("a", noise_mm=0.1), row("b", noise_mm=0.1)],
        [row("a", noise_mm=0.1), row("b", (1, 2), noise_mm=0.2)],
    ],
    ids=["one row", "other quantities", "two quantities", "equal values", "other seeds"],
)
def test_other_rows_are_none(rows: list[Row]) -> None:
    assert sweeps_of(rows) == []


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    """Three values: all reached, three of four reached, one of them hit."""
    rows = [row("n0", noise_mm=0.0), row("n1", noise_mm=1.0), row("n2", noise_mm=2.0)]
    runs = [run("n0", seed, clear_mm=2.0 + seed) for seed in (1, 2, 3, 4)]
    runs += [run("n1", seed, reached=seed > 1, clear_mm=0.5 * seed) for seed in (1, 2, 3, 4)]
    runs += [run("n2", seed, reached=False, clear_mm=seed - 1.5) for seed in (1, 2, 3, 4)]
    experiment = Experiment("noise", tuple(rows))
    return json.loads(json.dumps(document_of(experiment, {r.key: r for r in runs})))  # type: ignore[no-any-return]


def test_the_table_has_the_sweep_and_its_numbers(document: Mapping[str, Any]) -> None:
    (sweep,) = document["sweeps"]
    assert sweep["values"] == [0.0, 1.0, 2.0]
    assert sweep["rows"] == ["n0", "n1", "n2"]
    assert [one["values"] for one in document["rows"]] == [{"noise [mm]": x} for x in (0, 1, 2)]
    assert "values.noise [mm]" in csv_of(document).splitlines()[0]


def test_the_picture_shows_rates_and_margins_over_the_values(document: Mapping[str, Any]) -> None:
    figure = pictures.sensitivity(document, document["sweeps"][0])
    assert drawn(figure, 0) == [[(0.0, 100.0), (1.0, 75.0), (2.0, 0.0)]]
    assert drawn(figure, 1) == [[(0.0, 0.0), (1.0, 0.0), (2.0, 25.0)]]
    median, worst, zero = drawn(figure, 2)
    assert median == [(0.0, 4.5), (1.0, 1.25), (2.0, 1.0)]
    assert worst == [(0.0, 3.0), (1.0, 0.5), (2.0, -0.5)]
    assert [y for _, y in zero] == [0.0, 0.0]
    # At 2 mm no run is in the target, so there is no depth in it.
    assert drawn(figure, 3)[0] == [(0.0, 1.0), (1.0, 1.0)]
    assert [axes.get_xlabel() for axes in figure.axes[2:]] == ["noise [mm]"] * 2
    band = figure.axes[0].collections[0].get_paths()[0].vertices
    ends = {(float(x), round(float(y), 6)) for x, y in band}
    for x, count in ((0.0, 4), (1.0, 3), (2.0, 0)):
        rate = rate_of(count, 4)
        assert {(x, round(100 * rate.low, 6)), (x, round(100 * rate.high, 6))} <= ends


def test_a_task_without_regions_and_runs_that_broke_are_drawn() -> None:
    rows = (row("a", (1,), noise_mm=0.0), row("b", (1,), noise_mm=1.0))
    broken = run("b", 1, reached=False, outcome="failed")
    runs = {
        ("a", 1): run("a", 1, clear_mm=1.0),
        ("b", 1): type(broken)(
            **{
                **{name: getattr(broken, name) for name in broken.__dataclass_fields__},
                "clearance_mm": None,
                "target_mm": None,
            }
        ),
    }
    table = document_of(Experiment("x", rows), runs)
    figure = pictures.sensitivity(table, table["sweeps"][0])
    assert drawn(figure, 0) == [[(0.0, 100.0), (1.0, 0.0)]]
    assert drawn(figure, 1) == [[(0.0, 0.0)]]
    assert drawn(figure, 2)[0] == [(0.0, 1.0)]


def test_conclusions_say_what_was_tried_and_no_more(document: Mapping[str, Any]) -> None:
    all_reached, fewer, hits = conclusions_of(document, document["sweeps"][0])
    assert "all runs reached the target at 0 mm: " in all_reached
    assert "at least 39.8%" in all_reached
    assert "1 mm (3 of 4; 95 %: 19.4% to 99.4%), 2 mm (0 of 4; 95 %: 0.0% to 60.2%)" in fewer
    assert "hit at 2 mm (1 of 4; 95 %: 0.6% to 80.6%)" in hits


def test_the_report_has_the_sweep(document: Mapping[str, Any]) -> None:
    text = report_of(document, {})
    assert text.count("<svg") == 1 + 1 + 3 * 2
    assert "<h2>Sensitivity</h2>" in text
    assert "noise [mm]" in text


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0, 50,100 ms", ["0 ms", "50 ms", "100 ms"]),
        ("0,0.1s,200ms", ["0ms", "0.1s", "200ms"]),
        ("0,1", ["0", "1"]),
    ],
)
def test_the_unit_of_the_last_value_holds_for_numbers(text: str, expected: list[str]) -> None:
    assert listed_values(BY_WORDS["delay"], text) == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "a value is missing in ''"),
        ("1,,2s", "a value is missing in '1,,2s'"),
        ("1 s", "one value is no sweep"),
        ("0,50ms,0.1", "which unit 0.1 has"),
    ],
)
def test_wrong_lists_are_refused(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        listed_values(BY_WORDS["delay"], text)
    assert "hint: " in str(caught.value)


@pytest.mark.parametrize("text", ["roll-lag", "roll lag", "--roll-lag", "roll_lag"])
def test_a_quantity_is_found_by_its_words_and_its_option(text: str) -> None:
    assert quantity_of(text) is BY_WORDS["roll lag"]
    assert quantity_of("timeout") is BY_WORDS["time limit"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("nois", "did you mean noise"),
        ("radius-eror", "did you mean radius-error"),
        ("xyzzy", "choose from noise, radius-error, roll-lag, delay"),
        ("ranking", "it is no quantity"),
        ("force-sensing", "it is no quantity"),
        ("seed", "seeds are the same for all values"),
    ],
)
def test_what_cannot_be_swept_is_refused(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        quantity_of(text)


def asked(over: str, values: str, **more: Any) -> Experiment:  # noqa: ANN401
    facts: dict[str, Any] = {"known": "all", "needle": "phantom", "runs": 3, "settings": {}, **more}
    return sweep_of_task(TASK, BY_WORDS[over], values, **facts)


def test_a_sweep_of_a_task_has_a_row_for_each_value_with_the_same_seeds() -> None:
    settings = {"noise": "0.3mm", "deviation": "2mm", "ranking": "clearance, rolls"}
    experiment = asked("radius error", "-20,0,20%", settings=settings)
    assert experiment.name == "small_mid_cr over radius error"
    assert [one.id for one in experiment.rows] == [
        f"small_mid_cr-radius_error_{x}pct" for x in (-20, 0, 20)
    ]
    assert {one.seeds for one in experiment.rows} == {(1, 2, 3)}
    assert [one.values["needle.radius_ratio"] for one in experiment.rows] == [
        *(pytest.approx(x) for x in (-0.2, 0.0, 0.2))
    ]
    assert experiment.rows[0].values["deviation_mm"] == 2.0
    assert experiment.rows[0].values["ranking"] == ("clearance", "rolls")
    assert len(sweeps_of(experiment.rows)) == 1


def test_a_sweep_of_a_task_has_no_lab_whose_speed_it_cannot_say() -> None:
    with pytest.raises(InputError, match=r"how fast its lab runs\nhint: write a row"):
        asked("noise", "0,1mm", needle="lab")


def test_the_same_sweep_from_a_file_has_the_same_runs(tmp_path: Path) -> None:
    text = (
        '[[row]]\nscenario = "small_mid_cr.nsl"\nneedle = "phantom"\n'
        'delay = ["0 s", "0.2 s"]\nseeds = 3\n'
    )
    rows = read_experiment(written(tmp_path, text)).rows
    made = asked("delay", "0,200ms").rows
    assert [(one.id, one.seeds, one.digest) for one in rows] == [
        (one.id, one.seeds, one.digest) for one in made
    ]


@pytest.mark.parametrize(
    ("over", "values", "more", "message"),
    [
        ("noise", "0,-1mm", {}, r"`noise`: '-1mm' is not a length that is allowed"),
        ("noise", "0,1kg", {}, r"'1kg' is not a length"),
        ("noise", "1,1.0,2mm", {}, "1 mm stands there twice"),
        ("radius error", "-100,0%", {}, "must be greater than -100 %"),
        ("roll lag", "0,9deg", {"needle": "virtual"}, "means nothing to the virtual needle"),
        ("delay", "0,1s", {"needle": "virtual"}, "means nothing to the virtual needle"),
        ("roll error", "0,1deg", {}, "means nothing to a phantom needle"),
        ("noise", "0,1mm", {"needle": "fantom"}, "did you mean 'phantom'"),
        ("noise", "0,1mm", {"known": "C9"}, "C9"),
        ("noise", "0,1mm", {"settings": {"noise": "1mm"}}, "`noise` is swept, and --set fixes it"),
        ("noise", "0,1mm", {"settings": {"seed": "3"}}, "--runs says how many"),
        ("push", "2,20mm", {}, "must be greater than `push`"),
        ("force noise", "0.1,0.2N", {}, "cannot be 0.1 N here: 0.02 N follows from the needle"),
        ("radius error", "0,1%", {"settings": {"true radius": "9mm"}}, "both say"),
    ],
)
def test_sweeps_that_cannot_be_driven_are_refused(
    over: str, values: str, more: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message) as caught:
        asked(over, values, **more)
    # There is no file to point at.
    assert not str(caught.value).startswith(".")
