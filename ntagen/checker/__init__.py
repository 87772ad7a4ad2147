"""The engine with Python types: verdicts, traces, strategies and plans of UPPAAL models.

The engine is the Rust crate in ``checker/``; this package only gives its answers Python types. It
works for any model and knows nothing of needles. `model` loads a model; `facts`, `picture` and
`states` show what is in it. Queries have answers (`answer`) with runs (`runs`), strategies
(`strategy`, `learned`, `machine`) and plays against them (`play`). What only some answers need is
imported when it is used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ntagen.checker.answer import (
    Answer,
    Estimate,
    Extreme,
    Interrupted,
    Optimised,
    Place,
    Shielded,
    Value,
    Verdict,
)
from ntagen.checker.edges import EngineEdge, EnginePlan, EngineStep
from ntagen.checker.errors import RejectedError
from ntagen.checker.model import (
    HEURISTICS,
    Model,
    OverflowRule,
    diagnostic_pages,
    load,
    load_file,
)
from ntagen.checker.options import (
    MAX_PLANS,
    REDUCTIONS,
    CodeEngine,
    Options,
    PlansWanted,
    Progress,
    RunProgress,
    SearchOrder,
    StrategyWanted,
    TraceWanted,
)
from ntagen.checker.queries import (
    Expected,
    QueryForm,
    expected_of,
    form_of,
    is_as_expected,
    remark_of,
)

if TYPE_CHECKING:
    from ntagen.checker.distribution import Cumulative, Distribution, Histogram
    from ntagen.checker.learned import LearnedStrategy
    from ntagen.checker.states import Simulation, SymbolicState
    from ntagen.checker.trajectories import OverTime, Trajectory

__all__ = [
    "HEURISTICS",
    "MAX_PLANS",
    "REDUCTIONS",
    "Answer",
    "CodeEngine",
    "Cumulative",
    "Distribution",
    "EngineEdge",
    "EnginePlan",
    "EngineStep",
    "Estimate",
    "Expected",
    "Extreme",
    "Histogram",
    "Interrupted",
    "LearnedStrategy",
    "Model",
    "Optimised",
    "Options",
    "OverTime",
    "OverflowRule",
    "Place",
    "PlansWanted",
    "Progress",
    "QueryForm",
    "RejectedError",
    "RunProgress",
    "SearchOrder",
    "Shielded",
    "Simulation",
    "StrategyWanted",
    "SymbolicState",
    "TraceWanted",
    "Trajectory",
    "Value",
    "Verdict",
    "diagnostic_pages",
    "expected_of",
    "form_of",
    "is_as_expected",
    "load",
    "load_file",
    "remark_of",
]


_HOMES = {
    "Cumulative": "distribution",
    "Distribution": "distribution",
    "Histogram": "distribution",
    "LearnedStrategy": "learned",
    "OverTime": "trajectories",
    "Simulation": "states",
    "SymbolicState": "states",
    "Trajectory": "trajectories",
}
"""Where the names are that only some answers need."""


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
