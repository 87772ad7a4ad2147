"""Which queries of public models the engine accepts, and why it refuses the others.

    python tests/benchmarks/public_queries.py DIR [--list]

DIR holds models as others wrote them, such as a clone of DEIS-Tools/uppaal-models. Each model
(.xml) is loaded with its own queries and those of the file .q beside it that has its name. Every
query is read and checked as before an answer, and given up before anything is searched. Those of a
model that does not load have its first mistake. The table has a line for each code: how many
queries it refuses, and the first place and message. A file that `loadStrategy` names need not be
there.

--list prints all that is refused. The exit code is 1 if the engine fails on a model or a query.
"""

from __future__ import annotations

import argparse
import re
import sys
import traceback
import warnings
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

sys.path.insert(0, str(Path(__file__).parents[2]))

from ntagen import checker
from ntagen.checker import Model, RejectedError, form_of

CODE = re.compile(r"error\[([A-Z]\d+)\]: (.*)")
UNANSWERED = ("E0804", "E0805")
"""Refusals that come after all checks: the strategy of a name was not made, or a file not read."""

ANY_STRATEGY = "minE(1)[<=1] {} -> {}: <> true"
"""Stands for a strategy that was not made."""


@dataclass
class Table:
    """What became of all queries."""

    models: int = 0
    accepted: int = 0
    refused: Counter[str] = field(default_factory=Counter)
    """How many queries are refused, by code."""

    examples: dict[str, tuple[str, str]] = field(default_factory=dict)
    """The first place and message of a code."""

    lines: list[str] = field(default_factory=list)
    crashes: int = 0

    def refuse(self, place: str, count: int, error: RejectedError) -> None:
        found = [match for text in error.diagnostics if (match := CODE.search(text))]
        code, message = found[0].groups() if found else ("none", error.diagnostics[0])
        self.refused[code] += count
        self.examples.setdefault(code, (place, message))
        self.lines.append(f"{place}: {count} x {code} {message}")

    def crash(self, place: str) -> None:
        self.crashes += 1
        print(f"{place}: the engine fails", file=sys.stderr)
        traceback.print_exc()


def texts_in(path: Path) -> int:
    """How many queries a model has that does not load: those that a reader of XML finds."""
    try:
        root = ElementTree.parse(path).getroot()
    except ElementTree.ParseError:
        return 0
    return sum(1 for one in root.iter("formula") if (one.text or "").strip())


def texts_of(model: Model, path: Path) -> list[str]:
    """The queries of a model and of the list beside it."""
    beside = path.with_suffix(".q")
    listed = model.read_queries(beside) if beside.is_file() else ()
    return [query.text for query in [*model.queries, *listed]]


def check(model: Model, text: str) -> None:
    """Reads a query with all its checks.

    Raises:
        RejectedError: It is refused.
    """
    try:
        model.check(text, timeout_s=0.0, engine="interpreter")
    except RejectedError as error:
        if not any(f"[{code}]" in error.diagnostics[0] for code in UNANSWERED):
            raise
        form = form_of(text)
        if form is not None and form.defines is not None:
            # Later queries may name it.
            model.check(f"strategy {form.defines} = {ANY_STRATEGY}", timeout_s=0.0)


def look_at(path: Path, place: str, table: Table) -> None:
    """Loads a model, and checks its queries."""
    table.models += 1
    try:
        model = checker.load_file(path)
        texts = texts_of(model, path)
    except RejectedError as error:
        table.refuse(place, texts_in(path), error)
        return
    for text in texts:
        shown = f"{place}: {' '.join(text.split())}"
        try:
            check(model, text)
            table.accepted += 1
        except RejectedError as error:
            table.refuse(shown, 1, error)
        except Exception:
            table.crash(shown)


def main() -> int:
    words = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    words.add_argument("folder", type=Path, metavar="DIR")
    words.add_argument("--list", action="store_true", help="print all that is refused")
    asked = words.parse_args()
    warnings.simplefilter("ignore")
    table = Table()
    for path in sorted(asked.folder.rglob("*.xml")):
        place = str(path.relative_to(asked.folder))
        try:
            look_at(path, place, table)
        except Exception:
            table.crash(place)
    print(f"{'code':6} {'queries':>8}  first")
    for code, count in table.refused.most_common():
        place, message = table.examples[code]
        print(f"{code:6} {count:8}  {place}\n{'':17}{message}")
    refused = table.refused.total()
    print(
        f"{table.models} models, {table.accepted + refused} queries: {table.accepted} accepted, "
        f"{refused} refused, {table.crashes} failures of the engine"
    )
    if asked.list:
        print("\n".join(table.lines))
    return 1 if table.crashes or not table.models else 0


if __name__ == "__main__":
    sys.exit(main())
