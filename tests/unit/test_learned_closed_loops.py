"""Symbolic queries under learned strategies: against an explorer of their JSON, and random runs."""

from __future__ import annotations

import bisect
import itertools
import json
import math
import random
import re
import statistics
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from ntagen.checker import LearnedStrategy, Model, RejectedError, load

PLACES = 6
ROUNDS = 4


def is_satisfied(model: Model, query: str) -> bool:
    """The verdict, which must be one."""
    answer = model.check(query)
    assert answer.verdict in {"satisfied", "not satisfied"}, (query, answer)
    return answer.verdict == "satisfied"


# A walk without clocks, and an explorer of it that knows the strategy by its JSON only.


@dataclass(frozen=True)
class Action:
    """A move of the controller, where the place modulo `every` is not `not_at`."""

    every: int
    not_at: int
    factor: int
    shift: int
    price: int

    def is_enabled(self, at: int) -> bool:
        return at % self.every != self.not_at

    def leads_to(self, at: int) -> int:
        return (at * self.factor + self.shift) % PLACES


@dataclass(frozen=True)
class State:
    """Where the walk is, and how many rounds are left."""

    location: str
    at: int
    left: int


class Walk:
    """A random game: the controller acts, then the environment shifts the place, some times."""

    def __init__(self, seed: int) -> None:
        draw = random.Random(seed)
        self.actions = [
            Action(
                draw.randint(2, 3), draw.randrange(4), draw.randint(1, 2), shift, draw.randint(1, 9)
            )
            for shift in draw.sample(range(PLACES), 3)
        ]
        self.shifts = draw.sample(range(PLACES), 2)
        self.prices = [draw.randint(0, 20) for _ in range(PLACES)]

    @property
    def text(self) -> str:
        acts = ",\n".join(
            f"Choose -> Nature {{ guard at % {one.every} != {one.not_at}; "
            f"assign last = {number}, at = (at * {one.factor} + {one.shift}) % {PLACES}, "
            f"cost += {one.price}; }}"
            for number, one in enumerate(self.actions)
        )
        shifts = ",\n".join(
            f"Nature -u-> Choose {{ guard left > 0; "
            f"assign at = (at + {shift}) % {PLACES}, left--; }}"
            for shift in self.shifts
        )
        prices = ", ".join(map(str, self.prices))
        return f"""
            const int price[{PLACES}] = {{{prices}}};
            int[0,{PLACES - 1}] at = 1; int[0,{ROUNDS}] left = {ROUNDS}; int[0,2] last; int cost;
            process Walk() {{
              state Choose, Nature, Done; urgent Choose, Nature; init Choose;
              trans {acts}, {shifts},
                    Nature -u-> Done {{ guard left == 0; assign cost += price[at]; }};
            }}
            system Walk;"""

    def successors(
        self, state: State, best: Callable[[State, list[int]], set[int]]
    ) -> Iterator[State]:
        """What comes next, where `best` says which of the enabled actions are allowed."""
        if state.location == "Choose":
            enabled = [n for n, one in enumerate(self.actions) if one.is_enabled(state.at)]
            for number in best(state, enabled):
                yield State("Nature", self.actions[number].leads_to(state.at), state.left)
        elif state.location == "Nature" and state.left > 0:
            for shift in self.shifts:
                yield State("Choose", (state.at + shift) % PLACES, state.left - 1)
        elif state.location == "Nature":
            yield State("Done", state.at, 0)


def leaf(tree: object, point: list[int]) -> float:
    while isinstance(tree, dict):
        tree = tree["low" if point[tree["var"]] <= tree["bound"] else "high"]
    assert isinstance(tree, int | float)
    return float(tree)


