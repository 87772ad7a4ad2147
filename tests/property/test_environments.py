"""Changed environment files: each is a model that the engine loads, or gets diagnostics.

``NTAGEN_TEXTS=50000 NTAGEN_SEED=1`` makes a large run.
"""

from __future__ import annotations

import os
import random
import re
from pathlib import Path

import pytest

from ntagen import checker, nsl
from ntagen.render import render, render_queries

TESTS = Path(__file__).parents[1]
SEEDS = [
    path.read_text("utf-8", "replace")
    for path in [
        *sorted((TESTS / "corpus" / "nsl").glob("*/*.nsl")),
        *sorted((TESTS.parent / "examples").glob("**/*.nsl")),
    ]
]
TEXTS = int(os.environ.get("NTAGEN_TEXTS", "300"))
SEED = int(os.environ.get("NTAGEN_SEED", "0"))

NUMBERS = """
0 1 2 1e-9 0.0004 0.0005 1e-320 5e-324 1e-400 1e300 1e308 1e999 2147483647 2147483648 268435.4
268436 3.9999999999 1e-10 360 359.9999999999 100 101 10000 99999999999999999999 -0 (0-1) (1/3)
(1e308*10) (1e-308/1e10) (1/0) sqrt(2) sqrt(0-1) pi (2*pi) cos(90deg) min(1,2) x
""".split()  # noqa: SIM905  it is easier to read
WORDS = """
mm um m cm deg rad mrad s ms min mm/s per at most least times apart around sphere radius tip heading
bevel speed length step roll by resolution safety swept sampled query for in .. let { } ( ) , = + -
* / [ ] " // /*
""".split()  # noqa: SIM905


def changed(text: str, chance: random.Random) -> str:
    """A text with a few changes, most of them to its numbers."""
    for _ in range(chance.randint(1, 4)):
        kind = chance.randrange(10)
        numbers = list(re.finditer(r"\d+(\.\d+)?", text))
        if kind < 6 and numbers:
            place = chance.choice(numbers)
            text = text[: place.start()] + chance.choice(NUMBERS) + text[place.end() :]
            continue
        start = chance.randint(0, len(text))
        end = min(len(text), start + chance.randint(0, 15))
        middle = {
            6: "",
            7: chance.choice(WORDS),
            8: text[start:end] * 2,
            9: chr(chance.choice([0, 10, 34, 92, 160, 0x2028, 0xE9, 0x10FFFF])),
        }.get(kind, "")
        text = text[:start] + middle + text[end:]
    return text


def check_text(text: str) -> bool:
    """Whether a text is accepted; then the engine loads its model, and answers nothing but that."""
    try:
        scene = nsl.loads(text, str(TESTS / "corpus" / "nsl" / "ok" / "text.nsl"))
    except nsl.SourceError as error:
        return not (error.diagnostics and str(error))
    render_queries(scene)
    checker.load(render(scene)).facts_json()
    return True


@pytest.mark.slow
def test_changed_environments_are_models_or_get_diagnostics() -> None:
    chance = random.Random(SEED)
    accepted = 0
    for _ in range(TEXTS):
        text = changed(chance.choice(SEEDS), chance)
        try:
            accepted += check_text(text)
        except BaseException:
            (Path(os.environ.get("NTAGEN_FOUND", os.devnull))).write_text(text)
            raise
    assert TEXTS < 100 or 0 < accepted < TEXTS
