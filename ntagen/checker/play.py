"""Plays against a strategy: what can happen in a state, and the moves of both sides.

The strategy acts by itself at the first moment at which it does not wait; its opponent may move
before. If both can move at the same instant, the environment is first. The engine's independent
check computes the possible moves, not the solver that found the strategy.
"""

from __future__ import annotations

import contextlib
import json
import math
import random
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Final, Literal

import ntagen._checker as _checker
from ntagen.checker.errors import failing
from ntagen.checker.runs import Edge, Run, State, edges_of, runs_of, state_of
from ntagen.errors import InputError

__all__ = [
    "ENDINGS",
    "Chance",
    "Next",
    "Play",
    "Reply",
    "Situation",
    "Window",
    "delay_from",
    "forecast",
    "played",
]

_DELAY: Final = re.compile(r" *-?[0-9]{0,18}([./][0-9]{1,18})?(e-?[0-9]{1,3})? *")

_OPEN_UNITS = 5
"""In a window without end, a random delay is within this many units of its start."""

_FINEST = 2**20
"""The greatest denominator of a random delay."""


@dataclass(frozen=True, slots=True)
class Window:
    """An interval of delays, in units of the model's time.

    Attributes:
        first: The start of the interval.
        after_first: Whether the start itself is excluded.
        last: The end of the interval; ``None`` without an end.
        before_last: Whether the end itself is excluded.
    """

    first: Fraction
    after_first: bool
    last: Fraction | None
    before_last: bool

    def __contains__(self, delay: Fraction | int) -> bool:
        is_in = delay > self.first if self.after_first else delay >= self.first
        if self.last is None:
            return is_in
        return is_in and (delay < self.last if self.before_last else delay <= self.last)

    def soon(self) -> Fraction:
        """The first delay in it; if there is no first one, a delay soon after the start."""
        if not self.after_first:
            return self.first
        return self.first + (Fraction(1) if self.last is None else (self.last - self.first) / 2)

    def chosen(self, chance: random.Random) -> Fraction:
        """A random delay in it, a coarse fraction of a unit; a short one if there is no end."""
        end = self.first + _OPEN_UNITS if self.last is None else self.last
        parts = chance.choice((1, 2, 4))
        while parts <= _FINEST:
            grid = range(math.ceil(self.first * parts), math.floor(end * parts) + 1)
            delays = [delay for one in grid if (delay := Fraction(one, parts)) in self]
            if delays:
                return chance.choice(delays)
            parts *= 2
        return self.soon()

    def __str__(self) -> str:
        if self.first == self.last:
            return f"after {self.first}" if self.first else "now"
        if not self.first and not self.after_first:
            if self.last is None:
                return "at any time"
            return f"{'before' if self.before_last else 'within'} {self.last}"
        begin = f"after {'more than ' * self.after_first}{self.first}"
        if self.last is None:
            return begin if self.after_first else f"{begin} or later"
        return f"{begin} {'and less than' if self.before_last else 'up to'} {self.last}"


@dataclass(frozen=True, slots=True)
class Reply:
    """A move of one of the players.

    Attributes:
        edges: The edges that are taken together, the sender's first.
        windows: The delays after which it is possible, in ascending order.
    """

    edges: tuple[Edge, ...]
    windows: tuple[Window, ...]


@dataclass(frozen=True, slots=True)
class Next:
    """What happens next if the strategy's opponent does not move.

    Attributes:
        kind: ``acts``: the strategy takes `edges`. ``won``: play is over, and `winner` has won.
            ``must``: the opponent has to move before. ``fails``: the strategy has no next move
            (`why`), so that it does not keep its promise.
        delay: The time until then; ``None`` if time passes for ever.
        edges: The edges that the strategy takes.
        winner: Who has won.
        why: Why play is over: ``goal`` (the goal holds), ``broken`` (a condition that must be kept
            does not hold), ``stopped`` (time cannot pass and nobody has to move) or ``endless``
            (time passes for ever); or what the strategy lacks.
    """

    kind: Literal["acts", "won", "must", "fails"]
    delay: Fraction | None
    edges: tuple[Edge, ...] = ()
    winner: Literal["controller", "environment"] | None = None
    why: str = ""