def best_by_json(strategy: dict[str, Any]) -> Callable[[State, list[int]], set[int]]:
    """The best of the enabled actions, all of them where the strategy knows none."""
    numbers = {}
    for number, text in strategy["actions"].items():
        if found := re.search(r"last\s*:?=\s*(\d)", text):
            numbers[int(found[1])] = number

    def best(state: State, enabled: list[int]) -> set[int]:
        value = {"at": state.at, "left": state.left, "Walk.location": 0}
        key = ",".join(str(value[text.strip()]) for text in strategy["statevars"])
        point = [value[text.strip()] for text in strategy["pointvars"]]
        regressor = strategy["regressors"].get(f"({key or 1})")
        if regressor is None:
            return set(enabled)
        sign = 1 if regressor["minimize"] else -1
        known = {
            number: sign * leaf(regressor["regressor"][numbers[number]], point)
            for number in enabled
            if numbers[number] in regressor["regressor"]
        }
        least = min(known.values(), default=0.0)
        return {number for number, cost in known.items() if cost == least} or set(enabled)

    return best


def reachable(walk: Walk, best: Callable[[State, list[int]], set[int]]) -> set[State]:
    open_states, seen = [State("Choose", 1, ROUNDS)], set()
    while open_states:
        state = open_states.pop()
        if state not in seen:
            seen.add(state)
            open_states.extend(walk.successors(state, best))
    return seen


def ends_only_at(walk: Walk, best: Callable[[State, list[int]], set[int]], goal: set[int]) -> bool:
    """Whether every run passes a state of `goal` at ``Choose``."""

    def always(state: State) -> bool:
        if state.location == "Choose" and state.at in goal:
            return True
        after = list(walk.successors(state, best))
        return bool(after) and all(map(always, after))

    return always(State("Choose", 1, ROUNDS))


FEATURES = ["{at, left} -> {}", "{left} -> {at}", "{} -> {at}", "{at} -> {}", ""]


@pytest.mark.parametrize(("seed", "features"), list(itertools.product(range(4), FEATURES)))
def test_what_an_explorer_reaches_is_reached(seed: int, features: str, tmp_path: Path) -> None:
    walk = Walk(seed)
    model = load(walk.text)
    file = tmp_path / "S.json"
    model.check(f"strategy S = minE(cost)[<=1] {features}: <> Walk.Done", seed=seed)
    model.check(f'saveStrategy("{file}", S)', allow_write=[tmp_path])
    best = best_by_json(json.loads(file.read_text(encoding="utf-8")))
    expected = reachable(walk, best)
    everything = reachable(walk, lambda _, enabled: set(enabled))
    for location, at, left in itertools.product(
        ["Choose", "Nature", "Done"], range(PLACES), range(ROUNDS + 1)
    ):
        where = f"Walk.{location} && at == {at} && left == {left}"
        state = State(location, at, left)
        assert is_satisfied(model, f"E<> {where} under S") == (state in expected), where
        assert is_satisfied(model, f"A[] !({where}) under S") == (state not in expected), where
        assert is_satisfied(model, f"E<> {where}") == (state in everything), where
    for goal in itertools.combinations(range(PLACES), 2):
        always = f"A<> Walk.Choose && (at == {goal[0]} || at == {goal[1]}) under S"
        assert is_satisfied(model, always) == ends_only_at(walk, best, set(goal)), always


# Strategies over clocks, written as JSON.

WAITS = """
clock x;
process P() {
  state A { x <= 5 }, B, C; urgent B, C;
  init A;
  trans A -> B { guard x >= 1; }, A -> C { guard x >= 3; };
}
system P;
"""


def with_trees(
    model: Model,
    query: str,
    trees: Mapping[str, Mapping[str, object]],
    folder: Path,
    name: str = "S",
) -> None:
    """Keeps a strategy whose trees are these: by key, and by the beginning of the action's text."""
    learned = model.check(
        f"strategy Learned = {query}", seed=1, good_runs=50, max_iterations=1, runs=50
    ).strategy
    assert isinstance(learned, LearnedStrategy)
    actions = {str(number): action for number, action in enumerate(learned.actions)}
    text = {**json.loads(learned.json()), "actions": actions}
    regressors = {}
    for key, known in trees.items():
        regressor = {
            number: known[action]
            for number, text_of in actions.items()
            for action in known
            if re.sub(r"\s", "", text_of).startswith(action)
        }
        assert len(regressor) == len(known), (actions, known)
        regressors[key] = {
            "type": "act->point->val",
            "representation": "simpletree",
            "minimize": 1,
            "regressor": regressor,
        }
    file = folder / f"{name}.json"
    file.write_text(json.dumps({**text, "regressors": regressors}), encoding="utf-8")
    model.check(f'strategy {name} = loadStrategy("{file}")')


