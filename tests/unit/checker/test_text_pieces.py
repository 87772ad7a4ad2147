"""Strategies and runs that are shown, in pieces: together they are the whole text."""

from __future__ import annotations

import json
import math

import ntagen

# The strategy has 1,000 states of 500 words, more than a mebibyte.
GAME = """
int zeros[500]; int[0,1000] n; clock x;
process E() {
    state S { x <= 3 }, Lost; init S;
    trans S -u-> S { guard n < 1000 && x >= 1; assign n++, x = 0; }, S -u-> Lost { guard x > 2; };
}
process C() { state S; init S; trans S -> S { guard x >= 1 && x <= 2; assign x = 0; }; }
system E, C;
"""

RUNS = """
hybrid clock h; int n;
process P() {
    clock x;
    state S { x <= 1 && h' == 2 }, Far; init S;
    trans S -> S { guard n < 5; assign x = 0, n = n + 1; }, S -> Far { guard n == 5; };
}
system P;
"""


def test_the_pieces_of_a_strategy_are_its_text() -> None:
    answer = ntagen.load(GAME).check("control: A[] not E.Lost", strategy=True)
    for form, text in (("json", answer.strategy_json()), ("text", answer.strategy_text())):
        assert text is not None
        pieces = list(answer.strategy_pieces(form))  # type: ignore[arg-type]
        assert "".join(pieces) == text
        assert all(pieces)
        assert max(map(len, pieces)) <= 1 << 20
        assert form != "json" or len(pieces) > 1
    assert json.loads("".join(answer.strategy_pieces("json")))["owner"] == "controller"


def test_without_a_strategy_there_are_no_pieces() -> None:
    answer = ntagen.load(GAME).check("E<> n == 3")
    assert list(answer.strategy_pieces("json")) == []
    assert list(answer.strategy_pieces("text")) == []


def test_runs_as_json_have_the_points_of_the_runs() -> None:
    answer = ntagen.load(RUNS).check("simulate[<=6; 3]{h, n, n, 1 / (n - 5.0)}", seed=4)
    shown = [json.loads(text) for text in answer.trajectories_json()]
    assert [one["run"] for one in shown] == [0, 1, 2]
    infinite = 0
    for run, text in zip(answer.trajectories, shown, strict=True):
        assert list(text["points"]) == list(run.points)
        for name, points in run.points.items():
            for (time, value), (time_read, value_read) in zip(
                points, text["points"][name], strict=True
            ):
                assert time_read == time
                assert value_read == (value if math.isfinite(value) else None)
                infinite += not math.isfinite(value)
    assert infinite > 0
    assert list(ntagen.load(RUNS).check("E<> n == 3").trajectories_json()) == []
