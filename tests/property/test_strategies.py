"""Strategies win against random opponents, move by move, on the corpus and on random games.

The opponent's moves, their times and the ends of play come from the engine's independent check; the
strategy's own moves are those that `Strategy.action` names. ``NTAGEN_GAMES`` sets the number of
random games.
"""

from __future__ import annotations

import os
import random
import re
from fractions import Fraction
from pathlib import Path

import pytest

import ntagen
from ntagen.checker.strategy import Strategy
from ntagen.errors import InputError, LimitError

GAMES = Path(__file__).parents[1] / "corpus" / "games"

RANDOM_GAMES = int(os.environ.get("NTAGEN_GAMES", "100"))
PLAYS_A_GAME = 4
LONGEST_PLAY = 60


def queries() -> list[tuple[Path, str]]:
    """The games of the corpus that are asked without options."""
    found: list[tuple[Path, str]] = []
    for path in sorted(GAMES.glob("*.xta")):
        asked = re.findall(
            r"^// query: ((?:E<> )?control.*)$", path.read_text("utf-8"), re.MULTILINE
        )
        found += [(path, query) for query in asked if " under " not in query]
    return found


def played(strategy: Strategy, chance: random.Random) -> tuple[str | None, bool]:
    """Plays at random against a strategy.

    Returns:
        Who has won, if play has come to an end, and whether the goal was met on the way.
    """
    play = strategy.play()
    met = False
    for _ in range(LONGEST_PLAY):
        situation = play.situation()
        met |= situation.goal
        then = situation.next
        assert then.kind != "fails", (then.why, play.state)
        if situation.winner is not None:
            return situation.winner, met
        advice = strategy.action(play.state)
        if then.kind == "acts":
            # What the strategy says is what the rules of play make it do.
            assert (advice.kind == "act") == (then.delay == 0)
            assert then.edges == (advice.edges or advice.then)
            assert (advice.delay or 0) == then.delay
        choices = [
            (index, window) for index, one in enumerate(situation.replies) for window in one.windows
        ]
        if choices and (then.kind == "must" or chance.random() < 0.6):
            index, window = chance.choice(choices)
            edges, delay = situation.replies[index].edges, window.chosen(chance)
            play.wait(delay)
            reached = play.situation()
            met |= reached.goal
            play.reply(next(i for i, one in enumerate(reached.replies) if one.edges == edges), 0)
        elif situation.allowed and chance.random() < 0.7:
            index = chance.randrange(len(situation.allowed))
            window = chance.choice(situation.allowed[index].windows)
            play.allow(index, window.chosen(chance))
        elif then.kind == "acts":
            play.follow()
        elif then.kind == "won" and then.delay is not None and then.why in ("goal", "broken"):
            play.wait(then.delay)
        elif then.kind == "won":
            play.wait(then.delay or 0)
            return then.winner, met or play.situation().goal
        else:
            raise AssertionError("the opponent must move and has no move")
    return None, met


def check_wins(strategy: Strategy, seed: int) -> None:
    is_reached = (
        re.search(r"A<>|\bU\b", strategy.query) is not None and "&& A<>" not in strategy.query
    )
    must_end = is_reached == strategy.winning
    for play in range(PLAYS_A_GAME):
        try:
            winner, met = played(strategy, random.Random(f"{seed} {play}"))
        except InputError as error:
            # Where both sides only have open windows, times may become ever finer.
            if "cannot be waited" not in str(error):
                raise
            continue
        assert winner in (strategy.owner, None)
        if "&& A<>" in strategy.query:
            assert winner == "environment" or not strategy.winning or met
        elif must_end:
            assert winner == strategy.owner


@pytest.mark.parametrize(
    "seeds",
    [range(1), pytest.param(range(1, 5), marks=pytest.mark.slow)],
    ids=["few plays", "more plays"],
)
@pytest.mark.parametrize(("path", "query"), queries(), ids=lambda one: getattr(one, "stem", one))
def test_strategies_of_the_corpus_win(path: Path, query: str, seeds: range) -> None:
    model = ntagen.load(path)
    try:
        strategy = model.synthesize(query)
    except (InputError, LimitError):
        # Kinds of games that are refused, or have no strategy, have tests of their own.
        pytest.skip("the game gives no strategy")
    for seed in seeds:
        check_wins(strategy, seed)


