"""The reachable symbolic states of a model as Python values."""

from __future__ import annotations

from pathlib import Path

import pytest

import ntagen
from ntagen import checker
from ntagen.errors import LimitError, ModelError

CORPUS = Path(__file__).resolve().parents[2] / "corpus"

LAMP = """
clock x, y;
int[0,2] count;
process Lamp() {
  state Off, On { x < 2 };
  init Off;
  trans Off -> On { guard x >= 3 and count < 2; assign x = 0, count = count + 1; },
        On -> Off { guard x >= 1 and y >= 5; assign x = 0, y = 0; };
}
system Lamp;
"""

CHAIN = """
int n;
process P() { state A; init A; trans A -> A { guard n < 2000; assign n = n + 1; }; }
system P;
"""


def test_states_have_their_parts_and_the_way_to_them() -> None:
    first, second, third, *rest = checker.load(LAMP).states()
    assert (first.index, first.predecessor, first.step) == (0, None, None)
    assert (first.locations, first.variables) == ({"Lamp": "Off"}, {"count": 0})
    assert first.zone == ("y-x == 0",)
    assert (second.locations, second.variables) == ({"Lamp": "On"}, {"count": 1})
    assert second.predecessor == 0
    assert second.step is not None
    assert [(edge.source, edge.target) for edge in second.step.edges] == [("Off", "On")]
    assert "x < 2" in second.zone
    assert (third.predecessor, third.zone) == (1, ("y-x == 0",))
    assert [state.variables["count"] for state in rest] == [2, 2]


def test_matrix_says_the_same_as_the_constraints() -> None:
    first, second, *_ = checker.load(LAMP).states()
    assert first.dbm() == (
        ((0, False), (0, False), (0, False)),
        (None, (0, False), (0, False)),
        (None, (0, False), (0, False)),
    )
    assert second.dbm()[1][0] == (2, True)


def test_both_engines_and_every_limit_give_the_same_first_states() -> None:
    model = checker.load(CHAIN)
    everything = list(model.states())
    assert [state.variables["n"] for state in everything] == list(range(2001))
    assert list(model.states(engine="interpreter")) == everything
    for limit in (0, 1, 300, 2001, 5000):
        assert list(model.states(limit)) == everything[:limit]


def test_other_limits_are_errors() -> None:
    model = checker.load(CHAIN)
    with pytest.raises(LimitError, match="memory limit"):
        model.states(memory_bytes=1)
    with pytest.raises(LimitError, match="time limit"):
        model.states(timeout_s=0)
    with pytest.raises(ValueError, match="negative"):
        model.states(-1)


def test_failing_model_is_an_error() -> None:
    with pytest.raises(ModelError):
        checker.load(CHAIN.replace("int n;", "int[0,5] n;")).states()


@pytest.mark.parametrize(
    ("name", "zone"),
    [
        ("with_a_clock_guard", ("x <= 2",)),
        ("without_a_first_moment", ("x <= 1",)),
        ("stops_time_for_the_controller", ("x <= 2",)),
    ],
)
def test_a_walk_stops_where_urgent_synchronisations_stop_time(
    name: str, zone: tuple[str, ...]
) -> None:
    model = ntagen.load(CORPUS / "games" / f"urgent_channel_{name}.xta")
    walk = model.walk()
    assert walk.zone == zone == next(iter(model.states())).zone
    reached = {tuple(state.locations.items()) for state in model.states()}
    for index in range(len(walk.moves())):
        after = model.walk()
        after.take(index)
        assert tuple(after.locations.items()) in reached
