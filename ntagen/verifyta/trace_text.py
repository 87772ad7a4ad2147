"""Traces as text, in the form that verifyta 5 prints.

A concrete trace has exact times: a state with the values of clocks, a delay if time passes, the
edges that are taken. A symbolic trace has the constraints of each zone instead.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from decimal import Decimal, localcontext
from typing import TYPE_CHECKING, Any, Final

from ntagen.verifyta.trace import as_assigned

if TYPE_CHECKING:
    from ntagen.checker import Answer

_DIGITS: Final = 12
"""The most digits of a time."""


def trace_text(answer: Answer, *, symbolic: bool, has_stopwatches: bool) -> str | None:
    """The first trace of an answer.

    Args:
        answer: The answer.
        symbolic: Whether to give the zones. They are also given if there are no exact times.
        has_stopwatches: Whether clocks of the model may stand still. The states after delays are
            left out then.

    Returns:
        The text; ``None`` if there is no trace.
    """
    text = answer.trace_json()
    if text is None:
        return None
    raw = json.loads(text)
    first = raw["traces"][0] if "traces" in raw else raw
    is_concrete = "run" in first and not symbolic
    if is_concrete:
        return "".join(_concrete(first["run"], after_delays=not has_stopwatches))
    return "".join(_symbolic(first))


def _symbolic(trace: dict[str, Any]) -> Iterator[str]:
    for index, state in enumerate(trace["states"]):
        yield _state(state, state["zone"])
        if index < len(trace["transitions"]):
            yield _transition(trace["transitions"][index])


def _concrete(run: dict[str, Any], *, after_delays: bool) -> Iterator[str]:
    unit = run["ticks_per_unit"]
    for index, step in enumerate(run["steps"]):
        state = run["states"][index]
        yield _state(state, _clocks(state, 0, unit))
        if step["wait"]:
            yield f"\nDelay: {_number(step['wait'], unit)}\n"
            if after_delays:
                yield _state(state, _clocks(state, step["wait"], unit))
        yield _transition(step["edges"])
    last = run["states"][len(run["steps"])]
    yield _state(last, _clocks(last, 0, unit))
    wait = run["end"].get("wait")
    if wait:
        yield f"\nDelay: {_number(wait, unit)}\n"
        if len(run["states"]) > len(run["steps"]) + 1:
            final = run["states"][-1]
            yield _state(final, _clocks(final, 0, unit))


def _clocks(state: dict[str, Any], later: int, unit: int) -> list[str]:
    return [f"{name}={_number(value + later, unit)}" for name, value in state["clocks"].items()]


def _number(ticks: int, unit: int) -> str:
    """A time as decimal number."""
    with localcontext(prec=_DIGITS):
        return f"{(Decimal(ticks) / unit).normalize():f}"


def _state(state: dict[str, Any], clocks: list[str]) -> str:
    places = " ".join(f"{process}.{place}" for process, place in state["locations"].items())
    values = [f"{name}={value}" for name, value in state["variables"].items()]
    return f"\nState:\n( {places} )\n{' '.join([*values, *clocks])}\n"


def _transition(edges: list[dict[str, Any]]) -> str:
    return "\nTransition:\n" + "".join(f"  {_edge(edge)}\n" for edge in edges)


def _edge(edge: dict[str, Any]) -> str:
    ends = f"{edge['process']}.{edge['source']}->{edge['process']}.{edge['target']}"
    labels = [edge["guard"] or "1", edge["sync"] or "tau", as_assigned(edge["update"]) or "1"]
    chosen = "".join(f" [{name}={value}]" for name, value in edge["select"].items())
    return f"{ends} {{ {', '.join(labels)} }}{chosen}"
