"""What symbolic queries leave out decides nothing: its values can be any, and their answers stay.

In random models some doubles take values that are not known there: that of a clock, or a random
number. A model that is accepted is asked again with other initial values of the doubles that are
left out, and with a number in the place of what is not known, so that nothing is left out.

``NTAGEN_MODELS=20000 NTAGEN_SEED=1`` makes a large run.
"""

from __future__ import annotations

import os
import random
import re
from collections import Counter
from string import Template

import pytest

from ntagen import checker

MODELS = int(os.environ.get("NTAGEN_MODELS", "150"))
SEED = int(os.environ.get("NTAGEN_SEED", "0"))
STATES = 1000

MODEL = """
clock x, y, energy;
int[0,3] n, m;
typedef struct { double a, b; } pair_t;
double last = $last, best = $best, level[2] = { $level, $level };
pair_t pair = { $pair, $pair }, old = { $old, $old };
meta double drawn = $drawn;
FUNCTIONS
process P() {
    state A { x <= 4 $rate }, B, C { x <= 6 };
    init A;
    trans
    A ARROW B LABELS,
    A ARROW NAME LABELS,
    B ARROW C LABELS,
    B ARROW NAME LABELS,
    C ARROW A LABELS;
}
system P;
"""

RULES = {
    "LABELS": ["{ guard GUARD; assign STEP, STEP, RESET; }"],
    "NAME": ["A", "B", "C"],
    "ARROW": ["->", "->", "-u->"],
    "GUARD": ["true", "x >= DIGIT", "y <= 8", "x >= DIGIT && TRUTH", "TRUTH"],
    "RESET": ["x = 0", "y = 0", "energy = taken(VALUE)"],
    "STEP": [
        *["DOUBLE = VALUE"] * 6,
        "last = best = VALUE",
        "pair = old",
        "old = pair",
        "n = INT % 4",
        "m = INT % 4",
        "set(DOUBLE)",
        "fill(level)",
        "keep(VALUE)",
        "counted(VALUE)",
        "work()",
    ],
    "DOUBLE": ["last", "best", "level[0]", "level[n % 2]", "pair.a", "old.b", "drawn"],
    # Calls of `counted` change something; beside what is not known they are refused.
    "VALUE": [
        *["PURE"] * 12,
        *["counted(VALUE)", "(TRUTH ? VALUE : DIGIT)"] * 2,
        "fmin(PURE, counted(PURE))",
    ],
    # No value is negative, and none grows without end: then a model with known values is finite.
    "PURE": [
        *["DOUBLE"] * 3,
        *["$unknown"] * 2,
        "DIGIT",
        "1.5",
        "fmin(PURE, INT)",
        "fmod(PURE + PURE, 4.0)",
        "(TRUTH ? PURE : PURE)",
        "half(PURE)",
        "half_of(DOUBLE)",
    ],
    # The last of these two look at doubles; the model is refused if they are not known.
    "INT": [*["DIGIT", "n", "m", "(n + DIGIT)", "digit()"] * 4, "fint(DOUBLE)"],
    "TRUTH": [*["n < DIGIT", "m == DIGIT", "m > n", "is_high()"] * 4, "DOUBLE > 1.0"],
    "DIGIT": ["0", "1", "2", "3"],
}
"""What the words in capitals can stand for; some more than once, to be chosen more often."""

DEPTH = 5
"""From this depth on no text is chosen that has its own rule in it again."""

FUNCTIONS = {
    "half": "double half(double v) { return floor(v / 2); }",
    "half_of": "double half_of(const double &v) { return fmin(v / 2, VALUE); }",
    "digit": "int digit() { return INT; }",
    "is_high": "bool is_high() { return TRUTH; }",
    "counted": "double counted(double v) { m = (m + 1) % 4; drawn = v; return INT; }",
    "set": "void set(double &v) { v = VALUE; n = INT % 4; }",
    "fill": "void fill(double &v[2]) { for (i : int[0,1]) v[i] = v[1 - i] = VALUE; }",
    "keep": "void keep(double v) { DOUBLE = v; n = (n + 1) % 4; }",
    "work": "void work() { double l = PURE; STEP; l = VALUE; if (TRUTH) { STEP; } DOUBLE = l; }",
    "taken": "$taken",
}
"""By name; each calls only those before it."""

UNKNOWN = ["x", "(x + 2 * y)", "random(3)", "energy"]
"""What symbolic queries do not know."""

LEAVING_OUT = {"rate": "&& energy' == 3", "taken": "double taken(double v) { return v; }"}
KNOWING_ALL = {"unknown": "1.25", "rate": "", "taken": "int taken(double v) { return 0; }"}
"""The other gaps: the clock `energy` has a rate of its own and takes doubles, or has neither."""

