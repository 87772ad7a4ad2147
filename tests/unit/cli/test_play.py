"""`ntagen play`: both sides of a game, by typed lines and by chance."""

from __future__ import annotations

import io
import json
import re
import sys
from pathlib import Path

import pytest

from ntagen.cli import main

MACHINE = """
clock x;
process Press() {
  state Idle, Hot { x <= 4 }, Burnt, Done;
  init Idle;
  trans Idle -> Hot { guard x >= 1; assign x = 0; },
        Hot -> Done { guard x >= 2; },
        Hot -u-> Burnt { guard x > 3; },
        Idle -u-> Idle { guard x < 1; assign x = 0; };
}
system Press;
"""

SAFE = "control: A[] not Press.Burnt"

RACE = """
process P() {
  clock x;
  state L, G, Bad;
  init L;
  trans L -> G { guard x >= 1; }, L -u-> Bad { guard x >= 1; };
}
system P;
"""


class Player:
    """Plays a model: types lines, and gives what is printed."""

    def __init__(self, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
        self._capsys = capsys
        self._monkeypatch = monkeypatch

    def silence(self) -> None:
        """Types nothing."""
        self._monkeypatch.setattr(sys, "stdin", io.StringIO())

    def __call__(self, *arguments: str | Path, lines: str = "", code: int = 0) -> str:
        self._monkeypatch.setattr(sys, "stdin", io.StringIO(lines))
        assert main(["play", *map(str, arguments)]) == code
        return self._capsys.readouterr().out


@pytest.fixture
def player(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Player:
    return Player(capsys, monkeypatch)


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    path = tmp_path / "machine.xta"
    path.write_text(MACHINE)
    return path


def test_environment_plays_against_the_controller(
    machine: Path, tmp_path: Path, player: Player, capsys: pytest.CaptureFixture[str]
) -> None:
    strategy, log = tmp_path / "safe.json", tmp_path / "play.json"
    assert main(["check", str(machine), "--query", SAFE, "--strategy", str(strategy)]) == 0
    lines = "1 1/2\nw 1/4\n\n+1 2\nq\n"
    out = player(machine, "--strategy", strategy, "--log", log, lines=lines)
    assert "you are the environment" in out
    assert "  · after 1/2 you take Press.Idle -> Idle" in out
    assert "  · 1/4 passes" in out
    assert main(["verify", str(machine), str(log)]) == 0
    assert "trace replayed" in capsys.readouterr().out
    trace = json.loads(log.read_text())
    assert (trace["kind"], trace["winner"]) == ("play", None)


def test_strategy_acts_in_time(machine: Path, player: Player) -> None:
    out = player(machine, "--query", SAFE, lines="+1 1\n\n")
    assert "the controller waits, and after 3 takes Press.Hot -> Done" in out
    assert "1  Press.Hot -> Burnt" not in out
    assert "  · after 3 the controller takes Press.Hot -> Done" in out
    assert "Time passes for ever, and nobody moves: the controller has won after 4" in out


def test_controller_plays_against_a_counter_strategy(tmp_path: Path, player: Player) -> None:
    model, log = tmp_path / "race.xta", tmp_path / "play.json"
    model.write_text(RACE)
    out = player(model, "--query", "control: A<> P.G", "--log", log, lines="1\n\n")
    assert "you are the controller. The controller cannot win: see why." in out
    assert "you have no move; press Enter to go on" in out
    assert "there is no move 1" in out
    assert "  · after 1 the environment takes P.L -> Bad" in out
    assert "the environment has won after 1; the strategy has won." in out
    assert main(["verify", str(model), str(log)]) == 0


def test_enter_makes_the_only_move_that_must_be_made(tmp_path: Path, player: Player) -> None:
    model = tmp_path / "forced.xta"
    model.write_text(
        "process P() { clock x; state I { x <= 5 }, G; init I; trans I -u-> G { guard x > 2; }; }"
        "system P;"
    )
    out = player(model, "--query", "control: A<> P.G", lines="w 3\n\n")
    assert "the controller waits; you must move before time stops" in out
    assert "  · you take P.I -> G" in out
    assert "The goal holds: the controller has won after 3; the strategy has won." in out


def test_reached_goal_is_in_the_trace(tmp_path: Path, player: Player) -> None:
    model, log = tmp_path / "race.xta", tmp_path / "play.json"
    model.write_text(RACE.replace("guard x >= 1; }, L -u->", "}, L -u->"))
    out = player(model, "--query", "control: A<> P.G", "--log", log)
    assert "  · the controller takes P.L -> G" in out
    assert "The goal holds: the controller has won after 0" in out
    assert json.loads(log.read_text())["winner"] == "controller"
    assert main(["verify", str(model), str(log)]) == 0
    log.write_text(log.read_text().replace('"winner":"controller"', '"winner":"environment"'))
    assert main(["verify", str(model), str(log)]) == 2


def test_undo_goes_back_to_the_last_choice(machine: Path, player: Player) -> None:
    out = player(machine, "--query", SAFE, lines="+1 1\n\nu\nu\n1 1/2\nr\n")
    shown = re.findall(r"^\[(\d+)\] time (\S+)$", out, re.MULTILINE)
    assert shown == [("0", "0"), ("1", "1"), ("1", "1"), ("0", "0"), ("1", "1/2"), ("0", "0")]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("9", "there is no move 9"),
        ("+7", "there is no move +7"),
        ("0", "there is no move 0"),
        ("go", "go is not a command; type ? for help"),
        ("1 2 3", "1 2 3 is not a command; type ? for help"),
        ("1 soon", "soon is not a delay: write a number such as 2, 3/2 or 1.5"),
        ("1 1/0", "1/0 is not a delay"),
        ("1 -1", "a delay cannot be negative"),
        ("1 1", "this move is possible before 1"),
        ("1 1e-40", "too fine a fraction"),
        ("1 1/3000000000", "cannot be waited"),
        ("?", "make move 2, as soon as it is possible"),
        ("s", "Press.Idle"),
        ("m", "Press.Idle -> Idle   before 1"),
    ],
)
def test_what_is_typed_is_answered(machine: Path, player: Player, line: str, message: str) -> None:
    answer = player(machine, "--query", SAFE, lines=f"{line}\n").partition(f"> {line}\n")[2]
    assert message in answer


