"""Prints what Storm and Momba say of models in JANI, as JSON; run by `exchange.py`.

    PYTHON exchange_storm.py MODEL.jani...

PYTHON is that of an environment with ``stormpy`` (2.0) and ``momba`` (0.6). For each model: the
number of states and the values of the properties of Storm, which knows no timed automata, and the
number of combinations of locations and variables of Momba.
"""

from __future__ import annotations

import contextlib
import json
import sys
import warnings
from pathlib import Path
from typing import Any


def of_storm(path: str) -> dict[str, Any]:
    """The states and the values of the properties."""
    import stormpy

    model, properties = stormpy.parse_jani_model(path)
    built = stormpy.build_model(model, properties)
    first = built.initial_states[0]
    values = {
        one.get_name(): stormpy.model_checking(built, one).get_value(first) for one in properties
    }
    return {"states": stormpy.build_model(model).nr_states, "values": values}


def of_momba(path: str) -> dict[str, Any]:
    """The combinations of locations and variables."""
    from momba import engine, jani
    from momba.engine import time

    network = jani.load_model(Path(path).read_text("utf-8"))
    is_untimed = network.ctx.model_type.is_untimed
    explorer = engine.Explorer(network, engine.DiscreteTime if is_untimed else time.ZoneF64)
    waiting, seen = list(explorer.initial_states), set()
    while waiting:
        state = waiting.pop()
        places = sorted((a.automaton.name, l.name) for a, l in state.locations.items())  # noqa: E741
        values = sorted((name, str(value)) for name, value in state.global_env.items())
        zone = [] if is_untimed else sorted(map(str, state.valuations.zone.constraints))
        key = str(places), str(values), str(zone)
        if key not in seen:
            seen.add(key)
            waiting += [
                one.state
                for transition in state.transitions
                for one in transition.destinations.support
            ]
    return {"states": len({key[:2] for key in seen})}


def main() -> None:
    """Prints one object for each model, by its path."""
    warnings.simplefilter("ignore")
    found: dict[str, dict[str, Any]] = {}
    for path in sys.argv[1:]:
        found[path] = {}
        for tool, ask in (("storm", of_storm), ("momba", of_momba)):
            with contextlib.redirect_stdout(sys.stderr):
                try:
                    found[path][tool] = ask(path)
                except Exception as error:  # whatever the tool raises is its answer
                    found[path][tool] = {"error": f"{type(error).__name__}: {error}"[:80]}
    print(json.dumps(found))


main()
