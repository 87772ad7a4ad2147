"""The engine with Python types: verdicts, traces, strategies and plans of UPPAAL models.

The engine is the Rust crate in ``checker/``; this package only gives its answers Python types. It
works for any model and knows nothing of needles. `model` loads a model; `facts`, `picture` and
`states` show what is in it. Queries have answers (`answer`) with runs (`runs`), strategies
(`strategy`, `machine`) and plays against them (`play`).
"""

from ntagen.checker.answer import Answer, Extreme, Place, Value, Verdict
from ntagen.checker.edges import EngineEdge, EnginePlan, EngineStep
from ntagen.checker.errors import RejectedError
from ntagen.checker.model import (
    HEURISTICS,
    MAX_PLANS,
    CodeEngine,
    Model,
    OverflowRule,
    PlansWanted,
    Progress,
    SearchOrder,
    TraceWanted,
    diagnostic_pages,
    load,
    load_file,
)
from ntagen.checker.states import Simulation, SymbolicState

__all__ = [
    "HEURISTICS",
    "MAX_PLANS",
    "Answer",
    "CodeEngine",
    "EngineEdge",
    "EnginePlan",
    "EngineStep",
    "Extreme",
    "Model",
    "OverflowRule",
    "Place",
    "PlansWanted",
    "Progress",
    "RejectedError",
    "SearchOrder",
    "Simulation",
    "SymbolicState",
    "TraceWanted",
    "Value",
    "Verdict",
    "diagnostic_pages",
    "load",
    "load_file",
]
