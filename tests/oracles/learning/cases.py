"""Learning queries whose best values are known: models, queries and values.

`CASES` are the games whose values were known before there was a learner; `HELD_BACK` are others
of the same kinds, which nobody tunes a learner on. A model is the file of its name beside this one;
its first lines say what the game is. `closed` leaves the controller of a model no choice, so that
queries about random runs can confirm the value.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from pathlib import Path

from tests.oracles.learning import games
from tests.oracles.learning.induction import Choice, Game, Solution

HERE = Path(__file__).parent
EXACT = 1e-9
LEARNED = 1e-2
"""How far a learned value may be from the best one, as a part of it."""


class Method(Enum):
    """What the best value takes."""

    FINITE = "time stands still at all choices, and there are few states: value iteration"
    STEPS = "delays are constants: value iteration, with the time in the state"
    BLIND = "the features hide the state: search among the plans, or learning"
    CLOCKS = "delays are random or are chosen: learning"


@dataclass(frozen=True)
class Peer:
    """The same question to Storm, about `prism/MODEL.prism`.

    Its value is `more` too great, since rewards must not be negative.
    """

    question: str
    more: int = 0


@dataclass(frozen=True)
class Case:
    """A question about a model, and its answer.

    `query` stands behind `strategy S = `, and `oracle` computes `exact` again. `estimate` is about
    random runs of the closed model, with {runs} to fill in. `game` is the table of a finite game;
    `changes` close another one, by other text for some of its text. `under` is the query, named
    Safe, of a strategy to be refined.
    """

    model: str
    query: str
    exact: Fraction | float
    oracle: Callable[[], Fraction | float]
    method: Method
    estimate: str
    game: Callable[[], Game] | None = None
    changes: Mapping[str, str] | None = None
    peer: Peer | None = None
    under: str = ""

    @property
    def choice(self) -> Choice:
        """What is optimised."""
        return Choice.LEAST if self.query.startswith("min") else Choice.GREATEST

    @property
    def tolerance(self) -> float:
        """How far an answer may be from the exact value, as a part of it."""
        return EXACT if self.method in (Method.FINITE, Method.STEPS) else LEARNED

    @property
    def path(self) -> Path:
        """The model's file."""
        return HERE / f"{self.model}.xta"

    @property
    def name(self) -> str:
        """For lists of tests."""
        return f"{self.model}: {self.query}" + (" under Safe" if self.under else "")


def finite(
    query: str,
    exact: Fraction,
    game: Callable[[], Game],
    estimate: str,
    question: str,
    *,
    model: str = "",
    method: Method = Method.FINITE,
    more: int = 0,
) -> Case:
    """A case that backward induction decides."""
    aim = Choice.LEAST if query.startswith("min") else Choice.GREATEST
    return Case(
        model or game.__name__,
        query,
        exact,
        lambda: Solution(game(), aim).value,
        method,
        estimate,
        game,
        peer=Peer(question, more) if question else None,
    )


def closed(case: Case) -> str:
    """The model, closed by a best policy."""
    text = case.path.read_text(encoding="utf-8")
    for old, new in (case.changes or {}).items():
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    if case.game is not None:
        text = with_guards(text, Solution(case.game(), case.choice).guards())
    return text


EDGE = re.compile(
    r"(?P<ends>(?P<source>\w+) -> \w+) \{ ?(?P<select>select [^;]*; )?(?:guard (?P<guard>[^;]*); )?"
    r"(?P<rest>[^}]*)\}"
)


def with_guards(text: str, guards: Mapping[int, list[str]]) -> str:
    """The model, in which a controllable edge stands once for each of its guards.

    Clocks may not be in alternatives, so that one guard does not do. An edge without one is shut.
    """
    points = ", ".join(re.findall(r"branchpoint ([^;]*);", text)).split(", ")
    numbers = itertools.count()

    def guarded(found: re.Match[str]) -> str:
        if found["source"] in points:
            return found[0]
        own = f"({found['guard']}) && " if found["guard"] else ""
        select = found["select"] or ""
        return ",\n        ".join(
            f"{found['ends']} {{ {select}guard {own}{guard}; {found['rest']}}}"
            for guard in guards.get(next(numbers), ["false"])
        )

    return EDGE.sub(guarded, text)