def cut(bound: float, low: object, high: object, var: int = 0) -> dict[str, object]:
    return {"var": var, "bound": bound, "low": low, "high": high}


def waits(model: Model, tmp_path: Path, **trees: object) -> None:
    known = {"P.A->P.B": trees["b"], "P.A->P.C": trees["c"], "WAIT": trees["wait"]}
    known = {action: tree for action, tree in known.items() if tree is not None}
    with_trees(model, "minE(x)[<=5] {P.location} -> {x}: <> P.B || P.C", {"(0)": known}, tmp_path)


@pytest.mark.parametrize(
    ("trees", "satisfied", "not_satisfied"),
    [
        # It waits until 2, and then takes the better of what is possible at once.
        (
            {"b": 5, "c": cut(4, 9, 1), "wait": cut(2, 3, 7)},
            ["E<> P.B && x == 2", "A[] !(P.A && x > 2)", "A<> P.B", "A[] P.B imply x == 2"],
            ["E<> P.C", "E<> P.B && x != 2"],
        ),
        # It waits as long as it can, and then must move.
        (
            {"b": 5, "c": 4, "wait": 1},
            ["A<> P.C", "A[] P.C imply x == 5", "E<> P.A && x == 5"],
            ["E<> P.B"],
        ),
        # What may be best is not yet possible: it takes what is.
        ({"b": 5, "c": 1, "wait": 9}, ["A<> P.B", "A[] P.B imply x == 1"], ["E<> P.C"]),
        # Of two best actions each is allowed.
        (
            {"b": 2, "c": 2, "wait": cut(3, 1, 9)},
            ["E<> P.B && x == 3", "E<> P.C && x == 3", "A<> x == 3"],
            ["E<> P.A && x > 3", "E<> P.B && x < 3"],
        ),
        # At a cut the cells of both sides count.
        (
            {"b": cut(3, 9, 1), "c": 5, "wait": cut(3, 0, 9)},
            ["A[] P.A imply x <= 3", "E<> P.B && x == 3", "E<> P.C && x == 3 || P.B"],
            ["E<> P.B && x < 3", "E<> P.C && x > 3"],
        ),
        # To wait was never tried: it moves as soon as it can.
        ({"b": 5, "c": 1, "wait": None}, ["A<> P.B", "A[] P.B imply x == 1"], ["E<> P.C"]),
        # It has tried one action only, and waits for it, or for what is drawn until then.
        (
            {"b": None, "c": 1, "wait": None},
            ["E<> P.B && x == 1", "E<> P.B && x == 2", "E<> P.C && x == 4", "A<> P.B || P.C"],
            ["E<> P.B && x > 3", "E<> P.C && x < 3"],
        ),
    ],
)
def test_decisions_over_a_clock(
    trees: dict[str, Any], satisfied: list[str], not_satisfied: list[str], tmp_path: Path
) -> None:
    model = load(WAITS)
    waits(model, tmp_path, **trees)
    for query in satisfied:
        assert is_satisfied(model, f"{query} under S"), query
    for query in not_satisfied:
        assert not is_satisfied(model, f"{query} under S"), query


def test_without_clocks_delays_are_drawn(tmp_path: Path) -> None:
    model = load(WAITS)
    trees = {"(0)": {"P.A->P.B": 1, "P.A->P.C": 2, "WAIT": 9}}
    with_trees(model, "minE(x)[<=5] {P.location} -> {}: <> P.B || P.C", trees, tmp_path)
    assert is_satisfied(model, "E<> P.B && x == 1 under S")
    assert is_satisfied(model, "E<> P.B && x == 5 under S")
    assert not is_satisfied(model, "E<> P.C under S")
    assert is_satisfied(model, "A<> P.B under S")


def test_values_are_bounded_as_the_strategy_says(tmp_path: Path) -> None:
    model = load(WAITS)
    waits(model, tmp_path, b=5, c=cut(4, 9, 1), wait=cut(2, 3, 7))
    greatest = model.check("sup{P.B}: x under S").value
    least = model.check("inf{P.B}: x under S").value
    assert (str(greatest), str(least)) == ("2", "2") or (greatest, least) == (2, 2)


