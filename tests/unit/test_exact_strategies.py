"""Best strategies that are computed, and not learned: against known values and all strategies."""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import pytest

from ntagen.checker import Answer, RejectedError, load
from tests.benchmarks.best_strategy import GAMES
from tests.oracles.learning.cases import CASES, HELD_BACK, Case, Method

COMPUTED = [case for case in CASES + HELD_BACK if case.method in (Method.FINITE, Method.STEPS)]
NEAR = 1e-6


def asked(text: str, query: str, *, states: int | None = None) -> Answer:
    """The answer to a query for a strategy, named S."""
    return load(text).check(f"strategy S = {query}", states=states)


def assert_computed(answer: Answer, exact: float) -> None:
    """It is the exact value between bounds, from no runs."""
    estimate = answer.estimate
    assert estimate is not None, answer
    assert (estimate.method, estimate.runs, estimate.confidence) == ("value iteration", 0, 1.0)
    slack = NEAR * max(abs(exact), 1e-3)
    assert estimate.value == pytest.approx(exact, rel=NEAR, abs=1e-12)
    assert estimate.lower is not None
    assert estimate.upper is not None
    assert exact - slack <= estimate.lower <= estimate.upper <= exact + slack
    assert "exact: value iteration over" in (answer.message or "")


@pytest.mark.parametrize("case", COMPUTED, ids=lambda case: case.name)
def test_known_values_are_computed_and_runs_under_the_strategy_have_them(case: Case) -> None:
    model = load(case.path.read_text(encoding="utf-8"), str(case.path))
    under = ""
    if case.under:
        model.check(case.under)
        under = " under Safe"
    answer = model.check(f"strategy S = {case.query}{under}")
    assert_computed(answer, float(case.exact))
    followed = model.check(f"{case.estimate.format(runs=20_000)} under S", alpha=1e-6, seed=1)
    assert followed.estimate is not None
    lower, upper = followed.estimate.lower, followed.estimate.upper
    assert lower is not None
    assert upper is not None
    assert lower - NEAR <= float(case.exact) <= upper + NEAR


@pytest.mark.parametrize(
    "case", [case for case in CASES if case.method is Method.BLIND], ids=lambda case: case.name
)
def test_what_the_features_hide_is_left_to_learning(case: Case) -> None:
    answer = asked(case.path.read_text(encoding="utf-8"), case.query)
    assert answer.estimate is not None
    assert answer.estimate.runs > 0
    assert "not computed exactly: the features do not tell states apart" in (answer.message or "")


@pytest.mark.parametrize("model", ["parts", "plant", "relay", "steering"])
def test_the_greatest_value_is_the_least_of_the_opposite(model: str) -> None:
    path = Path(__file__).parents[1] / "oracles" / "learning" / f"{model}.xta"
    text = path.read_text(encoding="utf-8")
    price, goal = {
        "parts": ("cost", "Shop.Done"),
        "plant": ("gain", "Plant.Done"),
        "relay": ("gain", "Anna.Done"),
        "steering": ("0.5 * at", "Walk.Home || Walk.Lost"),
    }[model]
    least = asked(text, f"minE(-({price}))[<=1]: <> {goal}")
    greatest = asked(text, f"maxE({price})[<=1]: <> {goal}")
    assert least.estimate is not None
    assert greatest.estimate is not None
    assert greatest.estimate.value == pytest.approx(-least.estimate.value, rel=1e-12)


def test_the_order_of_processes_makes_no_difference() -> None:
    path = Path(__file__).parents[1] / "oracles" / "learning" / "relay.xta"
    text = path.read_text(encoding="utf-8")
    query = "maxE(gain)[<=1]: <> Anna.Done"
    other = text.replace("system Anna, Bert", "system Bert, Anna")
    assert_computed(asked(other, query), 9.318)


def test_useless_features_make_no_difference() -> None:
    path = Path(__file__).parents[1] / "oracles" / "learning" / "needle.xta"
    text = path.read_text(encoding="utf-8")
    query = "minE(cost)[<=1]{offset, left, cost, offset % 2}->{offset * 0.5}: <> Needle.Done"
    assert_computed(asked(text, query), 6.16)


CYCLE = """
int cost;
process P() {
  state A, B, Done;
  urgent A, B;
  init A;
  trans A -> B { assign cost += FIRST; }, B -> A { assign cost += SECOND; }, A -> Done { };
}
system P;
"""


