"""Strategies in a simulation: playing against one, and what one says of a state.

A play is a course whose moves are those of the user, and those that a strategy allows its owner.
Only waiting is a choice of its own there: until the strategy acts, or for a delay.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from ntagen.checker.play import ENDINGS, Chance, Next, Play, Situation, forecast
from ntagen.checker.runs import State as ExactState
from ntagen.checker.strategy import Advice, Strategy
from ntagen.errors import InputError, ModelError, UndecidedError
from ntagen.simulator.courses import Choice, Done, Move, Offer, State, delay_of, index_of
from ntagen.simulator.network import Network


class GameCourse:
    """A play against a strategy."""

    mode = "game"

    def __init__(self, strategy: Strategy, network: Network) -> None:
        self._network = network
        self._play: Play = strategy.play()
        self._strategy = strategy
        self._situation: Situation | None = None

    @property
    def rival(self) -> str:
        """Who the user is."""
        return "environment" if self._strategy.winning else "controller"

    def state(self) -> State:
        """The state."""
        state = self._play.state
        return {
            "locations": self._network.located(state.locations),
            "variables": state.variables,
            "clocks": {name: str(value) for name, value in state.clocks.items()},
        }

    def offer(self) -> Offer:
        """What can happen in it."""
        now = self._now()
        moves = [
            *(Move(self._network.parts_named(one.edges), one.windows) for one in now.replies),
            *(
                Move(self._network.parts_named(one.edges), one.windows, "strategy")
                for one in now.allowed
            ),
        ]
        winner, then = now.winner, now.next
        end = ""
        if winner is not None:
            end = f"{ENDINGS[then.why]}: the {winner} has won"
        game = {
            "owner": self._strategy.owner,
            "rival": self.rival,
            "query": self._strategy.query,
            "acts": then.kind == "acts",
            "forecast": self._forecast(then),
            "can_wait": winner is None and (then.kind == "acts" or bool(then.delay)),
            "goal": now.goal,
            "is_over": winner is not None,
        }
        return Offer(tuple(moves), end, game)

    def do(self, choice: Choice) -> Done:
        """Makes a step: a move, or waiting."""
        now = self._now()
        self._situation = None
        if choice.get("wait"):
            return self._wait(now, delay_of(choice))
        index, delay = index_of(choice), delay_of(choice)
        every = (*now.replies, *now.allowed)
        if not 0 <= index < len(every):
            raise InputError(f"there is no move {index + 1} here; there are {len(every)}")
        move = every[index]
        delay = move.windows[0].soon() if delay is None else delay
        if not any(delay in one for one in move.windows):
            possible = ", or ".join(map(str, move.windows))
            raise InputError(f"after {delay} this move is not possible: it is possible {possible}")
        parts, replies = self._network.parts_named(move.edges), len(now.replies)
        if index < replies:
            self._play.reply(index, delay)
        else:
            self._play.allow(index - replies, delay)
        who = "you" if index < replies else "strategy"
        return Done({"move": index, "delay": str(delay)}, parts, delay, who)

    def at_random(self, seed: int) -> Choice | None:
        """A random choice for the user; ``None`` if there is nothing to do."""
        now = self._now()
        if now.winner is not None:
            return None
        chosen = Chance(seed).choose(now)
        if chosen is not None:
            move, delay = chosen
            return {"move": (*now.replies, *now.allowed).index(move), "delay": str(delay)}
        is_possible = now.next.kind == "acts" or bool(now.next.delay)
        return {"wait": True} if is_possible else None

    def must_follow(self) -> bool:
        """Whether the strategy acts now, and the user has no choice."""
        now = self._now()
        return now.next.kind == "acts" and now.next.delay == 0 and not now.replies

    def trace_json(self) -> str | None:
        """The play as a trace that ``ntagen verify`` checks."""
        return self._play.trace_json()

    def _now(self) -> Situation:
        if self._situation is None:
            self._situation = self._play.situation()
        return self._situation

    def _wait(self, now: Situation, delay: Fraction | None) -> Done:
        then = now.next
        if delay is None and then.kind == "acts":
            self._play.follow()
            parts = self._network.parts_named(then.edges)
            return Done({"wait": True}, parts, then.delay or Fraction(0), "strategy")
        if delay is None and then.delay:
            delay = then.delay
        if delay is None:
            raise InputError(f"waiting leads nowhere: {self._forecast(then)}")
        if delay not in now.waits:
            raise InputError(f"you cannot wait for {delay}: {self._forecast(then)}")
        self._play.wait(delay)
        return Done({"wait": True, "delay": str(delay)}, (), delay, "time")

    def _forecast(self, then: Next) -> str:
        """What happens if the user only waits."""
        return forecast(then, self._strategy.owner, self._network.told_of)


class Adviser:
    """Says which moves a strategy makes or allows in a state with exact times.

    Attributes:
        query: The query that the strategy answers.
    """

    def __init__(self, strategy: Strategy, network: Network) -> None:
        self._strategy = strategy
        self._network = network
        self.query = strategy.query

    def advice(self, state: State, time: Fraction, moves: Sequence[Move]) -> dict[str, Any]:
        """What it says: ``text``, and in ``moves`` when it takes those of these that it may."""
        marks = ["" for _ in moves]
        known = {"query": self.query, "owner": self._strategy.owner, "moves": marks}
        clocks = {name: Fraction(value) for name, value in state["clocks"].items()}
        locations = self._network.location_names(state["locations"])
        exact = ExactState(locations, state["variables"], clocks)
        since = time if self._strategy.time_limit is not None else None
        try:
            found = self._strategy.allowed(exact, time=since)
        except (UndecidedError, ModelError) as error:
            return known | {"text": str(error).partition("\n")[0]}
        for one in found:
            self._mark(one, moves, marks)
        return known | {"text": "; ".join(map(self._said, found))}

    def _mark(self, advice: Advice, moves: Sequence[Move], marks: list[str]) -> None:
        edges = advice.edges if advice.kind == "act" else advice.then
        if not edges:
            return
        parts = self._network.parts_named(edges)
        for index, one in enumerate(moves):
            if one.parts == parts:
                is_now = advice.kind == "act" or not advice.delay
                marks[index] = "now" if is_now else f"after {advice.delay}"

    def _said(self, advice: Advice) -> str:
        if advice.kind == "done":
            return "play is over, and won"
        if advice.kind == "act":
            return f"take {self._network.told_of(advice.edges)}"
        if advice.delay is None:
            return "wait"
        if not advice.then:
            return f"wait {advice.delay}"
        return f"wait {advice.delay}, then take {self._network.told_of(advice.then)}"