# Random games with clocks, and random trees.

RACE = """
clock x, y; int[0,3] n;
broadcast chan tick;
process Nature() {{
  state Calm {{ y <= {calm} }}, Storm {{ y <= {storm} }};
  init Calm;
  trans Calm -u-> Storm {{ guard y >= {early}; sync tick!; assign y = 0; }},
        Storm -u-> Calm {{ guard y >= 1; assign y = 0; }};
}}
process Sailor() {{
  state Sea {{ x <= {sea} }}, Port {{ x <= {port} }}, Lost;
  init Sea;
  trans Sea -> Port {{ guard x >= {land} && n < 3; assign x = 0, n = n + 1; }},
        Port -> Sea {{ guard x >= 1; assign x = 0; }},
        Sea -> Sea {{ guard x >= 2; assign x = 0; }},
        Sea -u-> Lost {{ guard x >= {late}; sync tick?; }};
}}
system Nature, Sailor;
"""
MOST_ASKED = 80
ROUNDING = 1e-6
SAILOR = "minE(x)[<=25] {{Sailor.location, n}} -> {{{}}}: <> Sailor.Lost"


def race(draw: random.Random) -> str:
    storm = draw.randint(2, 4)
    return RACE.format(
        calm=draw.randint(3, 6), storm=storm, early=draw.randint(1, 3), sea=draw.randint(4, 7),
        port=draw.randint(2, 5), land=draw.randint(1, 3), late=draw.randint(2, 5),
    )  # fmt: skip


def random_tree(draw: random.Random, depth: int) -> object:
    if depth == 0 or draw.random() < 0.3:
        return draw.randint(0, 9)
    low, high = random_tree(draw, depth - 1), random_tree(draw, depth - 1)
    return cut(draw.randint(1, 5), low, high, var=draw.randrange(2))


def random_trees(draw: random.Random, depth: int) -> dict[str, dict[str, object]]:
    actions = {
        "0": ["Sailor.Sea->Sailor.Port", "Sailor.Sea->Sailor.Sea", "WAIT"],
        "1": ["Sailor.Port->Sailor.Sea", "WAIT"],
    }
    return {
        f"({location},{n})": {
            action: random_tree(draw, depth) for action in known if draw.random() < 0.85
        }
        for location, known in actions.items()
        for n in range(4)
        if draw.random() < 0.9
    }


@pytest.mark.parametrize(
    ("seed", "clocks", "depth"),
    [*((seed, "x, y", 3) for seed in range(12)), *((seed, "", 0) for seed in range(4))],
)
def test_runs_never_leave_the_closed_loop(
    seed: int, clocks: str, depth: int, tmp_path: Path
) -> None:
    draw = random.Random(seed)
    model = load(race(draw))
    with_trees(model, SAILOR.format(clocks), random_trees(draw, depth), tmp_path)
    shown = "Nature.location, Sailor.location, n, x, y"
    runs = model.check(f"simulate [<=25; 100] {{ {shown} }} under S", seed=seed).trajectories
    visited = set()
    for run in runs:
        lines = list(run.points.values())
        moments = sorted({moment for line in lines for moment, _ in line})
        spans = [pair for pair in itertools.pairwise(moments) if pair[1] - pair[0] > ROUNDING]
        for moment in map(statistics.mean, spans):
            nature, sailor, n, x, y = (value_at(line, moment) for line in lines)
            visited.add((int(nature), int(sailor), int(n), *box(x), *box(y)))
    assert len(visited) > 3
    some = draw.sample(sorted(visited), min(MOST_ASKED, len(visited)))
    for nature, sailor, n, x_low, x_high, y_low, y_high in some:
        where = (
            f"Nature.{['Calm', 'Storm'][nature]} && Sailor.{['Sea', 'Port', 'Lost'][sailor]}"
            f" && n == {n} && x >= {x_low} && x <= {x_high} && y >= {y_low} && y <= {y_high}"
        )
        assert is_satisfied(model, f"E<> {where} under S"), where
        assert not is_satisfied(model, f"A[] !({where}) under S"), where
    lost = model.check("Pr[<=25](<> Sailor.Lost) under S", seed=seed, runs=300)
    assert lost.estimate is not None
    if lost.estimate.value > 0:
        assert is_satisfied(model, "E<> Sailor.Lost under S")
    if is_satisfied(model, "A[] !Sailor.Lost under S"):
        assert lost.estimate.value == 0


