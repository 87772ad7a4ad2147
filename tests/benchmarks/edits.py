"""Models saved unchanged and after one edit: bytes that differ, hunks, and seconds.

Usage: edits.py FOLDER [--seed N]. All models below the folder that the engine loads are read by the
editor of `ntagen serve` and saved: the file must be equal byte for byte. Then one of its texts,
chosen at random, is changed: `diff -u` must have one hunk, and undo must give the file back.
Times are those of the processor.
"""

from __future__ import annotations

import argparse
import difflib
import random
import sys
import time
from collections import Counter
from pathlib import Path

from ntagen import checker
from ntagen.checker.survey import Texts, survey_json
from ntagen.document.document import Document
from ntagen.document.names import Names
from ntagen.document.outline import WHOLE
from ntagen.errors import NtagenError

TYPED = ("x", " && y > 2", "\n// a line\n", "é ]]> <")


def main() -> None:
    """Prints the counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    chance = random.Random(options.seed)
    counts: Counter[str] = Counter()
    times: list[tuple[float, float, int, Path]] = []
    for path in sorted(options.folder.rglob("*")):
        if path.suffix in (".xml", ".xta", ".ta") and path.is_file():
            look_at(path, chance, counts, times)
    for name, count in sorted(counts.items()):
        print(f"{count:6} {name}")
    for edit_s, survey_s, lines, path in sorted(times)[-3:]:
        print(
            f"{edit_s * 1e3:6.0f} ms edit, {survey_s * 1e3:.0f} ms mistakes: {lines} lines, {path}"
        )


def look_at(
    path: Path,
    chance: random.Random,
    counts: Counter[str],
    times: list[tuple[float, float, int, Path]],
) -> None:
    """Counts what a model shows."""
    try:
        checker.load_file(path)
    except (NtagenError, OSError):
        counts["not loadable"] += 1
        return
    data = path.read_bytes()
    document = Document(data)
    counts["models saved equal" if document.file() == data else "models saved DIFFERENT"] += 1
    addresses = [one for one, _ in document.outline.texts()] if document.has_parts else [WHOLE]
    address = chance.choice(addresses)
    content = document.content(address)
    old = "" if content is None else content.text
    at = chance.randrange(len(old) + 1)
    began = time.process_time()
    document.set_text(address, old[:at] + chance.choice(TYPED) + old[at:])
    edited = time.process_time()
    Names(document, survey_json(Texts(str(path), document.text.decode()))).mistakes()
    times.append((edited - began, time.process_time() - edited, data.count(b"\n"), path))
    counts[f"edits with {hunks(data, document.file())} hunks"] += 1
    document.undo()
    counts["undone equal" if document.file() == data else "undone DIFFERENT"] += 1


def hunks(before: bytes, after: bytes) -> int:
    """The number of hunks of ``diff -u`` between two texts."""
    first, second = (text.decode("latin-1").splitlines(keepends=True) for text in (before, after))
    return sum(line.startswith("@@") for line in difflib.unified_diff(first, second))


if __name__ == "__main__":
    sys.exit(main())