# Values that are not found by backward induction.


def blind_traffic() -> Fraction:
    """Either means of transport, whatever the traffic."""
    return min(Fraction(7, 10) * 10 + Fraction(3, 10) * 50, Fraction(25))


def planned_needle() -> Fraction:
    """The best plan of rolls that never looks at the offset."""
    chances = {-1: Fraction(1, 5), 0: Fraction(3, 5), 1: Fraction(1, 5)}

    def value(plan: tuple[int, ...]) -> Fraction:
        rolls, at = sum(map(abs, plan)), sum(plan)
        return Fraction(3 * rolls) + sum(
            math.prod(chances[step] for step in steps) * 10 * abs(at + sum(steps))
            for steps in itertools.product(chances, repeat=3)
        )

    return min(value(plan) for plan in itertools.product((-1, 0, 1), repeat=3))


def leaving() -> float:
    """The least of x + 4 e^(-x), where 1 = 4 e^(-x)."""
    return 1 + math.log(4)


def operating() -> float:
    """The greatest of x e^(-x/4), at x = 4."""
    return 4 / math.e


def wearing() -> Fraction:
    """The greatest of x (1 - x/10), at x = 5."""
    return Fraction(5) * (1 - Fraction(5, 10))


def waiting() -> Fraction:
    """Whoever walks at s rides with s/20, after s/2 on average, and else walks.

    The value rises up to s = 7 and falls from then on, so the least is at an end.
    """

    def value(s: int) -> Fraction:
        rides = Fraction(s, 20)
        return rides * (Fraction(s, 2) + 5) + (1 - rides) * (s + 18)

    return min(value(0), value(20))


def serving() -> Fraction:
    """The lesser of the two means."""
    return min(Fraction(0 + 4, 2), Fraction(1 + 2, 2))


def served() -> Fraction:
    """The greater of the two chances to be done by 6/5."""
    by = Fraction(6, 5)
    return max(by / 4, by - 1)