def random_model(chance: random.Random, channel: str = "chan") -> str:
    """Two processes with a clock each, that meet on two channels, the first of this kind."""
    processes = []
    for name in "PQ":
        invariants = [chance.choice(["", f" {{ x <= {chance.randint(1, 3)} }}"]) for _ in range(3)]
        edges = []
        for _ in range(chance.randint(2, 5)):
            owner = chance.choice(["->", "-u->"])
            relation = chance.choice(["<", "<=", ">", ">=", "=="])
            fields = []
            if chance.random() < 0.7:
                fields.append(f"guard {chance.choice('xy')} {relation} {chance.randint(0, 3)};")
            if chance.random() < 0.4:
                fields.append(f"sync {chance.choice('ab')}{chance.choice('!?')};")
            if chance.random() < 0.6:
                fields.append(f"assign {chance.choice('xy')} = 0;")
            source, target = chance.randrange(3), chance.randrange(3)
            edges.append(f"L{source} {owner} L{target} {{ {' '.join(fields)} }}")
        committed = chance.choice(["", "", "commit L1; ", "urgent L1; "])
        processes.append(
            f"process {name}() {{ clock x; "
            f"state L0{invariants[0]}, L1{invariants[1]}, L2{invariants[2]}; {committed}init L0; "
            f"trans {', '.join(edges)}; }}"
        )
    return f"clock y; {channel} a; broadcast chan b;\n" + "\n".join(processes) + "\nsystem P, Q;\n"


QUERIES = [
    "control: A<> P.L2",
    "control: A[] not P.L2",
    "control: A[ not Q.L1 U P.L2 ]",
    "control: A[ not Q.L1 W P.L2 ]",
    "control: A[] (not Q.L1 && A<> P.L2)",
    "control_t*: A<> P.L2",
    "E<> control: A[ not Q.L1 U P.L2 ]",
    "E<> control: A[] not Q.L1",
    "control_t*(3): A[ not Q.L1 U P.L2 ]",
    "control_t*(4, 1): A<> P.L2",
]


@pytest.mark.parametrize(
    "channel",
    [
        "chan",
        pytest.param("urgent chan", marks=pytest.mark.slow),
        pytest.param("urgent broadcast chan", marks=pytest.mark.slow),
    ],
)
def test_strategies_of_random_games_win(channel: str) -> None:
    won = {"controller": 0, "environment": 0}
    for seed in range(RANDOM_GAMES):
        chance = random.Random(seed)
        text = random_model(chance, channel)
        query = chance.choice(QUERIES)
        model = ntagen.load(text)
        try:
            strategy = model.synthesize(query)
        except InputError as error:
            if "has no strategy" not in str(error):
                raise
            continue
        won[strategy.owner] += 1
        try:
            check_wins(strategy, seed)
        except AssertionError as error:
            raise AssertionError(f"game {seed}: {query}\n{text}") from error
    assert min(won.values()) > RANDOM_GAMES // 20


def test_waits_are_exact() -> None:
    chance = random.Random(0)
    model = ntagen.load(
        "clock x; process P() { state A, B; init A;"
        "trans A -u-> B { guard x > 1 && x < 2; }; } system P;"
    )
    play = model.synthesize("control: A[] true").play()
    (reply,) = play.situation().replies
    (window,) = reply.windows
    assert str(window) == "after more than 1 and less than 2"
    assert all(1 < window.chosen(chance) < 2 for _ in range(50))
    play.wait(Fraction(1, 7))
    (reply,) = play.situation().replies
    assert reply.windows[0].first == Fraction(6, 7)
    with pytest.raises(IndexError, match="not possible"):
        play.reply(0, Fraction(6, 7))
    play.reply(0, Fraction(8, 9))
    assert play.state.clocks == {"x": Fraction(1, 7) + Fraction(8, 9)}
