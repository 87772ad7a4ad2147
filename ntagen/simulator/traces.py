"""Traces in the format of ``ntagen check --trace``: read into steps, and written from a history."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from fractions import Fraction
from math import lcm
from typing import Any, Final

from ntagen.errors import InputError
from ntagen.simulator.following import Timed
from ntagen.simulator.history import Entry
from ntagen.simulator.network import Network
from ntagen.values import dataclass

_FORMAT: Final = "ntagen-trace"
_FINEST: Final = 2**30
"""The check of traces knows no finer ticks."""

_HINT: Final = "hint: give a file that `ntagen check --trace FILE.json` wrote"


@dataclass(frozen=True, slots=True)
class Trace:
    """What a simulation takes from a trace.

    Attributes:
        steps: The moves, each with the delay before it; ``None`` without exact times.
        is_exact: Whether it has exact times.
        note: How the trace goes on after its last state; empty if there is nothing to say.
    """

    steps: tuple[Timed, ...]
    is_exact: bool
    note: str


def read(text: str, network: Network) -> Trace:
    """Reads a trace; of several in one file, the first.

    Raises:
        InputError: It is none, or not one of this model.
    """
    try:
        whole = json.loads(text)
    except (ValueError, RecursionError):
        raise InputError(f"this is no trace: it is not JSON\n{_HINT}") from None
    if not isinstance(whole, dict) or whole.get("format") != _FORMAT:
        raise InputError(f"this is no trace: its format is not {_FORMAT}\n{_HINT}")
    try:
        one = whole["traces"][0] if "traces" in whole else whole
        return _exact(one, network) if "run" in one else _symbolic(one, network)
    except (LookupError, TypeError, ValueError, AttributeError, ZeroDivisionError):
        raise InputError(f"this trace is incomplete\n{_HINT}") from None


def _exact(trace: Mapping[str, Any], network: Network) -> Trace:
    run = trace["run"]
    unit = int(run["ticks_per_unit"])
    waited = Fraction(0)
    steps: list[Timed] = []
    for step in run["steps"]:
        # A play may wait without a move; a simulation waits before its next one.
        waited += Fraction(int(step["wait"]), unit)
        if step["edges"]:
            steps.append((network.parts(step["edges"]), waited))
            waited = Fraction(0)
    end = run["end"]
    said = {
        "loop": f"from here on the trace goes on as after step {end.get('state')}, for ever",
        "waits": "from here on time passes for ever",
        "stuck": "nothing is possible any more",
    }
    note = said.get(end["kind"], "")
    if wait := waited + Fraction(int(end.get("wait") or 0), unit):
        note = f"the trace waits {wait} here" + (f"; then {note}" if note else "")
    return Trace(tuple(steps), True, _with_failure(note, trace, network))


def _symbolic(trace: Mapping[str, Any], network: Network) -> Trace:
    steps = tuple((network.parts(edges), None) for edges in trace["transitions"])
    ending = trace.get("ending", {})
    said = {
        "loop": f"from here on the trace goes on as after step {ending.get('loop')}, for ever",
        "waits": "from here on time passes for ever",
        "stuck": "nothing is possible any more",
    }
    return Trace(steps, False, _with_failure(said.get(ending.get("kind"), ""), trace, network))


def _with_failure(note: str, trace: Mapping[str, Any], network: Network) -> str:
    if "failing" not in trace:
        return note
    move = network.told(network.parts(trace["failing"]))
    return f"the model fails in the next step of the trace: {move}"


def written(entries: Sequence[Entry], network: Network) -> str:
    """The trace of a history with exact times; ``ntagen verify`` checks it.

    Its query is ``E<> true``: a run of the model is all that it shows.

    Raises:
        InputError: Its delays have no common unit that is not too fine.
    """
    steps = [one.done for one in entries if one.done is not None]
    unit = lcm(*((one.delay or Fraction(0)).denominator for one in steps))
    if unit > _FINEST:
        raise InputError(
            "the delays of this run have no common unit that is not too fine\n"
            "hint: choose coarser delays, such as 1/2 or 1.5"
        )
    run = {
        "ticks_per_unit": unit,
        "steps": [
            {
                "wait": int((one.delay or 0) * unit),
                "edges": network.edges_json(one.parts),
            }
            for one in steps
        ],
        "end": {"kind": "after", "wait": 0},
        "from": {"state": 0, "wait": 0},
        "states": [_state(one.state, network, unit) for one in entries],
    }
    whole = {"format": _FORMAT, "version": 1, "query": "E<> true", "run": run}
    return json.dumps(whole)


def _state(state: Mapping[str, Any], network: Network, unit: int) -> dict[str, Any]:
    return {
        "locations": network.location_names(state["locations"]),
        "variables": state["variables"],
        "clocks": {name: int(Fraction(value) * unit) for name, value in state["clocks"].items()},
    }
