"""The pictures of runs: what stands in them, at which place, and what is refused."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

from ntagen import checker
from ntagen.checker.picture.gantt import Stay, ticks
from ntagen.checker.runs import MOST_STEPS, Run, moments_of, stays_of
from ntagen.cli import main
from ntagen.errors import InputError

MODEL = """
int n; chan appr, go;
process Train() { clock x;
  state Safe, Appr { x <= 20 }, Cross; init Safe;
  trans Safe -> Appr { guard x >= 2; sync appr!; assign x = 0, n = n + 1; },
    Appr -> Cross { guard x == 7; sync go?; }; }
process Gate() { state Free, Busy, Open; init Free;
  trans Free -> Busy { sync appr?; }, Busy -> Open { sync go!; }; }
T = Train(); G = Gate();
system T, G;
"""


def run() -> Run:
    """At 2 the train comes near, at 9 it crosses."""
    found = checker.load(MODEL).check("E<> G.Open", trace=True, wanted_trace="fastest").trace
    assert found is not None
    return found


def titles(svg: str) -> list[str]:
    """The tooltips of a picture."""
    root = ET.fromstring(svg)
    return [one.text or "" for one in root.iter("{http://www.w3.org/2000/svg}title")][1:]


def test_a_gantt_chart_has_a_bar_for_each_stay() -> None:
    picture = run().gantt()
    assert titles(picture.text) == [
        *("T.Safe from 0 to 2", "T.Appr from 2 to 9"),
        *("G.Free from 0 to 2", "G.Busy from 2 to 9", "T.Cross at 9", "G.Open at 9"),
    ]
    assert "Run of 2 steps in time 9" in picture.text
    assert picture._repr_svg_() == picture.text


def test_bars_are_as_long_as_stays() -> None:
    widths = [float(one) for one in re.findall(r'width="([\d.]+)" height="18"', run().gantt().text)]
    assert widths[1] / widths[0] == pytest.approx(7 / 2, rel=1e-3)


def test_stays_of_a_process_follow_each_other() -> None:
    one = run()
    stays = stays_of(one, [*moments_of(one), Fraction(12)])
    assert stays[:3] == [
        Stay("T", "Safe", Fraction(0), Fraction(2)),
        Stay("T", "Appr", Fraction(2), Fraction(9)),
        Stay("T", "Cross", Fraction(9), Fraction(12)),
    ]


def test_a_run_without_time_is_drawn_by_its_states() -> None:
    text = """process P() { state A, B; init A; trans A -> B { }; }
    Q = P(); system Q;"""
    found = checker.load(text).check("E<> Q.B", trace=True).trace
    assert found is not None
    assert titles(found.gantt().text) == ["Q.A from 0 to 1", "Q.B from 1 to 2"]
    assert "which takes no time" in found.gantt().text


def test_a_loop_is_marked() -> None:
    assert "loop</text>" in replace(run(), end="loop", loop=1).gantt().text
    assert "as after step 1, for ever" in replace(run(), end="loop", loop=1).sequence().text


def test_a_sequence_chart_has_arrows_from_senders_to_receivers() -> None:
    svg = run().sequence().text
    assert titles(svg) == [
        *("T", "T.Safe", "G", "G.Free"),
        *("appr!", "T.Appr", "G.Busy", "n = 1"),
        *("go!", "G.Open", "T.Cross"),
    ]
    middles = {
        name: float(re.search(rf'<text x="([\d.]+)"[^>]*><title>{name}</title>', svg)[1])  # type: ignore[index]
        for name in "TG"
    }
    heads = [float(one) for one in re.findall(r'<polygon points="([\d.]+),', svg)]
    assert heads == [middles["G"], middles["T"]]
    assert ">at 2<" in svg
    assert ">at 9<" in svg


def test_a_long_run_has_no_sequence_chart() -> None:
    one = run()
    count = MOST_STEPS + 1
    long = replace(
        one, states=(one.states[0],) * (count + 1), steps=(one.steps[0],) * count, end="after"
    )
    with pytest.raises(InputError, match="shows at most 500"):
        long.sequence()
    assert long.gantt().text


@pytest.mark.parametrize(
    ("last", "expected"),
    [(0.0, [0.0]), (9.0, [float(i) for i in range(10)]), (50.0, [5.0 * i for i in range(11)])],
)
def test_ticks_are_round(last: float, expected: list[float]) -> None:
    assert ticks(last) == expected


def test_plot_draws_the_trace_of_a_query(tmp_path: Path) -> None:
    model, path = tmp_path / "train.xta", tmp_path / "trace.svg"
    model.write_text(MODEL)
    arguments = ["plot", str(model), "--query", "E<> G.Open", "-o", str(path)]
    assert main(arguments) == 0
    assert "T.Appr from 2 to" in path.read_text()
    assert main([*arguments, "--as", "sequence"]) == 0
    assert "<title>appr!</title>" in path.read_text()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--query", "A[] n <= 1"], "A[] n <= 1 is satisfied, and has no trace"),
        (["--query", "A[] n <= 1", "-o", "a.gif"], "endings: .svg, .png, .pdf"),
        ([], "the model has no queries"),
    ],
)
def test_plot_refuses_what_cannot_be_drawn(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, arguments: list[str], says: str
) -> None:
    model = tmp_path / "train.xta"
    model.write_text(MODEL)
    assert main(["plot", str(model), *arguments]) == 2
    assert says in capsys.readouterr().err