def cycle(first: int, second: int) -> str:
    """Two states between which the controller can go to and fro at these costs."""
    return CYCLE.replace("FIRST", str(first)).replace("SECOND", str(second))


def test_cycles_that_cost_something_or_nothing_are_left() -> None:
    assert_computed(asked(cycle(2, 3), "minE(cost)[<=1]: <> P.Done"), 0)
    assert_computed(asked(cycle(0, 0), "minE(cost)[<=1]: <> P.Done"), 0)
    assert_computed(asked(cycle(0, 0), "minPr[<=1]: <> P.Done"), 1)


def test_a_cycle_that_gains_each_time_is_a_mistake() -> None:
    with pytest.raises(RejectedError, match=r"E0806.*no best strategy"):
        asked(cycle(2, 3), "maxE(cost)[<=1]: <> P.Done")


def test_runs_that_never_end_are_a_mistake() -> None:
    text = cycle(0, 0).replace(", A -> Done { }", "")
    with pytest.raises(RejectedError, match=r"E0806.*for ever"):
        asked(text, "minE(cost)[<=1]: <> P.Done")


def test_limits_leave_it_to_learning() -> None:
    path = Path(__file__).parents[1] / "oracles" / "learning" / "parts.xta"
    answer = asked(path.read_text(encoding="utf-8"), "minE(cost)[<=1]: <> Shop.Done", states=5)
    assert "not computed exactly: there are more states than allowed" in (answer.message or "")


# Two processes of the environment and one of the controller compete where time stands still;
# afterwards two move at the same moment, one of them with two kinds of listeners.
RACE = """
broadcast chan all;
int a, cost;
clock x;
process Control() {
  state C, D { x <= 2 }, E;
  urgent C;
  init C;
  trans C -> D { assign cost += 2; }, C -> D { guard a > 2; assign cost += a; },
        D -> E { guard x >= 2; assign cost += 3; }, D -> E { guard x >= 2; assign cost = 0; };
}
process Early(const int by) {
  state U, V { x <= 2 }, W;
  urgent U;
  branchpoint B;
  init U;
  trans U -u-> V { assign a += by; }, U -u-> B { },
        B -> V { assign a += 2 * by; probability 3; }, B -> V { probability 1; },
        V -u-> W { guard x >= 2; sync all!; assign a += 1; };
}
process Listener() {
  state L, M, N;
  init L;
  trans L -u-> M { sync all?; assign cost += a; }, L -u-> N { sync all?; assign cost -= 1; },
        M -u-> N { sync all?; assign cost += 5; };
}
First = Early(1);
Second = Early(3);
One = Listener();
Other = Listener();
system Control, First, Second, One, Other;
"""


@pytest.mark.parametrize(
    "query",
    [
        "minE(cost)[<=3]: <> x >= 3",
        "maxE(cost)[<=3]: <> x >= 3",
        "minE(cost + 1)[<=3]{a, cost, Control.location, First.location, Second.location,"
        " One.location, Other.location}->{x}: <> x >= 3",
        "maxPr[<=3]: <> First.W && Second.W && cost > 12",
        "minPr[<=3]: <> First.W && Second.W && cost > 12",
        "maxPr[#<=4]: <> Control.E && a > 3",
        "minPr[#<=4]: <> Control.E && a > 3",
    ],
)
def test_runs_of_a_race_have_the_value_that_was_computed(query: str) -> None:
    model = load(RACE)
    answer = model.check(f"strategy S = {query}")
    assert answer.estimate is not None
    assert answer.estimate.is_computed, answer
    bound = query[query.index("[") : query.index("]")]
    goal = query[query.index("<>") :]
    price = query[query.index("(") : query.index(")") + 1] if "(" in query else ""
    follow = f"Pr{bound}]({goal})" if "Pr" in query else f"E{bound}](max: x >= 3 ? {price} : -99)"
    found = model.check(f"{follow} under S", alpha=1e-6, seed=3, runs=50_000).estimate
    assert found is not None
    assert found.lower is not None
    assert found.upper is not None
    assert found.lower - NEAR <= answer.estimate.value <= found.upper + NEAR


@pytest.mark.parametrize(
    ("game", "value"), [("gambler", 0.286142419), ("grid", 209.309465), ("inventory", 242.950412)]
)
def test_larger_games_have_the_values_that_storm_finds(game: str, value: float) -> None:
    instance = GAMES[game](10_000)
    assert_computed(asked(instance.model, instance.query), value)