COST = "E[<=1; {runs}](max: cost)"
CASES = (
    finite(
        "minE(cost)[<=1]{traffic}->{}: <> Day.Done",
        Fraction(29, 2),
        games.traffic,
        COST,
        'R{"cost"}min=? [F "done"]',
    ),
    finite(
        "minE(cost)[<=1]: <> Day.Done",
        Fraction(29, 2),
        games.traffic,
        COST,
        'R{"cost"}min=? [F "done"]',
    ),
    Case(
        "traffic",
        "minE(cost)[<=1]{}->{}: <> Day.Done",
        Fraction(22),
        blind_traffic,
        Method.BLIND,
        COST,
        changes={"Home -> Done { assign cost = 25; }": "Home -> Done { guard false; }"},
    ),
    finite(
        "minE(cost)[<=1]{parts, left}->{}: <> Shop.Done",
        Fraction(85, 16),
        games.parts,
        COST,
        'R{"cost"}min=? [F "done"]',
    ),
    finite(
        "maxE(gain)[<=1]{wear, left}->{}: <> Plant.Done",
        Fraction(343, 8),
        games.plant,
        "E[<=1; {runs}](max: Plant.Done ? gain : -100)",
        'R{"gain"}max=? [F "done"]',
        more=48,
    ),
    finite(
        "minE(cost)[<=1]{offset, left}->{}: <> Needle.Done",
        Fraction(154, 25),
        games.needle,
        COST,
        'R{"cost"}min=? [F "done"]',
    ),
    Case(
        "needle",
        "minE(cost)[<=1]{left}->{}: <> Needle.Done",
        Fraction(204, 25),
        planned_needle,
        Method.BLIND,
        COST,
        changes={"guard left > 0; assign left--, cost": "guard false; assign left--, cost"},
    ),
    Case(
        "leave",
        "minE(cost)[<=6]{}->{x}: <> Guest.Done",
        2.386294361119891,
        leaving,
        Method.CLOCKS,
        "E[<=6; {runs}](max: cost)",
        changes={"x <= 5": "x <= 1.3862943611198906", "{ assign": "{ guard x >= 1.386; assign"},
    ),
    Case(
        "operator",
        "maxE(gain)[<=40]{broken}->{x}: <> Operator.Stopped",
        1.4715177646857693,
        operating,
        Method.CLOCKS,
        "E[<=40; {runs}](max: gain)",
        changes={"x <= 40": "x <= 4", "{ assign gain": "{ guard x >= 4; assign gain"},
    ),
    finite(
        "minE(cost)[<=1]: <> Buyer.Done",
        Fraction(5),
        games.one_choice,
        COST,
        'R{"cost"}min=? [F "done"]',
    ),
    finite(
        "maxE(cost)[<=1]: <> Buyer.Done",
        Fraction(6),
        games.one_choice,
        COST,
        'R{"cost"}max=? [F "done"]',
    ),
    finite(
        "minE(time)[<=200]: <> Job.Success or Job.Ended",
        Fraction(20, 3),
        games.tries,
        "E[<=200; {runs}](max: Job.Success || Job.Ended ? 0.0 : time)",
        'R{"time"}min=? [F "done"]',
        method=Method.STEPS,
    ),
    finite(
        "maxPr[<=6]: <> Job.Success",
        Fraction(657, 1000),
        games.tries_in_time,
        "Pr[<=6; {runs}](<> Job.Success)",
        'Pmax=? [F ("success" & clock<=6)]',
        model="tries",
        method=Method.STEPS,
    ),
    finite(
        "minE(time)[<=1000]: <> Work.Done",
        Fraction(45, 4),
        games.stages,
        "E[<=1000; {runs}](max: Work.Done ? 0.0 : time)",
        'R{"time"}min=? [F "done"]',
        method=Method.STEPS,
    ),
    finite(
        "maxPr[<=1]: <> Gambler.Rich",
        Fraction(2, 5),
        games.gambler,
        "Pr[<=1; {runs}](<> Gambler.Rich)",
        'Pmax=? [F "rich"]',
    ),
    finite(
        "minE(cost)[<=1]: <> Driver.Done",
        Fraction(424374, 100000),
        games.parking,
        COST,
        'R{"cost"}min=? [F "done"]',
    ),
    Case(
        "worn",
        "maxE(gain)[<=10]{broken}->{x}: <> Operator.Stopped",
        Fraction(5, 2),
        wearing,
        Method.CLOCKS,
        "E[<=11; {runs}](max: gain)",
        changes={
            "Working { x <= 10 }": "Working { x <= 5 }",
            "{ assign gain": "{ guard x >= 5; assign gain",
        },
    ),
    Case(
        "bus",
        "minE(time)[<=60]{Person.location}->{x}: <> Person.There",
        Fraction(15),
        waiting,
        Method.CLOCKS,
        "E[<=60; {runs}](max: Person.There ? 0.0 : time)",
        changes={
            "Walking { assign": "Walking { guard false; assign",
            "Waiting { time <= 20 }": "Waiting",
        },
    ),
    Case(
        "servers",
        "minE(time)[<=5]: <> Client.Done",
        Fraction(3, 2),
        serving,
        Method.CLOCKS,
        "E[<=5; {runs}](max: Client.Done ? 0.0 : time)",
        changes={"Choose -> Wide { }": "Choose -> Wide { guard false; }"},
    ),
    Case(
        "servers",
        "maxPr[<=1.2]: <> Client.Done",
        Fraction(3, 10),
        served,
        Method.CLOCKS,
        "Pr[<=1.2; {runs}](<> Client.Done)",
        changes={"Choose -> Narrow { }": "Choose -> Narrow { guard false; }"},
    ),
    finite(
        "minE(cost)[<=1]: <> Route.Done",
        Fraction(1),
        games.routes,
        COST,
        'R{"cost"}min=? [F "done"]',
    ),
    Case(
        "routes",
        "minE(cost)[<=1]: <> Route.Done",
        Fraction(4),
        lambda: Fraction(4),
        Method.FINITE,
        COST,
        changes={"Open { assign": "Open { guard false; assign"},
        peer=Peer('R{"cost"}max=? [F "done"]'),
        under="strategy Safe = control: A[] not Route.Harm",
    ),
)

