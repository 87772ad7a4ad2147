"""Names that another format can have, each once."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final

UPPAAL_WORDS: Final = frozenset(
    [
        "const",
        "guard",
        "sync",
        "assign",
        "probability",
        "process",
        "state",
        "branchpoint",
        "init",
        "trans",
        "urgent",
        "commit",
        "broadcast",
        "priority",
        "bool",
        "double",
        "chan",
        "clock",
        "void",
        "system",
        "true",
        "false",
        "and",
        "or",
        "not",
        "imply",
        "int",
        "scalar",
        "location",
        "select",
        "for",
        "while",
        "do",
        "if",
        "else",
        "default",
        "return",
        "typedef",
        "struct",
        "import",
        "meta",
        "before_update",
        "after_update",
        "progress",
        "gantt",
        "assert",
        "IO",
        "string",
        "hybrid",
        "dynamic",
        "spawn",
        "exit",
        "query",
        "forall",
        "exists",
        "sum",
        "xor",
        "deadlock",
        "control",
        "control_t",
        "minE",
        "maxE",
        "minPr",
        "maxPr",
        "loadStrategy",
        "saveStrategy",
        "under",
        "imitate",
        "strategy",
        "simulate",
        "sat",
        "Pmax",
        "Pr",
        "numOf",
        "foreach",
        "sup",
        "inf",
        "bounds",
        "abs",
        "random",
    ]
)
"""The words that name nothing in models or queries (`checker/src/syntax/keywords.rs`)."""


class Names:
    """Gives names that are not taken yet.

    Args:
        taken: Names that are taken.
    """

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._taken = set(taken)

    def fresh(self, wanted: str) -> str:
        """The name that is wanted, or one like it; it is taken from then on."""
        # Train(3).x becomes Train_3_x.
        base = re.sub(r"\W", "_", re.sub(r"[)\]]", "", wanted))
        if not re.match(r"[A-Za-z_]", base):
            base = f"_{base}"
        name, number = base, 2
        while name in self._taken:
            name, number = f"{base}_{number}", number + 1
        self._taken.add(name)
        return name
