"""Sweeps: rows that differ in one quantity only, and what they show.

The rows of a sweep have the same seeds. So two values are compared on the same tissue with the same
draws, and curves are smoother than those of other runs would be. The runs of two values are
therefore not independent: an interval says something about its own value only.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ntagen.experiment.description import Row
from ntagen.parameters import BY_FIELD, Parameter


@dataclass(frozen=True, slots=True)
class Sweep:
    """Rows that differ in one quantity only.

    Attributes:
        name: What the rows have in common, in words.
        over: The quantity, in words with its usual unit.
        values: Its values in this unit, ascending.
        rows: The names of their rows.
    """

    name: str
    over: str
    values: tuple[float, ...]
    rows: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """The sweep as ``table.json`` has it."""
        return dataclasses.asdict(self)


def sweeps_of(rows: Sequence[Row]) -> list[Sweep]:
    """The sweeps in a table: all rows that are alike but for one quantity, which each of them has.

    In a grid of two quantities, each line of the grid is a sweep.
    """
    groups: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        for field in row.values:
            if BY_FIELD[field].is_quantity:
                rest = tuple(sorted((k, v) for k, v in row.values.items() if k != field))
                key = (field, row.scenario, row.known, row.needle, row.speed, row.seeds, rest)
                groups.setdefault(key, []).append(row)
    return [
        _sweep(BY_FIELD[field], group)
        for (field, *_), group in groups.items()
        if len({row.values[field] for row in group}) == len(group) > 1
    ]


def _sweep(over: Parameter, rows: Sequence[Row]) -> Sweep:
    first = rows[0]
    found = sorted((row.numbers()[over.words_and_unit], row.id) for row in rows)
    same = {words: shown for words, shown in first.shown_values().items() if words != over.words}
    facts = [first.scenario.stem, f"known: {first.known}", f"needle: {first.needle}"]
    return Sweep(
        name=", ".join([*facts, *(f"{words} {shown}" for words, shown in same.items())]),
        over=over.words_and_unit,
        values=tuple(value for value, _ in found),
        rows=tuple(row for _, row in found),
    )


def conclusions_of(document: Mapping[str, Any], sweep: Mapping[str, Any]) -> list[str]:
    """What a sweep shows, in a few lines; nothing is said of values that were not tried.

    Args:
        document: The table.
        sweep: One of its ``sweeps``.
    """
    rows = {row["id"]: row for row in document["rows"]}
    words, _, unit = sweep["over"].removesuffix("]").partition(" [")
    found = [
        (f"{value:g} {unit}".rstrip(), rows[row])
        for value, row in zip(sweep["values"], sweep["rows"], strict=True)
        if rows[row]["reach_rate"] is not None
    ]
    whole = [(value, row) for value, row in found if row["reach_rate"] == 1.0]
    fewer = [_counted(*one, "reach", "reached") for one in found if one[1]["reach_rate"] < 1.0]
    hits = [_counted(*one, "hit", "hits") for one in found if one[1]["hits"]]
    lines = []
    if whole:
        least = min(row["reach_low"] for _, row in whole)
        lines.append(
            f"{words}: all runs reached the target at {_listed(value for value, _ in whole)}: "
            f"the true rate there is at least {least:.1%}, with 95 % confidence for each value"
        )
    if fewer:
        lines.append(f"{words}: not all did at {_listed(fewer)}")
    if hits:
        lines.append(f"{words}: critical regions were hit at {_listed(hits)}")
    elif found:
        most = max(row["hit_high"] for _, row in found)
        lines.append(
            f"{words}: no run hit a critical region: the true rate is at most {most:.1%}, with "
            "95 % confidence for each value"
        )
    return lines


def _counted(value: str, row: Mapping[str, Any], name: str, count: str) -> str:
    """How often something happened at a value, with the interval of its rate."""
    interval = f"95 %: {row[f'{name}_low']:.1%} to {row[f'{name}_high']:.1%}"
    return f"{value} ({row[count]} of {row['runs']}; {interval})"


def _listed(parts: Iterable[str]) -> str:
    return ", ".join(parts)