HELD_BACK = (
    finite(
        "minE(cost)[<=1]{day, stock}->{}: <> Store.Done",
        Fraction(843, 64),
        games.inventory,
        COST,
        'R{"cost"}min=? [F "done"]',
    ),
    finite(
        "maxPr[<=1]{messages, charge}->{}: <> Link.Delivered",
        Fraction(1582, 2025),
        games.retries,
        "Pr[<=1; {runs}](<> Link.Delivered)",
        'Pmax=? [F "delivered"]',
    ),
    finite(
        "minPr[<=1]: <> Link.Delivered",
        Fraction(7429, 10935),
        games.retries,
        "Pr[<=1; {runs}](<> Link.Delivered)",
        'Pmin=? [F "delivered"]',
    ),
    finite(
        "minE(cost)[<=1]{done[0], done[1], done[2], now}->{}: <> Machine.Done",
        Fraction(32),
        games.scheduling,
        COST,
        'R{"cost"}min=? [F "done"]',
    ),
    finite(
        "maxPr[<=1]{at, left}->{}: <> Walk.Home",
        Fraction(219996, 390625),
        games.steering,
        "Pr[<=1; {runs}](<> Walk.Home)",
        'Pmax=? [F "home"]',
    ),
    finite(
        "minPr[<=1]: <> Walk.Home",
        Fraction(37, 128),
        games.steering,
        "Pr[<=1; {runs}](<> Walk.Home)",
        'Pmin=? [F "home"]',
    ),
    finite(
        "maxPr[<=1]{k}->{}: <> Interview.Won",
        Fraction(77, 180),
        games.secretary,
        "Pr[<=1; {runs}](<> Interview.Won)",
        'Pmax=? [F "won"]',
    ),
    finite(
        "maxE(gain)[<=1]{points, throws}->{}: <> Player.Kept",
        Fraction(35, 4),
        games.dice,
        "E[<=1; {runs}](max: Player.Kept ? gain : -100)",
        'R{"gain"}max=? [F "done"]',
        more=3,
    ),
    finite(
        "minE(cost)[<=1]{age, left}->{}: <> Owner.Done",
        Fraction(18),
        games.replacement,
        COST,
        'R{"cost"}min=? [F "done"]',
    ),
    finite(
        "maxPr[#<=4]{node, hops}->{}: <> Net.Arrived",
        Fraction(35, 48),
        lambda: games.routing(4),
        "Pr[#<=4; {runs}](<> Net.Arrived)",
        'Pmax=? [F<=4 "arrived"]',
        model="routing",
    ),
    finite(
        "maxPr[#<=6]{node, hops}->{}: <> Net.Arrived",
        Fraction(26, 27),
        lambda: games.routing(6),
        "Pr[#<=6; {runs}](<> Net.Arrived)",
        'Pmax=? [F<=6 "arrived"]',
        model="routing",
    ),
    finite(
        "maxPr[<=8]: <> Work.Done",
        Fraction(14693, 20000),
        lambda: games.deadline(8),
        "Pr[<=8; {runs}](<> Work.Done)",
        'Pmax=? [F ("done" & clock<=8)]',
        model="deadline",
        method=Method.STEPS,
    ),
    finite(
        "maxPr[<=10]{stage}->{time}: <> Work.Done",
        Fraction(36157, 40000),
        lambda: games.deadline(10),
        "Pr[<=10; {runs}](<> Work.Done)",
        'Pmax=? [F ("done" & clock<=10)]',
        model="deadline",
        method=Method.STEPS,
    ),
    finite(
        "minPr[<=10]: <> Work.Done",
        Fraction(343, 625),
        lambda: games.deadline(10),
        "Pr[<=10; {runs}](<> Work.Done)",
        'Pmin=? [F ("done" & clock<=10)]',
        model="deadline",
        method=Method.STEPS,
    ),
    finite(
        "maxE(gain)[<=1]: <> Anna.Done",
        Fraction(4659, 500),
        games.relay,
        "E[<=1; {runs}](max: Anna.Done ? gain : -100)",
        'R{"gain"}max=? [F "done"]',
        more=6,
    ),
)
