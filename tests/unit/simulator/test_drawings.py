"""What the simulator draws: zones, charts, values over time, random runs; and its lines of JSON."""

from __future__ import annotations

import io
import json

import pytest

from ntagen.cli import main
from ntagen.errors import InputError
from ntagen.simulator.session import Session
from ntagen.simulator.worker import work
from tests.simulated import CROSSING, LAMP, Talk


def test_a_zone_has_exact_corners() -> None:
    talk = Talk(CROSSING)
    talk.walk(0)
    zone = talk("zone", x="Cart(0).x", y="Cart(1).x")
    # Cart(0) is near, so its clock is at most 9; that of the other one runs for longer.
    assert sorted(zone["corners"]) == [[0, 0], [0, zone["y_end"]], [9, 9], [9, zone["y_end"]]]
    assert not any(zone["open"])
    talk.walk(0, 1, 1)
    zone = talk("zone", x="Cart(1).x", y="Cart(0).x")
    assert (zone["x"], zone["y"]) == ("Cart(1).x", "Cart(0).x")
    opened = Talk(STRICT)
    opened.walk(0)
    assert any(opened("zone", x="x", y="y")["open"])


def test_charts_show_the_steps() -> None:
    talk = Talk(CROSSING)
    for _ in range(6):
        talk("random", seed=1)
    for kind, says in (("gantt", "Cart(0).Near from"), ("sequence", "come[id]!")):
        svg = talk("chart", kind=kind)["svg"]
        assert svg.startswith("<svg ")
        assert says in svg


def test_values_over_time() -> None:
    talk = Talk(LAMP)
    talk("mode", mode="exact")
    talk("take", move=0, delay="2")
    talk("take", move=0, delay="1")
    found = talk("series", names=["pushes", "Hand.rest"])
    assert found["timed"]
    assert found["series"]["pushes"] == [[0, 0], [2, 0], [2, 1], [3, 1], [3, 2]]
    assert found["series"]["Hand.rest"] == [[0, 0], [2, 2], [2, 0], [3, 1], [3, 0]]
    talk("mode", mode="symbolic")
    found = talk("series", names=["pushes"])
    assert (found["timed"], found["series"]["pushes"][-1]) == (False, [2, 2])
    for names in (["nowhere"], ["pushes"] * 13):
        with pytest.raises(InputError):
            talk("series", names=names)


STRICT = """
clock x, y;
process P() { state A, B; init A; trans A -> B { guard x > 2; assign y = 0; }; }
system P;
"""

SMOKE = """
int n = 0; clock t;
process P() { clock x; state A { x <= 5 }; init A;
  trans A -> A { guard x >= 1; assign n = n + 1, x = 0; }; }
system P;
"""


def test_random_runs_come_in_blocks() -> None:
    talk = Talk(SMOKE)
    first = talk("runs", query="simulate [<=20; 50] { n, P.x }", seed=1, count=3)
    second = talk("runs", query="simulate [<=20; 50] { n, P.x }", seed=2, count=2)
    assert first["expressions"] == ["n", "P.x"]
    assert (len(first["runs"]), len(second["runs"])) == (3, 2)
    ends = [run[0][-1][0] for run in first["runs"]]
    assert ends == [20.0] * 3
    assert first["runs"][0] != second["runs"][0]
    # Long runs are thinned out, and keep their ends.
    (run,) = talk("runs", query="simulate [<=20000; 1] { n }", seed=1, count=1)["runs"]
    assert len(run[0]) < 900
    assert (run[0][0], run[0][-1][0]) == ((0.0, 0.0), 20000.0)
    for query, count in (("E<> P.A", 1), ("simulate [<=20] { m }", 1), ("simulate [<=9] {n}", 0)):
        with pytest.raises(InputError):
            talk("runs", query=query, seed=1, count=count)


def test_a_failing_run_is_said() -> None:
    talk = Talk(SMOKE.replace("int n", "int[0, 2] n"))
    with pytest.raises(InputError, match="value out of range"):
        talk("runs", query="simulate [<=90; 1] { n }", seed=1, count=1)


def test_lines_of_json_are_answered() -> None:
    said: list[str] = []
    talk = Talk(LAMP)
    begun: list[Session] = []

    def begin() -> Session:
        begun.append(Session(talk.model, timeout_s=5.0, memory_bytes=None))
        return begun[-1]

    lines = ['{"do": "take", "move": 0}\n', "what\n", "[]\n", '{"do": "take", "move": 9}\n']
    work(begin, lines, said.append)
    answers = [json.loads(one) for one in said]
    assert answers[0]["ok"]["position"] == 1
    assert [one["error"] for one in answers[1:]] == [
        "the request is no object of JSON",
        "the request is no object of JSON",
        "there is no move 10 here; there are 2",
    ]
    assert len(begun) == 1


def test_a_broken_model_is_an_answer(
    tmp_path: object, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = f"{tmp_path}/broken.xta"
    with open(path, "w", encoding="utf-8") as file:
        file.write("process P( {")
    monkeypatch.setattr("sys.stdin", io.StringIO('{"do": "open"}\n{"do": "open"}\n'))
    assert main(["simulate", path]) == 0
    answers = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert len(answers) == 2
    assert "broken.xta:1:12: error" in answers[0]["error"]


def test_the_worker_is_in_no_list_of_commands(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    assert "  simulate " not in capsys.readouterr().out
