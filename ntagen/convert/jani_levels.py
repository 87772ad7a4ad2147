"""In which order assignments count, as JANI's indexes.

JANI runs assignments with the same index at once, and those with greater ones later. An update of
UPPAAL gets a greater index than those before it where one reads or writes what the other writes.
"""

from __future__ import annotations

from collections.abc import Sequence

from ntagen.convert.expressions import Assign, Expr, Index, Name, names


def levels_of(updates: Sequence[Assign]) -> list[int]:
    """The index of each update, as small as what depends on what allows."""
    levels: list[int] = []
    for number, one in enumerate(updates):
        level = 0
        for before, other in zip(levels, updates[:number], strict=True):
            if base_of(other.target) in _read(one) | {base_of(one.target)}:
                level = max(level, before + 1)
            elif base_of(one.target) in _read(other):
                level = max(level, before)
        levels.append(level)
    return levels


def depends(first: Sequence[Assign], second: Sequence[Assign]) -> bool:
    """Whether it makes a difference that the first updates come before the second ones."""
    writes = {base_of(one.target) for one in first}
    reads = set().union(*(_read(one) for one in first), set())
    later_writes = {base_of(one.target) for one in second}
    later_reads = set().union(*(_read(one) for one in second), set())
    return bool(writes & (later_reads | later_writes)) or bool(reads & later_writes)


def _read(update: Assign) -> set[str]:
    """The names that an update reads: those of its value, and of the indexes of its target."""
    found = names(update.value)
    target = update.target
    while isinstance(target, Index):
        found |= names(target.index)
        target = target.base
    return found


def base_of(target: Expr) -> str:
    """The name of the variable, array or struct that an assignment writes."""
    while not isinstance(target, Name):
        target = target.base  # type: ignore[union-attr]
    return target.text
