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
    SearchOrder,
    TraceWanted,
)
from ntagen.checker.query_form import QueryForm, form_of
from ntagen.checker.states import Simulation, SymbolicState

__all__ = [
    "HEURISTICS",
    "MAX_PLANS",
    "REDUCTIONS",
    "Answer",
    "CodeEngine",
    "EngineEdge",
    "EnginePlan",
    "EngineStep",
    "Extreme",
    "Model",
    "Options",
    "OverflowRule",
    "Place",
    "PlansWanted",
    "Progress",
    "QueryForm",
    "RejectedError",
    "SearchOrder",
    "Simulation",
    "SymbolicState",
    "TraceWanted",
    "Value",
    "Verdict",
    "diagnostic_pages",
    "form_of",
    "load",
    "load_file",
]
