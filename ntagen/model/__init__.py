"""What is in a UPPAAL model, as values: templates with their pictures, processes, variables."""

from __future__ import annotations

from ntagen.model.diagram import BranchPoint, Edge, Location
from ntagen.model.facts import (
    Channel,
    Clock,
    Facts,
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
