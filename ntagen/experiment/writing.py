"""The table as text: JSON and CSV for programs, Markdown and LaTeX for documents.

Markdown and LaTeX have the columns of the paper's tables; below a row that names a line of the
paper stands that line.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

HEADINGS: Final = (
    "Row",
    "Known",
    "Runs",
    "TR reach (95 %)",
    "CR hit (95 %)",
    "Confidence",
    "Error [mm]",
    "Adjustments",
    "Plans",
    "Synthesis [s]",
    "Overall [s]",
)
"""The columns; what is in brackets in them is least, mean and greatest value."""

NOTE: Final = (
    "In brackets: least, mean and greatest value. Intervals are those of Clopper and Pearson. "
    "Confidence is the probability that the tip is in the target, as the driver says it when it "
    "ends there; error is the standard deviation of the tip then. "
    "Plans are those of all runs together. A synthesis is the engine's time for it; overall is the "
    "time on the needle's clock, and that of all syntheses of a run. Lines of the paper were "
    "measured on its computer."
)
"""What the columns mean."""

_SPECIAL: Final = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    **{sign: f"\\{sign}" for sign in "&%$#_{}"},
}


def csv_of(document: Mapping[str, Any]) -> str:
    """The rows as CSV, one column for each number."""
    rows = [flat(row) for row in document["rows"]]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def flat(row: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """A row without parts: the parts of an entry have its name and theirs, with a dot between."""
    found: dict[str, Any] = {}
    for name, value in row.items():
        if isinstance(value, Mapping):
            found |= flat(value, f"{prefix}{name}.")
        elif isinstance(value, list | tuple):
            found |= flat(dict(zip(("min", "avg", "max"), value, strict=True)), f"{prefix}{name}.")
        else:
            found[prefix + name] = value
    return found


def lines_of(document: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """The lines of the table in words, those of the paper among them; see `HEADINGS`."""
    lines = []
    for row in document["rows"]:
        lines.append(_line(row))
        if row["paper"]:
            lines.append(_paper_line(row["paper"]))
    return lines


def markdown_of(document: Mapping[str, Any]) -> str:
    """The table in Markdown."""

    def line(cells: Sequence[str]) -> str:
        return "| " + " | ".join(re.sub(r"([|_*`<])", r"\\\1", cell) for cell in cells) + " |"

    rule = "|" + "|".join(["---", "---", *["--:"] * (len(HEADINGS) - 2)]) + "|"
    lines = [line(HEADINGS), rule, *map(line, lines_of(document))]
    name = re.sub(r"([_*`<])", r"\\\1", document["name"])
    return (
        f"# {name}\n\n" + "\n".join(lines) + f"\n\n{NOTE}\n\nMade by ntagen {document['ntagen']}.\n"
    )


def latex_of(document: Mapping[str, Any]) -> str:
    """The table in LaTeX; it needs no package."""

    def line(cells: Sequence[str]) -> str:
        return " & ".join(map(_escaped, cells)) + r" \\"

    return "\n".join(
        [
            f"% {document['name']}; made by ntagen {document['ntagen']}".replace("\n", " "),
            r"\begin{tabular}{ll" + "r" * (len(HEADINGS) - 2) + "}",
            r"\hline",
            line(HEADINGS),
            r"\hline",
            *map(line, lines_of(document)),
            r"\hline",
            r"\end{tabular}",
            "% " + NOTE,
            "",
        ]
    )


def _escaped(text: str) -> str:
    return "".join(_SPECIAL.get(sign, sign) for sign in text)


def _line(row: Mapping[str, Any]) -> tuple[str, ...]:
    return (
        row["id"],
        row["known"],
        str(row["runs"]) if row["runs"] == row["wanted"] else f"{row['runs']} of {row['wanted']}",
        _rate(row, "reach"),
        _rate(row, "hit"),
        _spread(row["confidence"], 3),
        _spread(row["error_mm"], 2),
        _spread(row["adjustments"], 2),
        str(row["plans_total"]),
        _spread(row["synthesis_s"], 3),
        _spread(row["overall_s"], 1),
    )


def _paper_line(line: Mapping[str, Any]) -> tuple[str, ...]:
    return (
        f"paper: {line['line']}",
        "",
        "5 to 7" if line["runs"] is None else str(line["runs"]),
        f"{line['reach_rate']:.1%}",
        f"{line['hit_rate']:.1%}",
        "",
        "",
        _spread(_named(line["adjustments"]), 2),
        str(line["plans"]),
        _spread(_named(line["synthesis_s"]), 2),
        _spread(_named(line["overall_s"]), 1),
    )


def _named(values: Sequence[float]) -> dict[str, float]:
    return dict(zip(("min", "avg", "max"), values, strict=True))


def _rate(row: Mapping[str, Any], name: str) -> str:
    rate = row[f"{name}_rate"]
    ends = f"{100.0 * row[f'{name}_low']:.1f} to {100.0 * row[f'{name}_high']:.1f}"
    return "none made" if rate is None else f"{rate:.1%} ({ends})"


def _spread(spread: Mapping[str, float] | None, digits: int) -> str:
    if spread is None:
        return ""
    ends = [
        f"{spread[k]:.0f}" if isinstance(spread[k], int) else f"{spread[k]:.{digits}f}"
        for k in ("min", "max")
    ]
    return f"({ends[0]}, {spread['avg']:.{digits}f}, {ends[1]})"
