"""The report: one page of HTML with all pictures in it, and links to the logs of the worst runs."""

from __future__ import annotations

import html
import urllib.parse
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from ntagen.experiment import pictures
from ntagen.experiment.sweeps import conclusions_of
from ntagen.experiment.writing import HEADINGS, NOTE, lines_of
from ntagen.scene import Scene

_WORST: Final = 5

_STYLE: Final = """\
body { font: 15px/1.45 system-ui, sans-serif; max-width: 66rem; margin: 2rem auto; padding: 0 1rem;
  color: #1c2430; }
table { border-collapse: collapse; margin: 1rem 0; display: block; overflow-x: auto; }
th, td { padding: .25rem .6rem; text-align: right; border-bottom: 1px solid #e2e5ea;
  white-space: nowrap; }
th:first-child, td:first-child, td.words { text-align: left; }
tr.paper td { color: #6b7280; border-bottom-color: #b9bfc9; }
td.bad { color: #c8283c; font-weight: 600; }
p.note { color: #4b5563; font-size: 90%; }
svg { max-width: 100%; height: auto; }
h2 { margin-top: 2.5rem; border-bottom: 2px solid #e2e5ea; }
"""


def report_of(
    document: Mapping[str, Any],
    scenes: Mapping[str, Scene],
    sections: Mapping[str, str] | None = None,
) -> str:
    """The report as a page that needs no other file.

    Args:
        document: The table.
        scenes: The scene of each row, by the name of the row; a row without one has no picture of
            where regions were felt.
        sections: The sections that are drawn already (`section_of`), by the name of the row.
    """
    drawn = sections or {}
    title = html.escape(document["name"])
    parts = [
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>',
        f"<style>{_STYLE}</style></head><body><h1>{title}</h1>",
        table_of(document),
        f'<p class="note">{html.escape(NOTE)}</p>',
        *_lost(document),
        "<h2>Rates</h2><p>Dots: what was counted. Bars: 95 % intervals. Diamonds: the paper.</p>",
        pictures.svg_of(pictures.rates(document)),
        *_sweeps(document),
    ]
    for row in document["rows"]:
        name = row["id"]
        if name in drawn:
            parts.append(drawn[name])
        elif row["runs"]:
            parts.append(section_of(document, name, scenes.get(name)))
    parts.append(f'<p class="note">Made by ntagen {html.escape(document["ntagen"])}.</p>')
    parts.append("</body></html>\n")
    return "\n".join(parts)


def section_of(document: Mapping[str, Any], name: str, scene: Scene | None) -> str:
    """The part of the report about a row that has runs.

    Args:
        document: A table with this row and its runs; others count for nothing.
        name: The name of the row.
        scene: Its scene; without one, there is no picture of where regions were felt.
    """
    row = next(row for row in document["rows"] if row["id"] == name)
    return "\n".join(_section(document, row, scene))


def table_of(document: Mapping[str, Any]) -> str:
    """The table in HTML."""
    head = "".join(f"<th>{html.escape(one)}</th>" for one in HEADINGS)
    lines = []
    for cells in lines_of(document):
        kind = ' class="paper"' if cells[0].startswith("paper: ") else ""
        lines.append(f"<tr{kind}>" + "".join(f"<td>{html.escape(c)}</td>" for c in cells) + "</tr>")
    return f"<table><tr>{head}</tr>\n" + "\n".join(lines) + "</table>"


def worst_of(document: Mapping[str, Any], row: str, count: int = _WORST) -> list[dict[str, Any]]:
    """The worst runs of a row, the worst first.

    A hit is the worst, then a target that was not reached; then come a small clearance and many
    adjustments.
    """

    def badness(run: Mapping[str, Any]) -> tuple[Any, ...]:
        clear_mm = run["clearance_mm"]
        return (
            not run["is_hit"],
            run["is_reached"],
            float("inf") if clear_mm is None else clear_mm,
            -run["adjustments"],
            run["seed"],
        )

    return sorted((run for run in document["runs"] if run["row"] == row), key=badness)[:count]


def _sweeps(document: Mapping[str, Any]) -> Iterator[str]:
    """The part of the page about rows that differ in one quantity only."""
    if document["sweeps"]:
        yield "<h2>Sensitivity</h2><p>Each value with the same seeds. Shaded: 95 % intervals of "
        yield "rates; 5 to 95 % of runs. Between the dots, nothing was tried.</p>"
    for sweep in document["sweeps"]:
        yield f"<h3>{html.escape(sweep['over'])}: {html.escape(sweep['name'])}</h3>"
        yield f"<p>{'<br>'.join(map(html.escape, conclusions_of(document, sweep)))}</p>"
        yield pictures.svg_of(pictures.sensitivity(document, sweep))


def _section(
    document: Mapping[str, Any], row: Mapping[str, Any], scene: Scene | None
) -> Iterator[str]:
    name = row["id"]
    settings = ", ".join(f"{words} {value}" for words, value in row["settings"].items())
    facts = f"{row['scenario']}, known: {row['known']}, needle: {row['needle']}"
    outcomes = ", ".join(f"{count} {outcome}" for outcome, count in row["outcomes"].items())
    yield f"<h2>{html.escape(name)}</h2>"
    yield f"<p>{html.escape(facts + (', ' + settings if settings else ''))}<br>"
    yield f"{html.escape(outcomes)}</p>"
    yield pictures.svg_of(pictures.over_depth(document, name))
    runs = [run for run in document["runs"] if run["row"] == name]
    if scene is not None and any(run["felt"] for run in runs):
        yield "<h3>Where regions were felt</h3>"
        yield pictures.svg_of(pictures.felt(document, name, scene))
    yield "<h3>Times</h3>"
    yield pictures.svg_of(pictures.times(document, name))
    yield "<h3>The worst runs</h3>"
    yield _runs_table(worst_of(document, name))


def _runs_table(runs: Sequence[Mapping[str, Any]]) -> str:
    words = ("Seed", "End", "Reason", "Clearance [mm]", "Adjustments", "Needle [s]", "Log")
    head = "".join(f"<th>{word}</th>" for word in words)
    lines = []
    for run in runs:
        clear_mm = run["clearance_mm"]
        clear = "" if clear_mm is None else f"{clear_mm:.2f}"
        bad = ' class="bad"' if run["is_hit"] else ""
        link = f'<a href="{urllib.parse.quote(run["log"])}">log</a>' if run["log"] else ""
        lines.append(
            f"<tr><td>{run['seed']}</td><td>{html.escape(run['outcome'])}</td>"
            f'<td class="words">{html.escape(run["reason"])}</td><td{bad}>{clear}</td>'
            f"<td>{run['adjustments']}</td><td>{run['needle_s']:.1f}</td><td>{link}</td></tr>"
        )
    return f"<table><tr>{head}</tr>" + "\n".join(lines) + "</table>"


def _lost(document: Mapping[str, Any]) -> Iterator[str]:
    """What could not be made."""
    for one in document["lost"]:
        text = f"Not made: seed {one['seed']} of {one['row']}: {one['reason']}"
        yield f"<p>{html.escape(text)}</p>"