def value_at(line: list[tuple[float, float]], moment: float) -> float:
    """The value at a moment that is no point of a line."""
    place = bisect.bisect([at for at, _ in line], moment)
    (start, first), (end, last) = line[place - 1], line[place]
    return first + (last - first) * (moment - start) / (end - start)


def box(value: float) -> tuple[int, int]:
    """The integers between which a value lies, which is rounded where it is near one."""
    near = round(value)
    if abs(value - near) < ROUNDING:
        return near, near
    return math.floor(value), math.ceil(value)


# Strategies within safe ones, evidence, and refusals.

BRIDGE = """
clock x; int[0,3] tries; double cost;
process Train() {
  state Near { x <= 8 }, Over { x <= 3 }, Crash, Home;
  init Near;
  trans Near -> Over { guard x >= 2; assign cost = cost + 8 - x, x = 0; },
        Near -u-> Crash { guard x >= 5; },
        Over -> Near { guard tries < 3; assign x = 0, tries = tries + 1; },
        Over -u-> Home { guard x >= 1 && tries == 3; };
}
system Train;
"""
BRIDGE_QUERIES = ["A[] !Train.Crash", "A[] Train.Near imply x <= 5", "A<> tries > 0 || Train.Home"]


@pytest.mark.parametrize(
    "features", ["{Train.location, tries} -> {}", "{Train.location} -> {tries}"]
)
def test_what_is_learned_within_a_safe_strategy_is_safe(features: str) -> None:
    model = load(BRIDGE)
    learn = f"minE(cost)[<=60] {features}: <> Train.Home || Train.Crash"
    assert is_satisfied(model, "strategy Safe = control: A[] !Train.Crash")
    options: dict[str, Any] = {"seed": 1, "good_runs": 200, "max_iterations": 2, "runs": 200}
    model.check(f"strategy Free = {learn}", **options)
    model.check(f"strategy Within = {learn} under Safe", **options)
    assert not is_satisfied(model, "A[] !Train.Crash under Free")
    assert is_satisfied(model, "E<> Train.Home under Within")
    for query in BRIDGE_QUERIES[:2]:
        assert is_satisfied(model, f"{query} under Safe"), query
        assert is_satisfied(model, f"{query} under Within"), query
    crash = model.check("Pr[<=60](<> Train.Crash) under Within", runs=500, seed=1)
    assert crash.estimate is not None
    assert crash.estimate.value == 0


def test_traces_are_verified_and_certificates_are_refused(tmp_path: Path) -> None:
    model = load(WAITS)
    waits(model, tmp_path, b=5, c=cut(4, 9, 1), wait=cut(2, 3, 7))
    answer = model.check("E<> P.B under S", verify=True)
    assert answer.verified is True
    assert answer.trace is not None
    held = model.check("A[] !P.C under S", certificate=True)
    assert held.verdict == "satisfied"
    assert "no certificate" in (held.message or "")
    assert model.check("control: A<> P.B under S", verify=True).verified is True
    assert model.check("control: A<> P.C under S", verify=True).verdict == "not satisfied"


COUNTER = """
clock x; int[0,5000] n;
process P() {
  state A { x <= 1 }, B;
  init A;
  trans A -> A { guard n < 5000; assign n = n + 1, x = 0; }, A -> B { };
}
system P;
"""


def test_limits_end_the_closed_loop(tmp_path: Path) -> None:
    model = load(COUNTER)
    trees = {"(0)": {"P.A->P.A": 1, "P.A->P.B": 5, "WAIT": 9}}
    with_trees(model, "minE(n)[<=5] {P.location} -> {x}: <> P.B", trees, tmp_path)
    cut_off = model.check("A[] x == 0 under S", states=1000)
    assert cut_off.verdict == "unknown"
    assert "exploring what S decides" in (cut_off.message or "")
    assert is_satisfied(model, "P.A --> P.B && n == 5000 under S")