def test_chance_plays_the_same_with_the_same_seed(machine: Path, player: Player) -> None:
    arguments = (machine, "--query", SAFE, "--auto", "40")
    first = player(*arguments, "--seed", "3")
    assert first == player(*arguments, "--seed", "3")
    assert len({player(*arguments, "--seed", str(seed)) for seed in range(5)}) > 1


def test_options_without_an_effect_are_named(
    machine: Path, tmp_path: Path, player: Player, capsys: pytest.CaptureFixture[str]
) -> None:
    strategy = str(tmp_path / "safe.json")
    assert main(["check", str(machine), "--query", SAFE, "--strategy", strategy]) == 0
    capsys.readouterr()
    assert main(["play", str(machine), "--strategy", strategy, "--auto", "2", "--seed", "3"]) == 0
    assert capsys.readouterr().err == ""
    player.silence()
    assert main(["play", str(machine), "--strategy", strategy, "--seed", "3"]) == 0
    err = capsys.readouterr().err
    assert "note: --seed has no effect without --auto\n" in err


def test_wrong_strategy_is_defeated(machine: Path, tmp_path: Path, player: Player) -> None:
    strategy = tmp_path / "safe.json"
    assert main(["check", str(machine), "--query", SAFE, "--strategy", str(strategy)]) == 0
    changed = json.loads(strategy.read_text())
    for state in changed["states"]:
        if state["locations"]["Press"] == "Hot":
            state["decisions"] = [{"zones": [[]], "action": None, "rank": 0}]
    strategy.write_text(json.dumps(changed))
    out = player(machine, "--strategy", strategy, lines="+1 1\n1\n", code=1)
    assert "the environment has won after 9/2; you have won against the strategy." in out
    changed["states"] = changed["states"][:1]
    strategy.write_text(json.dumps(changed))
    out = player(machine, "--strategy", strategy, lines="+1 1\n\n", code=1)
    assert "The strategy has no next move: it has no decision here." in out


def test_a_search_with_limits_is_a_check(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "counter.xta"
    model.write_text(
        "int n; process P() { state L; init L;"
        "trans L -> L { guard n < 30000; assign n++; }, L -> L { guard n > 0; assign n--; }; }"
        "system P;"
    )
    words = [str(model), "--query", "control: A<> n == 30000", "--states", "100"]
    assert main(["check", *words, "--strategy", str(tmp_path / "s.json")]) == 3
    assert main(["play", *words]) == 2
    assert "no such option: --states; `ntagen check --strategy" in capsys.readouterr().err


def test_game_is_found_by_name_or_alone(tmp_path: Path, player: Player) -> None:
    model = tmp_path / "race.xml"
    query = "<query><formula>{}</formula><comment>{}</comment></query>"
    text = (
        "<nta><template><name>P</name><location id='a'><name>A</name></location>"
        "<init ref='a'/></template><system>system P;</system><queries>{}</queries></nta>"
    )
    model.write_text(text.format(query.format("control: A&lt;&gt; P.A", "Reach")))
    assert "control: A<> P.A" in player(model)
    assert "control: A<> P.A" in player(model, "--query", "Reach")
    model.write_text(text.format(""))
    player(model, code=2)
    player(model, "--query", "E<> P.A", code=2)
    player(model, "--query", "control: A<> P.A", "--strategy", "x.json", code=2)
    player(model, "--strategy", tmp_path / "none.json", code=2)


DIE = """
process P() {
  state Hand, High, Low, Done;
  branchpoint Falls;
  init Hand;
  trans Hand -> Falls { }, Falls -> High { }, Falls -> Low { },
        Low -> Done { }, High -> Done { };
}
system P;
"""


def test_the_environment_picks_the_leg(player: Player, tmp_path: Path) -> None:
    model = tmp_path / "die.xta"
    model.write_text(DIE)
    shown = player(model, "--query", "control: A<> P.Done", lines="2\n")
    assert "takes P.Hand -> High" in shown
    assert "  1  P.Hand -> High" in shown
    assert "  2  P.Hand -> Low" in shown
    assert "P.Low" in shown.split("> 2")[1]
    assert "the controller has won" in shown
    first = player(model, "--query", "control: A<> P.Done", lines="\n")
    assert "P.High" in first
    assert "P.Low" not in first


def test_the_strategy_of_the_environment_picks_the_leg(player: Player, tmp_path: Path) -> None:
    model = tmp_path / "die.xta"
    model.write_text(DIE)
    shown = player(model, "--query", "control: A<> P.High", lines="q\n")
    assert "P.Hand -> Low" in shown
    assert "P.Hand -> High" not in shown
