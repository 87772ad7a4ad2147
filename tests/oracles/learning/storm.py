"""Storm, asked for the best value of a model in the language of PRISM.

It is a peer that others wrote, and no part of ntagen: `pip install stormpy`.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path


@dataclass(frozen=True)
class StormAnswer:
    """A value, the number of states, and how long it took to build them and to compute it."""

    value: Fraction | float
    states: int
    build_s: float
    solve_s: float


def value_of(model: Path, question: str, *, is_exact: bool) -> StormAnswer:
    """The value of the initial state.

    It is a fraction, or else a double from a method that bounds its error.
    """
    import stormpy

    start = time.perf_counter()
    program = stormpy.parse_prism_program(str(model))
    (wanted,) = stormpy.parse_properties(question, program)
    build = stormpy.build_model[stormpy.Rational] if is_exact else stormpy.build_model
    states = build(program, [wanted])
    middle = time.perf_counter()
    found = stormpy.model_checking(states, wanted).get_value(states.initial_states[0])
    end = time.perf_counter()
    value = Fraction(str(found)) if is_exact else float(found)
    return StormAnswer(value, states.nr_states, middle - start, end - middle)
