"""How UPPAAL writes what ntagen keeps as the model has it."""

from __future__ import annotations

import re
from typing import Final

_ASSIGNMENT: Final = re.compile(r"\s*(?<![=!<>:+\-*/%&|^])=(?!=)\s*")


def as_assigned(update: str) -> str:
    """An update with ``:=`` for the assignments that the model writes with ``=``."""
    return _ASSIGNMENT.sub(" := ", update)
