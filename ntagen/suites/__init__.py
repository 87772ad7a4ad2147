"""Case suites from models: goals, traces that cover them, and the tests written from these.

`cover` finds a small set of traces that take every edge, enter every location or show every query
of a model. Each has exact times and has been replayed independently of the search. `written` and
`rendered` make files of tests from them; `replay` takes a test in another model.
"""

from ntagen.suites.cover import Limits, cover
from ntagen.suites.goals import KINDS, Covered, Goal
from ntagen.suites.rendering import rendered
from ntagen.suites.replay import replay
from ntagen.suites.storage import read_suite, suite_json
from ntagen.suites.suite import Case, Suite
from ntagen.suites.testcode import Harness, harness_of

__all__ = [
    "KINDS",
    "Case",
    "Covered",
    "Goal",
    "Harness",
    "Limits",
    "Suite",
    "cover",
    "harness_of",
    "read_suite",
    "rendered",
    "replay",
    "suite_json",
]