@dataclass(frozen=True, slots=True)
class Situation:
    """What can happen in a state of a play.

    Attributes:
        replies: The moves of the strategy's opponent.
        allowed: The moves that a permissive strategy allows its owner.
        waits: The delays for which the opponent can only wait before something happens.
        next: What happens if the opponent does not move.
        goal: Whether the goal of the query holds now.
    """

    replies: tuple[Reply, ...]
    allowed: tuple[Reply, ...]
    waits: Window
    next: Next
    goal: bool

    @property
    def winner(self) -> Literal["controller", "environment"] | None:
        """The winner, if play is over now: it is decided, or there are no moves left."""
        if self.next.kind != "won":
            return None
        is_decided = self.next.why in ("goal", "broken") and self.next.delay == 0
        is_at_end = self.next.delay in (0, None) and not self.replies and not self.allowed
        return self.next.winner if is_decided or is_at_end else None


class Chance:
    """Plays the opponent's side at random; the same seed makes the same choices."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)

    def choose(self, situation: Situation) -> tuple[Reply, Fraction] | None:
        """A random move and its delay; it may be a move that a permissive strategy allows.

        Returns:
            ``None`` to only wait.
        """
        options = [
            (one, window)
            for one in (*situation.replies, *situation.allowed)
            for window in one.windows
        ]
        # A choice that ends play is taken only if there is no other.
        must_move = situation.next.kind == "must" or situation.next.why in ("stopped", "endless")
        if not options or not (must_move or self._random.randrange(len(options) + 1)):
            return None
        move, window = self._random.choice(options)
        return move, window.chosen(self._random)


class Play:
    """A play against a strategy; it begins in the initial state.

    The caller is the opponent of the strategy: `reply` and `wait` are its steps, `follow` lets the
    strategy act. A permissive strategy waits as long as it may, unless `allow` makes it move. If
    the controller's strategy takes an edge to a branch point, its legs are among the replies.
    """

    def __init__(self, raw: _checker.Play) -> None:
        self._raw = raw

    def __len__(self) -> int:
        """The number of steps: moves, and waits without a move."""
        return self._raw.length

    @property
    def state(self) -> State:
        """The state."""
        text, unit = self._raw.state_json()
        return state_of(json.loads(text), unit)

    def situation(self) -> Situation:
        """What can happen in the state.

        Raises:
            ModelError: The model fails in it.
        """
        with _refusing():
            raw = json.loads(self._raw.situation_json())
        unit = raw["ticks_per_unit"]
        then = raw["next"]
        return Situation(
            replies=tuple(_reply(one, unit) for one in raw["replies"]),
            allowed=tuple(_reply(one, unit) for one in raw["allowed"]),
            waits=_window(raw["waits"], unit),
            next=Next(
                kind=then["kind"],
                delay=None if raw["ticks"] is None else Fraction(raw["ticks"], unit),
                edges=edges_of(then.get("edges", ())),
                winner=then.get("winner"),
                why=then.get("by") or then.get("gap", ""),
            ),
            goal=raw["goal"],
        )

    def reply(self, index: int, delay: Fraction | int) -> None:
        """Waits, and then makes the reply with this index.

        Raises:
            IndexError: It is not possible at all, or not after this delay.
            InputError: The delay is too fine a fraction.
            ModelError: The model fails in it.
        """
        self._step(delay, reply=index)

    def allow(self, index: int, delay: Fraction | int) -> None:
        """Waits, and then lets a permissive strategy make the allowed move with this index.

        Raises:
            IndexError: It is not allowed at all, or not after this delay.
            InputError: The delay is too fine a fraction.
            ModelError: The model fails in it.
        """
        self._step(delay, allowed=index)

    def wait(self, delay: Fraction | int) -> None:
        """Only waits.

        Raises:
            IndexError: Something else happens during this delay.
            InputError: The delay is too fine a fraction.
            ModelError: The model fails in it.
        """
        self._step(delay)

    def follow(self) -> None:
        """Waits until the strategy acts, and lets it act; at a branch point on the first leg.

        Raises:
            IndexError: It does not act next.
            ModelError: The model fails in it.
        """
        with _refusing():
            self._raw.follow()

    def undo(self, length: int) -> None:
        """Takes back the last steps, until only this many are left."""
        self._raw.undo(max(length, 0))

    def trace_json(self) -> str | None:
        """The play so far as a trace that ``ntagen verify`` checks.

        ``None`` if a common time unit of all delays would be too fine.
        """
        with _refusing():
            return self._raw.trace_json()

    def _step(
        self, delay: Fraction | int, *, reply: int | None = None, allowed: int | None = None
    ) -> None:
        exact = Fraction(delay)
        if (reply or allowed or 0) < 0:
            raise IndexError("a move has no negative index")
        with _refusing():
            try:
                self._raw.pass_time(
                    exact.numerator, exact.denominator, reply=reply, allowed=allowed
                )
            except OverflowError:
                raise InputError(f"the delay {exact} is too long or too fine a fraction") from None


ENDINGS: Final = {
    "goal": "the goal holds",
    "broken": "the condition that the controller must keep does not hold any more",
    "stopped": "time cannot pass, and nobody moves",
    "endless": "time passes for ever, and nobody moves",
}
"""Why play is over, in words, by `Next.why`."""


def forecast(then: Next, owner: str, told: Callable[[Sequence[Edge]], str]) -> str:
    """Says what happens if the opponent of a strategy only waits.

    Args:
        then: What happens.
        owner: Whose strategy it is.
        told: Says a move in words.
    """
    when = "at once" if then.delay == 0 else f"after {then.delay}"
    if then.kind == "acts":
        waits = "" if then.delay == 0 else "waits, and "
        return f"the {owner} {waits}{when} takes {told(then.edges)}"
    if then.kind == "must":
        return f"the {owner} waits; you must move before time stops"
    if then.kind == "fails":
        return f"{when} the strategy has no next move: {then.why}"
    outcome = {
        "goal": f"{when} the goal holds, and the {then.winner} wins",
        "broken": f"{when} the condition to keep does not hold, and the {then.winner} wins",
        "stopped": f"{when} time cannot pass; if nobody moves the {then.winner} wins",
        "endless": f"if nobody ever moves the {then.winner} wins",
    }[then.why]
    return f"the {owner} waits; {outcome}"


def delay_from(text: str) -> Fraction:
    """The delay that a user has typed, such as ``2``, ``3/2`` or ``1.5``.

    Raises:
        InputError: It is no such number, or negative.
    """
    try:
        # A long exponent would make a number that takes for ever.
        delay = Fraction(text if _DELAY.fullmatch(text) else "")
    except (ValueError, ZeroDivisionError):
        raise InputError(f"{text} is not a delay: write a number such as 2, 3/2 or 1.5") from None
    if delay < 0:
        raise InputError("a delay cannot be negative")
    return delay


def played(play: Play, steps: int, seed: int) -> Run:
    """The run of a play of at most `steps` steps, in which the opponent moves at random.

    Raises:
        InputError: A common unit of all delays would be too fine.
        ModelError: The model fails in a state of the play.
    """
    chance = Chance(seed)
    while len(play) < steps:
        situation = play.situation()
        then = situation.next
        if situation.winner is not None:
            break
        chosen = chance.choose(situation)
        if chosen is not None:
            move, delay = chosen
            if move in situation.replies:
                play.reply(situation.replies.index(move), delay)
            else:
                play.allow(situation.allowed.index(move), delay)
        elif then.kind == "acts":
            play.follow()
        elif then.kind == "won" and then.delay:
            play.wait(then.delay)
        else:
            break
    text = play.trace_json()
    if text is None:
        raise InputError(
            "the delays of this run have no common unit that is not too fine\n"
            "hint: ask for fewer steps, or for another seed"
        )
    return runs_of(json.loads(text))[0]


@contextlib.contextmanager
def _refusing() -> Iterator[None]:
    """Turns the engine's errors into ours."""
    try:
        with failing():
            yield
    except ValueError as error:
        raise InputError(str(error)) from None


def _reply(raw: dict[str, Any], unit: int) -> Reply:
    return Reply(edges_of(raw["edges"]), tuple(_window(window, unit) for window in raw["windows"]))


def _window(raw: list[Any], unit: int) -> Window:
    first, after_first, last, before_last = raw
    end = None if last is None else Fraction(last, unit)
    return Window(Fraction(first, unit), after_first, end, before_last)
