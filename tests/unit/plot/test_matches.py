"""Pictures of matches: what must be seen is in them."""

from __future__ import annotations

import ntagen
from ntagen.plot.matches import MatchRow, draw_matches
from ntagen.traces.matching import Options
from ntagen.traces.prediction import predict
from tests.traces import BENCH, points_of, trace


def test_trace_path_predictions_and_rolls_are_in_the_picture() -> None:
    points = points_of("one_roll", 1)
    match = ntagen.match(BENCH, points)
    predictions = predict(BENCH, trace(points), Options(rolls=0), from_mm=(20.0, 30.0))
    figure = draw_matches([MatchRow("a", match, predictions), MatchRow("b", match)], "title")
    names = {text.get_text() for text in figure.legends[0].get_texts()}
    assert names == {"measured", "plan's path", "roll"} | {
        f"predicted from {n} mm" for n in (20, 30)
    }
    assert len(figure.axes) == 6
    lines = figure.axes[0].get_lines()
    assert len(lines[0].get_xdata()) == len(match.distances_mm)
    deviations = figure.axes[2]
    assert list(deviations.get_lines()[0].get_ydata()) == list(match.distances_mm)
    assert len(deviations.get_lines()) == 2 + len(match.rolls)
    assert "roll" in deviations.texts[0].get_text()


def test_the_path_begins_at_the_origin_along_the_first_heading() -> None:
    figure = draw_matches([MatchRow("a", ntagen.match(BENCH, points_of("arc")))], "title")
    toward, aside = (figure.axes[i].get_lines()[1] for i in (0, 1))
    assert (toward.get_xdata()[0], toward.get_ydata()[0]) == (0.0, 0.0)
    assert toward.get_ydata()[-1] > 20.0
    assert max(abs(y) for y in aside.get_ydata()) < 1e-6
