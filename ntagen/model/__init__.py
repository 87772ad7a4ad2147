"""What is in a UPPAAL model, as values: templates with their pictures, processes, variables."""

from __future__ import annotations

from ntagen.model.facts import (
    BranchPoint,
    Channel,
    Clock,
    Edge,
    Facts,
    Location,
    Process,
    Query,
    ScalarSet,
    StateSize,
    Template,
    Variable,
)

__all__ = [
    "BranchPoint",
    "Channel",
    "Clock",
    "Edge",
    "Facts",
    "Location",
    "Process",
    "Query",
    "ScalarSet",
    "StateSize",
    "Template",
    "Variable",
]
