"""Strategies as values: what to do in a state, as files, and what is said of wrong states."""

from __future__ import annotations

import json
import os
import re
from fractions import Fraction
from pathlib import Path

import pytest

import ntagen
from ntagen.checker import RejectedError
from ntagen.checker.runs import Choice, Run, State
from ntagen.cli import main

FEEDER = """
clock x;
int[0,1] fed;
process M() {
  state Hungry, Full { x <= 3 }, Dead;
  init Hungry;
  trans Hungry -> Full { select k : int[1,2]; guard x >= 2 && x <= 4; assign x = 0, fed = 1; },
        Hungry -u-> Dead { guard x > 4; };
}
system M;
"""

RACE = """
process P() { clock x; state L, G, Bad; init L; trans L -> G { }, L -u-> Bad { }; }
system P;
"""

LATE = """
clock x;
process P() { state L, G; init L; trans L -> G { guard x > 1 && x < 2; }; }
system P;
"""

ROUNDS = """
clock x, y;
process P() {
  state L { x <= 1 }, Idle;
  init L;
  trans L -> L { guard x >= 1; assign x = 0; }, L -> Idle { };
}
system P;
"""

COUNTER = """
int n;
process P() {
  state L; init L;
  trans L -> L { guard n < 30000; assign n++; }, L -> L { guard n > 0; assign n--; };
}
system P;
"""

DOOR = """
clock x;
process Door() {
  state Shut { x <= 5 }, Open { x <= 2 }, Broken;
  init Shut;
  trans Shut -> Open { guard x >= 3; assign x = 0; },
        Open -> Shut { assign x = 0; },
        Open -u-> Broken { guard x > 1; };
}
system Door;
"""


def test_strategy_says_what_to_do_and_until_when() -> None:
    model = ntagen.load(FEEDER)
    strategy = model.synthesize("control: A<> M.Full", verify=True)
    assert (strategy.owner, strategy.winning, strategy.is_permissive) == ("controller", True, False)
    waiting = strategy.action(model.simulate(steps=0).states[0])
    assert (waiting.kind, waiting.delay, waiting.edges) == ("wait", 2, ())
    assert str(waiting) == "wait 2, then M.Hungry -> M.Full"
    later = strategy.action({"M": "Hungry", "fed": 0, "x": "1/3"})
    assert later.delay == Fraction(5, 3)
    acting = strategy.action({"M": "Hungry", "fed": False, "x": Fraction(5, 2)})
    assert acting.kind == "act"
    assert acting.edges[0].select["k"] in (1, 2)
    assert acting.edges == waiting.then
    nested = {"locations": {"M": "Full"}, "variables": {"fed": 1}, "clocks": {"x": 0}}
    assert strategy.action(nested).kind == "done"
    assert str(strategy.action(nested)) == "done"


def test_moment_is_chosen_where_acting_has_no_first_one() -> None:
    strategy = ntagen.load(LATE).synthesize("control: A<> P.G")
    advice = strategy.action({"P": "L", "x": Fraction(1, 2)})
    assert (advice.kind, advice.delay) == ("wait", Fraction(3, 4))
    assert strategy.action({"P": "L", "x": Fraction(5, 4)}).edges == advice.then


def test_permissive_strategy_gives_all_that_is_allowed() -> None:
    strategy = ntagen.load(DOOR).synthesize("control: A[] not Door.Broken")
    assert strategy.is_permissive
    state = {"Door": "Shut", "x": 4}
    allowed = strategy.allowed(state)
    assert sorted(one.kind for one in allowed) == ["act", "wait"]
    assert strategy.action(state).kind == "wait"
    assert strategy.action(state).delay == 1
    assert [one.kind for one in strategy.allowed({"Door": "Shut", "x": 5})] == ["act"]
    # After 1 the environment may break the open door, so it is shut before.
    opened = strategy.action({"Door": "Open", "x": 0})
    assert (opened.kind, opened.delay) == ("wait", 1)
    assert str(opened) == "wait 1, then Door.Open -> Door.Shut"