@pytest.mark.parametrize(
    ("query", "tree", "message"),
    [
        ("minE(x)[<=5] {P.location} -> {x}: <> P.B || P.C", cut(1.5, 1, 2), "compares x with 1.5"),
        ("minE(x)[<=5] {P.location} -> {x + 1}: <> P.B || P.C", cut(2, 1, 2), "sees x + 1"),
    ],
)
def test_what_zones_cannot_tell_is_refused(
    query: str, tree: dict[str, Any], message: str, tmp_path: Path
) -> None:
    model = load(WAITS)
    with_trees(model, query, {"(0)": {"P.A->P.B": tree, "WAIT": 1}}, tmp_path)
    with pytest.raises(RejectedError) as refused:
        model.check("E<> P.B under S")
    assert message in str(refused.value)
    assert "E0801" in str(refused.value)
    assert "ask Pr, E or simulate under it" in str(refused.value)
    assert model.check("Pr[<=9](<> P.B) under S", runs=10, seed=1).estimate is not None


def test_features_that_no_tree_asks_for_do_no_harm(tmp_path: Path) -> None:
    model = load(WAITS)
    query = "minE(x)[<=5] {P.location} -> {x + 1, x}: <> P.B || P.C"
    trees = {"(0)": {"P.A->P.B": 1, "P.A->P.C": 9, "WAIT": cut(4, 0, 5, var=1)}}
    with_trees(model, query, trees, tmp_path)
    assert is_satisfied(model, "A[] P.B imply x == 4 under S")


LEAVE = """
clock x; double cost;
process Guest() {{
  state Inside {{ x <= 5 * {unit} }}, Done;
  urgent Done;
  init Inside;
  trans Inside -> Done {{ assign cost = x / {unit}.0 + 4 * exp(-x / {unit}.0); }};
}}
system Guest;
"""


def test_cuts_are_integers_where_the_unit_of_time_is_small() -> None:
    model = load(LEAVE.format(unit=1000))
    learn = "minE(cost)[<=6000] {} -> {x}: <> Guest.Done"
    model.check(f"strategy S = {learn}", seed=1, max_iterations=3)
    assert is_satisfied(model, "A<> Guest.Done under S")
    # The best moment is ln 4 thousand. A guest who leaves between these pays at most 1 % more.
    assert is_satisfied(model, "A[] Guest.Done imply x >= 1176 && x <= 1613 under S")
    coarse = load(LEAVE.format(unit=1))
    coarse.check("strategy S = minE(cost)[<=6] {} -> {x}: <> Guest.Done", seed=1, max_iterations=2)
    with pytest.raises(RejectedError, match="zones have integers only"):
        coarse.check("A<> Guest.Done under S")


LATE = """
clock x, age; double cost;
process Guest() {
  state Inside { x <= 5000 }, Done, Bad;
  init Inside;
  trans Inside -> Done { assign cost = 5 - x / 1000.0, x = 0; },
        Inside -u-> Bad { guard x >= 2000; assign cost = 0; };
}
system Guest;
"""


def test_clocks_that_are_seen_and_a_safe_strategy_both_restrict() -> None:
    model = load(LATE)
    learn = "minE(cost)[<=6000] {} -> {x}: <> Guest.Done || Guest.Bad"
    assert is_satisfied(model, "strategy Safe = control: A[] !Guest.Bad")
    for name, under in ("Free", ""), ("Within", " under Safe"):
        model.check(f"strategy {name} = {learn}{under}", seed=1, max_iterations=3)
    assert is_satisfied(model, "E<> Guest.Bad under Free")
    assert is_satisfied(model, "A[] !Guest.Bad under Within")
    assert is_satisfied(model, "A<> Guest.Done under Within")
    # Who leaves early is safe, but pays for it: x is the time since then, and `age` the whole.
    assert is_satisfied(model, "E<> Guest.Done && age == x under Safe")
    assert is_satisfied(model, "A[] Guest.Done imply age - x >= 1000 under Within")
    assert not is_satisfied(model, "A[] Guest.Done imply age - x >= 1000 under Safe")
    bad = model.check("Pr[<=6000](<> Guest.Bad) under Within", runs=500, seed=1)
    assert bad.estimate is not None
    assert bad.estimate.value == 0
