"""Traces for people: steps with their times, and only what changes."""

from __future__ import annotations

from ntagen import checker

LAMP = """
clock x, y;
int n = 4; int zero;
process Lamp() {
  state Off, On { x < 2 };
  init Off;
  trans Off -> On { select k : int[1,2]; guard y >= 3; assign x = 0; },
        On -> On { guard x > 1 && n < 6; assign n = n + 1, y = 0; },
        On -> Off { guard x > 1; assign y = 0; };
}
system Lamp;
"""


def lines_of(query: str, most: int | None = None, model: str = LAMP) -> list[str]:
    return checker.load(model).check(query, wanted_trace="shortest").trace_lines(most)


def test_steps_have_times_edges_and_what_they_change() -> None:
    assert lines_of("E<> n == 6 && Lamp.On") == [
        "     start  Lamp.Off",
        "              n = 4",
        "        1.  at 3: Lamp.Off -> On [k=1]",
        "              x = 0",
        "        2.  at 9/2: Lamp.On",
        "              n: 4 -> 5  y = 0",
        "        3.  at 9/2: Lamp.On",
        "              n: 5 -> 6",
    ]


def test_the_last_steps_alone_can_be_told() -> None:
    lines = lines_of("E<> n == 6 && Lamp.On", most=1)
    assert lines[2:4] == ["            … 2 steps before", "        3.  at 9/2: Lamp.On"]


def test_the_end_of_a_run_is_told() -> None:
    assert lines_of("E[] (Lamp.Off and y <= 3) or Lamp.On")[-1].startswith(
        "            as after step "
    )
    assert lines_of("E[] true", model="process P() { state A; init A; } system P;") == [
        "     start  P.A",
        "            time passes for ever",
    ]
    assert lines_of("bounds{Lamp.On}: x")[0] == "least x:"
    assert checker.load(LAMP).check("A[] n < 9").trace_lines() == []


def test_the_way_to_an_error_ends_with_the_step_that_fails() -> None:
    model = """
    int[0,3] r = 3;
    process P() { state A, B, C; init A; trans A -> B { }, B -> C { assign r = r + 1; }; }
    system P;
    """
    assert lines_of("E<> P.C", model=model) == [
        "     start  P.A",
        "              r = 3",
        "        1.  at 0: P.A -> B",
        "            fails in the next step:",
        "              P.B -> C",
        "              r = 3",
    ]