def test_lost_game_gives_the_strategy_of_the_environment() -> None:
    model = ntagen.load(RACE)
    strategy = model.synthesize("control: A<> P.G")
    assert (strategy.owner, strategy.winning) == ("environment", False)
    assert str(strategy.action({"P": "L", "P.x": 7})) == "P.L -> P.Bad"
    assert strategy.verify().holds
    assert repr(strategy) == "<Strategy of the environment, 3 states: control: A<> P.G>"


def test_states_are_listed_with_zones_and_decisions() -> None:
    model = ntagen.load(FEEDER)
    strategy = model.synthesize("strategy Feed = control: A<> M.Full")
    assert strategy.query == "control: A<> M.Full"
    states = list(strategy)
    assert len(states) == len(strategy)
    first = states[0]
    assert first.locations == {"M": "Hungry"}
    assert first.variables == {"fed": 0}
    assert [decision.zones for decision in first.decisions] == [
        (("x >= 2", "x <= 4"),),
        (("x < 2",),),
    ]
    assert str(first.decisions[1]) == "x < 2: wait"
    assert strategy.at(model.walk()) == first
    assert strategy.at(next(model.states())) == first
    assert any(state.is_goal for state in states)


def test_goal_that_depends_on_clocks_does_not_end_play_elsewhere() -> None:
    strategy = ntagen.load(ROUNDS).synthesize("control: A<> y >= 3")
    (state,) = (one for one in strategy if one.locations == {"P": "L"})
    assert not state.is_goal
    assert strategy.action({"P": "L", "x": 0, "y": 0}).delay == 1


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("hello", ": error[E0805]: this is no JSON: expected value at line 1 column 1"),
        ('{"format": "ntagen-trace"}', ": error[E0805]: this is no strategy of ntagen"),
        ('{"format": "ntagen-strategy", "version": 9}', ": error[E0805]: at version: version 9"),
    ],
)
def test_what_is_no_strategy_is_refused_with_its_file(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "file.json"
    path.write_text(text)
    with pytest.raises(RejectedError) as refused:
        ntagen.load_strategy(path, ntagen.load(RACE))
    told = str(refused.value)
    assert told.startswith(f"{path}{said}")
    assert "\n  hint: " in told
    assert "prelude" not in told


def test_saved_strategy_is_read_again(tmp_path: Path) -> None:
    model = ntagen.load(FEEDER)
    strategy = model.synthesize("control: A<> M.Full")
    path = tmp_path / "feed.json"
    strategy.save(path)
    again = ntagen.load_strategy(path, model)
    assert again.json() == strategy.json() == path.read_text().rstrip("\n")
    assert again.verify().holds
    again.keep("Feed")
    assert model.check("A<> M.Full under Feed").verdict == "satisfied"
    assert model.check("A<> M.Full").verdict == "not satisfied"
    path.write_text(strategy.json().replace('"x >= 2"', '"x >= 3"'))
    changed = ntagen.load_strategy(path, model)
    assert not changed.verify().holds
    with pytest.raises(ntagen.RejectedError, match="the model's process P is missing"):
        ntagen.load_strategy(path, ntagen.load(RACE))
    with pytest.raises(OSError, match="nowhere"):
        ntagen.load_strategy(tmp_path / "nowhere.json", model)


@pytest.mark.parametrize(
    ("state", "message"),
    [
        ({"fed": 0, "x": 0}, "the model's process M is missing"),
        ({"M": "Hungry", "fed": 0}, "the value of clock x is missing"),
        ({"M": "Hungry", "x": 0}, "the model's variable fed is missing"),
        ({"M": "Hungry", "fed": 2, "x": 0}, "variable fed cannot be 2"),
        ({"M": "Angry", "fed": 0, "x": 0}, 'process M has no location "Angry"'),
        ({"M": "Hungry", "fed": 0, "x": 0, "n": 1}, "the model has no variable n"),
        ({"M": "Hungry", "fed": 0, "x": 0.5}, "the value 0.5 of clock x is not an exact number"),
        (
            {"M": "Hungry", "fed": 0, "x": "soon"},
            "the value 'soon' of clock x is not an exact number",
        ),
        ({"M": "Hungry", "fed": 0, "x": -1}, "the value of clock x is negative"),
        ({"M": "Hungry", "fed": 0, "x": Fraction(1, 2**50)}, "no whole numbers of any part"),
        ({"M": "Hungry", "fed": 0, "x": Fraction(1, 2**90)}, "no whole numbers of any part"),
        ({"M": "Hungry", "fed": "no", "x": 0}, "the value 'no' of fed is not a number"),
        ({"M": "Hungry", "fed": 0, "time": "1/2"}, "by their names; the clocks are x"),
    ],
)
def test_what_is_no_state_is_refused(state: dict[str, object], message: str) -> None:
    strategy = ntagen.load(FEEDER).synthesize("control: A<> M.Full")
    with pytest.raises(ntagen.InputError, match=re.escape(message)) as caught:
        strategy.action(state)
    assert not isinstance(caught.value, ntagen.UndecidedError)
    assert "\nhint: " in str(caught.value)


def test_states_outside_the_strategy_are_named() -> None:
    model = ntagen.load(FEEDER)
    strategy = model.synthesize("control: A<> M.Full")
    with pytest.raises(ntagen.UndecidedError, match=r"no state \( M.Hungry \) fed=1"):
        strategy.action({"M": "Hungry", "fed": 1, "x": 0})
    with pytest.raises(ntagen.UndecidedError) as caught:
        strategy.action({"M": "Hungry", "fed": 0, "x": "9/2"})
    assert str(caught.value) == (
        "the controller's strategy has no decision for x=9/2 in ( M.Hungry ) fed=0; it has\n"
        "  x >= 2 && x <= 4: M.Hungry -> M.Full\n"
        "  x < 2: wait"
    )
    with pytest.raises(ntagen.InputError, match="a symbolic state has no clock values"):
        strategy.action(model.walk())  # type: ignore[arg-type]


def test_what_gives_no_strategy_says_so() -> None:
    model = ntagen.load(FEEDER)
    with pytest.raises(ntagen.InputError, match="is not a control query"):
        model.synthesize("A<> M.Full")
    with pytest.raises(ntagen.NtagenError, match="stopped by the state limit"):
        ntagen.load(COUNTER).synthesize("control: A<> n == 30000", states=100)
    with pytest.raises(ntagen.RejectedError):
        model.synthesize("control: A<> M.Nowhere")


def test_simulation_follows_a_strategy() -> None:
    model = ntagen.load(FEEDER)
    strategy = model.synthesize("control: A<> M.Full")

    def choose(state: State, choices: tuple[Choice, ...]) -> tuple[int, Fraction] | None:
        advice = strategy.action(state)
        if advice.kind == "done":
            return None
        edges, delay = (
            (advice.then, advice.delay) if advice.kind == "wait" else (advice.edges, Fraction(0))
        )
        assert delay is not None
        return next(i for i, one in enumerate(choices) if one.edges == edges), delay

    run = model.simulate(choose=choose)
    assert run.states[-1].locations == {"M": "Full"}
    assert run.duration == 2


def test_strategies_within_a_time_look_at_a_clock() -> None:
    model = ntagen.load(FEEDER)
    strategy = model.synthesize("control_t*: A<> M.Full", verify=True)
    assert (strategy.winning, strategy.time_limit) == (True, 2)
    state = {"M": "Hungry", "fed": 0, "x": 1}
    advice = strategy.action(state, time=1)
    assert (advice.kind, advice.delay) == ("wait", 1)
    assert strategy.action({**state, "#time": "3/2", "x": "3/2"}).delay == Fraction(1, 2)
    with pytest.raises(ntagen.InputError, match="does not say how late it is"):
        strategy.action(state)
    with pytest.raises(ntagen.UndecidedError, match="no decision for x=1 #time=2"):
        strategy.action(state, time=2)
    play = strategy.play()
    play.follow()
    assert play.state.clocks["#time"] == 2
    assert play.situation().winner == "controller"
    log = play.trace_json()
    assert log is not None
    assert model.verify(log).holds
    late = json.loads(log) | {"time_limit": 1}
    assert model.verify(json.dumps(late)).holds is False
    lost = model.synthesize("control_t*(1): A<> M.Full", verify=True)
    assert (lost.owner, lost.time_limit) == ("environment", 1)
    assert model.synthesize("control: A<> M.Full").time_limit is None


def test_strategies_within_a_time_are_saved_and_played(tmp_path: Path) -> None:
    model = ntagen.load(FEEDER)
    path = tmp_path / "strategy.json"
    model.synthesize("control_t*(9): A<> M.Full").save(path)
    again = ntagen.load_strategy(path, ntagen.load(FEEDER))
    assert again.time_limit == 2
    assert again.verify().holds
    hasty = json.loads(path.read_text()) | {"time_limit": 1}
    path.write_text(json.dumps(hasty))
    assert ntagen.load_strategy(path, model).verify().holds is False
    other = hasty | {"query": "control_t*(1): A<> M.Full", "time_limit": 2}
    path.write_text(json.dumps(other))
    strategy = ntagen.load_strategy(path, model)
    assert (
        strategy.verify().lines[0].endswith("it is for another start or time limit than the query")
    )
    with pytest.raises(ntagen.InputError, match="for another start or time limit than"):
        strategy.play()


HELP = """
process P() {
  clock x;
  state Shut, Open { x <= 5 }, G, Bad;
  init Shut;
  trans Shut -u-> Open { guard x >= 2; assign x = 0; },
        Open -> G { guard x >= 1; },
        Open -u-> Bad { guard x >= 3; };
}
system P;
"""


def test_strategies_after_help_begin_where_it_leads(tmp_path: Path) -> None:
    model = ntagen.load(HELP)
    query = "E<> control: A<> P.G"
    strategy = model.synthesize(query, verify=True)
    assert strategy.winning
    start = strategy.start
    assert isinstance(start, Run)
    assert [str(step) for step in start.steps] == ["wait 2, then P.Shut -> P.Open"]
    assert strategy.action({"P": "Open", "P.x": 0}).delay == 1
    with pytest.raises(ntagen.UndecidedError):
        strategy.action({"P": "Shut", "P.x": 0})
    path = tmp_path / "strategy.json"
    strategy.save(path)
    again = ntagen.load_strategy(path, ntagen.load(HELP))
    assert again.start == start
    assert again.verify().holds
    assert again.json() == strategy.json()
    play = again.play()
    assert (len(play), play.state.locations) == (0, {"P": "Open"})
    play.undo(0)
    play.follow()
    assert play.situation().winner == "controller"
    log = play.trace_json()
    assert log is not None
    assert model.verify(log).holds
    raw = json.loads(path.read_text())
    raw["start"]["steps"][0]["wait"] = 0
    path.write_text(json.dumps(raw))
    hasty = ntagen.load_strategy(path, model)
    assert hasty.verify().lines[0].endswith("the way to where it begins is not possible")
    with pytest.raises(ntagen.InputError, match="the way to where the strategy begins"):
        hasty.play()
    with pytest.raises(ntagen.InputError, match="the run to the start of the strategy"):
        _ = hasty.start
    raw["start"]["kind"] = "sometime"
    path.write_text(json.dumps(raw))
    with pytest.raises(ntagen.RejectedError, match=r"at start\.kind: play does not begin sometime"):
        ntagen.load_strategy(path, model)


def test_no_help_is_of_use_against_a_strategy_from_everywhere() -> None:
    model = ntagen.load(HELP)
    strategy = model.synthesize("E<> control: A<> P.G && P.x < 1", verify=True)
    assert (strategy.owner, strategy.start) == ("environment", "anywhere")
    assert strategy.at({"P": "Open"}).decisions
    assert strategy.verify().holds
    assert strategy.play().state.locations == {"P": "Shut"}
    assert model.synthesize("control: A<> P.Bad").start == "initial"


def test_saving_leaves_the_old_file_if_it_fails(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    strategy = ntagen.load(FEEDER).synthesize("control: A<> M.Full")
    path = tmp_path / "feed.json"
    path.write_text("old")

    def fail(_descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", fail)
        with pytest.raises(ntagen.InputError, match=r"feed\.json: no space left on device"):
            strategy.save(path)
    assert {file.name: file.read_text() for file in tmp_path.iterdir()} == {"feed.json": "old"}
    strategy.save(path)
    assert path.read_text() == strategy.json() + "\n"


# The tank must not run over, and is to be filled: waiting and filling are both safe at first.
TANK = """
clock x;
int[0,3] level;
process P() {
  state Off, On { x <= 2 }, Over;
  init Off;
  trans Off -> On { assign x = 0; },
        On -> Off { guard x >= 1 && level < 3; assign level++; },
        On -u-> Off { guard x >= 2 && level < 3; assign level++; },
        On -u-> Over { guard level == 3; },
        Off -u-> Off { guard level > 0; assign level--; };
}
system P;
"""


def test_games_under_a_strategy_stay_within_it(tmp_path: Path) -> None:
    model = ntagen.load(TANK)
    safe = model.synthesize("control: A[] not P.Over")
    safe.keep("Safe")
    query = "control: A<> level == 1 under Safe"
    strategy = model.synthesize(query, verify=True)
    assert strategy.winning
    assert strategy.under is not None
    assert (strategy.under.query, strategy.under.json()) == (safe.query, safe.json())
    assert safe.under is None
    strategy.keep("Fill")
    assert model.check("A<> level == 1 under Fill").verdict == "satisfied"
    # Without it the controller may be careless on the way; the strategy says that in its file.
    path = tmp_path / "fill.json"
    strategy.save(path)
    again = ntagen.load_strategy(path, ntagen.load(TANK))
    assert again.json() == strategy.json()
    assert again.under is not None
    assert again.verify().holds
    assert ntagen.load(TANK).verify(path.read_text()).holds
    raw = json.loads(path.read_text())
    for state in raw["under"]["states"]:
        for decision in state["decisions"]:
            decision["action"] = None
    path.write_text(json.dumps(raw))
    forbidden = ntagen.load_strategy(path, model).verify()
    assert forbidden.holds is False
    assert forbidden.lines[0] == "strategy violated: its action is not possible here"
    raw["under"]["owner"] = "environment"
    path.write_text(json.dumps(raw))
    with pytest.raises(ntagen.RejectedError, match="at under"):
        ntagen.load_strategy(path, model)


def test_the_user_keeps_to_the_strategy_that_a_game_is_under() -> None:
    model = ntagen.load(TANK)
    model.synthesize("control: A[] not P.On").keep("Idle")
    lost = model.synthesize("control: A<> level == 1 under Idle", verify=True)
    assert lost.owner == "environment"
    situation = lost.play().situation()
    assert (situation.replies, situation.winner) == ((), "environment")
    model.synthesize("control_t*: A<> level == 1").keep("Soon")
    with pytest.raises(ntagen.RejectedError, match="games under a strategy within a time are not"):
        model.synthesize("control: A<> level == 2 under Soon")
    lost.keep("Lost")
    with pytest.raises(ntagen.RejectedError, match="under a strategy of the environment are not"):
        model.synthesize("control: A<> level == 2 under Lost")
    with pytest.raises(ntagen.RejectedError, match=r"control_t\* under a strategy are not"):
        model.synthesize("control_t*: A<> level == 1 under Idle")


def test_strategies_within_strategies_are_loaded_in_queries(tmp_path: Path) -> None:
    path = tmp_path / "model.xta"
    path.write_text(TANK)
    model = ntagen.load(path)
    for query, verdict in [
        ("strategy Safe = control: A[] not P.Over", "satisfied"),
        ('saveStrategy("safe.json", Safe)', "satisfied"),
        ('strategy Again = loadStrategy("safe.json")', "satisfied"),
        ("strategy Fill = control: A<> level == 1 under Again", "satisfied"),
        ("A<> level == 1 under Fill", "satisfied"),
        ("strategy More = control: A<> level == 1 && P.Off under Fill", "satisfied"),
        ('saveStrategy("more.json", More)', "satisfied"),
        ("A<> P.Off && level == 1 under More", "satisfied"),
    ]:
        assert model.check(query, verify=True, allow_write=[tmp_path]).verdict == verdict, query
    more = ntagen.load_strategy(tmp_path / "more.json", model)
    assert more.under is not None
    assert more.under.under is not None
    assert more.verify().holds


JOBS = """
clock time; bool busy;
process Job() {
  clock x;
  state Idle { ; 1 }, Work { x <= 3 }, Done;
  init Idle;
  trans Idle -> Work { guard !busy; assign busy = true, x = 0; },
        Work -u-> Done { guard x >= 2; assign busy = false; };
}
Kim = Job(); Peter = Job();
system Kim, Peter;
"""


def test_queries_under_a_reach_strategy_follow_all_that_wins(tmp_path: Path) -> None:
    """What is saved, and what is kept by hand, makes one move a state."""
    path = tmp_path / "jobs.xta"
    path.write_text(JOBS)
    model = ntagen.load(path)
    query = "control: A<> Kim.Done && time <= 8"
    first = "E<> Peter.Done && not Kim.Done"
    defined = model.check(f"strategy S = {query}", strategy=True)
    assert defined.strategy is not None
    answer = model.check(f"{first} under S")
    assert answer.satisfied
    assert answer.message == "S allows all moves and waits after which the win stays certain"
    likely = model.check("Pr[<=8](<> Peter.Done && not Kim.Done) under S", runs=200)
    assert likely.message is not None
    assert "stays certain" in likely.message
    assert isinstance(likely.value, float)
    assert 0.2 < likely.value < 0.8
    refined = model.check("strategy T = control: A<> Peter.Done && Kim.Done under S", strategy=True)
    assert refined.strategy is not None
    assert refined.strategy.under is not None
    assert '"selection":"any"' in refined.strategy.under.json().replace(" ", "")
    assert model.check('saveStrategy("s.json", S)', allow_write=[tmp_path]).satisfied
    assert model.check('strategy One = loadStrategy("s.json")').satisfied
    model.synthesize(query).keep("Kept")
    for name in ("One", "Kept"):
        answer = model.check(f"{first} under {name}")
        assert (answer.verdict, answer.message) == ("not satisfied", None)
    nearer = model.check("strategy N = control: A<> Kim.Done")
    assert nearer.satisfied
    told = model.check("A<> Kim.Done under N")
    assert told.satisfied
    assert told.message is not None
    assert told.message.startswith("N allows only moves that come nearer to the goal")


LAZY = """
int[0, 59] level, before;
process Dial() {
  clock x;
  state On { x <= 1 };
  init On;
  trans
  On -> On { select to : int[0, 59]; guard x >= 1; assign before = level, level = to, x = 0; },
  On -u-> On { guard x >= 1; assign level = 0, x = 0; };
}
system Dial;
"""


def test_a_named_strategy_is_made_when_it_is_first_used(tmp_path: Path) -> None:
    path = tmp_path / "dial.xta"
    path.write_text(LAZY)
    model = ntagen.load(path)
    query = "control: A[] level + before <= 50"
    answer = model.check(f"strategy Low = {query}", states=500)
    assert (answer.verdict, answer.strategy) == ("satisfied", None)
    with pytest.raises(
        ntagen.InputError, match="'Low': the search for it was stopped by the state limit"
    ):
        model.check("sup: level under Low", states=500)
    assert model.check("sup: level under Low").value == 50
    with_strategy = model.check(f"strategy Low = {query}", strategy=True)
    assert with_strategy.strategy is not None
    assert with_strategy.explored > 20 * answer.explored
    assert model.check("E<> level == 50 under Low").verdict == "satisfied"


OLD = '{"format":"ntagen-strategy","version":1}'
LEARNED = '{"version": 1.0, "type": "state->regressor", "representation": "map", "actions": {}}'


def saves(model: Path, *options: str, path: str) -> int:
    """The exit code of a check whose queries save a strategy there."""
    queries = model.with_suffix(".q")
    queries.write_text(f'strategy S = control: A[] not P.Over\nsaveStrategy("{path}", S)\n')
    return main(["check", str(model), str(queries), *options])


@pytest.fixture
def tank(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A model in a folder of its own; the current folder is the one that this lies in."""
    (tmp_path / "here" / "models").mkdir(parents=True)
    model = tmp_path / "here" / "models" / "tank.xta"
    model.write_text(TANK)
    monkeypatch.chdir(tmp_path / "here")
    return model


@pytest.mark.parametrize("path", ["s.json", "../s.json", "{}/here/new.json"])
def test_queries_save_below_the_current_folder(tank: Path, path: str, tmp_path: Path) -> None:
    path = path.format(tmp_path)
    assert saves(tank, path=path) == 0
    assert json.loads((tank.parent / path).read_text())["format"] == "ntagen-strategy"


@pytest.mark.parametrize(
    "path", ["../../s.json", "{}/s.json", "link/s.json", "../out.json", "dangling.json"]
)
def test_queries_do_not_save_elsewhere_unless_it_is_allowed(
    tank: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], path: str
) -> None:
    path = path.format(tmp_path)
    (tank.parent / "link").symlink_to(tmp_path)
    (tank.parents[1] / "out.json").symlink_to(tmp_path / "out.json")
    (tmp_path / "out.json").write_text(OLD)
    (tank.parent / "dangling.json").symlink_to(tmp_path / "made.json")
    before = {one.name: one.read_text() for one in tmp_path.iterdir() if one.is_file()}
    assert saves(tank, path=path) == 2
    said = capsys.readouterr().err
    assert "E0805" in said
    assert {one.name: one.read_text() for one in tmp_path.iterdir() if one.is_file()} == before
    if path != "dangling.json":
        assert f"allow it with --allow-write {tmp_path}" in said
        assert (
            saves(tank, "--allow-write", "models", "--allow-write", str(tmp_path), path=path) == 0
        )
        assert json.loads((tank.parent / path).read_text())["format"] == "ntagen-strategy"


@pytest.mark.parametrize(
    "old", ["alias ls='ls -l'\n", "{}", '{"version": 1, "type": "module"}', "\x7fELF", "\n"]
)
def test_queries_replace_nothing_but_strategies(
    tank: Path, capsys: pytest.CaptureFixture[str], old: str
) -> None:
    bashrc = tank.parent / ".bashrc"
    bashrc.write_text(old)
    assert saves(tank, path=".bashrc") == 2
    assert "it exists, and is no strategy" in capsys.readouterr().err
    assert bashrc.read_text() == old


@pytest.mark.parametrize("old", ["", OLD, LEARNED, "Initial state:\n\nState: ( P.A )\n"])
def test_queries_replace_strategies_and_keep_their_mode(tank: Path, old: str) -> None:
    path = tank.parent / "s.json"
    path.write_text(old)
    path.chmod(0o600)
    (tank.parent / "link.json").symlink_to("s.json")
    assert saves(tank, path="link.json") == 0
    assert json.loads(path.read_text())["format"] == "ntagen-strategy"
    assert path.stat().st_mode & 0o777 == 0o600
    assert (tank.parent / "link.json").is_symlink()
    assert not list(tank.parent.glob(".ntagen*"))


@pytest.mark.parametrize("path", ["/dev/zero", "/dev/null", "pipe", "."])
def test_queries_load_and_save_plain_files_only(
    tank: Path, capsys: pytest.CaptureFixture[str], path: str
) -> None:
    os.mkfifo(tank.parent / "pipe")
    assert saves(tank, "--allow-write", "/", path=path) == 2
    assert "cannot be written" in capsys.readouterr().err
    assert main(["check", str(tank), "--query", f'strategy S = loadStrategy("{path}")']) == 2
    assert "it is no plain file" in capsys.readouterr().err
