"""What the page shows of a history: the state, its moves, and new steps."""

from __future__ import annotations

from itertools import islice
from typing import Any, Final

from ntagen.checker.play import Window
from ntagen.errors import ModelError
from ntagen.simulator.courses import Move, Offer, State, zone_of
from ntagen.simulator.games import Adviser
from ntagen.simulator.history import Entry, History

MOST_CONSTRAINTS: Final = 200
"""At most so many constraints of a zone are listed; nobody reads more."""


MOST_VALUES: Final = 5000
"""At most so many variables are shown; arrays may have millions of parts."""


def view(history: History, known: int, adviser: Adviser | None) -> dict[str, Any]:
    """The view.

    Args:
        history: The history.
        known: How many steps of its way the page has.
        adviser: Who says which moves a strategy allows.
    """
    problem, offer = "", Offer(())
    try:
        offer = history.offer()
    except ModelError as error:
        problem = f"{error}\nhint: step back, and take another way"
    advice, here = None, history.here
    if adviser is not None and history.mode == "exact":
        advice = adviser.advice(here.state, here.time, offer.moves)
    new = history.entries[known + 1 :]
    return {
        "mode": history.mode,
        "position": history.position,
        "known": known,
        "steps": [_step(one) for one in new],
        "state": _state(here.state),
        "time": str(here.time),
        "moves": [_move(one) for one in offer.moves],
        "end": offer.end,
        "problem": problem,
        "game": offer.game,
        "advice": advice,
        "keep": {
            "mode": history.mode,
            "position": history.position,
            "known": known,
            "choices": [one.done.choice for one in new if one.done is not None],
        },
    }


def _state(state: State) -> dict[str, Any]:
    zone, variables = zone_of(state), state["variables"]
    shown = state
    if len(variables) > MOST_VALUES:
        shown = shown | {"variables": dict(islice(variables.items(), MOST_VALUES))}
    if zone is not None:
        more = len(zone[MOST_CONSTRAINTS:])
        shown = shown | {"zone": zone[:MOST_CONSTRAINTS], "more": more}
    return shown | {"more_values": max(0, len(variables) - MOST_VALUES)}


def _move(move: Move) -> dict[str, Any]:
    windows = move.windows
    return {
        "parts": move.parts,
        "windows": None if windows is None else list(map(str, windows)),
        "spans": None if windows is None else [_span(one) for one in windows],
        "who": move.who,
    }


def _span(window: Window) -> list[Any]:
    """A window as the page compares delays with it."""
    last = None if window.last is None else str(window.last)
    return [str(window.first), window.after_first, last, window.before_last]


def _step(entry: Entry) -> dict[str, Any]:
    done = entry.done
    if done is None:
        return {}
    delay = None if done.delay is None else str(done.delay)
    return {"parts": done.parts, "delay": delay, "who": done.who, "time": str(entry.time)}