def test_the_limit_of_time_ends_it() -> None:
    instance = GAMES["grid"](1_000_000)
    answer = load(instance.model).check(f"strategy S = {instance.query}", timeout_s=0.2)
    assert (answer.verdict, answer.stop) == ("unknown", "time")


# Random games: node s of some has edges to branch points, whose legs go to other nodes.

Legs = tuple[tuple[Fraction, int, int], ...]
"""Of each leg its chance, where it leads, and what it costs."""
Table = tuple[tuple[Legs, ...], ...]


def random_table(seed: int, costs: list[int]) -> Table:
    """The choices of each node; the last one is the end, and has none."""
    numbers = random.Random(seed)
    nodes = numbers.randint(3, 6)

    def legs() -> Legs:
        weights = [numbers.randint(1, 4) for _ in range(numbers.randint(1, 3))]
        return tuple(
            (Fraction(weight, sum(weights)), numbers.randrange(nodes), numbers.choice(costs))
            for weight in weights
        )

    choices = [tuple(legs() for _ in range(numbers.randint(1, 3))) for _ in range(nodes - 1)]
    return (*choices, ())


def text_of(table: Table) -> str:
    """The game as a model."""
    points, edges = [], []
    for node, choices in enumerate(table):
        for number, legs in enumerate(choices):
            point = f"B{node}_{number}"
            points.append(point)
            edges.append(f"At -> {point} {{ guard s == {node}; }}")
            whole = max(chance.denominator for chance, _, _ in legs)
            scale = whole * 12
            edges += [
                f"{point} -> At {{ assign s = {to}, cost += {cost}; "
                f"probability {int(chance * scale)}; }}"
                for chance, to, cost in legs
            ]
    end = len(table) - 1
    edges.append(f"At -u-> Done {{ guard s == {end}; }}")
    joined = ",\n        ".join(edges)
    return f"""int[0,{end}] s;
int cost;
process P() {{
  state At, Done;
  branchpoint {", ".join(points)};
  urgent At;
  init At;
  trans {joined};
}}
system P;
"""


def cost_of(table: Table, policy: tuple[int, ...]) -> Fraction | None:
    """What a strategy costs from node 0; ``None`` if it may never end."""
    end = len(table) - 1
    legs = [table[node][choice] for node, choice in enumerate(policy)]

    def reached(start: int) -> set[int]:
        found, waiting = {start}, [start]
        while waiting:
            node = waiting.pop()
            new = {to for _, to, _ in legs[node]} - found if node != end else set()
            found |= new
            waiting += new
        return found

    nodes = sorted(reached(0) - {end})
    if not all(end in reached(node) for node in nodes):
        return None
    rows = []
    for node in nodes:
        row = [Fraction(int(node == other)) for other in nodes]
        for chance, to, _ in legs[node]:
            if to != end:
                row[nodes.index(to)] -= chance
        rows.append([*row, sum((chance * cost for chance, _, cost in legs[node]), Fraction(0))])
    for place in range(len(rows)):
        pivot = next(k for k in range(place, len(rows)) if rows[k][place])
        rows[place], rows[pivot] = rows[pivot], rows[place]
        rows[place] = [value / rows[place][place] for value in rows[place]]
        for other in range(len(rows)):
            if other != place:
                factor = rows[other][place]
                pairs = zip(rows[other], rows[place], strict=True)
                rows[other] = [one - factor * value for one, value in pairs]
    return rows[0][-1] if rows else Fraction(0)


def strategies(table: Table) -> Iterator[tuple[int, ...]]:
    """All that need no memory."""
    return itertools.product(*(range(len(choices)) for choices in table[:-1]))


@pytest.mark.parametrize("seed", range(40))
def test_random_games_agree_with_all_strategies(seed: int) -> None:
    table = random_table(seed, [1, 2, 7] if seed % 2 else [0, 0, 3])
    costs = [cost for policy in strategies(table) if (cost := cost_of(table, policy)) is not None]
    query = "minE(cost)[<=1]: <> P.Done"
    if costs:
        assert_computed(asked(text_of(table), query), float(min(costs)))
    else:
        with pytest.raises(RejectedError, match="for ever"):
            asked(text_of(table), query)