NOT_KNOWN = {"E0244", "E0264"}
"""The codes of mistakes where something depends on a double that is not known."""

VARIABLES = ["last", "best", "level", "pair", "old", "drawn"]

QUERIES = [
    *[f"E<> P.{name} && {value} == {k}" for name in "ABC" for value in "nm" for k in range(4)],
    "bounds: n, m",
    "sup{P.C}: y",
    "A[] not deadlock",
    "P.A --> P.C",
    "control: A<> P.C",
    "control: A[] n < 3",
]


def written(rule: str, chance: random.Random, callees: set[str], depth: int) -> str:
    """A random text for a rule, with calls of these functions only."""
    texts = [
        text
        for text in RULES[rule]
        if callees.issuperset(FUNCTIONS.keys() & re.findall(r"\w+(?=\()", text))
        and (depth < DEPTH or rule not in text)
    ]
    return filled(chance.choice(texts), chance, callees, depth + 1)


def filled(text: str, chance: random.Random, callees: set[str], depth: int = 0) -> str:
    """The text with a random text for each word that has rules."""
    rules = "|".join(RULES)
    return re.sub(rf"\b({rules})\b", lambda rule: written(rule[0], chance, callees, depth), text)


def random_model(chance: random.Random) -> Template:
    """A model without the initial values, by variable, and without what `KNOWING_ALL` has."""
    callees: set[str] = set()
    functions = []
    for name, text in FUNCTIONS.items():
        functions.append(filled(text, chance, callees))
        callees.add(name)
    model = filled(MODEL, chance, callees)
    return Template(model.replace("FUNCTIONS", "\n".join(functions)))


def starting(left_out: set[str]) -> dict[str, str]:
    """The initial values of all variables, of these ones other than usual."""
    return {name: "7.25" if name in left_out else "0.0" for name in VARIABLES}


def left_out_of(model: checker.Model) -> set[str]:
    """The doubles that the warnings say are left out."""
    warnings = [text for text in model.warnings if "W0213" in text]
    return set(re.findall(r"the double '(\w+)' is ignored", "\n".join(warnings)))


def answers(text: str) -> list[tuple[str, str, object, str | None, int]]:
    """For each query: its text, verdict, value, the limit that stopped it, and explored states."""
    model = checker.load(text)
    found = [model.check(query, states=STATES, trace=False) for query in QUERIES]
    return [(one.query, one.verdict, one.value, one.stop, one.explored) for one in found]


def check_model(model: Template, unknown: str) -> Counter[str]:
    """Whatever is left out, the answers are the same; counts what became of the model."""
    text = model.substitute(LEAVING_OUT, unknown=unknown, **starting(set()))
    try:
        loaded = checker.load(text)
    except checker.RejectedError as error:
        if set(re.findall(r"error\[(\w+)\]", str(error))) - NOT_KNOWN:
            raise
        return Counter(refused=1)
    if any("W0217" in warning for warning in loaded.warnings):
        # Something depends on what is not known: only statistical queries have a meaning.
        return Counter(refused=1)
    left_out = left_out_of(loaded)
    if not left_out:
        return Counter(nothing_left_out=1)
    first = answers(text)
    assert answers(model.substitute(LEAVING_OUT, unknown=unknown, **starting(left_out))) == first

    known = model.substitute(KNOWING_ALL, **starting(set()))
    assert not left_out_of(checker.load(known))
    # Known doubles are part of the states, so that there are more: some queries reach the limit.
    pairs = [
        (one[:3], two[:3])
        for one, two in zip(first, answers(known), strict=True)
        if "unknown" not in (one[1], two[1])
    ]
    assert [two for _, two in pairs] == [one for one, _ in pairs]
    return Counter(accepted=1, compared=len(pairs), stopped=len(QUERIES) - len(pairs))


@pytest.mark.slow
def test_what_is_left_out_decides_nothing() -> None:
    chance = random.Random(SEED)
    counts: Counter[str] = Counter()
    for number in range(MODELS):
        model, unknown = random_model(chance), chance.choice(UNKNOWN)
        try:
            counts += check_model(model, unknown)
        except (AssertionError, checker.RejectedError) as error:
            text = model.safe_substitute(LEAVING_OUT, unknown=unknown)
            raise AssertionError(f"model {number}:\n{text}") from error
    if MODELS >= 100:
        # There was something to compare, and mistakes are among the models too.
        assert counts["accepted"] > MODELS // 4, counts
        assert counts["refused"] > MODELS // 10, counts
        assert counts["compared"] > 10 * counts["stopped"], counts
