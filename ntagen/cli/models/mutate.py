"""`ntagen mutate`: makes mutants of a model, and tells which queries and tests kill them."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli.guard import doing
from ntagen.cli.loading import load_model, pointing_to_explanations
from ntagen.cli.models.test import search_limits
from ntagen.cli.options import (
    constant_option,
    include_option,
    overflow_rule,
    path_argument,
    path_option,
)
from ntagen.cli.progress import status
from ntagen.cli.terminal import echo, print_table, say
from ntagen.errors import LimitError
from ntagen.files import write_files

if TYPE_CHECKING:
    from ntagen.mutation import Judge, Judged
    from ntagen.suites import Limits

SURVIVED: Final = 1
"""Exit code where a mutant survives."""

SURVIVORS_SHOWN: Final = 20


def _names(_: click.Context, __: click.Parameter, given: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(name for one in given for name in one.replace(",", " ").split())


@click.command(
    "mutate",
    epilog="Exit codes: 0 every valid mutant is killed, 1 some survive, 2 the input is rejected, 3 "
    "a limit came before some mutant was decided.",
)
@path_argument("path", metavar="MODEL")
@click.option(
    "--operators",
    metavar="LIST",
    multiple=True,
    callback=_names,
    help="The operators that make mutants, with commas between them.  [default: all]",
)
@click.option(
    "--template",
    "templates",
    metavar="NAME",
    multiple=True,
    help="Make mistakes in this template. You can give this option several times.  "
    "[default: in all templates]",
)
@click.option(
    "--most",
    metavar="N",
    type=click.IntRange(1),
    help="At most this many mutants of each operator, evenly spread.  [default: all]",
)
@path_option(
    "--suite",
    "suite_path",
    metavar="FILE.json",
    help="A suite of `ntagen test`: a mutant that cannot do what a test does is killed by it.",
)
@path_option("--keep", metavar="DIR", help="Write the mutants as UPPAAL models into this folder.")
@click.option("--json", "as_json", is_flag=True, help="Print everything as one JSON object.")
@constant_option()
@include_option()
@overflow_rule()
@search_limits()
def command(
    path: Path,
    operators: tuple[str, ...],
    templates: tuple[str, ...],
    most: int | None,
    suite_path: Path | None,
    keep: Path | None,
    as_json: bool,
    constants: dict[str, str],
    include: tuple[Path, ...],
    overflow: Any,  # noqa: ANN401  click gives a str where the engine wants literals
    limits: Limits,
) -> int:
    """Make mutants of a model, and tell which queries and tests kill them.

    MODEL is an environment (.nsl) or a UPPAAL model in XML. A mutant is the model with one mistake.
    A query kills it if its answer differs from that of the model, and a test of --suite if the
    mutant cannot do what the test does, with the same states at the same times. What survives says
    what no query and no test would notice; a mutant may also mean the same as the model.

    \b
    The operators, of Aichernig, Lorber and Nickovic (2013) but for guard-bound and drop-edge:
      guard-bound      adds or subtracts 1 at a bound of a guard
      guard-sign       replaces a comparison in a guard: < by <= and by >=
      guard-negation   negates a guard
      invariant-bound  adds or subtracts 1 at a bound of an invariant
      target           leads an edge to another location
      source           takes an edge from another location
      action           synchronises on another channel
      reset            takes the reset of a clock away, or adds one
      sink             leads an edge to a new location without a way out
      drop-edge        takes an edge away

    \b
    Examples:
      ntagen mutate model.xml
      ntagen mutate model.xml --template Gate --operators guard-bound,reset --keep mutants
      ntagen test model.xml -o suite.json
      ntagen mutate model.xml --suite suite.json --json --timeout 10s
    """  # noqa: D301  click wants the control character
    from ntagen.mutation import Judge, mutants
    from ntagen.suites import read_suite
    from ntagen.suites.layout import written_model

    with pointing_to_explanations(True):
        with doing("loading the model"):
            model = load_model(path, include, overflow, constants).model
        written = written_model(model)
        tests = read_suite(suite_path).tests if suite_path else ()
        judge = Judge(model, limits=limits, constants=constants, tests=tests)
        judged: list[Judged] = []
        with status("making mutants …", quiet=as_json) as show:
            for mutant in mutants(written, model, operators, templates, most):
                show(f"mutant {len(judged) + 1}: {mutant.name}")
                if keep is not None:
                    write_files({keep / f"{mutant.name}.xml": mutant.model.xml()})
                judged.append(judge.judge(mutant))
    if as_json:
        echo(json.dumps(_object(path, judge, judged), ensure_ascii=False))
    else:
        say([f"{' '.join(query.split())}: {why}" for query, why in judge.left_out.items()])
        _show(judge, judged, [case.name for case in tests])
    fates = {one.fate for one in judged}
    if "unknown" in fates:
        return LimitError.exit_code
    return SURVIVED if "survived" in fates else 0


def _object(path: Path, judge: Judge, judged: Sequence[Judged]) -> dict[str, Any]:
    return {
        "format": "ntagen-mutants",
        "version": 1,
        "model": path.name,
        "counts": dict(Counter(one.fate for one in judged)),
        "queries": {query: verdict for query, (verdict, _) in judge.answers.items()},
        "left_out": judge.left_out,
        "mutants": [
            {
                "name": one.mutant.name,
                "operator": one.mutant.operator,
                "place": one.mutant.place,
                "change": one.mutant.change,
                "fate": one.fate,
                "queries": one.queries,
                "tests": one.tests,
                "reason": one.reason,
            }
            for one in judged
        ],
    }


def _show(judge: Judge, judged: Sequence[Judged], tests: Sequence[str]) -> None:
    """Prints a table by operator, one by query and test, and what survives."""
    fates = ("killed", "survived", "unknown", "invalid")
    counts: Counter[tuple[str, str]] = Counter((one.mutant.operator, one.fate) for one in judged)
    operators = dict.fromkeys(one.mutant.operator for one in judged)
    rows = [[name, *(str(counts[name, fate]) for fate in fates)] for name in operators]
    totals: Counter[str] = Counter(one.fate for one in judged)
    print_table(
        ["operator", *fates],
        [*rows, ["all", *(str(totals[fate]) for fate in fates)]],
        fates,
    )
    by_query = Counter(query for one in judged for query in one.queries)
    by_test = Counter(test for one in judged for test in one.tests)
    kills = [[" ".join(query.split()), str(by_query[query])] for query in judge.answers]
    kills += [[name, str(by_test[name])] for name in tests]
    echo()
    print_table(["query or test", "kills"], kills, ("kills",))
    survivors = [one for one in judged if one.fate == "survived"]
    for one in survivors[:SURVIVORS_SHOWN]:
        echo(f"survived: {one.mutant.name}, {one.mutant.place}: {one.mutant.change}")
    if len(survivors) > SURVIVORS_SHOWN:
        echo(f"… {len(survivors) - SURVIVORS_SHOWN} more survived (all of them: --json)")
